//! The content of a file of one mesh: triangles, and materials by parts.

use crate::scene::{Image, ImageId, Material, MeshData, SceneBuilder, Slot, TextureRef, Texturing};
use crate::shared::messages::one_line;
use crate::shared::points::{Drawn, Points};
use std::sync::Arc;

/// How a material varies: its index, and references by index to the file's images.
pub type MaterialTextures = (usize, Texturing, Vec<(Slot, TextureRef)>);

/// A mesh, whose own table of parts is empty, and materials.
#[derive(Debug, Default)]
pub struct MeshFile {
    pub mesh: MeshData,
    pub materials: Vec<(String, Material)>,
    pub images: Vec<Arc<Image>>,
    /// How some materials vary.
    pub textures: Vec<MaterialTextures>,
    /// The first triangle of each part and its index into `materials`, in ascending order.
    pub parts: Vec<(u32, Option<usize>)>,
    /// Points and lines, where they are wanted, and the index of their material.
    pub points: Vec<(Option<usize>, Points)>,
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
        self.add_with_points(scene).0
    }

    /// Adds the materials to a scene, and returns the mesh with its parts, and its points by
    /// material.
    pub fn add_with_points(self, scene: &mut SceneBuilder) -> (MeshData, Vec<Drawn>) {
        let mut ids = Vec::with_capacity(self.materials.len());
        for (name, material) in &self.materials {
            ids.push(scene.material(&one_line(name), *material));
        }
        let images = self.images.into_iter();
        let images: Vec<ImageId> = images.map(|image| scene.shared_image(image)).collect();
        for (row, texturing, mut refs) in self.textures {
            for (_, texture) in &mut refs {
                texture.image = images[texture.image.index()];
            }
            scene.texture(ids[row], texturing, &refs);
        }
        let mut mesh = self.mesh;
        let parts = self.parts.iter();
        mesh.parts = parts
            .map(|(first, m)| (*first, m.map(|m| ids[m])))
            .collect();
        let points = self.points.into_iter();
        let points = points.map(|(m, points)| (m.map(|m| ids[m]), points));
        (mesh, points.collect())
    }
}
