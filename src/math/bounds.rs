//! Numbers with a bound on their error, and what the bounds are made of.
//!
//! A bound is forward: it follows from the inputs' magnitudes by counting
//! roundings (Higham, *Accuracy and Stability*, chapter 3). docs/NUMERICS.md
//! derives each.

use super::number::Number;
use std::cmp::Ordering;

/// Half a unit in the last place of 1.
pub const UNIT: f64 = f64::EPSILON / 2.0;

/// The exact number lies within `value ± error`. NaN and infinity in either
/// mean that nothing is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounded {
    pub value: f64,
    pub error: f64,
}

impl Bounded {
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
const SPARE: f64 = 1.0 + 16.0 * UNIT;

/// Far more than what underflow takes from the products in a step.
const TINY: f64 = f64::MIN_POSITIVE;

/// Running error analysis: each operation adds its own rounding to what its
/// operands bring along (Higham, section 3.3).
impl Number for Bounded {
    #[inline(always)]
    fn of(value: f64) -> Bounded {
        Bounded { value, error: 0.0 }
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
    fn displaced(o: f64, s: f64, d: f64, c: f64) -> Bounded {
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
            self.value * 0.0
        };
        let (steep, near) = (self.error / value, self.error.sqrt());
        // Not below where this is NaN.
        let carried = if steep < near { steep } else { near };
        Bounded::rounded(value, carried * SPARE)
    }
}

/// x + y, rounded, and what that leaves.
#[inline(always)]
fn sum(x: f64, y: f64) -> (f64, f64) {
    let sum = x + y;
    let other = sum - x;
    (sum, (x - (sum - other)) + (y - other))
}

/// x · y, rounded, and what that leaves; but for underflow.
#[inline(always)]
fn product(x: f64, y: f64) -> (f64, f64) {
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
