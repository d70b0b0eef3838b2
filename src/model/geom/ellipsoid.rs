//! Ellipsoids: the unit sphere, with rays divided by the radii.

use super::ray::{Ray, Span};
use super::sphere::centered_span;
use crate::math::lanes::{Lanes, Scalar};
use crate::math::{Aabb, Vec3};
use glam::DVec3;

/// Axis-parallel; turn it with a transform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    pub center: DVec3,
    /// Each > 0.
    pub radii: DVec3,
}

impl Ellipsoid {
    pub fn bounds(&self) -> Aabb {
        Aabb::new(self.center, self.center).grown(self.radii)
    }

    /// Outward, any length: the gradient of Σ(x/r)².
    #[inline(always)]
    pub fn normals_at<D: Lanes<Scalar = f64>>(&self, p: Vec3<D>) -> Vec3<D> {
        // Divided by the least radius first, so that squares stay in range.
        let least = self.radii.min_element();
        let shape = self.radii / least;
        let out = p - Vec3::splat(self.center.to_array());
        out.by((shape * shape).to_array())
    }
}

#[inline(always)]
pub fn span<L: Lanes>(ellipsoid: &Ellipsoid, ray: &Ray<L>) -> Span<L> {
    let center = Vec3::splat(ellipsoid.center.to_array().map(L::Scalar::from_f64));
    let radii: Vec3<L> = Vec3::splat(ellipsoid.radii.to_array().map(L::Scalar::from_f64));
    let by_radii = |v: Vec3<L>| Vec3::new(v.x / radii.x, v.y / radii.y, v.z / radii.z);
    let turned = |v: Vec3<L>| ray.shear.turned(v);
    let (org, dir) = (by_radii(ray.org - center), by_radii(ray.dir));
    let (org, dir) = (turned(org), turned(dir));
    centered_span(org, dir, dir.length_squared(), L::from_f32(1.0))
}
