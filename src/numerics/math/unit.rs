//! Lengths and unit vectors for hot loops, with the bits of glam's. They use the hardware
//! square root: glam's, with its feature `libm`, is an instruction in the legacy SSE
//! encoding, which stalls 256- and 512-bit code around it (measured: a cone kernel six
//! times slower; docs/decisions/029-no-glam-length.md).

use super::lanes::{Lanes, Mask};
use super::vec3::Vec3;
use glam::DVec3;

/// Returns the length of a vector of any scale; squares outside [1e-200, 1e200) are
/// avoided by scaling.
#[inline]
pub fn length(v: DVec3) -> f64 {
    let squared = v.length_squared();
    if (1e-200..1e200).contains(&squared) {
        return squared.sqrt();
    }
    let size = v.abs().max_element();
    if size > 0.0 && size.is_finite() {
        size * (v / size).length_squared().sqrt()
    } else {
        size
    }
}

/// Returns the unit vector of a vector of any scale; zero for zero, infinite and NaN
/// vectors.
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

/// Returns [`unit()`] of each lane, to two roundings: one division serves all axes. Lemma
/// L2, docs/numerics/leaving.md.
#[inline(always)]
pub fn units<D: Lanes<Scalar = f64>>(v: Vec3<D>) -> Vec3<D> {
    units_and_lengths(v).0
}

/// Returns [`units`] and the lengths.
#[inline(always)]
pub fn units_and_lengths<D: Lanes<Scalar = f64>>(v: Vec3<D>) -> (Vec3<D>, D) {
    let squared = v.length_squared();
    let ordinary = squared.ge(D::splat(1e-200)) & squared.lt(D::splat(1e200));
    let mut lengths = squared.sqrt();
    let mut units = v * (D::splat(1.0) / lengths);
    let mut others = (!ordinary).bits();
    while others != 0 {
        let i = others.trailing_zeros() as usize;
        others &= others - 1;
        let own = DVec3::new(v.x.lane(i), v.y.lane(i), v.z.lane(i));
        let one = unit(own);
        if one != DVec3::ZERO {
            lengths = lengths.with_lane(i, own.dot(one));
        }
        units.x = units.x.with_lane(i, one.x);
        units.y = units.y.with_lane(i, one.y);
        units.z = units.z.with_lane(i, one.z);
    }
    (units, lengths)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::f64x8;

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

    #[test]
    fn units_are_each_lane_s_unit_to_two_roundings() {
        for scale in [0.0, 1e-300, 1e-120, 1.0, 7e8, 1e120, 1e300, f64::NAN] {
            let lanes = |k: f64| f64x8::load(&std::array::from_fn::<_, 8, _>(|i| k + i as f64));
            let v = Vec3::new(lanes(1.0), lanes(-3.5), lanes(0.25)) * f64x8::splat(scale);
            let (found, lengths) = units_and_lengths(v);
            for i in 0..8 {
                let lane = |v: &Vec3<f64x8>| DVec3::new(v.x.lane(i), v.y.lane(i), v.z.lane(i));
                let expected = unit(lane(&v));
                let off = (lane(&found) - expected).abs().max_element();
                assert!(off <= 2.0 * f64::EPSILON, "{scale}: {off}");
                if scale.is_finite() {
                    let expected = length(lane(&v) / scale.max(1e-300)) * scale;
                    let off = (lengths.lane(i) - expected).abs();
                    assert!(off <= 4.0 * f64::EPSILON * expected, "{scale}: {off}");
                }
            }
        }
    }
}
