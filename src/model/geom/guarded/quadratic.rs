//! Roots of F(t) = a t² + 2b t + c whose coefficients have error bounds.
//!
//! The exact F lies within ε(t) = αt² + 2β|t| + γ of the computed one. Where the computed F is
//! steep enough beside a root, the exact one changes its sign next to it (Q1 to Q3,
//! docs/numerics/quadratics.md).

use super::{Between, roundings, tiny};
use crate::math::lanes::{Lanes, Scalar};

pub(in crate::geom) struct Quadratic<L: Lanes> {
    pub f: [L; 3],
    /// The error bounds α, β and γ of the coefficients.
    pub off: [L; 3],
    /// b² − ac.
    pub squared: L,
}

impl<L: Lanes> Quadratic<L> {
    #[inline(always)]
    pub fn new(f: [L; 3], off: [L; 3]) -> Quadratic<L> {
        let [a, b, c] = f;
        Quadratic {
            f,
            off,
            squared: b * b - a * c,
        }
    }

    /// Returns lanes in which F certainly has no root, so that its sign is that of a (Q3,
    /// docs/numerics/quadratics.md).
    #[inline(always)]
    pub fn is_rootless(&self) -> L::Mask {
        let [a, b, c] = self.f.map(L::abs);
        let [of_a, of_b, of_c] = self.off;
        let two = L::from_f32(2.0);
        let off = of_b * (two * b + of_b)
            + a * of_c
            + c * of_a
            + of_a * of_c
            + (b * b + a * c) * roundings(4.0)
            + tiny();
        self.squared.lt(-off)
    }

    /// Computes the roots, which are NaN where F has none; [`Roots::bound`] says where they are
    /// certain.
    #[inline(always)]
    pub fn roots(&self) -> Roots<'_, L> {
        let ([a, b, c], zero) = (self.f, L::zero());
        let squared = self.squared.max(zero);
        let steep = squared.sqrt();
        let q = -(b + L::select(b.lt(zero), -steep, steep));
        let (t0, t1) = (c / q, q / a);
        Roots {
            of: self,
            squared,
            flat: L::from_f32(1.0) / steep,
            q,
            t: [t0.min(t1), t0.max(t1)],
        }
    }
}

pub(in crate::geom) struct Roots<'a, L: Lanes> {
    of: &'a Quadratic<L>,
    /// b² − ac, and the inverse of its square root.
    squared: L,
    flat: L,
    /// −b ∓ √(b² − ac), the larger in magnitude.
    q: L,
    /// The roots, the lower one first.
    pub t: [L; 2],
}

impl<L: Lanes> Roots<'_, L> {
    /// Bounds the error of a root of at most this size, and returns the lanes in which the bound
    /// holds (Q2, docs/numerics/quadratics.md).
    #[inline(always)]
    pub fn bound(&self, size: L) -> (L, L::Mask) {
        let two = L::from_f32(2.0);
        let [of_a, of_b, of_c] = self.of.off;
        let q = self.q.abs();
        let off = (of_a * size + two * of_b) * size + of_c + size * q * roundings(6.5);
        let needed = (self.of.f[0].abs() * L::from_f32(8.0) + of_a * L::from_f32(50.0)) * off
            + q * q * roundings(50.0)
            + of_b * of_b * L::from_f32(20.5)
            + tiny();
        let infinity = L::splat(L::Scalar::INFINITY);
        let sure = needed.le(self.squared) & self.squared.lt(infinity);
        (two * off * self.flat + size * roundings(4.0) + tiny(), sure)
    }

    /// Returns a root and its bound, which is infinite where no bound holds.
    #[inline(always)]
    pub fn bounded(&self, t: L, size: L) -> Between<L> {
        let (wide, sure) = self.bound(size);
        let infinity = L::splat(L::Scalar::INFINITY);
        Between {
            least: L::select(sure, t - wide, -infinity),
            value: t,
            most: L::select(sure, t + wide, infinity),
        }
    }
}
