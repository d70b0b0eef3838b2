//! Ends of an operand that is a closed mesh (docs/SPEC.md, S42 to S45).

use super::{Csg, End, at_one_t, insert};
use crate::bounds;
use crate::facet;
use crate::number::Number;
use crate::ray::Ray;
use crate::scene::{Mesh, MeshId, Scene};
use crate::tree::Part;
use std::cmp::Ordering;

impl Csg {
    /// Finds the ends of a closed mesh from its triangles. The ray is about the mesh's
    /// centre.
    pub(super) fn ends_of_mesh<N: Number>(
        &self,
        scene: &Scene,
        ray: &Ray,
        operand: usize,
        id: MeshId,
    ) -> Result<Vec<End<N>>, N::Undecided> {
        let mesh = scene.meshes.row(id);
        let mut all: Vec<End<N>> = Vec::new();
        if ray.dir == [0.0; 3] {
            return Ok(all);
        }
        for triangle in self.triangles_along(&mesh, id, ray) {
            let corners = mesh.corners(triangle as usize).map(|p| p.map(f64::from));
            if let Some((t, side)) = facet::crossed(ray, corners)? {
                let end = End {
                    t,
                    operand,
                    enters: false,
                    face: triangle as usize,
                    against: side == Ordering::Less,
                };
                insert(&mut all, end)?;
            }
        }
        // Of several crossings at one t, an odd number is one end and an even number is
        // none (S44). The surface is the first of the triangles that face the line as most
        // of them do (S45).
        let mut ends: Vec<End<N>> = Vec::new();
        for group in at_one_t(&all)? {
            if group.len().is_multiple_of(2) {
                continue;
            }
            let against = group.iter().filter(|end| end.against).count();
            let most = group
                .iter()
                .filter(|end| end.against == (2 * against > group.len()));
            let end = most.min_by_key(|end| end.face).unwrap_or(&group[0]);
            ends.push(End {
                enters: ends.len().is_multiple_of(2),
                ..end.clone()
            });
        }
        Ok(ends)
    }

    /// Lists the triangles that the tree does not rule out, or all of them for brute force.
    fn triangles_along(&self, mesh: &Mesh, id: MeshId, ray: &Ray) -> Vec<u32> {
        let Some(tree) = self.triangles.get(id.index()) else {
            return (0..mesh.triangles.len() as u32).collect();
        };
        let mut found = Vec::new();
        tree.visit(ray, bounds::slack(ray.org, 1.0), Part::Line, |triangle| {
            found.push(triangle);
            f64::INFINITY
        });
        found
    }
}
