//! Planar polygons of any number of corners, convex or not.
//!
//! Like triangles, polygons are seen along the ray by Woop's shear; the origin is then inside if
//! the positive x-axis crosses the outline an odd number of times (Shimrat's rule, Communications
//! of the ACM 1962). The half-open rule on y and the exactly antisymmetric edge function assign a
//! ray through a shared edge to exactly one of two neighbours. t is that of the plane.

pub(super) mod exact;
pub mod guarded;
mod table;

pub use table::Polygons;

use super::chart::Chart;
use super::ray::{Meet, Ray};
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::math::{Aabb, Vec3, unit, unordered_dot};
use glam::DVec3;

/// A polygon's corners and the unit normal of its plane (Newell's method).
#[derive(Clone, Copy, Debug)]
pub struct Polygon<'a> {
    pub points: &'a [DVec3],
    pub normal: DVec3,
}

#[inline(always)]
pub fn meet<L: Lanes>(polygon: &Polygon, ray: &Ray<L>, active: L::Mask) -> Meet<L> {
    let splat = |v: DVec3| Vec3::splat(v.to_array().map(L::Scalar::from_f64));
    let mut inside = L::Mask::splat(false);
    for (k, lanes) in ray.shear.groups() {
        let lanes = lanes & active;
        let mut within = match polygon.points.len() {
            QUADRANGLE => is_around(polygon.points, ray, k),
            _ => L::Mask::splat(false),
        };
        if (lanes & !within).any() {
            within = within | odd_crossings(polygon.points, ray, k);
        }
        inside = inside | within & lanes;
    }
    if inside.none() {
        return Meet::certain(inside, L::zero());
    }
    let normal: Vec3<L> = splat(polygon.normal);
    let first = splat(polygon.points[0]) - ray.org;
    let t = normal.unordered_dot(first) / normal.unordered_dot(ray.dir);
    let finite = t.abs().lt(L::splat(L::Scalar::INFINITY));
    Meet::certain(inside & finite & t.gt(ray.t_min), t)
}

/// The number of corners of polygons that are tested by the signs of their edge functions alone.
/// If all edges turn one way about a ray the outline is around it, because each edge turns by less
/// than half a circle and all together by whole ones. Triangles gain nothing by this test.
pub const QUADRANGLE: usize = 4;

/// Returns a corner as rays whose longest axis is `k` see it.
#[inline(always)]
fn seen<L: Lanes>(ray: &Ray<L>, k: usize, point: DVec3) -> (L, L) {
    let corner = Vec3::splat(point.to_array().map(L::Scalar::from_f64));
    let (x, y, _) = ray.shear.apply(k, corner - ray.org);
    (x, y)
}

/// Returns lanes about which all edges turn one way, computed from finite numbers.
#[inline(always)]
fn is_around<L: Lanes>(points: &[DVec3], ray: &Ray<L>, k: usize) -> L::Mask {
    let (zero, infinity) = (L::zero(), L::splat(L::Scalar::INFINITY));
    let (mut low, mut high, mut sum) = (infinity, -infinity, zero);
    let (mut ax, mut ay) = seen(ray, k, points[points.len() - 1]);
    for point in points {
        let (bx, by) = seen(ray, k, *point);
        let side = ax * by - ay * bx;
        low = low.min(side);
        high = high.max(side);
        sum = sum + side;
        (ax, ay) = (bx, by);
    }
    (low.gt(zero) | high.lt(zero)) & sum.abs().lt(infinity)
}

#[inline(always)]
fn odd_crossings<L: Lanes>(points: &[DVec3], ray: &Ray<L>, k: usize) -> L::Mask {
    let zero = L::zero();
    let mut odd = L::Mask::splat(false);
    let (mut ax, mut ay) = seen(ray, k, points[points.len() - 1]);
    for point in points {
        let (bx, by) = seen(ray, k, *point);
        let (a_above, b_above) = (ay.gt(zero), by.gt(zero));
        let straddles = (a_above & !b_above) | (b_above & !a_above);
        // The crossing lies at x > 0 where this has the sign of by − ay.
        let side = ax * by - ay * bx;
        let right = (b_above & side.gt(zero)) | (a_above & side.lt(zero));
        let flips = straddles & right;
        odd = (odd & !flips) | (flips & !odd);
        (ax, ay) = (bx, by);
    }
    odd
}

/// Stretches an image over the rectangle about a polygon whose lower side runs along the first
/// edge, as it is seen from where the normal points.
pub(super) fn chart(polygon: &Polygon, p: DVec3) -> Chart {
    let points = polygon.points;
    let first = points[0];
    // Corners may coincide, but not all of them.
    let next = points.iter().find(|q| **q != first);
    let right = unit(next.map_or(DVec3::X, |next| *next - first));
    let down = right.cross(polygon.normal);
    Chart::stretched([right, down], p, |axis| {
        let along = points.iter().map(|q| q.dot(axis));
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        along.fold(none, |[low, high], x| [low.min(x), high.max(x)])
    })
}

/// The most that corners may lie off the plane, relative to the polygon's size.
pub const FLATNESS: f64 = 1e-6;

/// The growth of the box of the corners, relative to its longest side.
const MARGIN: f64 = 1e-3;

/// The least |n·d| / |d|∞ of rays whose hit certainly lies in the [`room`] (G7,
/// docs/numerics/polygons.md): the line passes within [`FLATNESS`] of the plane inside the
/// outline, so it meets the plane no farther from there than `FLATNESS` · √3 / this, less than
/// half of what the box grows by.
pub const STEEP: f64 = 4e-3;

/// Returns the box in which a polygon can be met: that of its corners, grown. Corners lie a little
/// off the plane, so a grazing ray may meet the plane anywhere; a point outside this box is no hit
/// (S28), so boxes of accelerators need hold no more.
pub fn room(points: &[DVec3]) -> Aabb {
    let bounds = Aabb::of_points(points.iter().copied());
    let margin = DVec3::splat(bounds.extent().max_element() * MARGIN);
    // Rounded outward, so that the whole margin remains.
    let down = |x: f64| x.next_down().max(-f64::MAX);
    let up = |x: f64| x.next_up().min(f64::MAX);
    let grown = bounds.grown(margin);
    let [min, max] = [grown.min.to_array(), grown.max.to_array()];
    Aabb::new(
        DVec3::from_array(min.map(down)),
        DVec3::from_array(max.map(up)),
    )
}

/// Computes the unit normal of a polygon's plane by Newell's method; an error says why the points
/// are not a planar polygon.
pub fn polygon_plane(points: &[DVec3]) -> Result<DVec3, String> {
    let Some(&origin) = points.first() else {
        return Err("it has no points".into());
    };
    let size = points
        .iter()
        .map(|p| (*p - origin).abs().max_element())
        .fold(0.0, f64::max);
    if !size.is_finite() {
        return Err("its points are too far apart".into());
    }
    if size == 0.0 {
        return Err("all its points are one point".into());
    }
    // Relative to the first point and scaled to unit size, so that nothing cancels or overflows.
    let at = |i: usize| (points[i % points.len()] - origin) / size;
    let normal: DVec3 = (0..points.len()).map(|i| at(i).cross(at(i + 1))).sum();
    let length = unordered_dot(normal, normal).sqrt();
    if length.is_nan() || length < 1e-12 {
        let along = (0..points.len()).map(at).fold(DVec3::ZERO, |long, p| {
            match p.length_squared() > long.length_squared() {
                true => p,
                false => long,
            }
        });
        let is_line = (0..points.len()).all(|i| at(i).cross(along).length() < 1e-12);
        return Err(match is_line {
            true => "its points lie on a line".into(),
            false => {
                "its edges cross, so that its parts of either side cancel; give its points in turn \
                      along its rim"
                    .into()
            }
        });
    }
    let normal = normal / length;
    let off = (0..points.len())
        .map(|i| at(i).dot(normal).abs())
        .fold(0.0, f64::max);
    if off > FLATNESS {
        return Err(format!(
            "its points are not in one plane (off by {off:.1e} of its size); split it into triangles"
        ));
    }
    Ok(normal)
}
