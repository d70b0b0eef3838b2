//! f64 numbers with a running error bound (docs/numerics/oracle.md, O1).
//!
//! Running error analysis (Wilkinson; Higham, *Accuracy and Stability of Numerical
//! Algorithms*, 3.3): `value` is the textbook formula in plain f64. Each operation bounds
//! how far the value may lie from exact arithmetic on the same input: half a unit in the
//! last place of its own result, plus the errors that its operands bring.
//!
//! A sign is known when all numbers within the error have it. NaN and overflow leave every
//! sign undecided, and none wrong.

use super::dyadic::Dyadic;
use super::number::Number;
use super::root::Root;
use super::surd::Surd;
use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number within `value ± error`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approx {
    pub value: f64,
    pub error: f64,
}

/// The error value of a sign that the error bound leaves undecided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Undecided;

/// The unit roundoff v of f64, 2⁻⁵³.
const UNIT: f64 = f64::EPSILON / 2.0;
/// The least positive f64, 2⁻¹⁰⁷⁴: twice what a product can lose to underflow (O1).
const TINY: f64 = f64::from_bits(1);

impl Approx {
    /// Returns an f64 that is exact.
    pub fn exact(value: f64) -> Approx {
        Approx { value, error: 0.0 }
    }

    /// Builds the result of one rounded operation; `inherited` is the error that the
    /// operands bring. The factor of 16v covers the roundings of the bound itself (O1).
    fn rounded(value: f64, inherited: f64) -> Approx {
        let error = inherited + value.abs() * UNIT;
        Approx {
            value,
            error: error * (1.0 + 16.0 * UNIT),
        }
    }

    /// Returns a number not above the exact one.
    pub fn lo(self) -> f64 {
        if self.error == 0.0 {
            self.value
        } else {
            (self.value - self.error).next_down()
        }
    }

    /// Returns a number not below the exact one.
    pub fn hi(self) -> f64 {
        if self.error == 0.0 {
            self.value
        } else {
            (self.value + self.error).next_up()
        }
    }

    /// Says whether the sign is certain.
    fn is_signed(self) -> bool {
        self.value.abs() > self.error
    }

    fn is_exactly_zero(self) -> bool {
        self.value == 0.0 && self.error == 0.0
    }

    /// Returns the square root of a number that is known not to be negative, whatever its
    /// error bound says.
    pub fn sqrt(self) -> Approx {
        let root = f64::max(self.value, 0.0).sqrt();
        let inherited = if self.value > self.error {
            self.error / ((self.value - self.error).sqrt() + root)
        } else {
            (f64::max(self.value, 0.0) + self.error).sqrt()
        };
        Approx::rounded(root, inherited)
    }
}

impl Number for Approx {
    type Undecided = Undecided;

    fn from_f64(x: f64) -> Approx {
        Approx::exact(x)
    }

    fn plus(&self, other: &Approx) -> Approx {
        *self + *other
    }

    fn minus(&self, other: &Approx) -> Approx {
        *self - *other
    }

    fn times(&self, other: &Approx) -> Approx {
        *self * *other
    }

    fn sign(&self) -> Result<Ordering, Undecided> {
        if self.is_exactly_zero() {
            Ok(Ordering::Equal)
        } else if !self.is_signed() {
            Err(Undecided)
        } else if self.value > 0.0 {
            Ok(Ordering::Greater)
        } else {
            Ok(Ordering::Less)
        }
    }

    /// Always undecided: formulas that need exact numbers are evaluated exactly as a whole.
    fn exactly(&self) -> Result<Dyadic, Undecided> {
        Err(Undecided)
    }
}

impl Root<Approx> {
    /// Returns the root in f64 with its error bound.
    pub fn value(&self) -> Approx {
        let Root::Surd(Surd { p, q, r, sign }) = self else {
            // Algebraic roots are exact and are never found with bounded f64.
            let (value, error) = (f64::NAN, f64::INFINITY);
            return Approx { value, error };
        };
        let root = if *sign > 0.0 { q.sqrt() } else { -q.sqrt() };
        (*p + root) / *r
    }
}

impl Neg for Approx {
    type Output = Approx;
    fn neg(self) -> Approx {
        Approx {
            value: -self.value,
            error: self.error,
        }
    }
}

impl Add for Approx {
    type Output = Approx;
    fn add(self, o: Approx) -> Approx {
        // Adding an exact zero rounds nothing.
        if self.is_exactly_zero() {
            return o;
        }
        if o.is_exactly_zero() {
            return self;
        }
        Approx::rounded(self.value + o.value, self.error + o.error)
    }
}

impl Sub for Approx {
    type Output = Approx;
    fn sub(self, o: Approx) -> Approx {
        self + -o
    }
}

impl Mul for Approx {
    type Output = Approx;
    fn mul(self, o: Approx) -> Approx {
        if self.is_exactly_zero() || o.is_exactly_zero() {
            return Approx::exact(0.0);
        }
        let inherited =
            self.value.abs() * o.error + o.value.abs() * self.error + self.error * o.error;
        Approx::rounded(self.value * o.value, inherited + 4.0 * TINY)
    }
}

impl Div for Approx {
    type Output = Approx;
    fn div(self, o: Approx) -> Approx {
        let value = self.value / o.value;
        if !o.is_signed() {
            let error = f64::INFINITY;
            return Approx { value, error };
        }
        if self.is_exactly_zero() {
            return self;
        }
        let inherited = (self.error + value.abs() * o.error) / (o.value.abs() - o.error);
        // The 4v cover the rounding of the divisor's distance from zero (O1).
        Approx::rounded(value, inherited * (1.0 + 4.0 * UNIT) + 4.0 * TINY)
    }
}

/// Three numbers with their errors.
pub type Approx3 = [Approx; 3];

/// Returns three f64 that are exact.
pub fn exact3(v: [f64; 3]) -> Approx3 {
    v.map(Approx::exact)
}

/// Returns a + b.
pub fn add(a: Approx3, b: Approx3) -> Approx3 {
    std::array::from_fn(|k| a[k] + b[k])
}

/// Returns s a.
pub fn scaled(a: Approx3, s: Approx) -> Approx3 {
    a.map(|x| x * s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Numbers of all sizes, with many bits or few.
    fn number() -> impl Strategy<Value = f64> {
        (-1.0..1.0_f64, -40..40_i32, any::<bool>()).prop_map(|(x, power, short)| {
            let x = if short { f64::from(x as f32) } else { x };
            x * 2.0_f64.powi(power)
        })
    }

    /// Compares exact numbers.
    fn at_most(a: &Dyadic, b: &Dyadic) -> bool {
        let Ok(sign) = a.minus(b).sign();
        sign.is_le()
    }

    fn between(lo: f64, exact: &Dyadic, hi: f64) -> bool {
        at_most(&Dyadic::from_f64(lo), exact) && at_most(exact, &Dyadic::from_f64(hi))
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            failure_persistence: None,
            ..ProptestConfig::with_cases(20_000)
        })]

        /// The error bounds hold, and so do the bounds of the enclosure; a sign that is
        /// known is the exact one.
        #[test]
        fn errors_are_bounds(a in number(), b in number(), c in number(), d in number()) {
            let [x, y, z, w] = [a, b, c, d].map(Approx::exact);
            let approx = (x * y - z * w) * (x + z) - w;
            let [x, y, z, w] = [a, b, c, d].map(Dyadic::from_f64);
            let exact = x.times(&y).minus(&z.times(&w)).times(&x.plus(&z)).minus(&w);
            prop_assert!(between(approx.lo(), &exact, approx.hi()), "{approx:?}");
            let (value, error) = (Dyadic::from_f64(approx.value), Dyadic::from_f64(approx.error));
            prop_assert!(at_most(&value.minus(&error), &exact));
            prop_assert!(at_most(&exact, &value.plus(&error)));
            let Ok(sign) = exact.sign();
            prop_assert!(approx.sign().is_err() || approx.sign() == Ok(sign));
            // A quotient times its divisor, and a root squared, enclose the exact number.
            let q = approx / Approx::exact(b);
            if q.error.is_finite() {
                let (lo, hi) = (Dyadic::from_f64(q.lo()).times(&y), Dyadic::from_f64(q.hi()).times(&y));
                let (lo, hi) = if b > 0.0 { (lo, hi) } else { (hi, lo) };
                prop_assert!(at_most(&lo, &exact) && at_most(&exact, &hi));
            }
            let root = approx.sqrt();
            if sign.is_gt() {
                prop_assert!(at_most(&Dyadic::from_f64(root.lo().max(0.0)).squared(), &exact));
                prop_assert!(at_most(&exact, &Dyadic::from_f64(root.hi()).squared()));
            }
        }
    }
}
