//! Triangles: the watertight test of Woop, Benthin and Wald (JCGT 2013).
//!
//! Vertices are seen from the ray's origin and sheared along the ray; the three
//! edge functions are differences of products without FMA, so an edge shared by
//! two triangles has exactly opposite values in them: no ray slips between, and
//! a ray that meets the edge exactly meets both. Differs from the paper in that
//! lanes with different major axes run one after another, that both orientations
//! are met, and that there is no f64 retry (that is what certainty is for).
//! Callers bring corners into their [`canonical`] order.

use super::ray::{Meet, Ray};
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask, Scalar};

/// Corners in f32, about the mesh's centre.
pub type Corners = [[f32; 3]; 3];

/// The corners in an order of their own, whatever the winding: two triangles on
/// the same three points (scans have such) then give the same bits of t, and the
/// lower id wins, as in exact arithmetic. The kernel asks for no winding.
pub fn canonical(mut corners: Corners) -> Corners {
    corners.sort_unstable_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    corners
}

#[inline(always)]
pub fn meet<L: Lanes>(corners: &Corners, ray: &Ray<L>, active: L::Mask) -> Meet<L> {
    meet_each(&splat(corners), ray, active)
}

/// The same corners in every lane.
#[inline(always)]
pub fn splat<L: Lanes>(corners: &Corners) -> [Vec3<L>; 3] {
    let corner = |c: &[f32; 3]| Vec3::new(L::from_f32(c[0]), L::from_f32(c[1]), L::from_f32(c[2]));
    [
        corner(&corners[0]),
        corner(&corners[1]),
        corner(&corners[2]),
    ]
}

/// A triangle of its own in each lane; the same bits as [`meet`].
#[inline(always)]
pub fn meet_each<L: Lanes>(corners: &[Vec3<L>; 3], ray: &Ray<L>, active: L::Mask) -> Meet<L> {
    let mut hit = L::Mask::splat(false);
    let mut t = L::zero();
    for (k, lanes) in ray.shear.groups() {
        let (inside, one) = along_axis(corners, ray, k);
        let here = inside & lanes & active;
        if here.none() {
            continue;
        }
        let one = one.t(ray);
        t = L::select(here, one, t);
        hit = hit | here;
    }
    // det = 0 (edge-on, or no area) gives an infinite or NaN t: never a hit.
    let finite = t.abs().lt(L::splat(L::Scalar::INFINITY));
    Meet::certain(hit & finite & t.gt(ray.t_min), t)
}

/// Where each lane's ray meets its triangle's plane, by the very steps of
/// [`meet`], whether or not it passes inside. NaN or infinite where edge-on.
#[inline(always)]
pub fn depth_each<L: Lanes>(corners: &[Vec3<L>; 3], ray: &Ray<L>) -> L {
    let mut t = L::zero();
    for (k, lanes) in ray.shear.groups() {
        t = L::select(lanes, along_axis(corners, ray, k).1.t(ray), t);
    }
    t
}

/// Lanes whose triangle the ray may meet in exact arithmetic, or at any better
/// precision, where corners relative to the origin and seen along the ray are out
/// of place by at most `misplaced` on each axis.
///
/// With m the largest coordinate so seen and e the misplacement, an edge function
/// (a difference of two products) is wrong by at most 4em + 2e², and rounding
/// adds less than em.
#[inline(always)]
pub fn may_meet_each<L: Lanes>(
    corners: &[Vec3<L>; 3],
    ray: &Ray<L>,
    misplaced: L::Scalar,
) -> L::Mask {
    let mut meets = L::Mask::splat(false);
    let e = L::splat(misplaced);
    for (k, lanes) in ray.shear.groups() {
        let seen = |c: Vec3<L>| ray.shear.apply(k, c - ray.org);
        let ((ax, ay, _), (bx, by, _)) = (seen(corners[0]), seen(corners[1]));
        let (cx, cy, _) = seen(corners[2]);
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        let largest = |x: L, y: L| x.abs().max(y.abs());
        let m = largest(ax, ay).max(largest(bx, by)).max(largest(cx, cy));
        let margin = e * (m * L::from_f32(5.0) + e * L::from_f32(2.0));
        let least = u.min(v).min(w);
        let most = u.max(v).max(w);
        meets = meets | ((least.ge(-margin) | most.le(margin)) & lanes);
    }
    meets
}

/// Barycentric weights, not yet divided by their sum, and the corners' depths.
struct Weighed<L> {
    weights: [L; 3],
    depths: [L; 3],
}

impl<L: Lanes> Weighed<L> {
    #[inline(always)]
    fn t(&self, ray: &Ray<L>) -> L {
        let ([u, v, w], [a, b, c]) = (self.weights, self.depths);
        let det = u + v + w;
        (u * a + v * b + w * c) / (det * ray.shear.along)
    }
}

#[inline(always)]
fn along_axis<L: Lanes>(corners: &[Vec3<L>; 3], ray: &Ray<L>, k: usize) -> (L::Mask, Weighed<L>) {
    let seen = |c: Vec3<L>| ray.shear.apply(k, c - ray.org);
    let (ax, ay, az) = seen(corners[0]);
    let (bx, by, bz) = seen(corners[1]);
    let (cx, cy, cz) = seen(corners[2]);
    let u = cx * by - cy * bx;
    let v = ax * cy - ay * cx;
    let w = bx * ay - by * ax;
    let zero = L::zero();
    let least = u.min(v).min(w);
    let most = u.max(v).max(w);
    let inside = least.ge(zero) | most.le(zero);
    let weighed = Weighed {
        weights: [u, v, w],
        depths: [az, bz, cz],
    };
    (inside, weighed)
}
