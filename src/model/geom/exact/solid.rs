//! Exact spans of a line in each kind of primitive: their ends are crossings of surfaces in exact
//! order (D13, docs/numerics/exact.md).

use super::Line;
use super::line_quadratic::{LineQuadratic, nearest_to};
use super::surface::Surface as AnySurface;
use crate::geom::{Clip, Cuboid, Ellipsoid, HalfSpace, Quadric, Sphere};
use std::cmp::Ordering;

/// A plane or a quadric.
type Surface = AnySurface<'static>;
type Root = super::root::Root<'static>;

/// Where a line enters a solid and where it leaves it; `None` if it always was inside, or stays.
pub type SpanRoots = [Option<Root>; 2];

/// The part of a line that is inside a solid.
#[derive(Clone, Copy, Debug)]
pub struct Inside {
    /// Whether the line is inside far before the first of `ends`.
    pub at_first: bool,
    /// Where that changes, in order.
    pub ends: SpanRoots,
}

impl Inside {
    pub const NOWHERE: Inside = Inside {
        at_first: false,
        ends: [None; 2],
    };

    /// Makes the part in a convex solid.
    #[inline(always)]
    pub(in crate::geom) fn of_convex(ends: Option<SpanRoots>) -> Inside {
        match ends {
            None => Inside::NOWHERE,
            Some([None, exit]) => Inside {
                at_first: true,
                ends: [exit, None],
            },
            Some(ends) => Inside {
                at_first: false,
                ends,
            },
        }
    }

    /// Returns the spans, of which a solid that is not convex has up to two.
    pub fn spans(&self) -> impl Iterator<Item = SpanRoots> + use<> {
        let [first, last] = self.ends;
        let both = match (self.at_first, first) {
            (true, _) => [Some([None, first]), last.map(|_| [last, None])],
            (false, None) => [None, None],
            (false, _) => [Some([first, last]), None],
        };
        both.into_iter().flatten()
    }
}

/// Returns the span in an intersection of half-spaces.
pub(in crate::geom) fn half_spaces(
    line: &Line,
    planes: impl Iterator<Item = HalfSpace>,
) -> Option<SpanRoots> {
    let (mut enter, mut exit): (Option<Root>, Option<Root>) = (None, None);
    for plane in planes {
        let normal = plane.normal.to_array();
        let offset = plane.offset;
        let curve = LineQuadratic::new(line, Surface::Plane { normal, offset }, 0.0);
        match curve.linear_sign() {
            Ordering::Equal if curve.constant_sign().is_gt() => return None,
            Ordering::Equal => {}
            Ordering::Less => {
                let at = curve.root_of_linear();
                if enter.is_none_or(|best| best.order(&at).is_lt()) {
                    enter = Some(at);
                }
            }
            Ordering::Greater => {
                let at = curve.root_of_linear();
                if exit.is_none_or(|best| best.order(&at).is_gt()) {
                    exit = Some(at);
                }
            }
        }
    }
    // The solid is closed, so the span may be one point.
    let empty = |(enter, exit): (&Root, &Root)| enter.order(exit).is_gt();
    if enter.as_ref().zip(exit.as_ref()).is_some_and(empty) {
        return None;
    }
    Some([enter, exit])
}

pub(in crate::geom) fn cuboid(line: &Line, cuboid: &Cuboid) -> Option<SpanRoots> {
    let planes = (0..6).map(|i| {
        let axis = glam::DVec3::AXES[i / 2];
        let (normal, offset) = if i % 2 == 0 {
            (axis, cuboid.max[i / 2])
        } else {
            (-axis, -cuboid.min[i / 2])
        };
        HalfSpace { normal, offset }
    });
    half_spaces(line, planes)
}

pub(in crate::geom) fn sphere(line: &Line, sphere: &Sphere) -> Option<SpanRoots> {
    let center = sphere.center.to_array();
    let radius = sphere.radius;
    round(line, Surface::Sphere { center, radius }, center)
}

/// Returns the span of a line in a clip; all of the line if there is none.
pub(in crate::geom) fn clip(line: &Line, clip: Option<Clip>) -> Option<SpanRoots> {
    match clip {
        None => Some([None, None]),
        Some(Clip::Sphere(row)) => sphere(line, &row),
        Some(Clip::Cuboid(row)) => cuboid(line, &row),
    }
}

pub(in crate::geom) fn ellipsoid(line: &Line, ellipsoid: &Ellipsoid) -> Option<SpanRoots> {
    let center = ellipsoid.center.to_array();
    let radii = ellipsoid.radii.to_array();
    round(line, Surface::Ellipsoid { center, radii }, center)
}

/// Returns the span in a bounded quadric, which a line leaves in both directions.
#[inline(always)]
fn round(line: &Line, surface: Surface, center: [f64; 3]) -> Option<SpanRoots> {
    let curve = LineQuadratic::new(line, surface, nearest_to(line, center));
    Some(curve.roots(Ordering::Greater)?.map(Some))
}

/// Returns the part in a quadric: between its roots, or outside of them.
pub(in crate::geom) fn quadric(line: &Line, quadric: &Quadric) -> Inside {
    let surface = Surface::Quadric(quadric.coefficients);
    let curve = LineQuadratic::new(line, surface, nearest_to(line, [0.0; 3]));
    let inside = |at_first: bool, ends: SpanRoots| Inside { at_first, ends };
    let bend = curve.quadratic_sign();
    if bend.is_eq() {
        return match curve.linear_sign() {
            Ordering::Equal => inside(curve.constant_sign().is_le(), [None; 2]),
            rise => inside(rise.is_gt(), [Some(curve.root_of_linear()), None]),
        };
    }
    match curve.roots(bend) {
        None => inside(bend.is_lt(), [None; 2]),
        // A double root that touches zero from below is no boundary.
        Some([a, b]) if bend.is_lt() && a.order(&b).is_eq() => inside(true, [None; 2]),
        Some(roots) => inside(bend.is_lt(), roots.map(Some)),
    }
}
