//! Half-spaces, boxes and convex polyhedra: planes that clip the ray.
//!
//! Cyrus and Beck 1978; Haines, *Graphics Gems II*, "Fast ray–convex polyhedron
//! intersection"; for a box the same is Kay and Kajiya's slabs.

use super::approx::*;
use super::ray::{Crossing, NearRay, Ray, length};
use super::roots::linear;
use crate::geom::{Cuboid, HalfSpace};

/// The plane n·x = offset. Unbounded: the reach is infinite.
pub fn half_space(ray: &Ray, shape: &HalfSpace, out: &mut Vec<Crossing>) {
    let normal = shape.normal.to_array();
    let b = dot(exact3(normal), exact3(ray.dir));
    let c = dot(exact3(normal), exact3(ray.org)) - Approx::exact(shape.offset);
    if let Some(root) = linear(b, c, f64::INFINITY) {
        out.push(Crossing {
            t: root.t,
            exists: root.exists,
            primitive: 0,
            normal,
        });
    }
}

pub fn cuboid(ray: &Ray, shape: &Cuboid, out: &mut Vec<Crossing>) {
    let (min, max) = (shape.min.to_array(), shape.max.to_array());
    let planes: [([f64; 3], f64); 6] = std::array::from_fn(|i| {
        let mut normal = [0.0; 3];
        if i < 3 {
            normal[i] = -1.0;
            (normal, -min[i])
        } else {
            normal[i - 3] = 1.0;
            (normal, max[i - 3])
        }
    });
    clip(&around(ray, &[min, max]), planes.into_iter(), out);
}

/// `points` are the corners that `planes` make; they only say how large it is.
pub fn polyhedron(ray: &Ray, planes: &[HalfSpace], points: &[[f64; 3]], out: &mut Vec<Crossing>) {
    let planes = planes.iter().map(|p| (p.normal.to_array(), p.offset));
    clip(&around(ray, points), planes, out);
}

/// The ray started anew at the middle of the points' box.
pub fn around(ray: &Ray, points: &[[f64; 3]]) -> NearRay {
    let bound = |pick: fn(f64, f64) -> f64, k: usize| {
        points.iter().map(|p| p[k]).reduce(pick).unwrap_or(0.0)
    };
    let min: [f64; 3] = std::array::from_fn(|k| bound(f64::min, k));
    let max: [f64; 3] = std::array::from_fn(|k| bound(f64::max, k));
    let middle = std::array::from_fn(|k| min[k] * 0.5 + max[k] * 0.5);
    let half = std::array::from_fn(|k| max[k] * 0.5 - min[k] * 0.5);
    ray.near(middle, length(half))
}

/// Where the ray enters the last and leaves the first of the half-spaces.
fn clip(ray: &NearRay, planes: impl Iterator<Item = ([f64; 3], f64)>, out: &mut Vec<Crossing>) {
    let mut enter: Vec<(Approx, [f64; 3])> = Vec::new();
    let mut leave: Vec<(Approx, [f64; 3])> = Vec::new();
    let mut inside = Verdict::YES;
    // A plane in which the ray lies, within rounding: it may cut anywhere.
    let mut lost = false;
    for (normal, offset) in planes {
        let n = exact3(normal);
        let speed = dot(n, ray.dir);
        let height = dot(n, ray.org) - Approx::exact(offset);
        if speed.is_exactly_zero() || height.certainly_beyond(speed.abs_hi() * ray.reach) {
            // On one side all along.
            inside = inside.and((-height).at_least_zero());
        } else if !speed.is_signed() {
            lost = true;
        } else if speed.value < 0.0 {
            enter.push((-height / speed, normal));
        } else {
            leave.push((-height / speed, normal));
        }
    }
    let first = enter.iter().map(|e| e.0).reduce(Approx::max);
    let last = leave.iter().map(|l| l.0).reduce(Approx::min);
    let (Some(first), Some(last)) = (first, last) else {
        return;
    };
    let mut exists = inside.and(last.at_least(first));
    if exists.is_no() {
        return;
    }
    exists.certain &= !lost;
    // At an edge two planes are last, within rounding: both are listed, for
    // their normals differ.
    let enters = enter.iter().filter(|(t, _)| !t.certainly_below(first.lo()));
    let leaves = leave.iter().filter(|(t, _)| !t.certainly_above(last.hi()));
    for (t, normal) in enters.chain(leaves) {
        let mut t = *t;
        if lost {
            t.error += ray.reach + t.value.abs();
        }
        out.push(ray.crossing(t, exists, *normal));
    }
}
