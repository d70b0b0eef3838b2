//! Spheres: the discriminant from the point of the line nearest the centre, and
//! the root that does not cancel (Haines, Günther, Akenine-Möller: Precision
//! Improvements for Ray/Sphere Intersection, Ray Tracing Gems 2019). The naive
//! discriminant loses the sphere at distances of thousands of radii.

pub mod guarded;

use super::chart::Chart;
use super::columns::{kernels_of_span, table};
use super::exact::{Inside, Line, solid};
use super::face::Face;
use super::guarded::{Ends, ObjectRay};
use super::kinds::SphereId;
use super::primitive::{Exact, Flaw, Primitive, finite, finite3, outward, positive};
use super::ray::Meet;
use super::ray::{Ray, Span};
use crate::math::lanes::{Lanes, Scalar};
use crate::math::{Aabb, Vec3};
use glam::DVec3;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    pub center: DVec3,
    /// The radius, > 0.
    pub radius: f64,
}

impl Sphere {
    pub fn bounds(&self) -> Aabb {
        Aabb::new(self.center, self.center).grown(DVec3::splat(self.radius))
    }

    /// Returns the outward normal, of any length.
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

/// Returns the part of each ray, permuted by its shear, in a sphere about the origin.
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
    // The root that is larger in magnitude first; the other from their product.
    let q = b + L::select(b.lt(L::zero()), -root, root);
    let product = org.length_squared() - radius * radius;
    let (t0, t1) = (product / q, q / dir_squared);
    // Both roots are 0 if q is 0: the origin lies on the surface and the ray is tangent.
    let at_origin = q.eq(L::zero());
    let t0 = L::select(at_origin, L::zero(), t0);
    Span {
        some: squared.ge(L::zero()),
        enter: t0.min(t1),
        exit: t0.max(t1),
    }
}

table!(Spheres of Sphere by SphereId { center: DVec3, radius: f64 });

impl Primitive for Spheres {
    type Id = SphereId;
    type Row<'a> = Sphere;
    const IS_DISTANCE: bool = false;

    #[inline(always)]
    fn exact(&self, id: SphereId) -> Sphere {
        self.row(id)
    }

    fn check(&self, id: SphereId) -> Result<(), Flaw> {
        let row = self.row(id);
        finite3("center", row.center)?;
        finite("radius", &[row.radius])?;
        positive("radius", row.radius)
    }

    fn bounds(&self, id: SphereId) -> Option<Aabb> {
        Some(outward(self.row(id).bounds()))
    }

    fn faces(&self, id: SphereId) -> Vec<Option<Face>> {
        let row = self.row(id);
        let (center, radii) = (row.center, DVec3::splat(row.radius));
        vec![Some(Face::Ellipsoid { center, radii })]
    }

    kernels_of_span! {
        (self, id: SphereId, object, active)
        span(&self.row(id), object.ray),
        guarded::meet_sphere(&self.row(id), object, active),
        guarded::sphere_ends(&self.row(id), object),
    }

    #[inline(always)]
    fn nearest<D: Lanes<Scalar = f64>>(&self, id: SphereId, p: Vec3<D>) -> (D, Vec3<D>) {
        let row = self.row(id);
        let out = row.normals_at(p);
        let squared = D::splat(row.radius * row.radius);
        (out.length_squared() - squared, out * D::splat(2.0))
    }

    #[inline(always)]
    fn normals<D: Lanes<Scalar = f64>>(&self, id: SphereId, p: Vec3<D>) -> Vec3<D> {
        self.row(id).normals_at(p)
    }

    fn chart(&self, id: SphereId, p: DVec3, _: DVec3) -> Chart {
        let row = self.row(id);
        let radii = DVec3::splat(row.radius);
        Chart::on_sphere((p - row.center) / radii, radii)
    }
}

impl<'a> Exact<'a> for Sphere {
    fn is_finite(&self) -> bool {
        self.center.is_finite() && self.radius.is_finite()
    }

    #[inline(always)]
    fn inside(&self, line: &Line) -> Inside {
        Inside::of_convex(solid::sphere(line, self))
    }
}
