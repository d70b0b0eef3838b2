//! Polygons and convex polyhedra, as ranges into shared columns.

use super::ids::{PolygonId, PolyhedronId};
use crate::geom::{HalfSpace, Polygon, polygon_plane};
use glam::DVec3;
use std::ops::Range;

/// The table of planar polygons, of any number of corners, convex or not.
#[derive(Clone, Debug, Default)]
pub struct Polygons {
    /// Corners of all polygons, in object space.
    pub points: Vec<DVec3>,
    /// Shading normals at the corners, for the polygons that have them.
    pub normals: Vec<DVec3>,
    pub points_of: Vec<Range<u32>>,
    pub normals_of: Vec<Option<u32>>,
    /// Unit normals of the planes; NaN where a polygon has none, which the scene's check
    /// refuses.
    pub plane: Vec<DVec3>,
}

impl Polygons {
    /// Adds a polygon. `normals` has one entry per corner, or none.
    pub fn push(&mut self, points: &[DVec3], normals: &[DVec3]) -> PolygonId {
        let first = self.points.len() as u32;
        self.points.extend_from_slice(points);
        self.points_of.push(first..self.points.len() as u32);
        self.normals_of
            .push((!normals.is_empty()).then_some(self.normals.len() as u32));
        self.normals.extend_from_slice(normals);
        self.plane.push(polygon_plane(points).unwrap_or(DVec3::NAN));
        PolygonId(self.points_of.len() as u32 - 1)
    }

    #[inline(always)]
    pub fn row(&self, id: PolygonId) -> Polygon<'_> {
        Polygon {
            points: self.points(id),
            normal: self.plane[id.index()],
        }
    }

    #[inline(always)]
    pub fn points(&self, id: PolygonId) -> &[DVec3] {
        let r = &self.points_of[id.index()];
        &self.points[r.start as usize..r.end as usize]
    }

    pub fn normals(&self, id: PolygonId) -> Option<&[DVec3]> {
        let first = self.normals_of[id.index()]? as usize;
        Some(&self.normals[first..first + self.points(id).len()])
    }

    pub fn len(&self) -> usize {
        self.points_of.len()
    }

    pub fn is_empty(&self) -> bool {
        self.points_of.is_empty()
    }

    pub fn bytes(&self) -> usize {
        (self.points.len() + self.normals.len()) * size_of::<DVec3>()
            + self.len() * (size_of::<Range<u32>>() + size_of::<Option<u32>>() + size_of::<DVec3>())
    }
}

/// The table of bounded intersections of half-spaces, with their corners.
#[derive(Clone, Debug, Default)]
pub struct Polyhedra {
    pub planes: Vec<HalfSpace>,
    pub points: Vec<DVec3>,
    pub planes_of: Vec<Range<u32>>,
    pub points_of: Vec<Range<u32>>,
}

impl Polyhedra {
    /// Adds a polyhedron. `points` are the corners that `planes` make;
    /// [`crate::geom::hull`] finds either from the other.
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
