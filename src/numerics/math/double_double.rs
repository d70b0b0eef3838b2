//! Double-double numbers with an error bound. They decide most questions that f64 leaves
//! open, in a third of the time of exact integers.
//!
//! A number is a sum of two f64 that do not overlap (Dekker 1971). A sum or a product
//! loses about v² of its result, v the unit roundoff [`UNIT`]. As in
//! [`ErrorBounded`](super::bounds::ErrorBounded), each operation adds its loss to the errors of its
//! operands. The loss of a sum is computed exactly: if it is 0, so is its bound. So rays
//! that run along faces, or start on them, are often decided without exact integers.
//! Lemmas D5 and D6, docs/numerics/exact.md.

use super::bounds::{SPARE, TINY, UNIT, product as split_product, sum};
use super::number::{ExactSign, Number};
use std::cmp::Ordering;

/// A double-double number: the exact number lies within `high + low ± error`, and `high`
/// is `high + low`, rounded. If any of them is NaN or infinite, at most the sign is
/// known, by [`Number::sign`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DoubleDouble {
    high: f64,
    low: f64,
    error: f64,
}

/// Error of a product relative to its result, where each low is at most v of its high: v²
/// for the product of the lows, v² for each of the two products with one low, 2v² for
/// their sum, and 3v² for adding the rounding error of the product of the highs. Lemma
/// D5, docs/numerics/exact.md.
const PRODUCT: f64 = 8.0 * UNIT * UNIT;

/// Magnitude above which no part of a product underflows. Lemma D5,
/// docs/numerics/exact.md.
const SAFE: f64 = f64::MIN_POSITIVE / (UNIT * UNIT * UNIT);

/// Returns x · y, rounded, and its exact rounding error. With and without FMA the results
/// differ only if a part leaves the format, and then the bound says so or integers
/// decide. [`ErrorBounded`](super::bounds::ErrorBounded), whose values are reported, always takes
/// the way without FMA.
#[inline(always)]
fn product(x: f64, y: f64) -> (f64, f64) {
    if cfg!(target_feature = "fma") {
        let product = x * y;
        (product, x.mul_add(y, -product))
    } else {
        split_product(x, y)
    }
}

impl DoubleDouble {
    #[inline(always)]
    fn exact((high, low): (f64, f64)) -> DoubleDouble {
        let error = 0.0;
        DoubleDouble { high, low, error }
    }

    /// Returns the number, rounded to f64.
    #[inline(always)]
    pub fn value(&self) -> f64 {
        self.high
    }

    #[inline(always)]
    fn is_zero(&self) -> bool {
        self.high == 0.0 && self.error == 0.0
    }
}

impl Number for DoubleDouble {
    type Space = ();

    #[inline(always)]
    fn of(_: (), x: f64) -> DoubleDouble {
        DoubleDouble::exact((x, 0.0))
    }

    #[inline(always)]
    fn plus(&self, other: &DoubleDouble) -> DoubleDouble {
        let (s, s_low) = sum(self.high, other.high);
        let (t, t_low) = sum(self.low, other.low);
        let (middle, lost) = sum(s_low, t);
        let (s, rest) = sum(s, middle);
        let (rest, also) = sum(rest, t_low);
        let (high, low) = sum(s, rest);
        // Sums lose nothing to underflow. Lemma D5, docs/numerics/exact.md.
        let carried = self.error + other.error;
        let error = (carried + (lost.abs() + also.abs())) * SPARE;
        DoubleDouble { high, low, error }
    }

    #[inline(always)]
    fn minus(&self, other: &DoubleDouble) -> DoubleDouble {
        self.plus(&other.negated_if(true))
    }

    #[inline(always)]
    fn times(&self, other: &DoubleDouble) -> DoubleDouble {
        let (x, y) = (self, other);
        let (first, rest) = product(x.high, y.high);
        let (high, low) = sum(first, rest + (x.high * y.low + x.low * y.high));
        let whole = x.low == 0.0 && y.low == 0.0 && x.error == 0.0 && y.error == 0.0;
        let error = if x.is_zero() || y.is_zero() || whole && high.abs() > SAFE {
            0.0
        } else {
            // Lemma D5, docs/numerics/exact.md.
            let carried = x.high.abs() * y.error + x.error * (y.high.abs() + y.error);
            (carried + high.abs() * PRODUCT) * SPARE + TINY
        };
        DoubleDouble { high, low, error }
    }

    #[inline(always)]
    fn doubled(&self) -> DoubleDouble {
        DoubleDouble {
            high: self.high * 2.0,
            low: self.low * 2.0,
            error: self.error * 2.0,
        }
    }

    /// Returns the sign where it is certain; `Equal` only if no operation lost anything.
    #[inline(always)]
    fn sign(&self) -> Option<Ordering> {
        let DoubleDouble { high, error, .. } = *self;
        if high > error {
            Some(Ordering::Greater)
        } else if high < -error {
            Some(Ordering::Less)
        } else {
            self.is_zero().then_some(Ordering::Equal)
        }
    }

    #[inline(always)]
    fn displaced(_: (), o: f64, s: f64, d: f64, c: f64) -> DoubleDouble {
        let from = DoubleDouble::exact(sum(o, -c));
        if s == 0.0 {
            return from;
        }
        from.plus(&DoubleDouble::of((), s).times(&DoubleDouble::of((), d)))
    }
}

impl ExactSign for DoubleDouble {
    #[inline(always)]
    fn scaled(_: (), m: u64, power: i32, negative: bool) -> DoubleDouble {
        if m == 0 {
            return DoubleDouble::exact((0.0, 0.0));
        }
        // Both parts must be normal numbers, and m may have 54 bits.
        let fits = m >> 54 == 0 && (-1000..900).contains(&power);
        let unit = if fits {
            f64::from_bits(((1023 + power) as u64) << 52)
        } else {
            f64::NAN
        };
        let last = m & 1;
        let parts = sum((m - last) as f64 * unit, last as f64 * unit);
        DoubleDouble::exact(parts).negated_if(negative)
    }

    #[inline(always)]
    fn negated_if(&self, negate: bool) -> DoubleDouble {
        let sign = if negate { -1.0 } else { 1.0 };
        DoubleDouble {
            high: self.high * sign,
            low: self.low * sign,
            error: self.error,
        }
    }

    #[inline(always)]
    fn briefly<T>(_: (), f: impl FnOnce() -> T) -> T {
        f()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::bounds::tests::{formulas, numbers};
    use crate::math::dyadic::{Dyadic, exactly};
    use crate::math::int::decoded;
    use proptest::prelude::*;

    /// Asserts that the exact number lies within the bounds, and that a certain sign is
    /// right.
    fn check(twice: &DoubleDouble, exact: &Dyadic) {
        let DoubleDouble { high, low, error } = *twice;
        if let Some(sign) = twice.sign() {
            assert!(exact.sign().is_none_or(|s| s == sign), "{twice:?}");
        }
        if ![high, low, error].iter().all(|x| x.is_finite()) {
            return;
        }
        assert_eq!(high + low, high);
        let of = |x| <Dyadic as Number>::of(exact.space(), x);
        let off = exact.minus(&of(high)).minus(&of(low));
        assert!(off.minus(&of(error)).sign().is_none_or(|s| s.is_le()));
        assert!(off.plus(&of(error)).sign().is_none_or(|s| s.is_ge()));
    }

    /// Nearly twice as many digits are known as in f64, also after cancellation; a
    /// difference of equal numbers that were rounded is not known to be 0.
    #[test]
    fn twice_the_digits_are_known() {
        let of = |x| DoubleDouble::of((), x);
        let third = of(1.0 / 3.0);
        let (square, other) = (third.squared(), of(1.0 / 3.0 + f64::EPSILON).squared());
        let off = other.minus(&square);
        assert!(off.error < 1e-31 && off.sign() == Some(Ordering::Greater));
        let cube = third.times(&square);
        assert_eq!(cube.minus(&cube).sign(), None);
        // Squares of f64 and sums of three numbers are exact in two f64.
        assert_eq!(square.minus(&square).sign(), Some(Ordering::Equal));
        let sum = square.plus(&of(1e-6)).minus(&square);
        assert_eq!(sum.minus(&of(1e-6)).sign(), Some(Ordering::Equal));
        assert_eq!(cube.times(&of(0.0)).sign(), Some(Ordering::Equal));
        let small = of(1e-200);
        assert_eq!(small.times(&small).sign(), None);
        assert_eq!(of(0.0).sign(), Some(Ordering::Equal));
        let near = DoubleDouble::displaced((), 1e9, 0.0, 1.0, 1e9);
        assert_eq!(near.sign(), Some(Ordering::Equal));
    }

    /// Numbers of 54 bits, which lie halfway between neighbours in f64, are exact unless
    /// they underflow.
    #[test]
    fn numbers_of_54_bits_have_a_place() {
        for x in [1.0, 1.0 / 3.0, 1e-280, 1e280, 3.0, f64::from_bits(7), 0.0] {
            let (m, power) = decoded(x);
            for (m, power) in [(m, power), (2 * m + 1, power - 1)] {
                let twice = DoubleDouble::scaled((), m, power, true);
                exactly(&|space| {
                    check(&twice, &Dyadic::scaled(space, m, power, true));
                    Some(())
                });
                assert!(twice.sign() == Some(Ordering::Less) || x < 1e-300, "{x}");
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            failure_persistence: None,
            ..ProptestConfig::with_cases(50_000)
        })]

        #[test]
        fn products_split_as_they_are_fused(x in -1e150..1e150, y in -1e-100..1e100) {
            let product = x * y;
            prop_assert_eq!(split_product(x, y), (product, x.mul_add(y, -product)));
        }

        #[test]
        fn running_bounds_hold(numbers in numbers()) {
            let twice = formulas::<DoubleDouble>((), numbers);
            exactly(&|space| {
                for (twice, exact) in twice.iter().zip(&formulas::<Dyadic>(space, numbers)) {
                    check(twice, exact);
                }
                Some(())
            });
        }
    }
}
