//! Numbers with a bound on their error, and what the bounds are made of.
//!
//! A bound is forward: it follows from the inputs' magnitudes by counting
//! roundings (Higham, *Accuracy and Stability*, chapter 3). docs/NUMERICS.md
//! derives each.

use super::number::Number;
use std::cmp::Ordering;

/// Half a unit in the last place of 1.
pub const UNIT: f64 = f64::EPSILON / 2.0;

/// How far from a surface a ray that leaves it starts, in roundings of the largest
/// coordinate that made the point: a transform of the ray, the point itself, and
/// the new ray's own transform and test take about a dozen each.
pub const LEAVING: f64 = 64.0;

/// So many times as far it starts from a curved operand of a combination: kernels
/// know roots of quadratics to some 150 roundings of its extent, and shall know that
/// the surface which the ray leaves lies behind it.
pub const LEAVING_CURVED: f64 = 4.0;

/// No farther from a polynomial's surface for the sake of its values' roundings, in units
/// of its own size and of the point's coordinates: where it has hardly a slope, as next to
/// a node, or of the square of another, their bound over it is of any size.
pub const LEAVING_SLOPELESS: f64 = 1.0 / 1024.0;

/// How far before a point without any slope its normal is worked out, in units of the
/// shape's extent: there the gradient of a square is some 10^8 times what it is off by at
/// its zero, and the direction of most surfaces less than a thousandth of a radian another.
pub const SLOPELESS: f64 = 1.0 / 4096.0;

/// Where shadow rays to a light at a point end, in units of the way to it: their
/// direction is rounded to f32, so that their end lies off the light by as much as
/// u of the way on each axis, and what is as near to the light as that is not
/// between.
pub const LIGHT_END: f32 = 1.0 - 4.0 * f32::EPSILON;

/// The exact number lies within `value ± error`. NaN and infinity in either
/// mean that nothing is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounded {
    pub value: f64,
    pub error: f64,
}

impl Bounded {
    #[inline(always)]
    pub fn exact(value: f64) -> Bounded {
        Bounded { value, error: 0.0 }
    }

    /// Against zero, where certain. Never `Equal`.
    #[inline(always)]
    pub fn sign(&self) -> Option<Ordering> {
        if self.value > self.error {
            Some(Ordering::Greater)
        } else if self.value < -self.error {
            Some(Ordering::Less)
        } else {
            None
        }
    }

    /// Where certain. Rounding is monotone, so sums that differ once rounded
    /// differ.
    #[inline(always)]
    pub fn order(&self, other: &Bounded) -> Option<Ordering> {
        if self.value + self.error < other.value - other.error {
            Some(Ordering::Less)
        } else if self.value - self.error > other.value + other.error {
            Some(Ordering::Greater)
        } else {
            None
        }
    }
}

/// More than what the few roundings of a bound itself take from it, relatively.
pub(super) const SPARE: f64 = 1.0 + 16.0 * UNIT;

/// Far more than what underflow takes from the products in a step.
pub(super) const TINY: f64 = f64::MIN_POSITIVE;

/// Running error analysis: each operation adds its own rounding to what its
/// operands bring along (Higham, section 3.3).
impl Number for Bounded {
    type Space = ();

    #[inline(always)]
    fn of(_: (), value: f64) -> Bounded {
        Bounded::exact(value)
    }

    #[inline(always)]
    fn plus(&self, other: &Bounded) -> Bounded {
        Bounded::rounded(self.value + other.value, self.error + other.error)
    }

    #[inline(always)]
    fn minus(&self, other: &Bounded) -> Bounded {
        Bounded::rounded(self.value - other.value, self.error + other.error)
    }

    #[inline(always)]
    fn times(&self, other: &Bounded) -> Bounded {
        let (x, y) = (self.value, other.value);
        let carried = x.abs() * other.error + self.error * (y.abs() + other.error);
        Bounded::rounded(x * y, carried)
    }

    #[inline(always)]
    fn sign(&self) -> Option<Ordering> {
        Bounded::sign(self)
    }

    /// As if in twice the precision: each operation's error is computed (Knuth's
    /// sum, Veltkamp's and Dekker's product), and only these are rounded.
    #[inline(always)]
    fn displaced(_: (), o: f64, s: f64, d: f64, c: f64) -> Bounded {
        let (from, low) = sum(o, -c);
        let (step, step_low) = product(s, d);
        let (all, all_low) = sum(from, step);
        let lows = low + step_low + all_low;
        let size = low.abs() + step_low.abs() + all_low.abs();
        Bounded::rounded(all + lows, size * (4.0 * UNIT))
    }
}

impl Bounded {
    /// A result that carries this much of its operands' errors, and is rounded
    /// once itself.
    #[inline(always)]
    fn rounded(value: f64, carried: f64) -> Bounded {
        let error = (carried + value.abs() * UNIT) * SPARE + TINY;
        Bounded { value, error }
    }

    #[inline(always)]
    pub fn negated(&self) -> Bounded {
        let value = -self.value;
        Bounded { value, ..*self }
    }

    /// |x/y − x̂/ŷ| ≤ (|x − x̂| + |x̂/ŷ| |y − ŷ|) / |y|.
    #[inline(always)]
    pub fn over(&self, other: &Bounded) -> Bounded {
        let value = self.value / other.value;
        // Not above |y|.
        let least = other.value.abs() - other.error;
        let error = (self.error + (value.abs() + TINY) * other.error + TINY) / least;
        if least > 0.0 {
            Bounded::rounded(value, error * SPARE)
        } else {
            let error = f64::INFINITY;
            Bounded { value, error }
        }
    }

    /// Of a number that is not negative, whatever f64 says of it. With x̂ ≥ 0,
    /// |√x − √x̂| = |x − x̂| / (√x + √x̂), and no more than √|x − x̂|.
    #[inline(always)]
    pub fn sqrt(&self) -> Bounded {
        let value = if self.value > 0.0 {
            self.value.sqrt()
        } else {
            self.value.abs() * 0.0
        };
        let (steep, near) = (self.error / value, self.error.sqrt());
        // Not below where this is NaN.
        let carried = if steep < near { steep } else { near };
        Bounded::rounded(value, carried * SPARE)
    }
}

/// x + y, rounded, and what that leaves.
#[inline(always)]
pub(super) fn sum(x: f64, y: f64) -> (f64, f64) {
    let sum = x + y;
    let other = sum - x;
    (sum, (x - (sum - other)) + (y - other))
}

/// x · y, rounded, and what that leaves; but for underflow.
#[inline(always)]
pub(super) fn product(x: f64, y: f64) -> (f64, f64) {
    let halves = |x: f64| {
        let big = x * 134_217_729.0;
        let high = big - (big - x);
        (high, x - high)
    };
    let product = x * y;
    let ((x, x_low), (y, y_low)) = (halves(x), halves(y));
    let rest = ((x * y - product) + x * y_low + x_low * y) + x_low * y_low;
    (product, rest)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::math::Sharp;
    use crate::math::dyadic::{Dyadic, exactly};
    use proptest::prelude::*;

    /// Whether the exact number lies within the bounds.
    fn holds(bounded: &Bounded, exact: &Dyadic) -> bool {
        if !bounded.value.is_finite() || !bounded.error.is_finite() {
            return true;
        }
        let of = |x| Dyadic::of(exact.space(), x);
        let (value, error) = (of(bounded.value), of(bounded.error));
        let off = exact.minus(&value);
        let beyond = off.minus(&error).sign();
        let below = off.plus(&error).sign();
        beyond.is_none_or(|s| s.is_le()) && below.is_none_or(|s| s.is_ge())
    }

    pub fn formulas<N: Number>(space: N::Space, [o, s, d, c]: [f64; 4]) -> [N; 6] {
        let [p, q, r] = [o, s, d].map(|x| N::of(space, x));
        let near = N::displaced(space, o, s, d, c);
        [
            p.plus(&q),
            p.minus(&q).plus(&r),
            p.times(&q),
            p.times(&q).minus(&r.squared()),
            near,
            near.times(&p.plus(&r)).doubled(),
        ]
    }

    /// Of like size, of any size, and so that they cancel.
    pub fn numbers() -> impl Strategy<Value = [f64; 4]> {
        let any = any::<[f64; 4]>().prop_filter("finite", |x| x.iter().all(|x| x.is_finite()));
        let like = [-2.0..2.0, -2.0..2.0, -2.0..2.0, -2.0..2.0];
        let cancel = [1e8..1e9, -2.0..2.0, 1e-3..1.0, 0.0..1.0].prop_map(|[o, s, d, c]| {
            let c = o + s * d * (1.0 + c * 1e-13);
            [o, s, d, c]
        });
        prop_oneof![any, like, cancel]
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            failure_persistence: None,
            ..ProptestConfig::with_cases(50_000)
        })]

        #[test]
        fn running_bounds_hold(numbers in numbers()) {
            exactly(&|space| {
                check(space, numbers);
                Some(())
            });
        }
    }

    fn check<'a>(space: &'a crate::math::dyadic::Space<'a>, numbers: [f64; 4]) {
        let of = |x| Dyadic::of(space, x);
        // The small space is left early, and may not be enough.
        let sign = |x: Dyadic| x.sign().map_or(0, |s| s as i32);
        let bounded = formulas::<Bounded>((), numbers);
        let exact = formulas::<Dyadic>(space, numbers);
        for (i, (bounded, exact)) in bounded.iter().zip(&exact).enumerate() {
            assert!(
                holds(bounded, exact),
                "formula {i} of {numbers:?}: {bounded:?}"
            );
        }
        for i in 0..6 {
            let (x, y) = (&exact[i], &exact[(i + 1) % 6]);
            // v ± e encloses, so y times it encloses x.
            let quotient = bounded[i].over(&bounded[(i + 1) % 6]);
            if quotient.value.is_finite() && quotient.error.is_finite() {
                let down = sign(*y) < 0;
                let (x, y) = (x.negated_if(down), y.negated_if(down));
                let (v, e) = (of(quotient.value), of(quotient.error));
                assert!(sign(v.plus(&e).times(&y).minus(&x)) >= 0);
                assert!(sign(v.minus(&e).times(&y).minus(&x)) <= 0);
            }
            let root = bounded[i].sqrt();
            assert!(!(root.error < 0.0), "{root:?}");
            if sign(*x) >= 0 && root.error.is_finite() {
                let (v, e) = (of(root.value), of(root.error));
                let (above, below) = (v.plus(&e), v.minus(&e));
                assert!(sign(above.squared().minus(x)) >= 0);
                assert!(sign(below) < 0 || sign(below.squared().minus(x)) <= 0);
            }
        }
    }

    /// A far ray's point near a centre, to the last bit but a few.
    #[test]
    fn far_points_are_known_well() {
        let near = <Bounded as Number>::displaced((), 1e9, -1.0 / 3.0, 3e9, 0.1);
        assert!(near.error < 1e-15 * near.value.abs().max(1e-6), "{near:?}");
    }
}
