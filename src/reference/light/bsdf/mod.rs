//! Reflection and transmission of surfaces by textbook formulas, one direction at a time.
//!
//! Directions are unit and local, z along the shading normal on the ray's side; `out` points
//! back along the ray. `eta` is the index of refraction on the far side over that on the near
//! one. Values are BSDF · |cos| of radiance: what refraction bends is divided by eta².

mod albedo;
mod coat;
mod diffuse;
mod film;
mod ggx;
mod glass;
mod layered;
mod phong;
mod sheen;

use crate::scene::{Material, Model};
use glam::DVec3;
use layered::Layered;
use phong::Phong;

pub type Color = [f64; 3];

/// A material's lobes.
#[derive(Clone, Debug)]
pub enum Bsdf {
    Layered(Box<Layered>),
    Phong(Phong),
}

/// The sum of all lobes that are not delta distributions, towards one direction.
#[derive(Clone, Copy, Debug, Default)]
pub struct Value {
    pub value: Color,
    pub pdf: f64,
}

/// A direction in which a path goes on.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    pub into: DVec3,
    /// BSDF · |cos| / pdf.
    pub weight: Color,
    pub pdf: f64,
    pub delta: bool,
}

impl Sample {
    /// Whether the path goes to the other side.
    pub fn through(&self) -> bool {
        self.into.z < 0.0
    }
}

impl Bsdf {
    /// Prepares a material; names what of it is not known.
    pub fn new(material: &Material) -> Result<Bsdf, &'static str> {
        if let Some(layer) = unknown(material) {
            return Err(layer);
        }
        Ok(match material.model {
            Model::Phong { .. } => Bsdf::Phong(Phong::new(material)),
            Model::MetallicRoughness { .. } => Bsdf::Layered(Box::new(Layered::new(material))),
        })
    }

    pub fn is_black(&self) -> bool {
        match self {
            Bsdf::Layered(it) => it.is_black(),
            Bsdf::Phong(it) => it.is_black(),
        }
    }

    pub fn only_delta(&self) -> bool {
        match self {
            Bsdf::Layered(it) => it.only_delta(),
            Bsdf::Phong(it) => it.only_delta(),
        }
    }

    pub fn transmits(&self) -> bool {
        match self {
            Bsdf::Layered(it) => it.transmits(),
            Bsdf::Phong(it) => it.transmits(),
        }
    }

    /// Returns what a smooth sheet lets pass straight on, at the cosine to its normal.
    pub fn straight(&self, cos: f64) -> Color {
        match self {
            Bsdf::Layered(it) => it.straight(cos),
            Bsdf::Phong(_) => [0.0; 3],
        }
    }

    pub fn eval(&self, eta: f64, out: DVec3, into: DVec3) -> Value {
        match self {
            Bsdf::Layered(it) => it.eval(eta, above(out), into),
            Bsdf::Phong(it) => it.eval(above(out), into),
        }
    }

    pub fn sample(&self, eta: f64, out: DVec3, u: [f64; 2], lobe: f64) -> Option<Sample> {
        match self {
            Bsdf::Layered(it) => it.sample(eta, above(out), u, lobe),
            Bsdf::Phong(it) => it.sample(eta, above(out), u, lobe),
        }
    }
}

/// Names a layer of a material that the reference does not model.
fn unknown(material: &Material) -> Option<&'static str> {
    let layers = &material.layers;
    let disperses = layers.dispersion > 0.0 && material.transmission > 0.0;
    disperses.then_some("dispersion")
}

/// Lifts a direction from the horizon: shading normals may see it from below.
fn above(out: DVec3) -> DVec3 {
    DVec3::new(out.x, out.y, out.z.max(1e-6))
}

fn mean(c: Color) -> f64 {
    (c[0] + c[1] + c[2]) / 3.0
}
