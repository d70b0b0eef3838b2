//! Affine maps with one stated order of operations.
//!
//! DESIGN: the object ray of an appearance *is* `object_from_world` applied to
//! the world ray in f64, in this order, without FMA. Everything that needs an
//! object ray (kernels of any width, the canonical evaluation) calls the
//! functions here, so they all see the same numbers. glam's types are only the
//! storage.

use super::axis_order::AxisOrder;
use super::lanes::{Lanes, max, min};
use super::vec3::{Vec3, unordered_dot};
use glam::{DAffine3, DMat3, DVec3};

/// A 3×4 matrix in f64: nine linear entries by column, and a translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    linear: [[f64; 3]; 3],
    pub translation: [f64; 3],
    /// In which columns' products are added: that of the column whose largest entry is
    /// the largest comes last. Worked out once, for rays go through a map by the million.
    order: AxisOrder,
}

impl Affine {
    pub const IDENTITY: Affine = Affine {
        linear: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        translation: [0.0; 3],
        order: AxisOrder::NUMBERED,
    };

    /// `linear[c][r]`: column `c`, row `r`.
    pub fn new(linear: [[f64; 3]; 3], translation: [f64; 3]) -> Affine {
        Affine {
            linear,
            translation,
            order: order_of(&linear),
        }
    }

    /// `linear()[c][r]`: column `c`, row `r`.
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

    /// `self · inner`: first `inner`, then `self`.
    ///
    /// Never inlined: of two products inlined into a loop, LLVM 22.1 (rustc 1.95,
    /// AVX-512, superword vectorisation) made wrong code. Alone it is right;
    /// tests/scene_checks/graphs.rs compares with a product written out.
    #[inline(never)]
    pub fn then_after(&self, inner: &Affine) -> Affine {
        let linear = inner.linear.map(|c| self.vector(c));
        Affine::new(linear, self.point(inner.translation))
    }

    /// A point: ((mᵢpᵢ + mⱼpⱼ) + mₖpₖ) + t, each row, no FMA; i, j, k: [`AxisOrder`]
    /// of the columns' largest entries.
    #[inline(always)]
    pub fn point(&self, p: [f64; 3]) -> [f64; 3] {
        let v = self.vector(p);
        std::array::from_fn(|r| v[r] + self.translation[r])
    }

    /// A direction: (mᵢvᵢ + mⱼvⱼ) + mₖvₖ, each row, no FMA, in the same order.
    #[inline(always)]
    pub fn vector(&self, v: [f64; 3]) -> [f64; 3] {
        let [a, b, c] = self.order.of_axes(self.linear.each_ref());
        let [x, y, z] = self.order.of_axes(v);
        std::array::from_fn(|r| a[r] * x + b[r] * y + c[r] * z)
    }

    /// [`point`](Self::point) for many points at once: the same bits per lane.
    #[inline(always)]
    pub fn points<D: Lanes<Scalar = f64>>(&self, p: Vec3<D>) -> Vec3<D> {
        let [x, y, z] = self.translation.map(D::splat);
        self.vectors(p) + Vec3::new(x, y, z)
    }

    /// [`vector`](Self::vector) for many directions at once.
    #[inline(always)]
    pub fn vectors<D: Lanes<Scalar = f64>>(&self, v: Vec3<D>) -> Vec3<D> {
        let [a, b, c] = self.order.of_axes(self.linear.each_ref());
        let [x, y, z] = self.order.of_axes([v.x, v.y, v.z]);
        let row = |r: usize| D::splat(a[r]) * x + D::splat(b[r]) * y + D::splat(c[r]) * z;
        Vec3::new(row(0), row(1), row(2))
    }

    /// The transpose of the linear part applied to `n`: with `object_from_world`
    /// this takes an object-space normal to world space (inverse transpose).
    #[inline(always)]
    pub fn transposed_vector(&self, n: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|c| {
            self.linear[c][0] * n[0] + self.linear[c][1] * n[1] + self.linear[c][2] * n[2]
        })
    }

    /// [`transposed_vector`](Self::transposed_vector) for many normals at once.
    #[inline(always)]
    pub fn transposed_vectors<D: Lanes<Scalar = f64>>(&self, n: Vec3<D>) -> Vec3<D> {
        let column = |c: usize| {
            let [x, y, z] = self.linear[c].map(D::splat);
            x * n.x + y * n.y + z * n.z
        };
        Vec3::new(column(0), column(1), column(2))
    }

    /// The largest row sum of magnitudes of the linear part (∞-norm).
    pub fn norm(&self) -> f64 {
        (0..3)
            .map(|r| (0..3).map(|c| self.linear[c][r].abs()).sum::<f64>())
            .fold(0.0, f64::max)
    }

    /// How much it lengthens vectors at most (2-norm), to within rounding: the
    /// root of the ∞-norm of MᵀM, which for rotations is 1.
    pub fn stretch(&self) -> f64 {
        let dot = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let row = |a: &[f64; 3]| -> f64 { self.linear.map(|b| dot(a, &b).abs()).iter().sum() };
        self.linear.iter().map(row).fold(0.0, f64::max).sqrt()
    }

    /// The inverse, or `None` where the linear part is singular or so close to
    /// it that its condition number (∞-norm) passes 10^15.
    pub fn inverse(&self) -> Option<Affine> {
        // Scaled to unit size first, so that no determinant under- or overflows; by a
        // power of two, which rounds nothing.
        let entries = self.linear.iter().flatten();
        let largest = entries.fold(0.0, |m, x| f64::max(m, x.abs()));
        if !self.is_finite() || !largest.is_normal() {
            return None;
        }
        let size = f64::from_bits(largest.to_bits() & f64::INFINITY.to_bits());
        let [x, y, z] = self.linear.map(|c| DVec3::from_array(c) / size);
        let rows = [y.cross(z), z.cross(x), x.cross(y)];
        // Along each column, which round differently, and of these the middle one: so
        // no axis counts more than another.
        let [a, b, c] = [(x, 0), (y, 1), (z, 2)].map(|(column, k)| unordered_dot(column, rows[k]));
        let determinant = max(min(a, b), min(max(a, b), c));
        if determinant == 0.0 || !determinant.is_finite() {
            return None;
        }
        let rows = rows.map(|row| row / determinant);
        let linear = [0, 1, 2].map(|c| rows.map(|row| row[c] / size));
        let mut result = Affine::new(linear, [0.0; 3]);
        result.translation = result.vector(self.translation).map(|x| -x);
        let condition = self.norm() * result.norm();
        (result.is_finite() && condition <= 1e15).then_some(result)
    }
}

/// By a column's largest entry.
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
