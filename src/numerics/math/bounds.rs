//! f64 numbers with running error bounds, and the distances at which rays leave surfaces.
//!
//! Bounds are forward: they follow from the magnitudes of the inputs by counting
//! roundings (Higham, *Accuracy and Stability of Numerical Algorithms*, chapter 3).
//! Derivations: lemmas D1 and D2 in docs/numerics/exact.md, L4 to L8 in
//! docs/numerics/leaving.md.

use super::number::Number;
use std::cmp::Ordering;

/// Unit roundoff of f64, v = 2⁻⁵³.
pub const UNIT: f64 = f64::EPSILON / 2.0;

/// Distance from a surface at which a ray that leaves it starts, in roundings of the
/// largest coordinate that made the point. A transform of the ray, the point itself, and
/// the new ray's own transform and test take about a dozen roundings each. Lemma L4,
/// docs/numerics/leaving.md.
pub const LEAVING: f64 = 64.0;

/// Factor on [`LEAVING`] for curved operands of CSG solids. Kernels know roots of
/// quadratics to some 150 roundings of the operand's extent, and must be certain that the
/// surface which the ray leaves lies behind it. Lemma L5, docs/numerics/leaving.md.
pub const LEAVING_CURVED: f64 = 4.0;

/// Upper limit of the starting distance from a polynomial surface, relative to the
/// shape's size and the point's coordinates. The distance is the error bound of the
/// polynomial's value over its slope, which has no limit where the slope vanishes: near a
/// node, or on the square of a polynomial. Lemma L7, docs/numerics/leaving.md.
pub const LEAVING_SLOPELESS: f64 = 1.0 / 1024.0;

/// Distance before a point without slope at which its normal is computed, relative to the
/// shape's extent. At this distance the gradient of a square is some 10⁸ times its error
/// at the zero, and most surfaces' normals have turned by less than a thousandth of a
/// radian. Lemma L8, docs/numerics/leaving.md.
pub const SLOPELESS: f64 = 1.0 / 4096.0;

/// End of shadow rays to a light at a point, as a fraction of the way to it: the last t of
/// f32 before the light itself, whose own place is no occluder. Lemma L6,
/// docs/numerics/leaving.md.
pub const LIGHT_END: f32 = 1.0 - 0.5 * f32::EPSILON;

/// An error-bounded number: the exact number lies within `value ± error`. If either is
/// NaN or infinite, nothing is known about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorBounded {
    pub value: f64,
    pub error: f64,
}

impl ErrorBounded {
    #[inline(always)]
    pub fn exact(value: f64) -> ErrorBounded {
        ErrorBounded { value, error: 0.0 }
    }

    /// Returns the sign of the exact number where it is certain; never `Equal`.
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

    /// Returns the order of two exact numbers where it is certain. Rounding is monotone,
    /// so sums that differ after rounding differ before it.
    #[inline(always)]
    pub fn order(&self, other: &ErrorBounded) -> Option<Ordering> {
        if self.value + self.error < other.value - other.error {
            Some(Ordering::Less)
        } else if self.value - self.error > other.value + other.error {
            Some(Ordering::Greater)
        } else {
            None
        }
    }
}

/// Factor that covers the few roundings of a bound itself. Lemma D1,
/// docs/numerics/exact.md.
pub(super) const SPARE: f64 = 1.0 + 16.0 * UNIT;

/// Addend that covers the underflow of products in one operation, 2⁻⁹⁰⁰. Far above the least
/// normal number, because it is multiplied further wherever a coordinate is 0, and processors
/// take a hundred times longer over denormal numbers. Lemma D1, docs/numerics/exact.md.
pub(super) const TINY: f64 = f64::from_bits((1023 - 900) << 52);

/// Running error analysis (Higham, section 3.3): each operation adds its own rounding to
/// the error that its operands carry. Lemma D1, docs/numerics/exact.md.
impl Number for ErrorBounded {
    type Space = ();

    #[inline(always)]
    fn of(_: (), value: f64) -> ErrorBounded {
        ErrorBounded::exact(value)
    }

    #[inline(always)]
    fn plus(&self, other: &ErrorBounded) -> ErrorBounded {
        ErrorBounded::rounded(self.value + other.value, self.error + other.error)
    }

    #[inline(always)]
    fn minus(&self, other: &ErrorBounded) -> ErrorBounded {
        ErrorBounded::rounded(self.value - other.value, self.error + other.error)
    }

    #[inline(always)]
    fn times(&self, other: &ErrorBounded) -> ErrorBounded {
        let (x, y) = (self.value, other.value);
        let carried = x.abs() * other.error + self.error * (y.abs() + other.error);
        ErrorBounded::rounded(x * y, carried)
    }

    #[inline(always)]
    fn sign(&self) -> Option<Ordering> {
        ErrorBounded::sign(self)
    }

    /// Computes o + s·d − c as if in twice the precision: the rounding errors of each
    /// operation are computed (Knuth's sum, Veltkamp's and Dekker's product), and only
    /// their sum is rounded. Lemma D2, docs/numerics/exact.md: the error is v of the
    /// result and 4v of the sum of those errors' magnitudes.
    #[inline(always)]
    fn displaced(_: (), o: f64, s: f64, d: f64, c: f64) -> ErrorBounded {
        let (from, low) = sum(o, -c);
        let (step, step_low) = product(s, d);
        let (all, all_low) = sum(from, step);
        let lows = low + step_low + all_low;
        let size = low.abs() + step_low.abs() + all_low.abs();
        ErrorBounded::rounded(all + lows, size * (4.0 * UNIT))
    }
}

impl ErrorBounded {
    /// Makes a result that is rounded once and carries the error `carried` from its
    /// operands.
    #[inline(always)]
    fn rounded(value: f64, carried: f64) -> ErrorBounded {
        let error = (carried + value.abs() * UNIT) * SPARE + TINY;
        ErrorBounded { value, error }
    }

    /// Negates, exactly.
    #[inline(always)]
    pub fn negated(&self) -> ErrorBounded {
        let value = -self.value;
        ErrorBounded { value, ..*self }
    }

    /// Divides. |x/y − x̂/ŷ| ≤ (|x − x̂| + |x̂/ŷ| |y − ŷ|) / |y|; the error is infinite
    /// if `other` may be 0. Lemma D1, docs/numerics/exact.md.
    #[inline(always)]
    pub fn over(&self, other: &ErrorBounded) -> ErrorBounded {
        let value = self.value / other.value;
        // A lower bound of |y|.
        let least = other.value.abs() - other.error;
        let error = (self.error + (value.abs() + TINY) * other.error + TINY) / least;
        if least > 0.0 {
            ErrorBounded::rounded(value, error * SPARE)
        } else {
            let error = f64::INFINITY;
            ErrorBounded { value, error }
        }
    }

    /// Takes the square root of a number that is known to be ≥ 0, even if `value` is
    /// negative. With x̂ ≥ 0, |√x − √x̂| = |x − x̂| / (√x + √x̂) ≤ √|x − x̂|. Lemma D1,
    /// docs/numerics/exact.md.
    #[inline(always)]
    pub fn sqrt(&self) -> ErrorBounded {
        let value = if self.value > 0.0 {
            self.value.sqrt()
        } else {
            self.value.abs() * 0.0
        };
        let (steep, near) = (self.error / value, self.error.sqrt());
        // `near` is also chosen if `steep` is NaN.
        let carried = if steep < near { steep } else { near };
        ErrorBounded::rounded(value, carried * SPARE)
    }
}

/// Returns x + y, rounded, and its exact rounding error (Knuth).
#[inline(always)]
pub(super) fn sum(x: f64, y: f64) -> (f64, f64) {
    let sum = x + y;
    let other = sum - x;
    (sum, (x - (sum - other)) + (y - other))
}

/// Returns x · y, rounded, and its exact rounding error, unless a part underflows or
/// overflows (Veltkamp, Dekker).
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
    use crate::math::ExactSign;
    use crate::math::dyadic::{Dyadic, exactly};
    use proptest::prelude::*;

    /// Whether the exact number lies within the bounds.
    fn holds(bounded: &ErrorBounded, exact: &Dyadic) -> bool {
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

    /// Generates four numbers of similar size, of any size, or so that o + s·d cancels c.
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
        // A number that found no room in the space counts as 0.
        let sign = |x: Dyadic| x.sign().map_or(0, |s| s as i32);
        let bounded = formulas::<ErrorBounded>((), numbers);
        let exact = formulas::<Dyadic>(space, numbers);
        for (i, (bounded, exact)) in bounded.iter().zip(&exact).enumerate() {
            assert!(
                holds(bounded, exact),
                "formula {i} of {numbers:?}: {bounded:?}"
            );
        }
        for i in 0..6 {
            let (x, y) = (&exact[i], &exact[(i + 1) % 6]);
            // v ± e encloses x/y, so y(v ± e) encloses x.
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

    /// A point of a distant ray near a centre is known to within a few roundings.
    #[test]
    fn far_points_are_known_well() {
        let near = <ErrorBounded as Number>::displaced((), 1e9, -1.0 / 3.0, 3e9, 0.1);
        assert!(near.error < 1e-15 * near.value.abs().max(1e-6), "{near:?}");
    }
}
