//! The traits that every kind of primitive implements.

use super::chart::Chart;
use super::exact::{Inside, Line, Root};
use super::face::Face;
use super::guarded::{Ends, ObjectRay};
use super::ray::Meet;
use super::scratch::Scratch;
use crate::math::lanes::Lanes;
use crate::math::{Aabb, Vec3, units_and_lengths};
use crate::roots::Solver;
use glam::DVec3;

/// Seals [`Primitive`]: only tables of [`super::kinds`] implement it.
pub trait Sealed {}

/// How the boundaries of a CSG operand are found along a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boundaries {
    /// One span, or the complement of one, in lanes ([`Primitive::ends`]).
    Span,
    /// As many boundaries as the polynomial's degree, in lanes.
    Polynomial,
    /// Any number of boundaries, one ray at a time ([`Exact::crossings`]).
    Crossings,
}

/// How the error of a hit's point in lanes grows with the operand's extent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blur {
    /// Not at all: bounds are computed apart.
    Apart,
    Planar,
    /// As of planes, and in other frames by the placement error of its planes.
    HalfSpaces,
    Curved,
}

/// The reason why a row is not a valid primitive.
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
    /// The primitive has none of this.
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

/// Grows a box by one f64 step on every side, for corners that are rounded sums.
pub(crate) fn outward(b: Aabb) -> Aabb {
    let step = |v: DVec3, f: fn(f64) -> f64| DVec3::from_array(v.to_array().map(f));
    Aabb::new(step(b.min, f64::next_down), step(b.max, f64::next_up))
}

pub(crate) const OPEN: &str = "it is open, and has no inside; leave out 'open'";

/// Distances of points from the surface, in object space.
#[derive(Clone, Copy, Debug)]
pub struct Height<D> {
    /// The signed distance, positive outside, to first order.
    pub above: D,
    /// The outward unit normal; zero where a function has no gradient.
    pub normal: Vec3<D>,
    /// The length of the gradient, if the surface is a function's level set; else 1.
    pub slope: D,
}

/// The table of a kind. Each function treats one row, in object space.
pub trait Primitive: Sealed {
    type Id: Copy;
    /// A row as the exact predicates take it.
    type Row<'a>: Exact<'a>
    where
        Self: 'a;

    const BOUNDARIES: Boundaries = Boundaries::Span;
    const BLUR: Blur = Blur::Curved;
    /// Whether [`nearest`](Primitive::nearest) returns distances and unit normals instead of
    /// values and gradients of a function that is zero on the surface.
    const IS_DISTANCE: bool = true;
    /// Whether it is a surface that f32 lanes meet from the ray's own start, as they meet
    /// triangles.
    const IS_FLAT: bool = false;

    fn exact(&self, id: Self::Id) -> Self::Row<'_>;

    fn check(&self, id: Self::Id) -> Result<(), Flaw>;

    /// Returns a box that holds every point; `None` if it is unbounded.
    fn bounds(&self, id: Self::Id) -> Option<Aabb>;

    /// Returns the reason why it cannot be an operand of CSG.
    fn no_inside(&self, _id: Self::Id) -> Option<&'static str> {
        None
    }

    /// Returns the faces, numbered as by [`Ends`]; `None` for a face that is a point.
    fn faces(&self, _id: Self::Id) -> Vec<Option<Face>> {
        Vec::new()
    }

    /// Returns the normals of the planes, if half-spaces bound it.
    fn plane_normals(&self, _id: Self::Id) -> Vec<DVec3> {
        Vec::new()
    }

    /// Returns rings of corners, at which stress tests aim rays.
    fn outlines(&self, _id: Self::Id) -> Vec<Vec<DVec3>> {
        Vec::new()
    }

    /// Returns the least extent, if error bounds in lanes depend on it.
    fn thickness(&self, id: Self::Id) -> Option<f64> {
        Some(self.bounds(id).map_or(1.0, |b| b.extent().min_element()))
    }

    /// Returns where rays first meet it beyond t_min, without error bounds.
    fn meet_fast<L: Lanes>(
        &self,
        id: Self::Id,
        object: &ObjectRay<L>,
        active: L::Mask,
        scratch: &mut Scratch,
    ) -> Meet<L>;

    /// Returns where rays first meet it beyond t_min, with error bounds. `extent` is no less than
    /// the longest side of its box.
    fn meet<L: Lanes>(
        &self,
        id: Self::Id,
        extent: f32,
        object: &ObjectRay<L>,
        active: L::Mask,
        scratch: &mut Scratch,
    ) -> Meet<L>;

    /// Meets again, in f64 lanes, rays that f32 left undecided.
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

    /// Returns the spans of rays without error bounds, if it has [`Boundaries::Span`].
    #[inline(always)]
    fn ends_fast<L: Lanes>(&self, _id: Self::Id, _object: &ObjectRay<L>) -> Ends<L> {
        unreachable!("it is no operand that is met in lanes")
    }

    /// Returns the spans of rays with error bounds. `astray` bounds the placement error of the
    /// surface, for kinds with [`Blur::Apart`].
    #[inline(always)]
    fn ends<L: Lanes>(&self, _id: Self::Id, _object: &ObjectRay<L>, _astray: L::Double) -> Ends<L> {
        unreachable!("it is no operand that is met in lanes")
    }

    /// Returns the signed distance and the unit normal of the nearest part of the surface, or
    /// value and gradient: see [`IS_DISTANCE`](Primitive::IS_DISTANCE).
    fn nearest<D: Lanes<Scalar = f64>>(&self, id: Self::Id, p: Vec3<D>) -> (D, Vec3<D>);

    /// Returns the outward normal, of any length, of the nearest part of the surface.
    #[inline(always)]
    fn normals<D: Lanes<Scalar = f64>>(&self, id: Self::Id, p: Vec3<D>) -> Vec3<D> {
        self.nearest(id, p).1
    }

    /// Returns the texture coordinates of a point of the surface, whose outward unit normal is
    /// given. Kinds without coordinates of their own are textured along the axes.
    fn chart(&self, _id: Self::Id, p: DVec3, normal: DVec3) -> Chart {
        Chart::along_axes(p, normal)
    }

    /// Computes the height from the result of [`nearest`](Primitive::nearest).
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

    /// Effective coordinate magnitude in error bounds of a function, besides the point's own: its
    /// error over its slope; 0 for other kinds. `slope` is passed where it is known.
    #[inline(always)]
    fn blur<D: Lanes<Scalar = f64>>(&self, _id: Self::Id, _at: Vec3<D>, _slope: Option<D>) -> D {
        D::zero()
    }
}

/// The exact predicates of a row.
pub trait Exact<'a>: Copy {
    fn is_finite(&self) -> bool;

    /// Returns the part of a line inside, if that is a span or the complement of one.
    #[inline(always)]
    fn inside(&self, _line: &Line) -> Inside {
        Inside::NOWHERE
    }

    /// Calls `visit` with all boundaries on a line, front to back, and whether the line enters
    /// there. Returns whether the line is in the solid from the start.
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

    /// Returns where the line first meets the boundary beyond t_min.
    #[inline(always)]
    fn first_beyond(&self, line: &Line, t_min: f64, _scratch: &mut Scratch) -> Option<Root<'a>> {
        let beyond = |end: &Root| end.order_with(t_min).is_gt();
        self.inside(line).ends.into_iter().flatten().find(beyond)
    }
}
