//! Horner's scheme with error bounds.
//!
//! Both bounds need |x| ≤ 2 and coefficients of at most 2^120, as
//! [`Polynomial::scaled_into`](super::polynomial::Polynomial) makes them. Then nothing
//! overflows, and underflow stays below [`FLOOR`].

use crate::math::lanes::{Lanes, Scalar};

/// Upper bound of the underflow of any sum formed here.
pub const FLOOR: f64 = 1.0e-270;

/// A value and a bound of its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approximate<L> {
    pub value: L,
    pub error: L,
}

impl<L: Lanes> Approximate<L> {
    /// Lanes in which the sign of the exact value is certain.
    #[inline(always)]
    pub fn certain(&self) -> L::Mask {
        self.value.abs().gt(self.error)
    }
}

/// Evaluates Σ cᵢ xⁱ with a running error bound, at any width and precision (lemma Z1,
/// docs/numerics/roots.md).
///
/// With y ← fl(fl(x y) + c) the product errs by δ |x y| and the sum by δ |y'|, |δ| ≤ u,
/// where y' is the new y. So the error e of y obeys e' ≤ |x| e + u |x y| + u |y'| (the
/// first u |x y| is relative to the computed product, which second order covers). With
/// m = e / u: m' = |x| m + |x y| + |y'|. This is summed without the products as 2 m − |y|:
/// algorithm 5.1 of Higham, *Accuracy and Stability of Numerical Algorithms*, halves it
/// to μ' = |x| μ + |y'|, e ≤ u (2 μ − |y|). μ itself rounds by less than one part in
/// (3 n + 3) u.
#[inline(always)]
pub fn horner<L: Lanes>(c: &[L], x: L) -> Approximate<L> {
    let n = c.len() - 1;
    let (mut y, size) = (c[n], x.abs());
    let mut mu = y.abs() * L::from_f32(0.5);
    for c in c[..n].iter().rev() {
        y = x * y + *c;
        mu = size * mu + y.abs();
    }
    // Lemma Z1, docs/numerics/roots.md.
    let u = L::Scalar::UNIT_ROUNDOFF.to_f64();
    let bound = 2.0 * u * (1.0 + 4.0 * (n as f64 + 1.0) * u);
    let floor = L::Scalar::MIN_POSITIVE.to_f64().max(FLOOR);
    Approximate {
        value: y,
        error: mu * L::from_f64(bound) + L::from_f64(floor),
    }
}

/// Evaluates the derivative Σ i cᵢ x^(i−1), without an error bound.
#[inline(always)]
pub fn derivative<L: Lanes>(c: &[L], x: L) -> L {
    let mut d = L::zero();
    for i in (1..c.len()).rev() {
        d = x * d + c[i] * L::from_f32(i as f32);
    }
    d
}

/// A polynomial's value, derivative and magnitude at a point x.
#[derive(Clone, Copy, Debug)]
pub struct Local<L> {
    /// p(x) is high + low, to within `error`.
    pub high: L,
    pub low: L,
    pub error: L,
    /// p'(x), rounded, without an error bound.
    pub slope: L,
    /// Σ |cᵢ| |x|ⁱ, rounded.
    pub size: L,
}

/// Evaluates p(x) as if in twice the precision, and p'(x): the compensated Horner scheme
/// of Graillat, Langlois and Louvet (2009). Lemma Z2, docs/numerics/roots.md.
///
/// Each product and each sum is kept with its error (Dekker, Knuth): x y = q + π and
/// q + c = y' + σ, exactly. Then p(x) = y₀ + Σ (πᵢ + σᵢ) xⁱ. That sum, `low`, is formed in
/// plain f64: its 2n roundings, and that of each πᵢ + σᵢ, err by at most
/// (2n + 2) u Σ (|πᵢ| + |σᵢ|) |x|ⁱ; the bound takes 2n + 4.
#[inline(always)]
pub fn local<L: Lanes<Scalar = f64>>(c: &[L], x: L) -> Local<L> {
    let n = c.len() - 1;
    let zero = L::zero();
    let (mut high, mut low, mut errors) = (c[n], zero, zero);
    let (mut slope, mut size) = (zero, c[n].abs());
    let x_size = x.abs();
    for c in c[..n].iter().rev() {
        slope = x * slope + high;
        let product = x * high;
        let pi = x.product_error(high, product);
        let sum = product + *c;
        let sigma = sum_error(product, *c, sum);
        low = x * low + (pi + sigma);
        errors = x_size * errors + (pi.abs() + sigma.abs());
        size = x_size * size + c.abs();
        high = sum;
    }
    // Lemma Z2, docs/numerics/roots.md.
    let factor = (2.0 * n as f64 + 4.0) * f64::UNIT_ROUNDOFF * (1.0 + 1e-12);
    Local {
        high,
        low,
        error: errors * L::from_f64(factor) + L::from_f64(FLOOR),
        slope,
        size,
    }
}

/// Returns a + b − fl(a + b), exactly (Knuth).
#[inline(always)]
pub fn sum_error<L: Lanes<Scalar = f64>>(a: L, b: L, sum: L) -> L {
    let b_part = sum - a;
    (a - (sum - b_part)) + (b - b_part)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::{f32x8, f64x8};
    use num_bigint::BigInt;
    use proptest::prelude::*;

    /// Returns x · 2^4000.
    fn exact(x: f64) -> BigInt {
        let (m, power) = crate::math::int::decoded(x);
        let size = BigInt::from(m) << (4000 + power);
        if x < 0.0 { -size } else { size }
    }

    /// Returns p(x) · 2^4000 for numbers with few enough bits below the point.
    fn exact_value(c: &[f64], x: f64) -> BigInt {
        let x = exact(x);
        c.iter().rev().fold(BigInt::ZERO, |y, c| {
            let product: BigInt = &y * &x;
            (product >> 4000) + exact(*c)
        })
    }

    /// Whether |value − p(x)| ≤ error, up to a thousand units of the least bit.
    fn holds(c: &[f64], x: f64, parts: &[f64], error: f64) -> bool {
        let sum: BigInt = parts.iter().map(|x| exact(*x)).sum();
        let off = sum - exact_value(c, x);
        let off = if off < BigInt::ZERO { -off } else { off };
        off <= exact(error) + 1000
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            failure_persistence: None,
            ..ProptestConfig::with_cases(2_000)
        })]

        #[test]
        fn bounds_of_values_hold_and_widths_agree(
            mut c in prop::collection::vec(-1.0_f64..1.0, 1..30),
            x in -1.5_f64..1.5,
            touch in any::<bool>(),
        ) {
            if touch {
                // Moves a root next to x, so that only rounding errors remain.
                let rest = horner(&c, x).value;
                c[0] -= rest;
            }
            let value = horner(&c, x);
            prop_assert!(holds(&c, x, &[value.value], value.error));
            let here = local(&c, x);
            prop_assert!(holds(&c, x, &[here.high, here.low], here.error));
            prop_assert_eq!(here.high, value.value);
            // The compensated scheme works in twice the precision.
            let u = f64::UNIT_ROUNDOFF * c.len() as f64;
            prop_assert!(here.error <= 8.1 * u * u * here.size + 1e-200);
            let wide: Vec<f64x8> = c.iter().map(|c| f64x8::splat(*c)).collect();
            let lanes = horner(&wide, f64x8::splat(x));
            prop_assert_eq!(lanes.value.lane(5), value.value);
            prop_assert_eq!(lanes.error.lane(5), value.error);
            let lanes = local(&wide, f64x8::splat(x));
            prop_assert_eq!(lanes.low.lane(3), here.low);
            prop_assert_eq!(lanes.error.lane(3), here.error);
            // In f32 the rounded inputs are the exact ones.
            let narrow: Vec<f32> = c.iter().map(|c| *c as f32).collect();
            let back: Vec<f64> = narrow.iter().map(|c| f64::from(*c)).collect();
            let value = horner(&narrow, x as f32);
            let x = f64::from(x as f32);
            prop_assert!(holds(&back, x, &[value.value.into()], value.error.into()));
            let wide: Vec<f32x8> = narrow.iter().map(|c| f32x8::splat(*c)).collect();
            let lanes = horner(&wide, f32x8::splat(x as f32));
            prop_assert_eq!(lanes.value.lane(1), value.value);
        }
    }

    #[test]
    fn derivatives() {
        assert_eq!(derivative(&[5.0, 3.0, 2.0, 1.0], 2.0), 3.0 + 8.0 + 12.0);
        assert_eq!(derivative(&[5.0], 2.0), 0.0);
        assert_eq!(local(&[5.0, 3.0, 2.0, 1.0], 2.0).slope, 23.0);
    }
}
