//! Lengths for the hot path. The same numbers as glam's, by the processor's own
//! square root: glam's, with its feature `libm`, is an instruction of the old
//! encoding, which stalls 256- and 512-bit code around it (measured: a cone
//! kernel six times slower).

use glam::DVec3;

#[inline]
pub fn length(v: DVec3) -> f64 {
    v.length_squared().sqrt()
}

/// Unit length at any scale; zero and what is not finite give zero.
#[inline]
pub fn unit(v: DVec3) -> DVec3 {
    let squared = v.length_squared();
    if (1e-200..1e200).contains(&squared) {
        return v / squared.sqrt();
    }
    let size = v.abs().max_element();
    if size > 0.0 && size.is_finite() {
        let scaled = v / size;
        scaled / length(scaled)
    } else {
        DVec3::ZERO
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_at_any_scale() {
        for scale in [1e-300, 1e-120, 1.0, 1e120, 1e300] {
            let u = unit(DVec3::new(1.0, -2.0, 2.0) * scale);
            let expected = DVec3::new(1.0, -2.0, 2.0) / 3.0;
            assert!((u - expected).abs().max_element() < 1e-15, "{u}");
        }
        assert_eq!(unit(DVec3::ZERO), DVec3::ZERO);
        assert_eq!(unit(DVec3::NAN), DVec3::ZERO);
        assert_eq!(unit(DVec3::INFINITY), DVec3::ZERO);
    }
}
