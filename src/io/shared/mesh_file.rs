//! The content of a file of one mesh: triangles, and materials by parts.

use crate::scene::{Material, MeshData, SceneBuilder};
use crate::shared::messages::one_line;

/// A mesh, whose own table of parts is empty, and materials.
#[derive(Debug, Default)]
pub struct MeshFile {
    pub mesh: MeshData,
    pub materials: Vec<(String, Material)>,
    /// The first triangle of each part and its index into `materials`, in ascending order.
    pub parts: Vec<(u32, Option<usize>)>,
}

impl MeshFile {
    /// Makes the triangles from here on a part of this material, unless they are already.
    pub fn begin_part(&mut self, material: Option<usize>) {
        if self.parts.last().and_then(|(_, m)| *m) != material {
            self.parts
                .push((self.mesh.triangles.len() as u32, material));
        }
    }

    /// Adds the materials to a scene, and returns the mesh with its parts.
    pub fn add_materials(self, scene: &mut SceneBuilder) -> MeshData {
        let mut ids = Vec::with_capacity(self.materials.len());
        for (name, material) in &self.materials {
            ids.push(scene.material(&one_line(name), *material));
        }
        let mut mesh = self.mesh;
        let parts = self.parts.iter();
        mesh.parts = parts
            .map(|(first, m)| (*first, m.map(|m| ids[m])))
            .collect();
        mesh
    }
}
