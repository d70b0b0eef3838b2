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
    let mut hit = L::Mask::splat(false);
    let mut t = L::zero();
    for (k, lanes) in ray.shear.groups() {
        let one = along_axis(corners, ray, k);
        let here = one.hit & lanes & active;
        t = L::select(here, one.t, t);
        hit = hit | here;
    }
    Meet::certain(hit, t)
}

#[inline(always)]
fn along_axis<L: Lanes>(corners: &Corners, ray: &Ray<L>, k: usize) -> Meet<L> {
    let seen = |c: &[f32; 3]| {
        let corner = Vec3::splat(c.map(L::Scalar::from_f32));
        ray.shear.apply(k, corner - ray.org)
    };
    let (ax, ay, az) = seen(&corners[0]);
    let (bx, by, bz) = seen(&corners[1]);
    let (cx, cy, cz) = seen(&corners[2]);
    let u = cx * by - cy * bx;
    let v = ax * cy - ay * cx;
    let w = bx * ay - by * ax;
    let zero = L::zero();
    let least = u.min(v).min(w);
    let most = u.max(v).max(w);
    let inside = least.ge(zero) | most.le(zero);
    if inside.none() {
        return Meet::certain(inside, zero);
    }
    let det = u + v + w;
    let t = (u * az + v * bz + w * cz) / (det * ray.shear.along);
    // det = 0 (edge-on, or no area) gives an infinite or NaN t: never a hit.
    let finite = t.abs().lt(L::splat(L::Scalar::INFINITY));
    Meet::certain(inside & finite & t.gt(ray.t_min), t)
}
