//! The table of convex polyhedra: bounded intersections of half-spaces, with their corners.

use super::columns::kernels_of_span;
use super::exact::{Inside, Line, solid};
use super::face::Face;
use super::guarded::{self, Ends, ObjectRay};
use super::half_space::{self, HalfSpace};
use super::kinds::PolyhedronId;
use super::primitive::{Blur, Exact, Flaw, Primitive, finite, finite3};
use super::ray::Meet;
use crate::math::lanes::Lanes;
use crate::math::{Aabb, Vec3};
use glam::DVec3;
use std::ops::Range;

/// Bounded intersections of half-spaces, with their corners: ranges into shared columns.
#[derive(Clone, Debug, Default)]
pub struct Polyhedra {
    pub planes: Vec<HalfSpace>,
    pub points: Vec<DVec3>,
    pub planes_of: Vec<Range<u32>>,
    pub points_of: Vec<Range<u32>>,
}

impl Polyhedra {
    /// Adds a polyhedron. `points` are the corners that `planes` make; [`crate::geom::hull`]
    /// computes either from the other.
    pub fn push(&mut self, planes: &[HalfSpace], points: &[DVec3]) -> PolyhedronId {
        let (plane, point) = (self.planes.len() as u32, self.points.len() as u32);
        self.planes.extend_from_slice(planes);
        self.points.extend_from_slice(points);
        self.planes_of.push(plane..self.planes.len() as u32);
        self.points_of.push(point..self.points.len() as u32);
        PolyhedronId(self.planes_of.len() as u32 - 1)
    }

    #[inline(always)]
    pub fn planes(&self, id: PolyhedronId) -> &[HalfSpace] {
        let r = &self.planes_of[id.index()];
        &self.planes[r.start as usize..r.end as usize]
    }

    pub fn points(&self, id: PolyhedronId) -> &[DVec3] {
        let r = &self.points_of[id.index()];
        &self.points[r.start as usize..r.end as usize]
    }

    pub fn len(&self) -> usize {
        self.planes_of.len()
    }

    pub fn is_empty(&self) -> bool {
        self.planes_of.is_empty()
    }

    pub fn bytes(&self) -> usize {
        self.planes.len() * size_of::<HalfSpace>()
            + self.points.len() * size_of::<DVec3>()
            + self.len() * 2 * size_of::<Range<u32>>()
    }
}

impl Primitive for Polyhedra {
    type Id = PolyhedronId;
    type Row<'a> = &'a [HalfSpace];
    const BLUR: Blur = Blur::HalfSpaces;

    #[inline(always)]
    fn exact(&self, id: PolyhedronId) -> &'_ [HalfSpace] {
        self.planes(id)
    }

    fn check(&self, id: PolyhedronId) -> Result<(), Flaw> {
        let (planes, points) = (self.planes(id), self.points(id));
        if planes.len() < 4 || points.len() < 4 {
            return Err(Flaw::Empty("volume (fewer than 4 faces or corners)"));
        }
        for plane in planes {
            finite3("planes", plane.normal)?;
            finite("planes", &[plane.offset])?;
            if plane.normal == DVec3::ZERO {
                let why = "one of its planes has the normal (0, 0, 0)".into();
                return Err(Flaw::Degenerate(why));
            }
        }
        points.iter().try_for_each(|p| finite3("points", *p))
    }

    fn bounds(&self, id: PolyhedronId) -> Option<Aabb> {
        // The planes define the solid; the corners agree with them to one part in 10¹⁰, because
        // `geom::hull` refuses sharper ones (P7, docs/numerics/planes.md).
        let bounds = Aabb::of_points(self.points(id).iter().copied());
        let size = bounds.max_abs() + bounds.diagonal();
        Some(bounds.grown(DVec3::splat(size * 2e-10)))
    }

    fn faces(&self, id: PolyhedronId) -> Vec<Option<Face>> {
        let planes = self.planes(id).iter();
        let of = planes.map(|plane| Some(Face::of_plane(plane.normal, plane.offset)));
        of.collect()
    }

    fn plane_normals(&self, id: PolyhedronId) -> Vec<DVec3> {
        self.planes(id).iter().map(|plane| plane.normal).collect()
    }

    kernels_of_span! {
        (self, id: PolyhedronId, object, active)
        half_space::span(self.planes(id), object.ray),
        guarded::half_space::meet_polyhedron(self.planes(id), self.points(id)[0], object, active),
        guarded::half_space::polyhedron_ends(self.planes(id), self.points(id)[0], object),
    }

    #[inline(always)]
    fn nearest<D: Lanes<Scalar = f64>>(&self, id: PolyhedronId, p: Vec3<D>) -> (D, Vec3<D>) {
        half_space::nearest(self.planes(id), p)
    }
}

impl<'a> Exact<'a> for &'a [HalfSpace] {
    fn is_finite(&self) -> bool {
        self.iter().all(|plane| plane.is_finite())
    }

    #[inline(always)]
    fn inside(&self, line: &Line) -> Inside {
        Inside::of_convex(solid::half_spaces(line, self.iter().copied()))
    }
}
