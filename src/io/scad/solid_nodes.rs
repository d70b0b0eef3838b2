//! The solids that a node is by itself: `cube`, `sphere`, `cylinder`, `polyhedron`.

use super::arguments;
use super::budget;
use super::curves;
use super::facets;
use super::nodes::{Outcome, Reader, is_size, radius};
use super::solids::Leaf;
use glam::DVec3;

impl Reader<'_> {
    pub(super) fn cube(&self, row: usize) -> Option<Leaf> {
        let of = self.arguments(row, &["size", "center"]);
        let size = DVec3::from_array(of.numbers("size", 1.0));
        let is_there = size.is_finite() && size.min_element() > 0.0;
        let min = match of.is_true("center") {
            true => size * -0.5,
            false => DVec3::ZERO,
        };
        let max = min + size;
        is_there.then_some(Leaf::Cuboid { min, max })
    }

    pub(super) fn sphere(&self, row: usize) -> Outcome<Option<Leaf>> {
        let of = self.arguments(row, &["r"]);
        let radius = radius(&of, "r", "d", 1.0);
        if !is_size(radius) {
            return Ok(None);
        }
        match curves::sides_if_any(self.curves, &of, radius) {
            Some(sides) => {
                budget::fits((sides as usize).pow(2))?;
                facets::of_rings(&curves::sphere(radius, sides)).map(Some)
            }
            None => Ok(Some(Leaf::Sphere {
                center: DVec3::ZERO,
                radius,
            })),
        }
    }

    pub(super) fn cylinder(&self, row: usize) -> Outcome<Option<Leaf>> {
        let of = self.arguments(row, &["h", "r1", "r2", "center"]);
        let height = of.number_or("h", 1.0);
        let both = radius(&of, "r", "d", 1.0);
        let radii = [("r1", "d1"), ("r2", "d2")].map(|(r, d)| radius(&of, r, d, both));
        let [low, high] = radii;
        let is_there = is_size(height)
            && radii.iter().all(|r| r.is_finite() && *r >= 0.0)
            && radii.iter().any(|r| *r > 0.0);
        if !is_there {
            return Ok(None);
        }
        let from = match of.is_true("center") {
            true => height * -0.5,
            false => 0.0,
        };
        let to = from + height;
        match curves::sides_if_any(self.curves, &of, low.max(high)) {
            Some(sides) => {
                let ring = |radius: f64, z: f64| match radius > 0.0 {
                    true => {
                        let corners = curves::circle(radius, sides).into_iter();
                        corners.map(|p| p.extend(z)).collect()
                    }
                    false => vec![DVec3::new(0.0, 0.0, z)],
                };
                facets::of_rings(&[ring(high, to), ring(low, from)]).map(Some)
            }
            None => Ok(Some(Leaf::Frustum {
                base: DVec3::new(0.0, 0.0, from),
                top: DVec3::new(0.0, 0.0, to),
                base_radius: low,
                top_radius: high,
            })),
        }
    }

    pub(super) fn polyhedron(&mut self, row: usize) -> Outcome<Option<Leaf>> {
        let of = self.arguments(row, &["points", "faces", "convexity"]);
        let points = arguments::points::<3>(of.get("points"));
        let points = points.map_err(|why| format!("this polyhedron cannot be drawn: {why}"))?;
        let faces = of.get("faces").or_else(|| of.get("triangles"));
        let faces = arguments::faces(faces, points.len());
        let faces = faces.map_err(|why| format!("this polyhedron cannot be drawn: {why}"))?;
        let points: Vec<DVec3> = points.into_iter().map(DVec3::from_array).collect();
        facets::of_faces(points, &faces, self.report)
    }
}
