//! Materials as the reference's paths read them.

use super::bsdf::{Bsdf, Color};
use crate::scene::Material;

/// A material.
#[derive(Clone, Debug)]
pub struct Matter {
    pub bsdf: Bsdf,
    /// The radiance of the surface itself.
    pub shine: Color,
    pub unlit: bool,
    /// Absorption inside, per world unit.
    absorption: Color,
    pub has_medium: bool,
    pub thin_walled: bool,
    /// The share of the surface that is there.
    pub opacity: f64,
    pub ior: f64,
    pub priority: i32,
}

impl Matter {
    /// Reads a material; names what of it is not known.
    pub fn new(material: &Material) -> Result<Matter, &'static str> {
        let layers = &material.layers;
        let bsdf = Bsdf::new(material)?;
        let mut shine = material.emission.map(f64::from);
        if layers.unlit {
            shine = std::array::from_fn(|k| shine[k] + f64::from(material.base_color[k]));
        }
        // Holes do not shine.
        let shine = shine.map(|c| c * f64::from(layers.opacity));
        let distance = f64::from(layers.attenuation_distance);
        let left = layers.attenuation_color.map(|c| f64::from(c.max(1e-6)));
        Ok(Matter {
            bsdf,
            shine,
            unlit: layers.unlit,
            absorption: left.map(|c| -libm::log(c) / distance),
            has_medium: material.transmission > 0.0 && !layers.thin_walled,
            thin_walled: layers.thin_walled,
            opacity: f64::from(layers.opacity).clamp(0.0, 1.0),
            ior: f64::from(material.ior),
            priority: layers.priority,
        })
    }

    /// Says whether paths that do not pass the surface end on it.
    pub fn ends(&self) -> bool {
        self.unlit || self.bsdf.is_black()
    }

    /// Returns the share of light that passes straight on, through holes and smooth sheets, at
    /// the cosine to the normal.
    pub fn straight(&self, cos: f64) -> Color {
        let sheet = self.bsdf.straight(cos.min(1.0));
        sheet.map(|share| (1.0 - self.opacity) + self.opacity * share)
    }

    /// Returns what is left of light after a way inside (Beer and Lambert).
    pub fn left(&self, way: f64) -> Color {
        self.absorption
            .map(|a| if a == 0.0 { 1.0 } else { libm::exp(-a * way) })
    }
}
