//! Half-spaces, and convex polyhedra as their intersections (Cyrus and Beck 1978; Haines, Graphics
//! Gems II 1991).

pub mod guarded;

use super::columns::{kernels_of_span, table};
use super::exact::{Inside, Line, solid};
use super::face::Face;
use super::guarded::{Ends, ObjectRay};
use super::kinds::HalfSpaceId;
use super::primitive::{Blur, Exact, Flaw, Primitive, finite, finite3};
use super::ray::Meet;
use super::ray::{Ray, Span};
use crate::math::Aabb;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::math::{Vec3, length};
use glam::DVec3;

/// The solid n·x ≤ offset; unbounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// The outward normal, of any length > 0.
    pub normal: DVec3,
    pub offset: f64,
}

/// Returns the part of each ray in one half-space, or in the bounded solid that several make.
#[inline(always)]
pub fn span<L: Lanes>(planes: &[HalfSpace], ray: &Ray<L>) -> Span<L> {
    let infinity = L::splat(L::Scalar::INFINITY);
    let zero = L::zero();
    let (org, dir) = (ray.shear.turned(ray.org), ray.shear.turned_dir(ray.dir));
    let mut some = L::Mask::splat(true);
    let mut enter = -infinity;
    let mut exit = infinity;
    for plane in planes {
        let normal = Vec3::splat(plane.normal.to_array().map(L::Scalar::from_f64));
        let normal = ray.shear.turned(normal);
        let room = L::from_f64(plane.offset) - normal.dot(org);
        let speed = normal.dot(dir);
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

impl HalfSpace {
    /// Returns the distance of `p` above the plane, and the outward unit normal.
    #[inline(always)]
    pub fn nearest<D: Lanes<Scalar = f64>>(&self, p: Vec3<D>) -> (D, Vec3<D>) {
        let plane = self.ordinary();
        let shorter = 1.0 / length(plane.normal);
        let normal = Vec3::<D>::splat(plane.normal.to_array());
        let above = (normal.dot(p) - D::splat(plane.offset)) * D::splat(shorter);
        (above, Vec3::splat((plane.normal * shorter).to_array()))
    }

    /// Returns the same plane with a normal whose square neither overflows nor underflows.
    #[inline(always)]
    fn ordinary(&self) -> HalfSpace {
        let size = self.normal.abs().max_element();
        if (1e-100..1e100).contains(&size) {
            return *self;
        }
        self.scaled(-libm::ilogb(size))
    }

    /// Scales by a power of two, which rounds only what is negligible beside the largest
    /// component.
    #[cold]
    fn scaled(&self, power: i32) -> HalfSpace {
        HalfSpace {
            normal: self.normal.map(|x| libm::scalbn(x, power)),
            offset: libm::scalbn(self.offset, power),
        }
    }
}

/// Returns the distance of `p` above the nearest plane, and that plane's outward unit normal.
#[inline(always)]
pub fn nearest<D: Lanes<Scalar = f64>>(planes: &[HalfSpace], p: Vec3<D>) -> (D, Vec3<D>) {
    let mut best = (D::splat(f64::INFINITY), Vec3::splat(DVec3::Y.to_array()));
    for plane in planes {
        let (above, normal) = plane.nearest(p);
        let nearer = above.abs().lt(best.0.abs());
        best.0 = D::select(nearer, above, best.0);
        best.1 = Vec3::select(nearer, normal, best.1);
    }
    best
}

table!(HalfSpaces of HalfSpace by HalfSpaceId { normal: DVec3, offset: f64 });

impl Primitive for HalfSpaces {
    type Id = HalfSpaceId;
    type Row<'a> = HalfSpace;
    const BLUR: Blur = Blur::HalfSpaces;

    #[inline(always)]
    fn exact(&self, id: HalfSpaceId) -> HalfSpace {
        self.row(id)
    }

    fn check(&self, id: HalfSpaceId) -> Result<(), Flaw> {
        let row = self.row(id);
        finite3("normal", row.normal)?;
        finite("offset", &[row.offset])?;
        if row.normal == DVec3::ZERO {
            return Err(Flaw::Degenerate("its normal is (0, 0, 0)".into()));
        }
        Ok(())
    }

    fn bounds(&self, _id: HalfSpaceId) -> Option<Aabb> {
        None
    }

    fn faces(&self, id: HalfSpaceId) -> Vec<Option<Face>> {
        let row = self.row(id);
        vec![Some(Face::of_plane(row.normal, row.offset))]
    }

    fn plane_normals(&self, id: HalfSpaceId) -> Vec<DVec3> {
        vec![self.row(id).normal]
    }

    kernels_of_span! {
        (self, id: HalfSpaceId, object, active)
        span(&[self.row(id)], object.ray),
        guarded::meet(&self.row(id), object, active),
        guarded::ends(&self.row(id), object),
    }

    #[inline(always)]
    fn nearest<D: Lanes<Scalar = f64>>(&self, id: HalfSpaceId, p: Vec3<D>) -> (D, Vec3<D>) {
        self.row(id).nearest(p)
    }

    #[inline(always)]
    fn normals<D: Lanes<Scalar = f64>>(&self, id: HalfSpaceId, p: Vec3<D>) -> Vec3<D> {
        let _ = p;
        Vec3::splat(self.row(id).normal.to_array())
    }
}

impl<'a> Exact<'a> for HalfSpace {
    fn is_finite(&self) -> bool {
        self.normal.is_finite() && self.offset.is_finite()
    }

    #[inline(always)]
    fn inside(&self, line: &Line) -> Inside {
        Inside::of_convex(solid::half_spaces(line, [*self].into_iter()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_are_the_same_whatever_their_normal_s_length() {
        for power in [-1060, -570, -300, 0, 300, 570, 1020] {
            let long = libm::scalbn(1.0, power);
            let plane = HalfSpace {
                normal: DVec3::new(0.0, 3.0, -4.0) * long,
                offset: 5.0 * long,
            };
            let (above, normal) = plane.nearest(Vec3::<f64>::new(7.0, 1.0, -8.0));
            assert_eq!(above, 6.0, "2^{power}");
            assert!((DVec3::from(normal) - DVec3::new(0.0, 0.6, -0.8)).length() < 1e-15);
        }
    }
}
