//! Conditioning: how much roundings in one space amount to in another.

use crate::math::Affine;

/// The amplification of relative roundings of coordinates by a map and its inverse: element
/// (r, c) is the share of coordinate c in coordinate r, |M⁻¹|·|M|. Its ∞-norm is the
/// condition number of Bauer and Skeel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Conditioning([[f64; 3]; 3]);

impl Conditioning {
    /// No amplification, for a shape in the space itself.
    pub const NONE: Conditioning = Conditioning([[0.0; 3]; 3]);

    /// Returns the amplification as seen from outside the space that `outward` leads out of
    /// and `inward` leads into, where this is the amplification in that space. The
    /// roundings of the maps count once.
    pub fn through(&self, inward: &Affine, outward: &Affine) -> Conditioning {
        let (to, from) = (inward.linear(), outward.linear());
        let middle = |r: usize, k: usize| self.0[r][k] + f64::from(u8::from(r == k));
        let inner =
            |r: usize, c: usize| -> f64 { (0..3).map(|k| middle(r, k) * to[c][k].abs()).sum() };
        let outer = |r: usize, c: usize| (0..3).map(|k| from[k][r].abs() * inner(k, c)).sum();
        Conditioning([0, 1, 2].map(|r| [0, 1, 2].map(|c| outer(r, c))))
    }

    /// Returns the elementwise maximum, for several shapes in one space.
    pub fn max(&self, other: &Conditioning) -> Conditioning {
        let element = |r: usize, c: usize| greater(self.0[r][c], other.0[r][c]);
        Conditioning([0, 1, 2].map(|r| [0, 1, 2].map(|c| element(r, c))))
    }

    /// Returns the ∞-norm: how much the largest coordinate counts. It is 1 where axes are
    /// only scaled and swapped, at most 3 where a scaled shape is rotated, and up to the
    /// condition number where a rotated shape is scaled.
    pub fn norm(&self) -> f64 {
        let rows = self.0.map(|row| row.iter().sum::<f64>());
        rows.into_iter().fold(0.0, greater)
    }
}

/// Returns the greater number; NaN counts as the greatest.
fn greater(x: f64, y: f64) -> f64 {
    if x > y || x.is_nan() { x } else { y }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DAffine3, DVec3};

    fn norm(map: DAffine3) -> f64 {
        Conditioning::NONE
            .through(&map.inverse().into(), &map.into())
            .norm()
    }

    #[test]
    fn needles_blur_where_they_lie_obliquely_in_their_own_space() {
        let turn = DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.8);
        let needle = DAffine3::from_scale(DVec3::new(1e6, 1.0, 1e-3));
        let shift = DAffine3::from_translation(DVec3::new(1e9, 0.0, -3.0));
        assert!((norm(needle) - 1.0).abs() < 1e-9);
        assert!((1.0..3.0001).contains(&norm(shift * turn * needle)));
        assert!(norm(needle * turn) > 1e8);
    }

    #[test]
    fn blurs_of_spaces_in_spaces_add_up() {
        let turn = DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.8);
        let needle = DAffine3::from_scale(DVec3::new(1e4, 1.0, 1.0));
        let through =
            |blur: Conditioning, map: DAffine3| blur.through(&map.inverse().into(), &map.into());
        let turned = through(Conditioning::NONE, turn);
        // A rotated shape in a needle, and a needle in a rotated space.
        assert!(through(turned, needle).norm() > 1e3);
        assert!(through(through(Conditioning::NONE, needle), turn).norm() < 8.0);
        assert_eq!(turned.max(&Conditioning::NONE), turned);
    }

    #[test]
    fn what_is_no_number_is_more_than_any() {
        let wild = Conditioning([[f64::NAN; 3]; 3]);
        assert!(wild.max(&Conditioning::NONE).norm().is_nan());
        assert!(Conditioning::NONE.max(&wild).norm().is_nan());
    }
}
