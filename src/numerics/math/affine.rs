//! Affine maps with a fixed order of operations.
//!
//! SPEC (S5 to S7, docs/SPEC.md) defines the object ray of an instance as
//! `object_from_world` applied to the world ray in f64, in this order, without FMA.
//! Everything that needs an object ray (kernels of any width, the exact fallback) calls
//! the functions here, so all see the same numbers (lemma A1,
//! docs/numerics/transforms.md). glam's types serve only for conversion and construction.

use super::axis_order::AxisOrder;
use super::lanes::{Lanes, max, min};
use super::vec3::{Vec3, unordered_dot};
use glam::{DAffine3, DMat3, DVec3};

/// A 3×4 matrix in f64: nine linear entries by column, and a translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    linear: [[f64; 3]; 3],
    pub translation: [f64; 3],
    /// Order in which the products of the columns are added: the column whose largest
    /// entry is the largest comes last. It is computed once per map, since millions of
    /// rays go through a map.
    order: AxisOrder,
}

impl Affine {
    pub const IDENTITY: Affine = Affine {
        linear: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        translation: [0.0; 3],
        order: AxisOrder::NUMBERED,
    };

    /// Makes a map from `linear[c][r]` (column `c`, row `r`) and a translation.
    pub fn new(linear: [[f64; 3]; 3], translation: [f64; 3]) -> Affine {
        Affine {
            linear,
            translation,
            order: order_of(&linear),
        }
    }

    /// Returns the linear part; `linear()[c][r]` is column `c`, row `r`.
    #[inline(always)]
    pub fn linear(&self) -> &[[f64; 3]; 3] {
        &self.linear
    }

    pub fn is_identity(&self) -> bool {
        *self == Affine::IDENTITY
    }

    pub fn is_finite(&self) -> bool {
        self.linear.iter().flatten().all(|x| x.is_finite())
            && self.translation.iter().all(|x| x.is_finite())
    }

    /// Returns the composition `self · inner`, which applies `inner` first.
    ///
    /// Never inlined: LLVM 22.1 (rustc 1.95, AVX-512, superword vectorisation)
    /// miscompiled a loop with two inlined products. A single product is compiled
    /// correctly; tests/formats/scene_checks/graphs.rs compares it with a product written out.
    #[inline(never)]
    pub fn then_after(&self, inner: &Affine) -> Affine {
        let linear = inner.linear.map(|c| self.vector(c));
        Affine::new(linear, self.point(inner.translation))
    }

    /// Maps a point: ((mᵢpᵢ + mⱼpⱼ) + mₖpₖ) + t in each row, without FMA. i, j, k is the
    /// [`AxisOrder`] of the columns' largest entries.
    #[inline(always)]
    pub fn point(&self, p: [f64; 3]) -> [f64; 3] {
        let v = self.vector(p);
        std::array::from_fn(|r| v[r] + self.translation[r])
    }

    /// Maps a direction: (mᵢvᵢ + mⱼvⱼ) + mₖvₖ in each row, without FMA, in the order of
    /// [`point`](Self::point).
    #[inline(always)]
    pub fn vector(&self, v: [f64; 3]) -> [f64; 3] {
        let [a, b, c] = self.order.of_axes(self.linear.each_ref());
        let [x, y, z] = self.order.of_axes(v);
        std::array::from_fn(|r| a[r] * x + b[r] * y + c[r] * z)
    }

    /// Maps one point per lane, with the bits of [`point`](Self::point).
    #[inline(always)]
    pub fn points<D: Lanes<Scalar = f64>>(&self, p: Vec3<D>) -> Vec3<D> {
        let [x, y, z] = self.translation.map(D::splat);
        self.vectors(p) + Vec3::new(x, y, z)
    }

    /// Maps one direction per lane, with the bits of [`vector`](Self::vector).
    #[inline(always)]
    pub fn vectors<D: Lanes<Scalar = f64>>(&self, v: Vec3<D>) -> Vec3<D> {
        let [a, b, c] = self.order.of_axes(self.linear.each_ref());
        let [x, y, z] = self.order.of_axes([v.x, v.y, v.z]);
        let row = |r: usize| D::splat(a[r]) * x + D::splat(b[r]) * y + D::splat(c[r]) * z;
        Vec3::new(row(0), row(1), row(2))
    }

    /// Applies the transpose of the linear part to `n`. With `object_from_world` this
    /// takes an object-space normal to world space (inverse transpose).
    #[inline(always)]
    pub fn transposed_vector(&self, n: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|c| {
            self.linear[c][0] * n[0] + self.linear[c][1] * n[1] + self.linear[c][2] * n[2]
        })
    }

    /// Applies the transpose to one normal per lane, with the bits of
    /// [`transposed_vector`](Self::transposed_vector).
    #[inline(always)]
    pub fn transposed_vectors<D: Lanes<Scalar = f64>>(&self, n: Vec3<D>) -> Vec3<D> {
        let column = |c: usize| {
            let [x, y, z] = self.linear[c].map(D::splat);
            x * n.x + y * n.y + z * n.z
        };
        Vec3::new(column(0), column(1), column(2))
    }

    /// Returns the largest row sum of magnitudes of the linear part (∞-norm).
    pub fn norm(&self) -> f64 {
        (0..3)
            .map(|r| (0..3).map(|c| self.linear[c][r].abs()).sum::<f64>())
            .fold(0.0, f64::max)
    }

    /// Returns an upper bound, to within rounding, of the factor by which the map
    /// lengthens vectors (2-norm): √‖MᵀM‖∞, which is 1 for rotations.
    pub fn stretch(&self) -> f64 {
        let dot = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let row = |a: &[f64; 3]| -> f64 { self.linear.map(|b| dot(a, &b).abs()).iter().sum() };
        self.linear.iter().map(row).fold(0.0, f64::max).sqrt()
    }

    /// Returns the inverse; `None` if an entry is not finite, or the linear part is
    /// singular or has a condition number (∞-norm) above 10¹⁵ (lemma A2,
    /// docs/numerics/transforms.md).
    pub fn inverse(&self) -> Option<Affine> {
        // Scale to unit size by a power of two, which rounds nothing, so that no
        // determinant overflows or underflows.
        let entries = self.linear.iter().flatten();
        let largest = entries.fold(0.0, |m, x| f64::max(m, x.abs()));
        if !self.is_finite() || !largest.is_normal() {
            return None;
        }
        let size = f64::from_bits(largest.to_bits() & f64::INFINITY.to_bits());
        let [x, y, z] = self.linear.map(|c| DVec3::from_array(c) / size);
        let rows = [y.cross(z), z.cross(x), x.cross(y)];
        // Expand the determinant along each column and take the median: the three round
        // differently, and the median does not depend on the axes' names.
        let [a, b, c] = [(x, 0), (y, 1), (z, 2)].map(|(column, k)| unordered_dot(column, rows[k]));
        let determinant = max(min(a, b), min(max(a, b), c));
        if determinant == 0.0 || !determinant.is_finite() {
            return None;
        }
        let rows = rows.map(|row| row / determinant);
        let linear = [0, 1, 2].map(|c| rows.map(|row| row[c] / size));
        let mut result = Affine::new(linear, [0.0; 3]);
        // Lemma A2, docs/numerics/transforms.md.
        result.translation = result.vector(self.translation).map(|x| -x);
        let condition = self.norm() * result.norm();
        (result.is_finite() && condition <= 1e15).then_some(result)
    }
}

/// Orders the columns by their largest entries in magnitude.
fn order_of(linear: &[[f64; 3]; 3]) -> AxisOrder {
    AxisOrder::of(linear.map(|c| max(max(c[0].abs(), c[1].abs()), c[2].abs())))
}

impl From<DAffine3> for Affine {
    fn from(m: DAffine3) -> Affine {
        Affine::new(m.matrix3.to_cols_array_2d(), m.translation.to_array())
    }
}

impl From<Affine> for DAffine3 {
    fn from(m: Affine) -> DAffine3 {
        DAffine3 {
            matrix3: DMat3::from_cols_array_2d(&m.linear),
            translation: DVec3::from_array(m.translation),
        }
    }
}
