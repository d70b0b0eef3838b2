//! Affine maps of transform steps.
//!
//! Rotations are exact at multiples of 90 degrees: angles are reduced in degrees, quarter
//! turns are swaps and changes of sign, and only the remaining angle of at most 45 degrees
//! goes through sine and cosine, of `libm`, which gives the same bits on all machines.

use crate::math::Affine;
use glam::DVec3;

/// Computes (sine, cosine) of an angle in degrees.
fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    // Both remainders are exact: fmod is exact, and so is the difference of two numbers
    // within a factor of two of each other (Sterbenz).
    let within = degrees % 360.0;
    let quarters = libm::round(within / 90.0);
    let (s, c) = libm::sincos((within - quarters * 90.0).to_radians());
    match (quarters as i32).rem_euclid(4) {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    }
}

/// The rotation about axis `k` that turns axis `k + 1` towards axis `k + 2`: counter-clockwise
/// as seen from the end of the axis.
pub(super) fn about_axis(k: usize, degrees: f64) -> Affine {
    let (s, c) = sin_cos_degrees(degrees);
    let (a, b) = ((k + 1) % 3, (k + 2) % 3);
    let mut m = *Affine::IDENTITY.linear();
    m[a][a] = c;
    m[a][b] = s;
    m[b][a] = -s;
    m[b][b] = c;
    Affine::new(m, [0.0; 3])
}

/// The rotation about any axis, counter-clockwise, by Rodrigues' formula:
/// R = c·I + s·[u]× + (1 − c)·u·uᵀ. `axis` has any length but 0.
pub(super) fn about(axis: DVec3, degrees: f64) -> Affine {
    let along = |k: usize| axis[(k + 1) % 3] == 0.0 && axis[(k + 2) % 3] == 0.0;
    if let Some(k) = (0..3).find(|k| along(*k)) {
        return about_axis(k, degrees.copysign(degrees * axis[k]));
    }
    // The division by the largest component keeps the squares within range.
    let u = (axis / axis.abs().max_element()).normalize();
    let (s, c) = sin_cos_degrees(degrees);
    let column = |e: DVec3| (e * c + u.cross(e) * s + u * (u.dot(e) * (1.0 - c))).to_array();
    let linear = [column(DVec3::X), column(DVec3::Y), column(DVec3::Z)];
    Affine::new(linear, [0.0; 3])
}

pub(super) fn translation(by: [f64; 3]) -> Affine {
    Affine::new(*Affine::IDENTITY.linear(), by)
}

pub(super) fn scaling([x, y, z]: [f64; 3]) -> Affine {
    let linear = [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]];
    Affine::new(linear, [0.0; 3])
}

/// The map of a 3×4 matrix, given by rows.
pub(super) fn from_rows(rows: [[f64; 4]; 3]) -> Affine {
    let column = |c: usize| [rows[0][c], rows[1][c], rows[2][c]];
    Affine::new([column(0), column(1), column(2)], column(3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn quarter_turns_are_exact() {
        for turns in -9..=9 {
            let (s, c) = sin_cos_degrees(f64::from(turns) * 90.0);
            let exact = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)];
            assert_eq!((s, c), exact[i32::rem_euclid(turns, 4) as usize]);
        }
        assert_eq!(about_axis(1, 90.0).vector([0.0, 0.0, 1.0]), [1.0, 0.0, 0.0]);
        assert_eq!(about_axis(0, 90.0).vector([0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
        assert_eq!(about_axis(2, 90.0).vector([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
        assert!(about_axis(2, 720.0).is_identity());
    }

    proptest! {
        #[test]
        fn sine_and_cosine_are_those_of_libm(degrees in -1e4..1e4_f64) {
            let (s, c) = sin_cos_degrees(degrees);
            let radians = f64::to_radians(degrees);
            // The conversion to radians rounds π/180 and the product: 175 · 2⁻⁵² = 3.9e-14.
            prop_assert!((s - libm::sin(radians)).abs() < 4e-14);
            prop_assert!((c - libm::cos(radians)).abs() < 4e-14);
        }

        #[test]
        fn an_axis_of_coordinates_is_that_axis(
            k in 0..3_usize, size in 0.1..10.0_f64, flip: bool, degrees in -400.0..400.0_f64,
        ) {
            let mut axis = DVec3::ZERO;
            axis[k] = if flip { -size } else { size };
            let same = about_axis(k, if flip { -degrees } else { degrees });
            prop_assert_eq!(about(axis, degrees), same);
        }

        #[test]
        fn a_rotation_keeps_its_axis_and_turns_as_far(
            x in 0.1..1.0_f64, y in -1.0..1.0_f64, z in -1.0..1.0_f64, degrees in -360.0..360.0_f64,
        ) {
            let axis = DVec3::new(x, y, z);
            let m = about(axis, degrees);
            let kept = DVec3::from_array(m.vector(axis.to_array()));
            // A row has three entries, each rounded four times, of size up to √3: 4e-15.
            prop_assert!((kept - axis).length() < 4e-15);
            let across = axis.normalize().any_orthonormal_vector();
            let turned = DVec3::from_array(m.vector(across.to_array()));
            let (s, c) = sin_cos_degrees(degrees);
            prop_assert!((turned.dot(across) - c).abs() < 2e-15);
            prop_assert!((across.cross(turned).dot(axis.normalize()) - s).abs() < 2e-15);
        }
    }
}
