//! Iridescence of a thin film (KHR_materials_iridescence): Belcour and Barla 2017, "A practical
//! extension to microfacet theory for the modeling of varying iridescence", as glTF has it:
//! three orders of interference, unpolarised, with Schlick's term at both interfaces.

use super::fresnel::{schlick, unit_interval};
use lanecast_numerics::math::elementary::{exp, sin_cos_turns};
use lanecast_numerics::math::lanes::{Lanes, max, min};
use std::f32::consts::TAU;

/// A film in air.
#[derive(Clone, Copy, Debug)]
pub struct Film {
    pub share: f32,
    ior: f32,
    /// The thickness in nanometres.
    thickness: f32,
}

/// Gaussians that fit the CIE 1931 sensitivities over phase: height, place and variance. X has
/// a second one.
const GAUSSIANS: [(f32, f32, f32); 4] = [
    (5.485_6e-13, 1.681_0e6, 4.327_8e9),
    (4.420_1e-13, 1.795_3e6, 9.304_6e9),
    (5.248_1e-13, 2.208_4e6, 6.612_1e9),
    (9.747_0e-14, 2.239_9e6, 4.528_2e9),
];

/// The integral of the sensitivities, which makes white of a flat spectrum.
const WHITE: f32 = 1.068_5e-7;

/// Linear Rec. 709 from CIE XYZ, row by row.
const RGB_FROM_XYZ: [[f32; 3]; 3] = [
    [3.240_454_2, -1.537_138_5, -0.498_531_4],
    [-0.969_266, 1.876_010_8, 0.041_556],
    [0.055_643_4, -0.204_025_9, 1.057_225_2],
];

impl Film {
    /// Makes a film. One thinner than 0.03 nm fades away.
    pub fn new(share: f32, ior: f32, thickness: f32) -> Film {
        let thickness = if thickness > 0.0 {
            thickness.min(1e4)
        } else {
            0.0
        };
        let t = (thickness / 0.03).min(1.0);
        let there = t * t * (3.0 - 2.0 * t);
        let ior = if ior > 0.0 { ior.clamp(0.1, 10.0) } else { 1.0 };
        Film {
            share,
            ior: 1.0 + (ior - 1.0) * there,
            thickness,
        }
    }

    /// Returns the Fresnel term of the film over a base of reflectance `f0`.
    #[inline(always)]
    pub fn reflectance<L: Lanes<Scalar = f32>>(&self, cos: L, f0: [L; 3]) -> [L; 3] {
        let (zero, one) = (L::zero(), L::splat(1.0));
        let ior = L::splat(self.ior);
        let cos = unit_interval(cos);
        let cos2 = one - (one - cos * cos) / (ior * ior);
        let total = cos2.lt(zero);
        let inner = max(cos2, zero).sqrt();
        let root = (self.ior - 1.0) / (self.ior + 1.0);
        let first = L::splat(root * root);
        let r12 = first + (one - first) * schlick(cos);
        let t121 = one - r12;
        let path = L::splat(2.0 * self.ior * self.thickness) * inner;
        // Phases in turns: half a turn where a denser medium reflects.
        let phase21 = L::splat(if self.ior < 1.0 { 0.0 } else { 0.5 });
        let term = schlick(inner);
        let mut r23 = [zero; 3];
        let mut phase = [zero; 3];
        for k in 0..3 {
            let root = min(f0[k], L::splat(0.999_9)).sqrt();
            let base = (one + root) / (one - root);
            let r = (base - ior) / (base + ior);
            let r = r * r;
            r23[k] = r + (one - r) * term;
            phase[k] = phase21 + L::select(base.lt(ior), L::splat(0.5), zero);
        }
        let both = r23.map(|r| min(max(r12 * r, L::splat(1e-5)), L::splat(0.999_9)));
        let series: [L; 3] = std::array::from_fn(|k| t121 * t121 * r23[k] / (one - both[k]));
        let mut sum = series.map(|s| r12 + s);
        let mut order = series.map(|s| s - t121);
        for m in [1.0, 2.0] {
            let m = L::splat(m);
            let wave = interference(m * path, phase.map(|p| m * p));
            for k in 0..3 {
                order[k] = order[k] * both[k].sqrt();
                sum[k] = sum[k] + L::splat(2.0) * order[k] * wave[k];
            }
        }
        sum.map(|r| L::select(total, one, unit_interval(r)))
    }
}

/// Returns the interference of an optical path difference in nanometres, with phase shifts in
/// turns, as a colour (the paper's equation 10).
#[inline(always)]
fn interference<L: Lanes<Scalar = f32>>(path: L, shift: [L; 3]) -> [L; 3] {
    let metres = path * L::splat(1e-9);
    let phase = metres * L::splat(TAU);
    let wave = |(height, place, variance): (f32, f32, f32), shift: L| {
        let (_, cos) = sin_cos_turns(L::splat(place) * metres + shift);
        let scale = height * (TAU * variance).sqrt() / WHITE;
        L::splat(scale) * cos * exp(L::splat(-variance) * phase * phase)
    };
    let x = wave(GAUSSIANS[0], shift[0]) + wave(GAUSSIANS[3], shift[0]);
    let y = wave(GAUSSIANS[1], shift[1]);
    let z = wave(GAUSSIANS[2], shift[2]);
    RGB_FROM_XYZ.map(|[a, b, c]| L::splat(a) * x + L::splat(b) * y + L::splat(c) * z)
}
