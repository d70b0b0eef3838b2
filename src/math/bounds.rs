//! Numbers with a bound on their error, and what the bounds are made of.
//!
//! A bound is forward: it follows from the inputs' magnitudes by counting
//! roundings (Higham, *Accuracy and Stability*, chapter 3). docs/NUMERICS.md
//! derives each.

use std::cmp::Ordering;

/// Half a unit in the last place of 1.
pub const UNIT: f64 = f64::EPSILON / 2.0;

/// How far from a surface a ray that leaves it starts, in roundings of the largest
/// coordinate that made the point: a transform of the ray, the point itself, and
/// the new ray's own transform and test take about a dozen each.
pub const LEAVING: f64 = 64.0;

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
