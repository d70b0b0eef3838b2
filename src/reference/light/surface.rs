//! Surfaces where rays of the reference end.

use super::LightReference;
use super::smooth::corrected;
use crate::path::leaving;
use crate::scene::{MaterialId, Shape};
use crate::{Hit, TURNED};
use glam::DVec3;

/// A surface that a ray meets.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    pub point: DVec3,
    /// The geometric normal, outward.
    pub ng: DVec3,
    /// The normals on the ray's side: geometric, and for shading.
    pub facing: DVec3,
    pub ns: DVec3,
    /// Where scattered rays and rays to lights start: lifted off the facets of a smooth mesh.
    pub lifted: DVec3,
    /// Whether it is, so that what the shading normal faces is above the surface (S77).
    pub curved: bool,
    /// Whether the ray comes from outside.
    pub front: bool,
    /// The distance from the point at which rays leave.
    off: f64,
    /// By number: past the last of the scene for surfaces without a material.
    pub material: u32,
}

impl Surface {
    /// Lets rays leave farther away.
    pub(super) fn lift(&mut self, by: f64) {
        self.off += by;
    }

    /// Returns how much farther away than here a ray leaves that starts at a point.
    pub(super) fn farther(&self, org: DVec3) -> f64 {
        let apart = |from: DVec3| (org - from).dot(self.ng).abs() - self.off;
        match self.lifted.distance(org) < self.point.distance(org) {
            true => apart(self.lifted),
            false => apart(self.point),
        }
    }

    /// Lets rays leave from the facet itself.
    pub(super) fn flatten(&mut self) {
        (self.lifted, self.curved) = (self.point, false);
    }

    /// Returns where a ray starts that leaves above or below the surface; from the facet, if it
    /// is that of a mirror.
    pub fn scattered(&self, above: bool, mirrored: bool) -> DVec3 {
        let from = if mirrored { self.point } else { self.lifted };
        let off = if above { self.off } else { -self.off };
        from + self.facing * off
    }

    /// Returns where a ray starts that leaves in a direction.
    pub fn leave(&self, dir: DVec3) -> DVec3 {
        let side = if dir.dot(self.ng) >= 0.0 { 1.0 } else { -1.0 };
        self.point + self.ng * (side * self.off)
    }
}

impl LightReference<'_> {
    /// Evaluates the surface of a hit.
    pub(super) fn surface(&self, org: DVec3, dir: DVec3, hit: &Hit) -> Surface {
        let left = leaving(self.reference, org.to_array(), dir.to_array(), hit);
        let ng = DVec3::from_array(hit.normal);
        let front = dir.dot(ng) <= 0.0;
        let facing = if front { ng } else { -ng };
        let point = DVec3::from_array(left.point);
        let smooth = self.smooth(hit, point, front);
        let ns = match smooth.normal {
            Some(normal) => corrected(normal, facing, (front, dir)),
            None => facing,
        };
        Surface {
            point,
            ng,
            facing,
            ns: if ns.dot(dir) < 0.0 { ns } else { facing },
            lifted: point + smooth.lift,
            curved: smooth.lift != DVec3::ZERO,
            front,
            off: left.off,
            material: self.number(self.material(hit)),
        }
    }

    /// Returns the number of a material, the last for none.
    pub(super) fn number(&self, id: Option<MaterialId>) -> u32 {
        id.map_or(self.matter.len() as u32 - 1, |id| id.0)
    }

    /// Finds the material of a hit: the instance's, else the CSG operand's, else the
    /// triangle's.
    pub(super) fn material(&self, hit: &Hit) -> Option<MaterialId> {
        let scene = self.reference.scene();
        let row = &self.reference.rows[hit.instance as usize];
        row.material.or_else(|| match scene.shapes.row(row.shape) {
            Shape::Mesh(id) => scene.meshes.row(id).material(hit.primitive),
            Shape::Csg(id) => {
                let solid = &self.solids[&id.0];
                let (operand, surface) = solid.operand_of(hit.primitive & !TURNED);
                let operand = &solid.operands[operand as usize];
                operand.material.or_else(|| match operand.shape {
                    Shape::Mesh(id) => scene.meshes.row(id).material(surface),
                    _ => None,
                })
            }
            _ => None,
        })
    }
}
