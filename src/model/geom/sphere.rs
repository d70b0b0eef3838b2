//! Spheres: the discriminant from the point of the line nearest the centre, and
//! the root that does not cancel (Haines, Günther, Akenine-Möller: Precision
//! Improvements for Ray/Sphere Intersection, Ray Tracing Gems 2019). The naive
//! discriminant loses the sphere at distances of thousands of radii.

use super::ray::{Ray, Span};
use crate::math::lanes::{Lanes, Scalar};
use crate::math::{Aabb, Vec3};
use glam::DVec3;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    pub center: DVec3,
    /// > 0.
    pub radius: f64,
}

impl Sphere {
    pub fn bounds(&self) -> Aabb {
        Aabb::new(self.center, self.center).grown(DVec3::splat(self.radius))
    }

    /// Outward, any length.
    #[inline(always)]
    pub fn normals_at<D: Lanes<Scalar = f64>>(&self, p: Vec3<D>) -> Vec3<D> {
        p - Vec3::splat(self.center.to_array())
    }
}

#[inline(always)]
pub fn span<L: Lanes>(sphere: &Sphere, ray: &Ray<L>) -> Span<L> {
    let center = Vec3::splat(sphere.center.to_array().map(L::Scalar::from_f64));
    let radius = L::from_f64(sphere.radius);
    let org = ray.shear.turned(ray.org - center);
    centered_span(org, ray.shear.turned_dir(ray.dir), ray.dir_squared, radius)
}

/// A sphere about the origin, of turned rays.
#[inline(always)]
pub(super) fn centered_span<L: Lanes>(
    org: Vec3<L>,
    dir: Vec3<L>,
    dir_squared: L,
    radius: L,
) -> Span<L> {
    let b = -org.dot(dir);
    let nearest = org + dir * (b / dir_squared);
    let squared = radius * radius - nearest.length_squared();
    let root = (squared * dir_squared).sqrt();
    // The larger root in magnitude first; the other from their product.
    let q = b + L::select(b.lt(L::zero()), -root, root);
    let product = org.length_squared() - radius * radius;
    let (t0, t1) = (product / q, q / dir_squared);
    // Both roots are 0 where q is: on the surface and tangent to it.
    let at_origin = q.eq(L::zero());
    let t0 = L::select(at_origin, L::zero(), t0);
    Span {
        some: squared.ge(L::zero()),
        enter: t0.min(t1),
        exit: t0.max(t1),
    }
}
