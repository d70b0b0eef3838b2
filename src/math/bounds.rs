//! Numbers with a bound on their error, and what the bounds are made of.
//!
//! A bound is forward: it follows from the inputs' magnitudes by counting
//! roundings (Higham, *Accuracy and Stability*, chapter 3). docs/NUMERICS.md
//! derives each.

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
