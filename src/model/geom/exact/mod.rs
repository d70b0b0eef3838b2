//! Exact predicates of a ray and any primitive.
//!
//! The inputs are f64 (a mesh's corners f32) and exact by definition (S6). A boundary lies where a
//! polynomial along the ray is zero, whose coefficients are polynomials in the inputs; a crossing
//! is represented by this root, not by a number. Signs and orders come from f64 with a running
//! error bound (D1, docs/numerics/exact.md), which nearly always decides, else from double-double
//! ([`DoubleDouble`](crate::math::double_double::DoubleDouble), D5), and else from exact numbers
//! ([`Dyadic`](crate::math::dyadic::Dyadic), D11). No finite input is refused. Triangles have
//! predicates of their own ([`crate::geom::triangle::exact`]). tests/kernels/exact_solids/
//! compares with integers of any length.

mod axis_plane;
pub(in crate::geom) mod line_quadratic;
pub mod orientation;
mod per_lane;
mod plane;
pub(in crate::geom) mod restriction;
pub(in crate::geom) mod root;
mod rounding;
pub(in crate::geom) mod solid;
pub(in crate::geom) mod surface;

pub use super::implicit::exact::{Meeting, meetings, meetings_between, sign_at};
pub use per_lane::meet_per_lane;
pub use root::Root;
pub use solid::{Inside, SpanRoots};

use super::kinds::for_each_kind;
use super::primitive::{Exact, Primitive};
use super::scratch::Scratch;
use super::triangle::{Corners, exact as triangle};
use crate::math::Aabb;
use crate::math::bounds::ErrorBounded;
use glam::DVec3;
use root::Branch;
use std::cmp::Ordering;
use surface::Surface;

/// The line of an object ray, unbounded in both directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    pub org: [f64; 3],
    pub dir: [f64; 3],
}

macro_rules! solids {
    ($([$kind:ident $field:ident $table:ident $($rest:tt)*])*) => {
        /// A row of any table of primitives.
        #[derive(Clone, Copy, Debug)]
        pub enum Solid<'a> {
            $($kind(<super::$table as Primitive>::Row<'a>),)*
        }

        impl<'a> Solid<'a> {
            fn is_finite(&self) -> bool {
                match self {
                    $(Solid::$kind(row) => Exact::is_finite(row),)*
                }
            }

            #[inline(always)]
            fn first_beyond(
                &self,
                line: &Line,
                t_min: f64,
                scratch: &mut Scratch,
            ) -> Option<Root<'a>> {
                match self {
                    $(Solid::$kind(row) => Exact::first_beyond(row, line, t_min, scratch),)*
                }
            }

            #[inline(always)]
            fn inside(&self, line: &Line) -> Inside {
                match self {
                    $(Solid::$kind(row) => Exact::inside(row, line),)*
                }
            }

            /// Calls `visit` with all boundaries on a line of finite numbers, front to back, and
            /// whether the line enters there. Returns whether the line is in the solid from the
            /// start. For polynomials see [`meetings`].
            pub fn crossings(
                &self,
                line: &Line,
                scratch: &mut Scratch,
                visit: impl FnMut(Root<'a>, bool),
            ) -> bool {
                match self {
                    $(Solid::$kind(row) => Exact::crossings(row, line, scratch, visit),)*
                }
            }
        }
    };
}

for_each_kind!(solids);

/// Returns where a ray first meets the boundary of a primitive beyond `t_min`, in exact
/// arithmetic. Nothing is met if a number is not finite.
pub fn first_beyond<'a>(
    solid: &Solid<'a>,
    line: &Line,
    t_min: f64,
    scratch: &mut Scratch,
) -> Option<Root<'a>> {
    (line.has_direction() && line.is_finite() && solid.is_finite())
        .then(|| solid.first_beyond(line, t_min, scratch))?
}

/// Returns where a ray first meets the boundary of a row beyond `t_min`.
pub(super) fn first_beyond_of<'a>(
    row: &impl Exact<'a>,
    line: &Line,
    t_min: f64,
    scratch: &mut Scratch,
) -> Option<Root<'a>> {
    (line.has_direction() && line.is_finite() && row.is_finite())
        .then(|| row.first_beyond(line, t_min, scratch))?
}

/// Returns the part of a line in a solid, in exact arithmetic; nothing for a surface, or if a
/// number is not finite. For solids that a line may enter many times see [`Solid::crossings`].
pub fn span(solid: &Solid, line: &Line) -> Inside {
    if !line.has_direction() || !line.is_finite() || !solid.is_finite() {
        return Inside::NOWHERE;
    }
    solid.inside(line)
}

/// Returns where a line of finite numbers passes through a triangle of a closed surface, and
/// whether it runs against the triangle's normal. A line through an edge or corner is treated as a
/// symbolically perturbed line that meets none, so it crosses the surface an even number of times.
#[inline]
pub fn through(line: &Line, corners: &Corners) -> Option<(Root<'static>, bool)> {
    let Line { org, dir } = *line;
    let corners = *corners;
    let pair = triangle::Pair { org, dir, corners };
    let met = triangle::meet_exact(&pair).filter(|met| met.is_generic())?;
    let root = Root::new(line, Surface::Facet(corners), Branch::Upper, met.t);
    Some((root, met.is_against()))
}

impl Line {
    pub fn has_direction(&self) -> bool {
        self.dir.iter().any(|x| *x != 0.0)
    }

    pub fn is_finite(&self) -> bool {
        self.org.iter().chain(&self.dir).all(|x| x.is_finite())
    }

    /// Returns a range of t that holds the part in a box, with room for all roundings, each of
    /// which counts `condition` times; `None` if the line certainly misses the box.
    pub fn part_in(&self, bounds: &Aabb, condition: f64) -> Option<[f64; 2]> {
        let (org, dir) = (DVec3::from_array(self.org), DVec3::from_array(self.dir));
        let size = bounds.max_abs().max(org.abs().max_element());
        let slack = DVec3::splat(size * condition * (32.0 * f64::EPSILON));
        let bounds = bounds.grown(slack);
        let (mut enter, mut exit) = (f64::NEG_INFINITY, f64::INFINITY);
        for k in 0..3 {
            if dir[k] == 0.0 {
                if org[k] < bounds.min[k] || org[k] > bounds.max[k] {
                    return None;
                }
                continue;
            }
            let (a, b) = (
                (bounds.min[k] - org[k]) / dir[k],
                (bounds.max[k] - org[k]) / dir[k],
            );
            // `max` and `min` ignore NaN, which infinite numbers give.
            enter = enter.max(a.min(b));
            exit = exit.min(a.max(b));
        }
        let room = (enter.abs() + exit.abs()) * (8.0 * f64::EPSILON);
        let passes = enter > exit + room;
        (!passes).then_some([enter - room, exit + room])
    }
}

/// A crossing of a ray and a primitive of any kind.
#[derive(Clone, Copy, Debug)]
pub enum Crossing<'a> {
    Triangle(triangle::Crossing<'a>),
    Root(Root<'a>),
}

impl<'a> Crossing<'a> {
    /// Returns t in f64 with its error bound.
    #[inline]
    pub fn t(&self) -> ErrorBounded {
        match self {
            Crossing::Triangle(crossing) => crossing.t,
            Crossing::Root(root) => root.t,
        }
    }

    /// Orders by t, exactly.
    #[inline]
    pub fn order(&self, other: &Crossing) -> Ordering {
        match (self, other) {
            (Crossing::Triangle(a), Crossing::Triangle(b)) => a.order(b),
            (Crossing::Root(a), Crossing::Root(b)) => a.order(b),
            (a, b) => {
                let certain = a.t().order(&b.t());
                certain.unwrap_or_else(|| a.root().order(&b.root()))
            }
        }
    }

    /// Orders t and a number, exactly. Infinity and NaN are above all t.
    #[inline]
    pub fn order_with(&self, x: f64) -> Ordering {
        match self {
            Crossing::Triangle(crossing) => crossing.order_with(x),
            Crossing::Root(root) => root.order_with(x),
        }
    }

    /// Returns the f64 nearest to t, ties to even, so that equal t have equal bits.
    pub fn rounded(&self) -> f64 {
        match self {
            Crossing::Triangle(crossing) => crossing.rounded(),
            Crossing::Root(root) => root.rounded(),
        }
    }

    /// Returns the crossing as a root; a triangle's as that of its plane.
    fn root(&self) -> Root<'a> {
        match self {
            Crossing::Root(root) => *root,
            Crossing::Triangle(crossing) => {
                let triangle::Pair { org, dir, corners } = *crossing.pair;
                let line = Line { org, dir };
                Root::new(&line, Surface::Facet(corners), Branch::Upper, crossing.t)
            }
        }
    }
}
