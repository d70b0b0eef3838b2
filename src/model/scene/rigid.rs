//! Rigid interpolation: a matrix is taken apart into a rotation and a symmetric stretch, of
//! which the first is turned evenly and the second goes straight (Shoemake and Duff, "Matrix
//! Animation and Polar Decomposition", 1992), so that a wheel keeps its size.
//!
//! M = R S, S first. S has positive eigenvalues, or negative ones where M mirrors. A mean of two
//! such matrices is one again, so a motion between two matrices that both mirror, or both do
//! not, is nowhere singular.

use crate::math::Affine;
use glam::{DMat3, DQuat, DVec3};

/// A linear map as a rotation after a stretch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pose {
    rotation: DQuat,
    /// Symmetric; negative definite where the map mirrors.
    stretch: DMat3,
}

/// The cosine of half the angle below which two rotations count as half a turn apart. It is
/// far above the rounding of a quaternion, and far below what a file can mean.
const HALF_TURN: f64 = 1e-9;

/// Steps of Newton's iteration. It converges in ten where the condition is 1e16.
const STEPS: usize = 40;

impl Pose {
    /// Takes a regular map apart. Maps that are not finite give NaN.
    pub fn of(map: &Affine) -> Pose {
        let size = map
            .linear()
            .iter()
            .flatten()
            .fold(0.0, |most: f64, x| most.max(x.abs()));
        let map = DMat3::from_cols_array_2d(&map.linear().map(|c| c.map(|x| x / size)));
        let mut factor = map;
        for _ in 0..STEPS {
            // Newton's iteration for the orthogonal factor, scaled (Higham 1986).
            let inverse = factor.inverse().transpose();
            let scale = (length(&inverse) / length(&factor)).sqrt();
            let next = (factor * scale + inverse * (1.0 / scale)) * 0.5;
            let change = length(&(next - factor));
            factor = next;
            // Squared convergence: the next step would change nothing.
            if !(change > 1e-9) {
                break;
            }
        }
        let side = if factor.determinant() < 0.0 {
            -1.0
        } else {
            1.0
        };
        let rotation = factor * side;
        let stretch = rotation.transpose() * map;
        Pose {
            rotation: DQuat::from_mat3(&rotation).normalize(),
            stretch: (stretch + stretch.transpose()) * (0.5 * size),
        }
    }

    /// Says whether the map turns space inside out.
    pub fn mirrors(&self) -> bool {
        self.stretch.x_axis.x < 0.0
    }

    /// Returns the map at a share `s` of the way to another. It turns the shorter way; half a
    /// turn goes counter-clockwise about the axis, in the parent's space, whose largest
    /// component is positive.
    pub fn towards(&self, other: &Pose, s: f64) -> [[f64; 3]; 3] {
        let mut turn = other.rotation * self.rotation.conjugate();
        let axis = DVec3::new(turn.x, turn.y, turn.z);
        let largest =
            axis.to_array().into_iter().fold(
                0.0,
                |most: f64, x| {
                    if x.abs() > most.abs() { x } else { most }
                },
            );
        let backward = match turn.w.abs() > HALF_TURN {
            true => turn.w < 0.0,
            false => largest < 0.0,
        };
        if backward {
            turn = -turn;
        }
        let axis = DVec3::new(turn.x, turn.y, turn.z);
        let sine = axis.length();
        let half = libm::atan2(sine, turn.w) * s;
        let turn = match sine > 0.0 {
            true => {
                let v = axis * (libm::sin(half) / sine);
                DQuat::from_xyzw(v.x, v.y, v.z, libm::cos(half))
            }
            false => DQuat::IDENTITY,
        };
        let rotation = DMat3::from_quat((turn * self.rotation).normalize());
        (rotation * (self.stretch * (1.0 - s) + other.stretch * s)).to_cols_array_2d()
    }
}

fn length(m: &DMat3) -> f64 {
    let columns = [m.x_axis, m.y_axis, m.z_axis];
    columns
        .iter()
        .map(|c| c.length_squared())
        .sum::<f64>()
        .sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DAffine3;

    fn at(a: DMat3, b: DMat3, s: f64) -> DMat3 {
        let pose = |m: DMat3| Pose::of(&DAffine3::from_mat3(m).into());
        DMat3::from_cols_array_2d(&pose(a).towards(&pose(b), s))
    }

    fn near(a: DMat3, b: DMat3) -> bool {
        length(&(a - b)) <= 1e-14 * length(&b)
    }

    #[test]
    fn turns_keep_their_size() {
        let turn = |degrees: f64| DMat3::from_rotation_z(degrees.to_radians());
        for (from, by) in [(0.0, 90.0), (30.0, 179.0), (-20.0, -120.0), (170.0, 180.0)] {
            for s in [0.25, 0.5, 0.9] {
                let there = at(turn(from), turn(from + by), s);
                assert!(near(there, turn(from + by * s)), "{from} {by} {s} {there}");
            }
        }
        // Half a turn the other way round is half a turn this way round.
        assert!(near(at(turn(0.0), turn(-180.0), 0.5), turn(90.0)));
    }

    #[test]
    fn stretches_go_straight() {
        let turned = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), 1.0);
        for size in [1e-200, 1e-7, 1.0, 1e150] {
            let scaled = |x: f64| DMat3::from_diagonal(DVec3::new(x, 3.0, -0.5 * x) * size);
            let half = at(turned * scaled(1.0), turned * scaled(2.0), 0.5);
            assert!(
                near(half * (1.0 / size), turned * scaled(1.5) * (1.0 / size)),
                "{size}"
            );
        }
        // A needle.
        let needle = DMat3::from_diagonal(DVec3::new(1e-9, 1.0, 1e-9));
        let half = at(needle, turned * needle, 1.0);
        assert!(near(half, turned * needle), "{half}");
    }

    #[test]
    fn mirrors_are_known() {
        let pose = |scale: [f64; 3]| {
            let turned = DMat3::from_rotation_x(2.0) * DMat3::from_diagonal(scale.into());
            Pose::of(&DAffine3::from_mat3(turned).into()).mirrors()
        };
        assert!(!pose([1.0, 2.0, 3.0]) && !pose([-1.0, -2.0, 3.0]));
        assert!(pose([-1.0, 2.0, 3.0]) && pose([-1.0, -2.0, -3.0]));
    }
}
