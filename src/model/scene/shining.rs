//! What of a scene shines.

use super::{Light, MaterialId, Tables};

impl Tables {
    /// Says whether nothing in the scene shines but, perhaps, its background.
    pub fn is_dark(&self) -> bool {
        // What an image makes shine, such as the lamps of a model, lights no scene.
        self.lights.is_empty()
            && self.environment.is_none()
            && !self.shines(|material| !self.textures.has_emission(material))
    }

    /// Says whether the scene's light has an extent, so that only paths find all of it.
    pub fn has_soft_light(&self) -> bool {
        let soft = |light: &Light| match *light {
            Light::Point { radius, .. } | Light::Spot { radius, .. } => radius > 0.0,
            Light::Directional { angle, .. } => angle > 0.0,
            Light::Rectangle { .. } | Light::Disc { .. } => true,
        };
        self.environment.is_some() || self.lights.iter().any(soft) || self.shines(|_| true)
    }

    /// Says whether some material that counts shines and stands on anything. Files bring whole
    /// libraries of materials.
    fn shines(&self, counts: impl Fn(MaterialId) -> bool) -> bool {
        let rows = (0..).map(MaterialId).zip(&self.materials.rows);
        let mut shining: Vec<MaterialId> = rows
            .filter(|(id, row)| row.emission != [0.0; 3] && counts(*id))
            .map(|(id, _)| id)
            .collect();
        if shining.is_empty() {
            return false;
        }
        shining.sort_unstable();
        let shines = |id: &MaterialId| shining.binary_search(id).is_ok();
        let placed = self.roots.material.iter().chain(&self.edges.material);
        let parts = self.meshes.parts.iter().map(|(_, material)| material);
        let operands = self.csg.operands.iter().map(|operand| &operand.material);
        let csg = self.csg.material.iter().chain(operands);
        placed.chain(csg).chain(parts).flatten().any(shines)
    }
}
