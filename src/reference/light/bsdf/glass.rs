//! The shares that glass reflects and transmits: the surface of a solid, and a thin sheet.

use super::ggx::{Interface, fresnel};
use super::{Color, mean};

/// A solid whose index differs from 1 by less than this is a window.
const MATCHED: f64 = 1.0 / 1024.0;

/// What transmits.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    /// A sheet: light passes unbent.
    pub thin: bool,
    pub ior: f64,
    /// A factor of the reflectance.
    pub tint: Color,
    /// What is left of light that passes once.
    pub color: Color,
}

/// The shares of light that glass reflects and transmits, and the chance to reflect.
pub struct Shares {
    pub reflected: Color,
    pub transmitted: Color,
    pub chance: f64,
    pub interface: Interface,
}

impl Window {
    /// Fresnel's shares at a facet; of a sheet the sums over all inner reflections.
    pub fn shares(&self, cos: f64, eta: f64) -> Shares {
        let ratio = if self.thin { self.ior } else { eta };
        let mut interface = fresnel(cos, ratio);
        if matched(ratio) {
            (interface.reflectance, interface.cos) = (0.0, cos);
        }
        let (mut reflected, mut transmitted) = ([0.0; 3], [0.0; 3]);
        for k in 0..3 {
            let c = self.color[k];
            let r = match interface.total {
                true => 1.0,
                false => interface.reflectance * self.tint[k],
            };
            // R + T² R c² (1 + R² c² + …) and T² c (1 + R² c² + …).
            let orders = 1.0 / (1.0 - r * r * c * c).max(f64::MIN_POSITIVE);
            (reflected[k], transmitted[k]) = match self.thin {
                false => (r, (1.0 - r) * c),
                true if r == 1.0 => (1.0, 0.0),
                true => {
                    let once = (1.0 - r) * (1.0 - r) * c * orders;
                    (r + once * r * c, once)
                }
            };
        }
        let (a, b) = (mean(reflected), mean(transmitted));
        Shares {
            reflected,
            transmitted,
            chance: if a + b > 0.0 { a / (a + b) } else { 1.0 },
            interface,
        }
    }
}

pub fn matched(eta: f64) -> bool {
    (eta - 1.0).abs() < MATCHED
}
