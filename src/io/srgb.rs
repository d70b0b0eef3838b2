//! Linear light to 8-bit sRGB (IEC 61966-2-1), to the nearest code.
//!
//! The transfer function is inverted once, at the 255 borders between codes;
//! a value's code is the number of borders at or below it. That rounds right by
//! construction, is monotone, and needs no power per pixel. The borders are
//! computed in f64 by the crate `libm`, so bits are the same on all machines.
//! Values outside 0…1 are clamped; NaN becomes 0.

pub struct SrgbEncoder {
    /// `borders[k]` is the linear value half-way between codes k and k + 1.
    borders: [f64; 255],
}

impl SrgbEncoder {
    pub fn new() -> SrgbEncoder {
        SrgbEncoder {
            borders: std::array::from_fn(|k| linear_from_srgb((k as f64 + 0.5) / 255.0)),
        }
    }

    pub fn encode(&self, linear: f32) -> u8 {
        // Every comparison with NaN is false: it has no border below it.
        let linear = f64::from(linear);
        self.borders.partition_point(|border| linear >= *border) as u8
    }
}

impl Default for SrgbEncoder {
    fn default() -> SrgbEncoder {
        SrgbEncoder::new()
    }
}

/// The standard's decoding function, 0…1 to 0…1.
fn linear_from_srgb(encoded: f64) -> f64 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        libm::pow((encoded + 0.055) / 1.055, 2.4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The standard's encoding function, rounded: the direct way.
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
            // The least value above this code, by bisection over the bits.
            let (mut below, mut above) = (0, 1.0_f32.to_bits());
            while above - below > 1 {
                let middle = (below + above) / 2;
                if srgb.encode(f32::from_bits(middle)) > code {
                    above = middle;
                } else {
                    below = middle;
                }
            }
            // The standard's two functions are inverse to each other only to
            // about 1e-5 of a code, at their joint.
            let border = direct(f64::from(f32::from_bits(above)));
            assert!((border - 0.5 - f64::from(code)).abs() < 1e-4, "{code}");
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
