//! Circular cylinders: cones of equal radii.

use super::chart::Chart;
use super::columns::table;
use super::cone::{Cone, Upright, apart, span};
use super::face::Face;
use super::guarded::{self, Ends, ObjectRay};
use super::kinds::CylinderId;
use super::primitive::{Flaw, OPEN, Primitive, finite, finite3, positive};
use super::ray::Meet;
use super::scratch::Scratch;
use crate::math::lanes::Lanes;
use crate::math::{Aabb, Vec3};
use glam::DVec3;

/// A finite circular cylinder from `base` to `top`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    pub base: DVec3,
    pub top: DVec3,
    /// The radius, > 0.
    pub radius: f64,
    /// Whether the caps are left out: it is then a surface without inside.
    pub open: bool,
}

impl Cylinder {
    #[inline(always)]
    pub fn as_cone(&self) -> Cone {
        Cone {
            base: self.base,
            top: self.top,
            base_radius: self.radius,
            top_radius: self.radius,
            open: self.open,
        }
    }

    pub fn bounds(&self) -> Aabb {
        self.as_cone().bounds()
    }
}

table!(Cylinders of Cylinder by CylinderId {
    base: DVec3,
    top: DVec3,
    radius: f64,
    open: bool,
} with uprights: Upright = |row: &Cylinder| row.as_cone().upright());

impl Cylinders {
    /// Returns the row in the form that kernels take.
    #[inline(always)]
    pub fn upright(&self, id: CylinderId) -> &Upright {
        &self.uprights[id.index()]
    }
}

impl Primitive for Cylinders {
    type Id = CylinderId;
    type Row<'a> = Cone;

    #[inline(always)]
    fn exact(&self, id: CylinderId) -> Cone {
        self.row(id).as_cone()
    }

    fn check(&self, id: CylinderId) -> Result<(), Flaw> {
        let row = self.row(id);
        finite3("base", row.base)?;
        finite3("top", row.top)?;
        finite("radius", &[row.radius])?;
        positive("radius", row.radius)?;
        apart(row.base, row.top)
    }

    fn bounds(&self, id: CylinderId) -> Option<Aabb> {
        Some(self.row(id).bounds())
    }

    fn no_inside(&self, id: CylinderId) -> Option<&'static str> {
        self.open[id.index()].then_some(OPEN)
    }

    fn faces(&self, id: CylinderId) -> Vec<Option<Face>> {
        let row = self.row(id);
        let caps = [Face::cap(row.base, row.top), Face::cap(row.top, row.base)];
        let side = Face::side(row.base, row.top, row.radius);
        caps.into_iter().chain([side]).map(Some).collect()
    }

    /// Returns the lesser of height and diameter: the box of an oblique one says nothing about it.
    fn thickness(&self, id: CylinderId) -> Option<f64> {
        let row = self.row(id);
        Some(row.base.distance(row.top).min(2.0 * row.radius))
    }

    #[inline(always)]
    fn meet_fast<L: Lanes>(
        &self,
        id: CylinderId,
        object: &ObjectRay<L>,
        active: L::Mask,
        _: &mut Scratch,
    ) -> Meet<L> {
        let _ = active;
        self.upright(id).meet_fast(object.ray)
    }

    #[inline(always)]
    fn meet<L: Lanes>(
        &self,
        id: CylinderId,
        _extent: f32,
        object: &ObjectRay<L>,
        active: L::Mask,
        _: &mut Scratch,
    ) -> Meet<L> {
        guarded::cone::meet_cylinder(self.upright(id), object, active)
    }

    #[inline(always)]
    fn ends_fast<L: Lanes>(&self, id: CylinderId, object: &ObjectRay<L>) -> Ends<L> {
        Ends::certain(&span(self.upright(id), object.ray))
    }

    #[inline(always)]
    fn ends<L: Lanes>(&self, id: CylinderId, object: &ObjectRay<L>, _astray: L::Double) -> Ends<L> {
        guarded::cone::cylinder_ends(self.upright(id), object)
    }

    #[inline(always)]
    fn nearest<D: Lanes<Scalar = f64>>(&self, id: CylinderId, p: Vec3<D>) -> (D, Vec3<D>) {
        self.upright(id).nearest(p)
    }

    fn chart(&self, id: CylinderId, p: DVec3, _: DVec3) -> Chart {
        Chart::on_cone(self.upright(id), p)
    }
}
