//! Conversion of linear light to 8-bit sRGB (IEC 61966-2-1), to the nearest code.
//!
//! The transfer function is inverted once, at the 255 borders between codes; the code of a
//! value is the number of borders at or below it. This rounds correctly by construction, is
//! monotone, and needs no power function per pixel. The borders are computed in f64 by the
//! crate `libm`, so results are the same on all machines. Values outside 0…1 are clamped;
//! NaN becomes 0.
//!
//! The relative distance of neighbouring borders is at least 1/112, so a cell of f32 values
//! that agree in the exponent and eight bits of the fraction contains at most one border. A
//! table holds the code at the beginning of each cell, and one comparison finds the code.

pub use crate::scene::linear_from_srgb;

/// The tables of the conversion.
pub struct SrgbEncoder {
    /// `borders[k]` is the linear value half-way between codes k and k + 1; the last one is
    /// infinity, because no code follows 255.
    borders: [f64; 256],
    /// The code at the beginning of each cell from [`LEAST`] to 1.
    codes: [u8; CELLS],
}

/// The beginning of the first cell; no border is below.
const LEAST: f32 = 1.0 / 8192.0;
/// The number of low bits in which the f32 values of one cell differ.
const CELL: u32 = 23 - 8;
const CELLS: usize = ((1.0_f32.to_bits() - LEAST.to_bits()) >> CELL) as usize;

impl SrgbEncoder {
    /// Computes the tables.
    pub fn new() -> SrgbEncoder {
        let border = |k: usize| match k {
            255 => f64::INFINITY,
            _ => linear_from_srgb((k as f64 + 0.5) / 255.0),
        };
        let borders: [f64; 256] = std::array::from_fn(border);
        let code = |cell: usize| {
            let start = f32::from_bits(LEAST.to_bits() + ((cell as u32) << CELL));
            borders.partition_point(|border| f64::from(start) >= *border) as u8
        };
        SrgbEncoder {
            codes: std::array::from_fn(code),
            borders,
        }
    }

    /// Returns the code nearest to a linear value.
    #[inline]
    pub fn encode(&self, linear: f32) -> u8 {
        // NaN fails both comparisons and gets code 0.
        if linear >= 1.0 {
            return 255;
        }
        if linear >= LEAST {
            let code = self.codes[((linear.to_bits() - LEAST.to_bits()) >> CELL) as usize];
            let next = self.borders[usize::from(code)];
            return code + u8::from(f64::from(linear) >= next);
        }
        0
    }
}

impl Default for SrgbEncoder {
    fn default() -> SrgbEncoder {
        SrgbEncoder::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Encodes by the standard's function, in units of codes, without rounding.
    fn direct(linear: f64) -> f64 {
        let linear = linear.clamp(0.0, 1.0);
        255.0
            * if linear <= 0.0031308 {
                12.92 * linear
            } else {
                1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055
            }
    }

    #[test]
    fn known_points() {
        let srgb = SrgbEncoder::new();
        for (linear, code) in [
            (0.0, 0),
            (-0.0, 0),
            (1.0, 255),
            (0.5, 188),
            // Photographic middle grey.
            (0.18, 118),
            (0.214_041_14, 128),
            (0.0031308, 10),
            // The first border lies at 0.5 / 255 / 12.92.
            (0.000_151, 0),
            (0.000_152_5, 1),
            (-1.0, 0),
            (7.0, 255),
            (f32::INFINITY, 255),
            (f32::NEG_INFINITY, 0),
            (f32::NAN, 0),
        ] {
            assert_eq!(srgb.encode(linear), code, "{linear}");
        }
    }

    #[test]
    fn every_code_comes_back() {
        let srgb = SrgbEncoder::new();
        for code in 0..=255_u8 {
            let linear = linear_from_srgb(f64::from(code) / 255.0) as f32;
            assert_eq!(srgb.encode(linear), code);
        }
    }

    #[test]
    fn codes_change_half_way() {
        let srgb = SrgbEncoder::new();
        for code in 0..255_u8 {
            // Bisection over the bits finds the least value with a higher code.
            let (mut below, mut above) = (0, 1.0_f32.to_bits());
            while above - below > 1 {
                let middle = (below + above) / 2;
                if srgb.encode(f32::from_bits(middle)) > code {
                    above = middle;
                } else {
                    below = middle;
                }
            }
            // At the joint of their two pieces, the standard's functions are inverse to each
            // other only to about 1e-5 of a code.
            let border = direct(f64::from(f32::from_bits(above)));
            assert!((border - 0.5 - f64::from(code)).abs() < 1e-4, "{code}");
        }
    }

    #[test]
    fn codes_count_the_borders() {
        let srgb = SrgbEncoder::new();
        assert!(srgb.borders[0] > f64::from(LEAST) && srgb.borders[254] < 1.0);
        let counted = |linear: f32| {
            let below = |border: &f64| f64::from(linear) >= *border;
            srgb.borders.partition_point(below) as u8
        };
        // Both ends of each cell, and both neighbours of each border.
        let ends = (0..=CELLS as u32).map(|cell| LEAST.to_bits() + (cell << CELL));
        let borders = srgb.borders[..255].iter().map(|b| (*b as f32).to_bits());
        for bits in ends.chain(borders) {
            for near in [bits - 1, bits, bits + 1] {
                let linear = f32::from_bits(near);
                assert_eq!(srgb.encode(linear), counted(linear), "{linear:e}");
            }
        }
    }

    proptest! {
        #[test]
        fn nearest_code(linear in -0.1_f32..1.1) {
            let code = f64::from(SrgbEncoder::new().encode(linear));
            prop_assert!((code - direct(f64::from(linear))).abs() <= 0.5 + 1e-4);
        }
    }
}
