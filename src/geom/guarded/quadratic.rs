//! Roots of F(t) = a t² + 2b t + c, of coefficients known to so much each.
//!
//! The exact F lies within ε(t) = αt² + 2β|t| + γ of the computed one. Where the
//! computed F is steep enough beside a root, the exact one changes its sign next to
//! it. docs/NUMERICS.md ("Cone, cylinder") has the proof.

use super::{roundings, tiny};
use crate::math::lanes::{Lanes, Scalar};

pub(super) struct Quadratic<L: Lanes> {
    pub f: [L; 3],
    /// α, β and γ.
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

    /// Lanes in which F certainly has no root; and so has a sign, that of a.
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

    /// Both roots, lower first, and a bound for both; and the lanes in which it holds.
    #[inline(always)]
    pub fn roots(&self) -> ([L; 2], L, L::Mask) {
        let (zero, two) = (L::zero(), L::from_f32(2.0));
        let ([a, b, c], [of_a, of_b, of_c]) = (self.f, self.off);
        let squared = self.squared.max(zero);
        let steep = squared.sqrt();
        // −b ∓ the root, the larger in magnitude.
        let q = -(b + L::select(b.lt(zero), -steep, steep));
        let (t0, t1) = (c / q, q / a);
        let (size, q) = (t0.abs().max(t1.abs()), q.abs());
        let off = (of_a * size + two * of_b) * size + of_c + size * q * roundings(6.5);
        let needed = (a.abs() * L::from_f32(8.0) + of_a * L::from_f32(50.0)) * off
            + q * q * roundings(50.0)
            + of_b * of_b * L::from_f32(20.5)
            + tiny();
        let wide = two * off / steep + size * roundings(4.0) + tiny();
        let infinity = L::splat(L::Scalar::INFINITY);
        let sure = needed.lt(squared) & (size + wide).lt(infinity);
        ([t0.min(t1), t0.max(t1)], wide, sure)
    }
}
