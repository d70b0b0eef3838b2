//! Ellipsoids: the unit sphere, met by rays divided by the radii.

use super::chart::Chart;
use super::columns::{kernels_of_span, table};
use super::exact::{Inside, Line, solid};
use super::face::Face;
use super::guarded::{Ends, ObjectRay};
use super::kinds::EllipsoidId;
use super::primitive::{Exact, Flaw, Primitive, finite3, outward, positive};
use super::ray::Meet;
use super::ray::{Ray, Span};
use super::sphere::centered_span;
use super::sphere::guarded::{ellipsoid_ends, meet_ellipsoid};
use crate::math::lanes::{Lanes, Scalar};
use crate::math::{Aabb, Vec3};
use glam::DVec3;

/// An axis-parallel ellipsoid; a transform turns it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    pub center: DVec3,
    /// The radii along the axes, each > 0.
    pub radii: DVec3,
}

impl Ellipsoid {
    pub fn bounds(&self) -> Aabb {
        Aabb::new(self.center, self.center).grown(self.radii)
    }

    /// Returns the outward normal, of any length: the gradient of Σ(x/r)².
    #[inline(always)]
    pub fn normals_at<D: Lanes<Scalar = f64>>(&self, p: Vec3<D>) -> Vec3<D> {
        // Relative to the least radius, so that squares stay in range.
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

table!(Ellipsoids of Ellipsoid by EllipsoidId { center: DVec3, radii: DVec3 });

impl Primitive for Ellipsoids {
    type Id = EllipsoidId;
    type Row<'a> = Ellipsoid;
    const IS_DISTANCE: bool = false;

    #[inline(always)]
    fn exact(&self, id: EllipsoidId) -> Ellipsoid {
        self.row(id)
    }

    fn check(&self, id: EllipsoidId) -> Result<(), Flaw> {
        let row = self.row(id);
        finite3("center", row.center)?;
        finite3("radii", row.radii)?;
        positive("radii", row.radii.min_element())
    }

    fn bounds(&self, id: EllipsoidId) -> Option<Aabb> {
        Some(outward(self.row(id).bounds()))
    }

    fn faces(&self, id: EllipsoidId) -> Vec<Option<Face>> {
        let row = self.row(id);
        let (center, radii) = (row.center, row.radii);
        vec![Some(Face::Ellipsoid { center, radii })]
    }

    kernels_of_span! {
        (self, id: EllipsoidId, object, active)
        span(&self.row(id), object.ray),
        meet_ellipsoid(&self.row(id), object, active),
        ellipsoid_ends(&self.row(id), object),
    }

    #[inline(always)]
    fn nearest<D: Lanes<Scalar = f64>>(&self, id: EllipsoidId, p: Vec3<D>) -> (D, Vec3<D>) {
        let row = self.row(id);
        let shrink = |v: Vec3<D>| {
            let [x, y, z] = row.radii.to_array().map(|r| D::splat(1.0 / r));
            Vec3::new(v.x * x, v.y * y, v.z * z)
        };
        let scaled = shrink(p - Vec3::splat(row.center.to_array()));
        let value = scaled.length_squared() - D::splat(1.0);
        (value, shrink(scaled) * D::splat(2.0))
    }

    #[inline(always)]
    fn normals<D: Lanes<Scalar = f64>>(&self, id: EllipsoidId, p: Vec3<D>) -> Vec3<D> {
        self.row(id).normals_at(p)
    }

    fn chart(&self, id: EllipsoidId, p: DVec3, _: DVec3) -> Chart {
        let row = self.row(id);
        Chart::on_sphere((p - row.center) / row.radii, row.radii)
    }
}

impl<'a> Exact<'a> for Ellipsoid {
    fn is_finite(&self) -> bool {
        self.center.is_finite() && self.radii.is_finite()
    }

    #[inline(always)]
    fn inside(&self, line: &Line) -> Inside {
        Inside::of_convex(solid::ellipsoid(line, self))
    }
}
