//! The media around a point of a path: by the path's own list, or by the solids that contain
//! the point (S75).

use super::LightReference;
use super::matter::Matter;
use super::surface::Surface;
use crate::scene::Shape;
use crate::{Crossing, Hit};
use glam::DVec3;

/// The media around a point, by number of their material: at most four.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Media(Vec<u32>);

impl Media {
    pub fn enter(&mut self, material: u32) {
        if self.0.len() < 4 {
            self.0.push(material);
        }
    }

    pub fn leave(&mut self, material: u32) {
        if let Some(at) = self.0.iter().position(|m| *m == material) {
            self.0.remove(at);
        }
    }

    pub fn has(&self, material: u32) -> bool {
        self.0.contains(&material)
    }

    /// Returns the medium of the highest priority, of the highest number among equals.
    pub fn innermost(&self, all: &[Matter]) -> Option<u32> {
        let priority = |m: &&u32| (all[**m as usize].priority, **m);
        self.0.iter().max_by_key(priority).copied()
    }
}

/// Returns the index of refraction of a medium, 1 without one.
pub fn index(all: &[Matter], medium: Option<u32>) -> f64 {
    medium.map_or(1.0, |m| all[m as usize].ior)
}

impl LightReference<'_> {
    /// Returns the media behind a surface of a medium, and what is there on this side and
    /// on that.
    pub(super) fn cross(&self, media: &Media, at: &Surface) -> (Media, [Option<u32>; 2]) {
        let (mut before, mut behind) = (media.clone(), media.clone());
        if self.settings.asks_solids {
            behind = self.media_at(at.leave(-at.facing));
        } else if at.front {
            behind.enter(at.material);
        } else {
            behind.leave(at.material);
            // A ray that starts inside has not entered.
            if !before.has(at.material) {
                before.enter(at.material);
            }
        }
        let sides = [&before, &behind].map(|media| media.innermost(&self.matter));
        (behind, sides)
    }

    /// Lists the media of the solids that contain a point. A solid does if the line through it
    /// along y leaves the solid next, or entered it last and never leaves it; the material is
    /// that of the surface that says so.
    pub(super) fn media_at(&self, point: DVec3) -> Media {
        let mut media = Media::default();
        let up = [0.0, 1.0, 0.0];
        for instance in &self.bounding {
            let crossings = self.reference.crossings(point.to_array(), up, *instance, 0);
            let crosses = crossings.iter().filter(|c| c.normal[1] != 0.0);
            let (past, ahead): (Vec<&Crossing>, Vec<&Crossing>) = crosses.partition(|c| c.t <= 0.0);
            let end = match (ahead.first(), past.last()) {
                (Some(next), _) if next.normal[1] > 0.0 => next,
                (None, Some(last)) if last.normal[1] < 0.0 => last,
                _ => continue,
            };
            let material = self.material(&Hit {
                t: end.t,
                instance: *instance,
                primitive: end.primitive,
                normal: end.normal,
            });
            let number = self.number(material);
            if self.matter[number as usize].has_medium {
                media.enter(number);
            }
        }
        media
    }

    /// Lists the instances whose surfaces, or some of them, bound a medium; names what of
    /// them cannot be asked whether a point is inside.
    pub(super) fn media_bounds(&self) -> Result<Vec<u64>, &'static str> {
        let scene = self.reference.scene();
        let mut found = Vec::new();
        for (id, row) in (0..).zip(self.reference.rows.iter()) {
            let shape = scene.shapes.row(row.shape);
            let bounds = |id| self.matter[self.number(id) as usize].has_medium;
            let some = match (row.material, shape) {
                (Some(_), _) => bounds(row.material),
                (None, Shape::Csg(csg)) => {
                    let operands = &self.solids[&csg.0].operands;
                    operands.iter().any(|operand| bounds(operand.material))
                }
                (None, Shape::Mesh(id)) => {
                    let mesh = scene.meshes.row(id);
                    (0..mesh.triangles.len() as u32).any(|k| bounds(mesh.material(k)))
                }
                _ => false,
            };
            if !some {
                continue;
            }
            if matches!(shape, Shape::Mesh(_)) {
                return Err("media of meshes that touch others, or around the eye,");
            }
            if scene.no_inside(shape).is_none() {
                found.push(id);
            }
        }
        Ok(found)
    }
}
