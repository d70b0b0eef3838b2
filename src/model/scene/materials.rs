//! Materials, one row each, which shading reads once per hit.
//!
//! There are two shading models: metallic-roughness (glTF's; GGX) and Phong (NFF, MTL). The
//! first may carry the layers of glTF's material extensions. Colours are linear Rec. 709.

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
    pub layers: Layers,
}

/// What glTF's material extensions add to metallic-roughness, and diffuse roughness and
/// priority besides. [`Layers::default`] adds nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layers {
    /// The share of the surface that is there, from 0 (a hole) to 1.
    pub opacity: f32,
    /// True if the surface shows its base colour and takes no part in lighting.
    pub unlit: bool,
    /// The roughness of the diffuse base (EON), from 0 (Lambert) to 1.
    pub diffuse_roughness: f32,
    /// The strength of the dielectric's reflection, from 0 to 1, and its tint at normal
    /// incidence (KHR_materials_specular).
    pub specular: f32,
    pub specular_color: Rgb,
    /// The stretch of highlights, from 0 to 1, and its turn from the tangent in radians
    /// (KHR_materials_anisotropy).
    pub anisotropy: f32,
    pub anisotropy_rotation: f32,
    /// A clear lacquer of index 1.5: its share and roughness (KHR_materials_clearcoat).
    pub clearcoat: f32,
    pub clearcoat_roughness: f32,
    /// Fibres: their colour, black for none, and roughness (KHR_materials_sheen).
    pub sheen_color: Rgb,
    pub sheen_roughness: f32,
    /// Light that leaves diffusely on the other side: its share of the diffuse base, and its
    /// colour (KHR_materials_diffuse_transmission).
    pub diffuse_transmission: f32,
    pub diffuse_transmission_color: Rgb,
    /// A thin film: its share, index, and thickness in nanometres (KHR_materials_iridescence).
    pub iridescence: f32,
    pub iridescence_ior: f32,
    pub iridescence_thickness: f32,
    /// 20 divided by the Abbe number; 0 for none (KHR_materials_dispersion).
    pub dispersion: f32,
    /// True if what transmits is a sheet without a volume: light passes without refraction.
    pub thin_walled: bool,
    /// The colour that white light takes on over `attenuation_distance` inside
    /// (KHR_materials_volume); world units, infinite for clear media.
    pub attenuation_color: Rgb,
    pub attenuation_distance: f32,
    /// Where media overlap, the one of the highest priority is there (Schmidt and Budge 2002).
    pub priority: i32,
}

impl Default for Layers {
    fn default() -> Layers {
        Layers {
            opacity: 1.0,
            unlit: false,
            diffuse_roughness: 0.0,
            specular: 1.0,
            specular_color: [1.0; 3],
            anisotropy: 0.0,
            anisotropy_rotation: 0.0,
            clearcoat: 0.0,
            clearcoat_roughness: 0.0,
            sheen_color: [0.0; 3],
            sheen_roughness: 0.0,
            diffuse_transmission: 0.0,
            diffuse_transmission_color: [1.0; 3],
            iridescence: 0.0,
            iridescence_ior: 1.3,
            iridescence_thickness: 400.0,
            dispersion: 0.0,
            thin_walled: false,
            attenuation_color: [1.0; 3],
            attenuation_distance: f32::INFINITY,
            priority: 0,
        }
    }
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
    /// Returns the radiance of the surface as light sampling aims at it: holes do not shine, and
    /// what is unlit is met only.
    pub fn sampled_emission(&self) -> Rgb {
        match self.layers.unlit {
            true => [0.0; 3],
            false => self.emission.map(|c| c * self.layers.opacity),
        }
    }

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
            layers: Layers::default(),
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
