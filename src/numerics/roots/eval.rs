//! Horner's scheme, with what its rounding may amount to.
//!
//! Both bounds need |x| ≤ 2 and coefficients of at most 2^120, as those that
//! [`Polynomial::scaled_into`](super::polynomial::Polynomial) gives: then nothing
//! overflows, and what underflows stays below [`FLOOR`].

use crate::math::lanes::{Lanes, Scalar};

/// More than the underflow of any sum that is formed here.
pub const FLOOR: f64 = 1.0e-270;

/// A number, and a bound of its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approximate<L> {
    pub value: L,
    pub error: L,
}

impl<L: Lanes> Approximate<L> {
    /// Where the sign is sure.
    #[inline(always)]
    pub fn certain(&self) -> L::Mask {
        self.value.abs().gt(self.error)
    }
}

/// Σ cᵢ xⁱ with a running bound of its error, at any width and precision.
///
/// With y ← fl(fl(x y) + c) the product errs by δ |x y|, the sum by δ |y'|, both
/// |δ| ≤ u, with y' the new y. So the error e of y obeys e' ≤ |x| e + u |x y| +
/// u |y'| (the first u|xy| against the computed product, which second order
/// covers), and with m = e / u: m' = |x| m + |x y| + |y'|. That is summed without
/// the products, as 2 m − |y|: Higham, Accuracy and Stability of Numerical
/// Algorithms, algorithm 5.1, halves it to μ' = |x| μ + |y'|, e ≤ u (2 μ − |y|).
/// μ itself rounds by less than one part in (3 n + 3) u.
#[inline(always)]
pub fn horner<L: Lanes>(c: &[L], x: L) -> Approximate<L> {
    let n = c.len() - 1;
    let (mut y, size) = (c[n], x.abs());
    let mut mu = y.abs() * L::from_f32(0.5);
    for c in c[..n].iter().rev() {
        y = x * y + *c;
        mu = size * mu + y.abs();
    }
    let u = L::Scalar::UNIT_ROUNDOFF.to_f64();
    let bound = 2.0 * u * (1.0 + 4.0 * (n as f64 + 1.0) * u);
    let floor = L::Scalar::MIN_POSITIVE.to_f64().max(FLOOR);
    Approximate {
        value: y,
        error: mu * L::from_f64(bound) + L::from_f64(floor),
    }
}

/// Σ i cᵢ x^(i−1), as it rounds.
#[inline(always)]
pub fn derivative<L: Lanes>(c: &[L], x: L) -> L {
    let mut d = L::zero();
    for i in (1..c.len()).rev() {
        d = x * d + c[i] * L::from_f32(i as f32);
    }
    d
}

/// What is known of a polynomial near a point.
#[derive(Clone, Copy, Debug)]
pub struct Local<L> {
    /// p(x) = high + low, to within `error`.
    pub high: L,
    pub low: L,
    pub error: L,
    /// p'(x), plainly rounded.
    pub slope: L,
    /// Σ |cᵢ| |x|ⁱ, rounded.
    pub size: L,
}

/// p(x) as if in twice the precision: the compensated Horner scheme of Graillat,
/// Langlois and Louvet (2009), with its derivative beside it.
///
/// Each product and each sum is kept with its error (Dekker, Knuth): x y = q + π,
/// q + c = y' + σ, exactly. Then p(x) = y₀ + Σ (πᵢ + σᵢ) xⁱ, and that sum, called
/// `low`, is formed plainly: its 2n roundings, and that of each πᵢ + σᵢ, err by at
/// most (2n + 2) u Σ (|πᵢ| + |σᵢ|) |x|ⁱ; the bound takes 2n + 4.
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
    let factor = (2.0 * n as f64 + 4.0) * f64::UNIT_ROUNDOFF * (1.0 + 1e-12);
    Local {
        high,
        low,
        error: errors * L::from_f64(factor) + L::from_f64(FLOOR),
        slope,
        size,
    }
}

/// a + b − fl(a + b) (Knuth).
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

    /// Times 2^4000.
    fn exact(x: f64) -> BigInt {
        let (m, power) = crate::math::int::decoded(x);
        let size = BigInt::from(m) << (4000 + power);
        if x < 0.0 { -size } else { size }
    }

    /// p(x) · 2^4000 of numbers with few enough bits below.
    fn exact_value(c: &[f64], x: f64) -> BigInt {
        let x = exact(x);
        c.iter().rev().fold(BigInt::ZERO, |y, c| {
            let product: BigInt = &y * &x;
            (product >> 4000) + exact(*c)
        })
    }

    /// |value − p(x)| ≤ error, and the larger of the two in units of the least bit.
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
                // A root at x, nearly: what remains is rounding.
                let rest = horner(&c, x).value;
                c[0] -= rest;
            }
            let value = horner(&c, x);
            prop_assert!(holds(&c, x, &[value.value], value.error));
            let here = local(&c, x);
            prop_assert!(holds(&c, x, &[here.high, here.low], here.error));
            prop_assert_eq!(here.high, value.value);
            // Twice the precision.
            let u = f64::UNIT_ROUNDOFF * c.len() as f64;
            prop_assert!(here.error <= 8.1 * u * u * here.size + 1e-200);
            let wide: Vec<f64x8> = c.iter().map(|c| f64x8::splat(*c)).collect();
            let lanes = horner(&wide, f64x8::splat(x));
            prop_assert_eq!(lanes.value.lane(5), value.value);
            prop_assert_eq!(lanes.error.lane(5), value.error);
            let lanes = local(&wide, f64x8::splat(x));
            prop_assert_eq!(lanes.low.lane(3), here.low);
            prop_assert_eq!(lanes.error.lane(3), here.error);
            // f32, whose inputs are other numbers.
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
