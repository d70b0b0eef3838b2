//! Materials, one row each, which shading reads once per hit.
//!
//! There are two shading models: metallic-roughness (glTF's; GGX) and Phong (NFF, MTL).
//! Colours are linear Rec. 709.

use super::ids::MaterialId;
use super::names::Names;

pub type Rgb = [f32; 3];

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// The colour that the `albedo` AOV shows.
    pub base_color: Rgb,
    /// The radiance that the surface emits, in W/(sr·m²).
    pub emission: Rgb,
    /// The fraction of light that passes through, from 0 to 1.
    pub transmission: f32,
    /// The index of refraction of the inside relative to the outside, > 0.
    pub ior: f32,
    pub model: Model,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Model {
    /// glTF's model: GGX with α = roughness²; a roughness of 0 is a perfect mirror.
    MetallicRoughness { metallic: f32, roughness: f32 },
    /// Phong's model, with constant coefficients: `diffuse` (the fraction that Lambert
    /// reflects), `specular` (the highlight of the given cosine power) and `mirror` (the
    /// weight of the reflected ray).
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

/// The material of surfaces that have none: a light grey, dull dielectric.
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
