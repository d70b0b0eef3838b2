//! Target points on polynomial surfaces: anywhere on the surface, where the gradient
//! vanishes, and on the rim that the clip cuts. Computed in f64, so they lie on the
//! surface approximately.

use super::{Random, Target};
use glam::{DMat3, DVec3};
use lanecast_model::geom::tape::Arithmetic;
use lanecast_model::geom::{Clip, Implicit, Tape};
use lanecast_numerics::math::Aabb;

/// Number of parts of a path between which signs are compared, and of bisection steps.
const PARTS: usize = 16;
const HALVINGS: usize = 60;
/// Number of random chords or starting points, and of Newton steps per starting point.
const TRIES: usize = 8;
const NEWTON_STEPS: usize = 24;
/// Relative tolerance for zero.
const NEARLY: f64 = 1e-9;

pub(super) fn in_implicit(row: &Implicit, random: &mut Random) -> Target {
    let bounds = row.bounds.unwrap_or_else(|| {
        let reach = [0.5, 1.0, 2.0, 4.0, 16.0][random.below(5)];
        Aabb::new(DVec3::splat(-reach), DVec3::splat(reach))
    });
    let found = match (random.below(4), row.clip) {
        (0, _) => node(row.tape, &bounds, random),
        (1, Some(clip)) => rim(row.tape, &clip, random),
        _ => None,
    };
    found
        .or_else(|| smooth(row.tape, &bounds, random))
        .unwrap_or_else(|| random.anywhere())
}

/// Returns a point on a random chord. The first tangent is a direction of zero normal
/// curvature if there is one.
fn smooth(tape: &Tape, bounds: &Aabb, random: &mut Random) -> Option<Target> {
    let point = (0..TRIES).find_map(|_| {
        let (a, b) = (within(bounds, random), within(bounds, random));
        zero_along(tape, |s| a.lerp(b, s))
    })?;
    let (_, slope) = at(tape, point);
    let (u, v) = slope.try_normalize()?.any_orthonormal_pair();
    let bend = bend(tape, point, bounds);
    Some(Target {
        point,
        along: [flat(bend, u, v), v],
    })
}

/// Finds a singular point by Newton's method on the gradient; the tangents are lines of
/// the tangent cone.
fn node(tape: &Tape, bounds: &Aabb, random: &mut Random) -> Option<Target> {
    let size = (bounds.max - bounds.min).max_element();
    (0..TRIES).find_map(|_| {
        let mut point = within(bounds, random);
        for _ in 0..NEWTON_STEPS {
            let step = bend(tape, point, bounds).inverse() * at(tape, point).1;
            if !step.is_finite() {
                break;
            }
            point -= step;
        }
        let (value, slope) = at(tape, point);
        let bend = bend(tape, point, bounds);
        let usual = bend
            .to_cols_array()
            .iter()
            .fold(0.0, |m, x| f64::max(m, x.abs()));
        let near = value.abs() <= NEARLY * usual * size * size;
        let flat_there = slope.length() <= NEARLY * usual * size;
        let inside = point.cmpge(bounds.min).all() && point.cmple(bounds.max).all();
        (near && flat_there && inside).then(|| {
            let along = [(); 2].map(|()| {
                let (u, v) = random.direction().any_orthonormal_pair();
                flat(bend, u, v)
            });
            Target { point, along }
        })
    })
}

/// Returns a point on the clip's own surface; the tangents run along the rim and across
/// it.
fn rim(tape: &Tape, clip: &Clip, random: &mut Random) -> Option<Target> {
    let (point, out) = (0..TRIES).find_map(|_| match clip {
        Clip::Sphere(ball) => {
            let (a, b) = (random.direction(), random.direction());
            let on = |s: f64| ball.center + a.lerp(b, s).normalize_or(a) * ball.radius;
            let point = zero_along(tape, on)?;
            Some((point, point - ball.center))
        }
        Clip::Cuboid(row) => {
            let (axis, end) = (random.below(3), [row.min, row.max][random.below(2)]);
            let bounds = Aabb::new(row.min, row.max);
            let [a, b] = [(); 2].map(|()| {
                let mut p = within(&bounds, random);
                p[axis] = end[axis];
                p
            });
            let point = zero_along(tape, |s| a.lerp(b, s))?;
            Some((point, DVec3::AXES[axis]))
        }
    })?;
    let (_, slope) = at(tape, point);
    let along = slope.cross(out);
    Some(Target {
        point,
        along: [along, slope.cross(along)],
    })
}

/// Bisects for a sign change along a path. Returns `None` if the sampled signs agree.
fn zero_along(tape: &Tape, path: impl Fn(f64) -> DVec3) -> Option<DVec3> {
    let outside = |s: f64| at(tape, path(s)).0 > 0.0;
    let part = |i: usize| i as f64 / PARTS as f64;
    let first = (0..PARTS).find(|i| outside(part(*i)) != outside(part(i + 1)))?;
    let (mut lo, mut hi) = (part(first), part(first + 1));
    let side = outside(lo);
    for _ in 0..HALVINGS {
        let middle = lo + (hi - lo) * 0.5;
        if outside(middle) == side {
            lo = middle;
        } else {
            hi = middle;
        }
    }
    Some(path(hi))
}

/// Returns the second derivatives, by central differences.
fn bend(tape: &Tape, p: DVec3, bounds: &Aabb) -> DMat3 {
    let h = 1e-5 * (bounds.max - bounds.min).max_element();
    let column = |axis: DVec3| (at(tape, p + axis * h).1 - at(tape, p - axis * h).1) / (2.0 * h);
    DMat3::from_cols_array_2d(&DVec3::AXES.map(|axis| column(axis).to_array()))
}

/// Returns u + x v at a zero of a quadratic form, or else at an extreme of it.
fn flat(form: DMat3, u: DVec3, v: DVec3) -> DVec3 {
    let (uu, uv, vv) = (u.dot(form * u), u.dot(form * v), v.dot(form * v));
    let x = (-uv + (uv * uv - uu * vv).max(0.0).sqrt()) / vv;
    if x.is_finite() { u + v * x } else { u }
}

fn within(bounds: &Aabb, random: &mut Random) -> DVec3 {
    let part = DVec3::new(random.unit(), random.unit(), random.unit());
    bounds.min + (bounds.max - bounds.min) * part
}

/// A value and its gradient.
type Slope = (f64, DVec3);

struct At(DVec3);

/// Evaluates the polynomial and its gradient.
fn at(tape: &Tape, p: DVec3) -> Slope {
    tape.evaluate(&At(p))
}

impl Arithmetic for At {
    type Value = Slope;

    fn coordinate(&self, axis: usize) -> Slope {
        (self.0[axis], DVec3::AXES[axis])
    }

    fn constant(&self, value: f64) -> Slope {
        (value, DVec3::ZERO)
    }

    fn sum(&self, a: &Slope, b: &Slope) -> Slope {
        (a.0 + b.0, a.1 + b.1)
    }

    fn difference(&self, a: &Slope, b: &Slope) -> Slope {
        (a.0 - b.0, a.1 - b.1)
    }

    fn product(&self, a: &Slope, b: &Slope) -> Slope {
        (a.0 * b.0, b.1 * a.0 + a.1 * b.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lanecast_model::geom::tape::Builder;
    use lanecast_model::geom::{Cuboid, Sphere};

    /// x² + y² − z².
    fn cone() -> Tape {
        let mut b = Builder::default();
        let [x, y, z] = [0, 1, 2].map(|axis| {
            let v = b.coordinate(axis);
            b.power(v, 2)
        });
        let sum = b.sum(x, y);
        let last = b.difference(sum, z);
        b.finish(last)
    }

    fn is_near(x: f64, y: f64) -> bool {
        (x - y).abs() < 1e-12
    }

    #[test]
    fn targets_lie_on_the_surface_at_its_node_and_rim() {
        let tape = cone();
        let random = &mut Random(1);
        let bounds = Aabb::new(DVec3::splat(-2.0), DVec3::splat(2.0));
        let ball = Clip::Sphere(Sphere {
            center: DVec3::X,
            radius: 1.5,
        });
        let block = Clip::Cuboid(Cuboid {
            min: DVec3::splat(-2.0),
            max: DVec3::new(2.0, 1.0, 0.5),
        });
        let mut found = [0; 4];
        for _ in 0..100 {
            if let Some(target) = smooth(&tape, &bounds, random) {
                let (value, slope) = at(&tape, target.point);
                assert!(is_near(value, 0.0));
                // A generator: the whole line lies in the cone.
                let along = target.along[0].normalize();
                let (there, _) = at(&tape, target.point + along);
                assert!(is_near(slope.dot(along), 0.0) && there.abs() < 1e-2);
                found[0] += 1;
            }
            if let Some(target) = node(&tape, &bounds, random) {
                assert!(target.point.length() < 1e-6);
                found[1] += 1;
            }
            if let Some(target) = rim(&tape, &ball, random) {
                let off = target.point - DVec3::X;
                assert!(is_near(at(&tape, target.point).0, 0.0) && is_near(off.length(), 1.5));
                found[2] += 1;
            }
            if let Some(target) = rim(&tape, &block, random) {
                let p = target.point;
                assert!(is_near(at(&tape, p).0, 0.0));
                let ends = [-2.0, 2.0, 1.0, 0.5];
                assert!(p.to_array().iter().any(|x| ends.contains(x)));
                found[3] += 1;
            }
        }
        assert!(found.iter().all(|n| *n > 50), "{found:?}");
    }
}
