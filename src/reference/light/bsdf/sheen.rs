//! Sheen of fibres (KHR_materials_sheen): the "Charlie" distribution and the fitted masking of
//! Conty Estevez and Kulla 2017.

use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Intervals of the model's table of albedos over √μ, and the points of the midpoint rule by
/// which its nodes are defined: heights, dense towards the horizon, and half the azimuths.
const ANGLES: usize = 32;
const HEIGHTS: usize = 48;
const TURNS: usize = 32;

/// The coefficients a to e of Λ's fit for α = 0 and 1 (the paper's table 1).
const FITS: [[f64; 5]; 2] = [
    [25.3245, 3.32435, 0.16801, -1.27393, -4.85967],
    [21.5473, 3.82987, 0.19823, -1.97760, -4.32054],
];

#[derive(Clone, Debug)]
pub struct Sheen {
    pub color: [f64; 3],
    alpha: f64,
    albedo: Vec<f64>,
}

impl Sheen {
    pub fn new(color: [f64; 3], roughness: f64) -> Sheen {
        let mut sheen = Sheen {
            color,
            alpha: (roughness * roughness).max(1e-3),
            albedo: Vec::new(),
        };
        let node = |k: usize| {
            let root = k as f64 / ANGLES as f64;
            sheen.integrated((root * root).max(1e-6))
        };
        sheen.albedo = (0..=ANGLES).map(node).collect();
        sheen
    }

    fn integrated(&self, mu: f64) -> f64 {
        let out = DVec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
        let mut sum = 0.0;
        for i in 0..HEIGHTS {
            // z = t², dz = 2t dt.
            let t = (i as f64 + 0.5) / HEIGHTS as f64;
            let r = (1.0 - t.powi(4)).sqrt();
            for j in 0..TURNS {
                let (sin, cos) = libm::sincos(PI * (j as f64 + 0.5) / TURNS as f64);
                let into = DVec3::new(r * cos, r * sin, t * t);
                sum += 2.0 * t * self.value(out, into);
            }
        }
        sum / (HEIGHTS * TURNS) as f64 * TAU
    }

    /// Returns the albedo of a white sheen at the cosine `mu`.
    pub fn albedo(&self, mu: f64) -> f64 {
        let x = mu.clamp(0.0, 1.0).sqrt() * ANGLES as f64;
        let k = (x as usize).min(ANGLES - 1);
        let [low, high] = [self.albedo[k], self.albedo[k + 1]];
        (low + (x - k as f64) * (high - low)).min(1.0)
    }

    /// Λ (equations 3 and 4).
    fn lambda(&self, mu: f64) -> f64 {
        let part = (1.0 - self.alpha) * (1.0 - self.alpha);
        let [a, b, c, d, e] =
            std::array::from_fn(|k| part * FITS[0][k] + (1.0 - part) * FITS[1][k]);
        let fit = |x: f64| a / (1.0 + b * x.powf(c)) + d * x + e;
        match mu < 0.5 {
            true => fit(mu).exp(),
            false => (2.0 * fit(0.5) - fit(1.0 - mu)).exp(),
        }
    }

    /// Returns BRDF · cos of a white sheen; 0 below the surface.
    pub fn value(&self, out: DVec3, into: DVec3) -> f64 {
        if into.z <= 0.0 {
            return 0.0;
        }
        let h = (out + into).normalize();
        let sin = (h.x * h.x + h.y * h.y).sqrt().min(1.0);
        let density = (2.0 + 1.0 / self.alpha) * sin.powf(1.0 / self.alpha) / TAU;
        let visible = 1.0 / (1.0 + self.lambda(out.z) + self.lambda(into.z));
        density * visible / (4.0 * out.z)
    }
}
