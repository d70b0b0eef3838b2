//! Rough diffuse reflection: the energy-preserving Oren–Nayar model, EON (Portsmouth, Kutz and
//! Hill 2024), which at a roughness of 0 is Lambert's.

use super::fresnel::unit_interval;
use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::lanes::{Lanes, max};
use std::f32::consts::PI;

/// The factors of the roughness in the albedo of single scattering, at normal incidence and in
/// the mean: ½ − 2/3π and ⅔ − 28/15π.
const NORMAL: f32 = 0.5 - 2.0 / (3.0 * PI);
const MEAN: f32 = 2.0 / 3.0 - 28.0 / (15.0 * PI);

/// The model of one roughness.
#[derive(Clone, Copy, Debug)]
pub struct Eon {
    roughness: f32,
    scale: f32,
    /// The mean albedo of single scattering at a white surface.
    mean: f32,
}

/// What does not depend on the light: of one channel each, the factor of single scattering and
/// that of multiple scattering.
#[derive(Clone, Copy, Debug)]
pub struct EonColor<L> {
    pub single: [L; 3],
    pub multiple: [L; 3],
}

impl Eon {
    pub fn new(roughness: f32) -> Eon {
        let scale = 1.0 / (1.0 + NORMAL * roughness);
        Eon {
            roughness,
            scale,
            mean: scale * (1.0 + MEAN * roughness),
        }
    }

    /// Returns the albedo of single scattering at a white surface: the paper's polynomial,
    /// within 1e-3 of the exact one.
    #[inline(always)]
    pub fn albedo<L: Lanes<Scalar = f32>>(&self, mu: L) -> L {
        let c = L::splat(1.0) - unit_interval(mu);
        let mut g = L::splat(0.071_443);
        for k in [-0.332_181_45, 0.491_881_88, 0.057_108_53] {
            g = g * c + L::splat(k);
        }
        let scale = L::splat(self.scale);
        scale + scale * L::splat(self.roughness) * g * c
    }

    /// Returns the factors for the colour `base`, weighed by `weight`.
    #[inline(always)]
    pub fn color<L: Lanes<Scalar = f32>>(&self, base: [L; 3], weight: L, mu: L) -> EonColor<L> {
        let one = L::splat(1.0);
        let rest = one - self.albedo(mu);
        let absent = 1.0 - self.mean;
        EonColor {
            single: base.map(|c| weight * c),
            multiple: base.map(|c| {
                let again = c * c * L::splat(self.mean) / (one - c * L::splat(absent));
                weight * again * rest * L::splat(1.0 / absent.max(1e-6))
            }),
        }
    }

    /// Returns what single and multiple scattering send towards `into`, over cos/π.
    #[inline(always)]
    pub fn terms<L: Lanes<Scalar = f32>>(&self, out: Vec3<L>, into: Vec3<L>) -> [L; 2] {
        let (zero, one) = (L::zero(), L::splat(1.0));
        // The cosine of the azimuths' difference times both sines.
        let s = out.x * into.x + out.y * into.y;
        let least = L::splat(1e-6);
        let t = L::select(s.gt(zero), max(max(out.z, into.z), least), one);
        let scale = L::splat(self.scale);
        let single = scale + scale * L::splat(self.roughness) * s / t;
        [max(single, zero), one - self.albedo(into.z)]
    }
}
