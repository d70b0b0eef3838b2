//! Materials: one row each, read once per hit.
//!
//! Two shading models: metallic-roughness (glTF's; GGX) and Phong (NFF, MTL).
//! Colours are linear Rec. 709.

use super::ids::MaterialId;
use super::names::Names;

pub type Rgb = [f32; 3];

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// What the `albedo` AOV shows.
    pub base_color: Rgb,
    /// Radiance that the surface gives off, W/(sr·m²).
    pub emission: Rgb,
    /// Fraction of light that passes through, 0 to 1.
    pub transmission: f32,
    /// Index of refraction of the inside, relative to the outside; > 0.
    pub ior: f32,
    pub model: Model,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Model {
    /// glTF's: GGX with α = roughness²; roughness 0 is a perfect mirror.
    MetallicRoughness { metallic: f32, roughness: f32 },
    /// Constant coefficients: `diffuse` (Lambert: reflected fraction),
    /// `specular` (highlight of the given cosine power), `mirror` (weight of the
    /// reflected ray).
    Phong {
        diffuse: Rgb,
        specular: Rgb,
        exponent: f32,
        mirror: Rgb,
    },
}

impl Material {
    pub fn metallic_roughness(base_color: Rgb, metallic: f32, roughness: f32) -> Material {
        Material {
            base_color,
            emission: [0.0; 3],
            transmission: 0.0,
            ior: 1.5,
            model: Model::MetallicRoughness {
                metallic,
                roughness,
            },
        }
    }
}

/// A light grey, dull dielectric: what has no material gets this one.
impl Default for Material {
    fn default() -> Material {
        Material::metallic_roughness([0.6, 0.6, 0.6], 0.0, 0.7)
    }
}

#[derive(Clone, Debug, Default)]
pub struct Materials {
    pub rows: Vec<Material>,
    pub names: Names,
}

impl Materials {
    pub fn push(&mut self, name: &str, material: Material) -> MaterialId {
        self.names.set(self.rows.len() as u32, name);
        self.rows.push(material);
        MaterialId(self.rows.len() as u32 - 1)
    }

    pub fn len(&self) -> usize {
        self.rows.len()
    }

    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    pub fn bytes(&self) -> usize {
        self.rows.len() * size_of::<Material>() + self.names.bytes()
    }
}
