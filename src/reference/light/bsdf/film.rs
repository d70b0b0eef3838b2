//! Iridescence of a thin film in air (KHR_materials_iridescence), by Belcour and Barla 2017 as
//! glTF's sample has it: Schlick's term at both interfaces, two orders of interference.

use super::Color;
use super::ggx::schlick;
use std::f64::consts::{PI, TAU};

/// The Gaussians of the colour matching functions over phase: height, place and variance.
const X: [[f64; 3]; 2] = [
    [5.4856e-13, 1.6810e6, 4.3278e9],
    [9.7470e-14, 2.2399e6, 4.5282e9],
];
const Y: [f64; 3] = [4.4201e-13, 1.7953e6, 9.3046e9];
const Z: [f64; 3] = [5.2481e-13, 2.2084e6, 6.6121e9];
const WHITE: f64 = 1.0685e-7;

const RGB_FROM_XYZ: [[f64; 3]; 3] = [
    [3.2404542, -1.5371385, -0.4985314],
    [-0.9692660, 1.8760108, 0.0415560],
    [0.0556434, -0.2040259, 1.0572252],
];

#[derive(Clone, Copy, Debug)]
pub struct Film {
    pub share: f64,
    ior: f64,
    /// In metres.
    thickness: f64,
}

impl Film {
    /// Makes a film of a thickness in nanometres. One thinner than 0.03 nm fades away.
    pub fn new(share: f64, ior: f64, thickness: f64) -> Film {
        let thickness = thickness.clamp(0.0, 1e4);
        let t = (thickness / 0.03).min(1.0);
        let ior = if ior > 0.0 { ior.clamp(0.1, 10.0) } else { 1.0 };
        Film {
            share,
            ior: 1.0 + (ior - 1.0) * t * t * (3.0 - 2.0 * t),
            thickness: thickness * 1e-9,
        }
    }

    /// Returns the reflectance over a base of the reflectance `f0` at normal incidence.
    pub fn reflectance(&self, cos: f64, f0: Color) -> Color {
        let cos = cos.clamp(0.0, 1.0);
        let cos2 = 1.0 - (1.0 - cos * cos) / (self.ior * self.ior);
        if cos2 < 0.0 {
            return [1.0; 3];
        }
        let inner = cos2.sqrt();
        let first = ((self.ior - 1.0) / (self.ior + 1.0)).powi(2);
        let outer = first + (1.0 - first) * schlick(cos);
        let passed = (1.0 - outer) * (1.0 - outer);
        let path = 2.0 * self.ior * self.thickness * inner;
        let half = |is: bool| if is { PI } else { 0.0 };
        let (mut phase, mut both, mut series) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        for k in 0..3 {
            let root = f0[k].min(0.9999).sqrt();
            let base = (1.0 + root) / (1.0 - root);
            let r = ((base - self.ior) / (base + self.ior)).powi(2);
            let below = r + (1.0 - r) * schlick(inner);
            phase[k] = half(self.ior >= 1.0) + half(base < self.ior);
            both[k] = (outer * below).clamp(1e-5, 0.9999);
            series[k] = passed * below / (1.0 - both[k]);
        }
        let mut sum = series.map(|s| outer + s);
        for order in [1, 2] {
            let times = f64::from(order);
            let wave = sensitivity(times * path, |k| times * phase[k]);
            for k in 0..3 {
                let size = (series[k] - (1.0 - outer)) * both[k].sqrt().powi(order);
                sum[k] += 2.0 * size * wave[k];
            }
        }
        sum.map(|r| r.clamp(0.0, 1.0))
    }
}

/// Returns the interference of an optical path difference in metres as a colour (equation 10),
/// with a shift of the phase of each of X, Y and Z.
fn sensitivity(path: f64, shift: impl Fn(usize) -> f64) -> Color {
    let wave = |[height, place, variance]: [f64; 3], shift: f64| {
        let phase = TAU * path;
        let scale = height * (TAU * variance).sqrt() / WHITE;
        scale * libm::cos(place * phase + shift) * libm::exp(-variance * phase * phase)
    };
    let xyz = [
        wave(X[0], shift(0)) + wave(X[1], shift(0)),
        wave(Y, shift(1)),
        wave(Z, shift(2)),
    ];
    RGB_FROM_XYZ.map(|row| (0..3).map(|k| row[k] * xyz[k]).sum())
}
