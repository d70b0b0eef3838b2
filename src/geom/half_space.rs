//! Half-spaces, and convex polyhedra as their intersections (Cyrus and Beck
//! 1978; Haines, Graphics Gems II 1991).

use super::ray::{Ray, Span};
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask, Scalar};
use glam::DVec3;

/// The solid n·x ≤ offset; unbounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// Outward, any length > 0.
    pub normal: DVec3,
    pub offset: f64,
}

/// Of one half-space, or of the bounded solid that several make.
#[inline(always)]
pub fn span<L: Lanes>(planes: &[HalfSpace], ray: &Ray<L>) -> Span<L> {
    let infinity = L::splat(L::Scalar::INFINITY);
    let zero = L::zero();
    let org = ray.shear.turned(ray.org);
    let mut some = L::Mask::splat(true);
    let mut enter = -infinity;
    let mut exit = infinity;
    for plane in planes {
        let normal = Vec3::splat(plane.normal.to_array().map(L::Scalar::from_f64));
        let normal = ray.shear.turned(normal);
        let room = L::from_f64(plane.offset) - normal.dot(org);
        let speed = normal.dot(ray.turned);
        let t = room / speed;
        let (inward, outward) = (speed.lt(zero), speed.gt(zero));
        enter = enter.max(L::select(inward, t, -infinity));
        exit = exit.min(L::select(outward, t, infinity));
        some = some & (inward | outward | room.ge(zero));
    }
    Span {
        some: some & enter.le(exit),
        enter,
        exit,
    }
}

/// Outward normal, any length, of the plane nearest to `p`.
pub fn normal_at(planes: &[HalfSpace], p: DVec3) -> DVec3 {
    let distance = |h: &HalfSpace| (h.normal.dot(p) - h.offset).abs() / h.normal.length();
    planes
        .iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .map_or(DVec3::Y, |h| h.normal)
}
