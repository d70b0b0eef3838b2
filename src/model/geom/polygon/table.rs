//! The table of polygons: ranges into shared columns.

use super::{Polygon, chart, guarded, meet, polygon_plane, room};
use crate::geom::exact::{Line, Root};
use crate::geom::guarded::ObjectRay;
use crate::geom::kinds::PolygonId;
use crate::geom::primitive::{Blur, Exact, Flaw, Primitive, finite3};
use crate::geom::ray::Meet;
use crate::geom::{Chart, Scratch};
use crate::math::lanes::Lanes;
use crate::math::{Aabb, Vec3, unit};
use glam::DVec3;
use std::ops::Range;

/// Planar polygons of any number of corners, convex or not.
#[derive(Clone, Debug, Default)]
pub struct Polygons {
    /// Corners of all polygons, object space.
    pub points: Vec<DVec3>,
    /// Shading normals at the corners, for the polygons that have them.
    pub normals: Vec<DVec3>,
    pub points_of: Vec<Range<u32>>,
    pub normals_of: Vec<Option<Range<u32>>>,
    /// Unit normals of the planes; NaN where a polygon has none, which the check refuses.
    pub plane: Vec<DVec3>,
}

impl Polygons {
    /// Adds a polygon. `normals` has one entry per corner, or none.
    pub fn push(&mut self, points: &[DVec3], normals: &[DVec3]) -> PolygonId {
        let first = self.points.len() as u32;
        self.points.extend_from_slice(points);
        self.points_of.push(first..self.points.len() as u32);
        let first = self.normals.len() as u32;
        self.normals.extend_from_slice(normals);
        let range = first..self.normals.len() as u32;
        self.normals_of.push((!normals.is_empty()).then_some(range));
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
        let r = self.normals_of[id.index()].as_ref()?;
        Some(&self.normals[r.start as usize..r.end as usize])
    }

    pub fn len(&self) -> usize {
        self.points_of.len()
    }

    pub fn is_empty(&self) -> bool {
        self.points_of.is_empty()
    }

    pub fn bytes(&self) -> usize {
        (self.points.len() + self.normals.len()) * size_of::<DVec3>()
            + self.len()
                * (size_of::<Range<u32>>() + size_of::<Option<Range<u32>>>() + size_of::<DVec3>())
    }
}

impl Primitive for Polygons {
    type Id = PolygonId;
    type Row<'a> = Polygon<'a>;
    const BLUR: Blur = Blur::Curved;
    const IS_FLAT: bool = true;

    #[inline(always)]
    fn exact(&self, id: PolygonId) -> Polygon<'_> {
        self.row(id)
    }

    fn check(&self, id: PolygonId) -> Result<(), Flaw> {
        let points = self.points(id);
        if points.len() < 3 {
            return Err(Flaw::Empty("area (fewer than 3 points)"));
        }
        for p in points {
            finite3("points", *p)?;
        }
        if let Some(given) = self.normals(id) {
            let (normals, vertices) = (given.len(), points.len());
            if normals != vertices {
                return Err(Flaw::NormalCount { normals, vertices });
            }
            for n in given {
                finite3("normals", *n)?;
            }
        }
        polygon_plane(points).map(drop).map_err(Flaw::Degenerate)
    }

    fn bounds(&self, id: PolygonId) -> Option<Aabb> {
        Some(room(self.points(id)))
    }

    fn no_inside(&self, _id: PolygonId) -> Option<&'static str> {
        Some("it is a surface and has no inside; use a solid")
    }

    fn outlines(&self, id: PolygonId) -> Vec<Vec<DVec3>> {
        vec![self.points(id).to_vec()]
    }

    #[inline(always)]
    fn meet_fast<L: Lanes>(
        &self,
        id: PolygonId,
        object: &ObjectRay<L>,
        active: L::Mask,
        _: &mut Scratch,
    ) -> Meet<L> {
        meet(&self.row(id), object.ray, active)
    }

    #[inline(always)]
    fn meet<L: Lanes>(
        &self,
        id: PolygonId,
        extent: f32,
        object: &ObjectRay<L>,
        active: L::Mask,
        _: &mut Scratch,
    ) -> Meet<L> {
        guarded::meet(&self.row(id), extent, object, active)
    }

    #[inline(always)]
    fn meet_again<L: Lanes>(
        &self,
        id: PolygonId,
        extent: f32,
        object: &ObjectRay<L>,
        active: L::Mask,
        _: &mut Scratch,
    ) -> Meet<L> {
        guarded::meet_again(&self.row(id), extent, object, active)
    }

    #[inline(always)]
    fn nearest<D: Lanes<Scalar = f64>>(&self, id: PolygonId, p: Vec3<D>) -> (D, Vec3<D>) {
        let polygon = self.row(id);
        let on = Vec3::splat(polygon.points[0].to_array());
        let normal = Vec3::splat(unit(polygon.normal).to_array());
        ((p - on).dot(normal), normal)
    }

    fn chart(&self, id: PolygonId, p: DVec3, _: DVec3) -> Chart {
        chart(&self.row(id), p)
    }
}

impl<'a> Exact<'a> for Polygon<'a> {
    fn is_finite(&self) -> bool {
        let all = self.points.iter().all(|p| p.is_finite());
        all && self.normal.is_finite() && !self.points.is_empty()
    }

    #[inline(always)]
    fn first_beyond(&self, line: &Line, t_min: f64, _: &mut Scratch) -> Option<Root<'a>> {
        super::exact::polygon(line, self, t_min)
    }
}
