//! Rough diffuse reflection that keeps energy, EON (Portsmouth, Kutz and Hill 2024).

use glam::DVec3;
use std::f64::consts::PI;

#[derive(Clone, Copy, Debug)]
pub struct Eon {
    roughness: f64,
    scale: f64,
    /// The mean albedo of single scattering.
    mean: f64,
}

impl Eon {
    pub fn new(roughness: f64) -> Eon {
        let scale = 1.0 / (1.0 + (0.5 - 2.0 / (3.0 * PI)) * roughness);
        let mean = scale * (1.0 + (2.0 / 3.0 - 28.0 / (15.0 * PI)) * roughness);
        Eon {
            roughness,
            scale,
            mean,
        }
    }

    /// The albedo of single scattering by the paper's polynomial.
    fn albedo(&self, mu: f64) -> f64 {
        let c = 1.0 - mu.clamp(0.0, 1.0);
        let g = [0.0571085289, 0.491881867, -0.332181442, 0.0714429953];
        let g = g.iter().rev().fold(0.0, |sum, k| (sum + k) * c);
        self.scale * (1.0 + self.roughness * g)
    }

    /// Returns BRDF · π for a reflectance.
    pub fn value(&self, reflectance: f64, out: DVec3, into: DVec3) -> f64 {
        let s = out.x * into.x + out.y * into.y;
        let t = if s > 0.0 {
            out.z.max(into.z).max(1e-6)
        } else {
            1.0
        };
        let single = (self.scale * (1.0 + self.roughness * s / t)).max(0.0);
        let absent = 1.0 - self.mean;
        let again = reflectance * reflectance * self.mean / (1.0 - reflectance * absent);
        let both = (1.0 - self.albedo(out.z)) * (1.0 - self.albedo(into.z));
        reflectance * single + again * both / absent.max(1e-6)
    }
}
