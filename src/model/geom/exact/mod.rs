//! A ray against any primitive, decided as exact arithmetic would.
//!
//! Its numbers are f64 (a mesh's corners f32), and exact by definition
//! (docs/NUMERICS.md). A boundary lies where a polynomial of degree one or two
//! along the ray is zero, whose coefficients are polynomials of the inputs: a
//! crossing is such a root, and not a number. Signs and orders come from f64
//! with a running bound on its error, as nearly always, else from twice its precision
//! ([`DoubleDouble`](crate::math::double_double::DoubleDouble)), and else from exact numbers in a place of the
//! thread ([`Dyadic`](crate::math::dyadic::Dyadic)); no finite input is refused. Triangles, which are most, have predicates of their own
//! ([`crate::geom::triangle::exact`]).
//! tests/exact_solids.rs compares with integers of any length.

mod across;
mod along;
mod curve;
mod implicit;
mod level_set;
mod plane;
mod polygon;
mod root;
mod rounded;
pub mod side;
mod solid;
mod surface;

pub use implicit::{Meeting, meetings, meetings_between, sign_at};
pub use level_set::crossings;
pub use root::Root;
pub use solid::{Ends, Inside};

use super::triangle::{Corners, exact as triangle};
use super::{Cone, Cuboid, Ellipsoid, HalfSpace, Implicit, LevelSet, Polygon, Quadric, Sphere};
use crate::math::Aabb;
use crate::math::bounds::ErrorBounded;
use glam::DVec3;
use root::Branch;
use std::cmp::Ordering;
use surface::Surface;

/// An object ray, both ways without end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    pub org: [f64; 3],
    pub dir: [f64; 3],
}

/// A row of any table but that of meshes.
#[derive(Clone, Copy, Debug)]
pub enum Solid<'a> {
    HalfSpace(HalfSpace),
    Polyhedron(&'a [HalfSpace]),
    Cuboid(Cuboid),
    Sphere(Sphere),
    Ellipsoid(Ellipsoid),
    /// Also a cylinder.
    Cone(Cone),
    Quadric(Quadric),
    Polygon(Polygon<'a>),
    Implicit(Implicit<'a>),
    LevelSet(LevelSet<'a>),
}

/// Where a ray first meets the boundary of a primitive beyond `t_min`, in exact
/// arithmetic. Nothing is met where a number is not finite.
pub fn first_beyond<'a>(solid: &Solid<'a>, line: &Line, t_min: f64) -> Option<Root<'a>> {
    let has_direction = line.dir.iter().any(|x| *x != 0.0);
    if !has_direction || !line.is_finite() || !solid.is_finite() {
        return None;
    }
    match solid {
        Solid::Cone(cone) if cone.open => solid::cone_side(line, cone, t_min),
        Solid::Polygon(polygon) => polygon::polygon(line, polygon, t_min),
        Solid::Implicit(row) => implicit::first_beyond(row, line, t_min),
        Solid::LevelSet(row) => level_set::first_beyond(row, line, t_min),
        closed => {
            let beyond = |end: &Root| end.order_with(t_min).is_gt();
            inside(closed, line).ends.into_iter().flatten().find(beyond)
        }
    }
}

/// What a line has in a solid, in exact arithmetic; of a surface, nothing, and
/// nothing where a number is not finite. Of an implicit, see [`meetings`], of a level set [`crossings`].
pub fn span(solid: &Solid, line: &Line) -> Inside {
    let is_line = line.dir.iter().any(|x| *x != 0.0);
    if !is_line || !line.is_finite() || !solid.is_finite() {
        return Inside::NOWHERE;
    }
    inside(solid, line)
}

#[inline(always)]
fn inside(solid: &Solid, line: &Line) -> Inside {
    Inside::of_convex(match solid {
        Solid::Quadric(row) => return solid::quadric(line, row),
        Solid::HalfSpace(plane) => solid::half_spaces(line, [*plane].into_iter()),
        Solid::Polyhedron(planes) => solid::half_spaces(line, planes.iter().copied()),
        Solid::Cuboid(cuboid) => solid::cuboid(line, cuboid),
        Solid::Sphere(sphere) => solid::sphere(line, sphere),
        Solid::Ellipsoid(ellipsoid) => solid::ellipsoid(line, ellipsoid),
        Solid::Cone(cone) if !cone.open => solid::cone(line, cone),
        Solid::Cone(_) | Solid::Polygon(_) | Solid::Implicit(_) | Solid::LevelSet(_) => None,
    })
}

/// Where a line goes through a triangle of a closed surface, and whether it comes
/// against the triangle's normal. A line through an edge or a corner does so as one
/// next to it would that meets none, always the same; so it crosses the surface an
/// even number of times. Of a line of finite numbers.
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
    pub fn is_finite(&self) -> bool {
        self.org.iter().chain(&self.dir).all(|x| x.is_finite())
    }

    /// No less than the part that is in a box, with room for all roundings, each of which
    /// counts `condition` times; `None`: it certainly passes by.
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
            // NaN, of infinities, is passed over.
            enter = enter.max(a.min(b));
            exit = exit.min(a.max(b));
        }
        let room = (enter.abs() + exit.abs()) * (8.0 * f64::EPSILON);
        let passes = enter > exit + room;
        (!passes).then_some([enter - room, exit + room])
    }
}

impl Solid<'_> {
    fn is_finite(&self) -> bool {
        let is_finite = |p: &HalfSpace| p.normal.is_finite() && p.offset.is_finite();
        let all = |points: &[DVec3]| points.iter().all(|p| p.is_finite());
        match self {
            Solid::HalfSpace(plane) => is_finite(plane),
            Solid::Polyhedron(planes) => planes.iter().all(is_finite),
            Solid::Cuboid(row) => all(&[row.min, row.max]),
            Solid::Sphere(row) => row.center.is_finite() && row.radius.is_finite(),
            Solid::Ellipsoid(row) => all(&[row.center, row.radii]),
            Solid::Cone(row) => {
                let radii = [row.base_radius, row.top_radius];
                all(&[row.base, row.top]) && radii.iter().all(|r| r.is_finite())
            }
            Solid::Quadric(row) => row.coefficients.iter().all(|x| x.is_finite()),
            Solid::Implicit(row) => row.is_finite(),
            Solid::LevelSet(row) => row.is_finite(),
            Solid::Polygon(row) => {
                row.normal.is_finite() && all(row.points) && !row.points.is_empty()
            }
        }
    }
}

/// Where a ray meets a primitive of any kind.
#[derive(Clone, Copy, Debug)]
pub enum Crossing<'a> {
    Triangle(triangle::Crossing<'a>),
    Root(Root<'a>),
}

impl<'a> Crossing<'a> {
    /// t, as far as f64 knows it.
    #[inline]
    pub fn t(&self) -> ErrorBounded {
        match self {
            Crossing::Triangle(crossing) => crossing.t,
            Crossing::Root(root) => root.t,
        }
    }

    /// By t, exactly.
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

    /// t against a number, exactly. Infinity is above all, and so is NaN.
    #[inline]
    pub fn order_with(&self, x: f64) -> Ordering {
        match self {
            Crossing::Triangle(crossing) => crossing.order_with(x),
            Crossing::Root(root) => root.order_with(x),
        }
    }

    /// The f64 nearest to t, ties to even; so equal t have equal bits.
    pub fn rounded(&self) -> f64 {
        match self {
            Crossing::Triangle(crossing) => crossing.rounded(),
            Crossing::Root(root) => root.rounded(),
        }
    }

    /// A triangle's as that of its plane.
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
