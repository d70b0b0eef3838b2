//! The GGX distribution in its textbook form: Walter et al. 2007 (D, equation 33), Heitz 2014
//! (Λ and the height-correlated G₂, equations 72 and 99), Dupuy and Benyoub 2023 (visible
//! normals by spherical caps).

use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// The least α.
const LEAST: f64 = 1e-12;

/// A GGX distribution.
#[derive(Clone, Copy, Debug)]
pub struct Ggx {
    /// α along x and y.
    x: f64,
    y: f64,
}

impl Ggx {
    pub fn new(alpha: f64) -> Ggx {
        Ggx::stretched(alpha, alpha)
    }

    /// Makes a distribution of two α, along x and along y.
    pub fn stretched(x: f64, y: f64) -> Ggx {
        Ggx {
            x: x.max(LEAST),
            y: y.max(LEAST),
        }
    }

    /// D(h) of a unit vector h, 0 below the surface.
    pub fn density(&self, h: DVec3) -> f64 {
        let (x, y) = (h.x / self.x, h.y / self.y);
        let s = x * x + y * y + h.z * h.z;
        1.0 / (PI * self.x * self.y * s * s)
    }

    /// Λ(w) of Smith's masking.
    fn lambda(&self, w: DVec3) -> f64 {
        let (x, y) = (self.x * w.x / w.z, self.y * w.y / w.z);
        0.5 * ((1.0 + x * x + y * y).sqrt() - 1.0)
    }

    pub fn masking(&self, out: DVec3) -> f64 {
        1.0 / (1.0 + self.lambda(out))
    }

    /// G₂ of two directions on the same or on different sides.
    pub fn masking_shadowing(&self, out: DVec3, into: DVec3) -> f64 {
        1.0 / (1.0 + self.lambda(out) + self.lambda(into))
    }

    /// The density of normals visible from `out`.
    pub fn visible(&self, out: DVec3, h: DVec3) -> f64 {
        self.masking(out) * out.dot(h).abs() * self.density(h) / out.z
    }

    /// Samples a normal visible from `out`.
    pub fn sample(&self, out: DVec3, [u, v]: [f64; 2]) -> DVec3 {
        let w = DVec3::new(out.x * self.x, out.y * self.y, out.z).normalize();
        let z = (1.0 - u) * (1.0 + w.z) - w.z;
        let sin = (1.0 - z * z).max(0.0).sqrt();
        let (s, c) = libm::sincos(TAU * v);
        let h = DVec3::new(sin * c, sin * s, z) + w;
        DVec3::new(h.x * self.x, h.y * self.y, h.z.max(0.0)).normalize()
    }
}

/// (1 − cos)⁵ of Schlick 1994.
pub fn schlick(cos: f64) -> f64 {
    (1.0 - cos.clamp(0.0, 1.0)).powi(5)
}

/// A dielectric interface as Fresnel has it.
#[derive(Clone, Copy, Debug)]
pub struct Interface {
    /// The unpolarised reflectance.
    pub reflectance: f64,
    /// The cosine of the refracted ray, ≥ 0.
    pub cos: f64,
    pub total: bool,
}

/// Evaluates Fresnel's equations; `eta` is the index on the far side over that on the near one.
pub fn fresnel(cos: f64, eta: f64) -> Interface {
    let cos = cos.clamp(0.0, 1.0);
    let sin2 = (1.0 - cos * cos) / (eta * eta);
    if sin2 >= 1.0 {
        return Interface {
            reflectance: 1.0,
            cos: 0.0,
            total: true,
        };
    }
    let refracted = (1.0 - sin2).sqrt();
    let s = (cos - eta * refracted) / (cos + eta * refracted);
    let p = (eta * cos - refracted) / (eta * cos + refracted);
    Interface {
        reflectance: 0.5 * (s * s + p * p),
        cos: refracted,
        total: false,
    }
}
