//! What every kind of primitive says of itself.

use super::exact::{Inside, Line, Root};
use super::face::Face;
use super::guarded::{Ends, ObjectRay};
use super::ray::Meet;
use super::scratch::Scratch;
use crate::math::lanes::Lanes;
use crate::math::{Aabb, Vec3, units_and_lengths};
use crate::roots::Solver;
use glam::DVec3;

/// Only tables of [`super::kinds`] are primitives.
pub trait Sealed {}

/// How boundaries of an operand of CSG are found along a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boundaries {
    /// One span in lanes ([`Primitive::ends`]), or what is outside of one.
    Span,
    /// As many as the polynomial's degree, in lanes.
    Polynomial,
    /// Any number, one ray at a time ([`Exact::crossings`]).
    Crossings,
}

/// What a hit's point is off by in lanes, in units of the operand's extent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blur {
    /// Nothing besides what is known of it apart.
    Apart,
    Planar,
    /// And in frames as far off as its planes may be placed.
    HalfSpaces,
    Curved,
}

/// Why a row is no primitive.
#[derive(Clone, Debug, PartialEq)]
pub enum Flaw {
    NotFinite {
        field: &'static str,
        value: String,
    },
    OutOfRange {
        field: &'static str,
        value: String,
        must: &'static str,
    },
    Degenerate(String),
    NoFormula {
        degree: u32,
        solver: Solver,
        most: usize,
    },
    /// It has none of this.
    Empty(&'static str),
    NormalCount {
        normals: usize,
        vertices: usize,
    },
}

pub(super) fn finite(field: &'static str, values: &[f64]) -> Result<(), Flaw> {
    match values.iter().find(|v| !v.is_finite()) {
        None => Ok(()),
        Some(v) => Err(Flaw::NotFinite {
            field,
            value: v.to_string(),
        }),
    }
}

pub(super) fn finite3(field: &'static str, v: DVec3) -> Result<(), Flaw> {
    finite(field, &v.to_array())
}

pub(super) fn require(
    ok: bool,
    field: &'static str,
    value: f64,
    must: &'static str,
) -> Result<(), Flaw> {
    if ok {
        return Ok(());
    }
    let value = value.to_string();
    Err(Flaw::OutOfRange { field, value, must })
}

pub(super) fn positive(field: &'static str, value: f64) -> Result<(), Flaw> {
    require(value > 0.0, field, value, "greater than 0")
}

/// One step further on every side: for corners that are rounded sums.
pub(crate) fn outward(b: Aabb) -> Aabb {
    let step = |v: DVec3, f: fn(f64) -> f64| DVec3::from_array(v.to_array().map(f));
    Aabb::new(step(b.min, f64::next_down), step(b.max, f64::next_up))
}

pub(crate) const OPEN: &str = "it is open, and has no inside; leave out 'open'";

/// Points against the surface below them, in object space.
#[derive(Clone, Copy, Debug)]
pub struct Height<D> {
    /// Outward; to first order in it.
    pub above: D,
    /// Outward, unit; zero where a polynomial or another function has no gradient.
    pub normal: Vec3<D>,
    /// Of a function of space, the length of its gradient; else 1.
    pub slope: D,
}

/// The table of a kind. Each function is about one row, in object space.
pub trait Primitive: Sealed {
    type Id: Copy;
    /// What the exact predicates need of a row.
    type Row<'a>: Exact<'a>
    where
        Self: 'a;

    const BOUNDARIES: Boundaries = Boundaries::Span;
    const BLUR: Blur = Blur::Curved;
    /// Whether [`nearest`](Primitive::nearest) gives distances and unit normals, and not
    /// values and gradients of a function that is zero on the surface.
    const IS_DISTANCE: bool = true;
    /// A surface that is met in lanes where the ray starts, as triangles are.
    const IS_FLAT: bool = false;

    fn exact(&self, id: Self::Id) -> Self::Row<'_>;

    fn check(&self, id: Self::Id) -> Result<(), Flaw>;

    /// Conservative: no point is left out. `None` for those without bounds.
    fn bounds(&self, id: Self::Id) -> Option<Aabb>;

    /// Why it cannot be an operand of CSG.
    fn no_inside(&self, _id: Self::Id) -> Option<&'static str> {
        None
    }

    /// Numbered as by [`Ends`]; `None` where a face is but a point.
    fn faces(&self, _id: Self::Id) -> Vec<Option<Face>> {
        Vec::new()
    }

    /// Of what half-spaces bound, the planes' normals.
    fn plane_normals(&self, _id: Self::Id) -> Vec<DVec3> {
        Vec::new()
    }

    /// Rings of corners at which a ray's answer turns: where others look for errors.
    fn outlines(&self, _id: Self::Id) -> Vec<Vec<DVec3>> {
        Vec::new()
    }

    /// The least extent, if bounds in lanes grow with it.
    fn thickness(&self, id: Self::Id) -> Option<f64> {
        Some(self.bounds(id).map_or(1.0, |b| b.extent().min_element()))
    }

    /// Where rays first meet it beyond t_min; without bounds.
    fn meet_fast<L: Lanes>(
        &self,
        id: Self::Id,
        object: &ObjectRay<L>,
        active: L::Mask,
        scratch: &mut Scratch,
    ) -> Meet<L>;

    /// The same with error bounds. `extent`: no less than the longest side of its box.
    fn meet<L: Lanes>(
        &self,
        id: Self::Id,
        extent: f32,
        object: &ObjectRay<L>,
        active: L::Mask,
        scratch: &mut Scratch,
    ) -> Meet<L>;

    /// The same of lanes in f64 of what f32 left in doubt.
    #[inline(always)]
    fn meet_again<L: Lanes>(
        &self,
        id: Self::Id,
        extent: f32,
        object: &ObjectRay<L>,
        active: L::Mask,
        scratch: &mut Scratch,
    ) -> Meet<L> {
        self.meet(id, extent, object, active, scratch)
    }

    /// What rays have in it, without bounds; of [`Boundaries::Span`].
    #[inline(always)]
    fn ends_fast<L: Lanes>(&self, _id: Self::Id, _object: &ObjectRay<L>) -> Ends<L> {
        unreachable!("it is no operand that is met in lanes")
    }

    /// The same with bounds. `astray`: how far off its surface may be placed, of kinds
    /// whose bounds do not grow with their extent.
    #[inline(always)]
    fn ends<L: Lanes>(&self, _id: Self::Id, _object: &ObjectRay<L>, _astray: L::Double) -> Ends<L> {
        unreachable!("it is no operand that is met in lanes")
    }

    /// Distance, outward, and unit normal of the nearest part of the surface, or value and
    /// gradient: see [`IS_DISTANCE`](Primitive::IS_DISTANCE).
    fn nearest<D: Lanes<Scalar = f64>>(&self, id: Self::Id, p: Vec3<D>) -> (D, Vec3<D>);

    /// Outward, any length, of the nearest part of the surface.
    #[inline(always)]
    fn normals<D: Lanes<Scalar = f64>>(&self, id: Self::Id, p: Vec3<D>) -> Vec3<D> {
        self.nearest(id, p).1
    }

    /// Of what [`nearest`](Primitive::nearest) gave.
    #[inline(always)]
    fn height<D: Lanes<Scalar = f64>>(&self, (value, gradient): (D, Vec3<D>)) -> Height<D> {
        if Self::IS_DISTANCE {
            return Height {
                above: value,
                normal: gradient,
                slope: D::splat(1.0),
            };
        }
        let (normal, slope) = units_and_lengths(gradient);
        Height {
            above: value / slope,
            normal,
            slope,
        }
    }

    /// Effective coordinate magnitude of a function's roundings, beyond the point's own.
    /// `slope`: where it is known.
    #[inline(always)]
    fn blur<D: Lanes<Scalar = f64>>(&self, _id: Self::Id, _at: Vec3<D>, _slope: Option<D>) -> D {
        D::zero()
    }
}

/// A row as exact arithmetic takes it.
pub trait Exact<'a>: Copy {
    fn is_finite(&self) -> bool;

    /// What a line has in it, if that is a span, or what is outside of one.
    #[inline(always)]
    fn inside(&self, _line: &Line) -> Inside {
        Inside::NOWHERE
    }

    /// Calls `visit` with all boundaries on a line, front to back, and whether the line comes
    /// in there. Returns whether it is in the solid from the start.
    fn crossings(
        &self,
        line: &Line,
        _scratch: &mut Scratch,
        mut visit: impl FnMut(Root<'a>, bool),
    ) -> bool {
        let Inside { at_first, ends } = self.inside(line);
        for (root, enters) in ends.into_iter().flatten().zip([!at_first, at_first]) {
            visit(root, enters);
        }
        at_first
    }

    /// Where the line first meets its boundary beyond t_min.
    #[inline(always)]
    fn first_beyond(&self, line: &Line, t_min: f64, _scratch: &mut Scratch) -> Option<Root<'a>> {
        let beyond = |end: &Root| end.order_with(t_min).is_gt();
        self.inside(line).ends.into_iter().flatten().find(beyond)
    }
}
