//! Intervals of real numbers, rounded outward (Hickey, Ju, van Emden: *Interval
//! Arithmetic: From Principles to Implementation*, JACM 2001).
//!
//! Ends are f64 and may be infinite. The interval holds the real numbers between them and
//! never infinity, so zero times a half-line is zero. Every operation is rounded to
//! nearest and then moved one step outward, which is at least half a unit in the last
//! place. A sum that rounds to 0 is exact, and so is a product with a power of two;
//! neither is moved. A product does not cross the zero behind which its factors' signs
//! put it. Overflow gives infinite ends and never NaN: a lower end is never +∞ and an
//! upper end never −∞. Lemma V7, docs/numerics/level-sets.md.

use super::is_power_of_two;

/// A closed interval; both ends are NaN for [`Interval::NONE`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    pub low: f64,
    /// At least `low`.
    pub high: f64,
}

impl Interval {
    /// The whole real line.
    pub const LINE: Interval = Interval {
        low: f64::NEG_INFINITY,
        high: f64::INFINITY,
    };

    pub const ZERO: Interval = Interval::new(0.0, 0.0);

    /// The empty interval. Arithmetic on it is not defined.
    pub const NONE: Interval = Interval::new(f64::NAN, f64::NAN);

    #[inline]
    pub const fn new(low: f64, high: f64) -> Interval {
        Interval { low, high }
    }

    /// Returns [x, x] for a finite x, and the line for any other.
    #[inline]
    pub fn point(x: f64) -> Interval {
        if x.is_finite() {
            Interval::new(x, x)
        } else {
            Interval::LINE
        }
    }

    /// Returns an interval around every real number that rounds to x. Lemma V7,
    /// docs/numerics/level-sets.md.
    pub fn around(x: f64) -> Interval {
        Interval::point(x).padded(2.0 * f64::EPSILON)
    }

    #[inline]
    pub fn is_none(&self) -> bool {
        self.low.is_nan()
    }

    /// Moves each finite end outward by `part` of itself and by the least normal number,
    /// for ends whose relative error is at most `part`.
    #[inline]
    pub fn padded(&self, part: f64) -> Interval {
        let room = |x: f64| x.abs() * part + f64::MIN_POSITIVE;
        let met = |x: f64, end: f64| if x.is_infinite() { x } else { end };
        Interval {
            low: met(self.low, self.low - room(self.low)),
            high: met(self.high, self.high + room(self.high)),
        }
    }

    pub fn holds(&self, x: f64) -> bool {
        self.low <= x && x <= self.high
    }

    /// Returns the smallest interval that contains both.
    pub fn hull(&self, other: &Interval) -> Interval {
        Interval {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// Returns the intersection; [`Interval::NONE`] if it is empty.
    #[inline]
    pub fn common(&self, other: &Interval) -> Interval {
        let (low, high) = (self.low.max(other.low), self.high.min(other.high));
        if low <= high && !self.is_none() && !other.is_none() {
            Interval { low, high }
        } else {
            Interval::NONE
        }
    }

    #[inline]
    pub fn width(&self) -> f64 {
        self.high - self.low
    }

    #[inline]
    pub fn is_finite(&self) -> bool {
        self.low.is_finite() && self.high.is_finite()
    }

    #[inline]
    pub fn excludes_zero(&self) -> bool {
        self.low > 0.0 || self.high < 0.0
    }

    /// Returns a number between the ends of a finite interval.
    #[inline]
    pub fn middle(&self) -> f64 {
        // Halving rounds subnormal numbers, so the sum may lie outside.
        (0.5 * self.low + 0.5 * self.high).clamp(self.low, self.high)
    }

    #[inline]
    pub fn max_abs(&self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    pub fn negated(&self) -> Interval {
        Interval {
            low: -self.high,
            high: -self.low,
        }
    }

    #[inline]
    pub fn plus(&self, other: &Interval) -> Interval {
        if *other == Interval::ZERO {
            return *self;
        }
        if *self == Interval::ZERO {
            return *other;
        }
        Interval {
            low: sum_below(self.low, other.low),
            high: sum_above(self.high, other.high),
        }
    }

    #[inline]
    pub fn minus(&self, other: &Interval) -> Interval {
        if *other == Interval::ZERO {
            return *self;
        }
        Interval {
            low: sum_below(self.low, -other.high),
            high: sum_above(self.high, -other.low),
        }
    }

    #[inline]
    pub fn times(&self, other: &Interval) -> Interval {
        if *self == Interval::ZERO || *other == Interval::ZERO {
            return Interval::ZERO;
        }
        let exact = self.times_power(other).or_else(|| other.times_power(self));
        if let Some(exact) = exact {
            return exact;
        }
        let corners = [
            self.low * other.low,
            self.low * other.high,
            self.high * other.low,
            self.high * other.high,
        ];
        let [least, most] = if self.is_finite() && other.is_finite() {
            let [a, b, c, d] = corners;
            let less = |x: f64, y: f64| if x < y { x } else { y };
            let more = |x: f64, y: f64| if x > y { x } else { y };
            [less(less(a, b), less(c, d)), more(more(a, b), more(c, d))]
        } else {
            // Zero times infinity is NaN at a corner, and `min` and `max` ignore NaN. The
            // missing bound is not lost: the other corner at that zero is 0, or the other
            // end of the factor with the zero gives the infinity.
            let least = corners.into_iter().fold(f64::NAN, f64::min);
            [least, corners.into_iter().fold(f64::NAN, f64::max)]
        };
        let (mut low, mut high) = (least.next_down(), most.next_up());
        if least == 0.0 && self.sign() == other.sign() && self.sign() != 0 {
            low = 0.0;
        }
        if most == 0.0 && self.sign() == -other.sign() && self.sign() != 0 {
            high = 0.0;
        }
        Interval { low, high }
    }

    /// Multiplies by a power of two; `None` if `power` is not one, or if a product is not
    /// exact.
    #[inline]
    fn times_power(&self, power: &Interval) -> Option<Interval> {
        let by = power.low;
        if by != power.high || !is_power_of_two(by) {
            return None;
        }
        let (a, b) = (self.low * by, self.high * by);
        let is_exact = |from: f64, to: f64| from == 0.0 || from.is_infinite() || to.is_normal();
        let (low, high) = if by > 0.0 { (a, b) } else { (b, a) };
        let exact = is_exact(self.low, a) && is_exact(self.high, b);
        exact.then_some(Interval { low, high })
    }

    /// Divides by an interval that excludes zero.
    pub fn over(&self, other: &Interval) -> Interval {
        let inverse = Interval {
            low: (1.0 / other.high).next_down(),
            high: (1.0 / other.low).next_up(),
        };
        self.times(&inverse)
    }

    pub fn squared(&self) -> Interval {
        if *self == Interval::ZERO {
            return Interval::ZERO;
        }
        let most = self.max_abs();
        let least = if self.low > 0.0 {
            self.low
        } else {
            (-self.high).max(0.0)
        };
        Interval {
            low: (least * least).next_down().max(0.0),
            high: (most * most).next_up(),
        }
    }

    /// Raises to a power by repeated squaring.
    pub fn power(&self, exponent: u32) -> Interval {
        let (mut square, mut rest) = (*self, exponent);
        let mut result = Interval::new(1.0, 1.0);
        while rest > 0 {
            if rest & 1 == 1 {
                result = result.times(&square);
            }
            rest >>= 1;
            if rest > 0 {
                square = square.squared();
            }
        }
        result
    }

    /// Returns an interval around 1/x for all x > 0 of an interval with `low` ≥ 0.
    pub fn inverse_of_positive(&self) -> Interval {
        Interval {
            low: (1.0 / self.high).next_down().max(0.0),
            high: if self.low > 0.0 {
                (1.0 / self.low).next_up()
            } else {
                f64::INFINITY
            },
        }
    }

    /// Returns 1 if the interval has no negative number, −1 if it has no positive one,
    /// else 0.
    #[inline]
    fn sign(&self) -> i32 {
        if self.low >= 0.0 {
            1
        } else if self.high <= 0.0 {
            -1
        } else {
            0
        }
    }
}

#[inline]
fn sum_below(a: f64, b: f64) -> f64 {
    let sum = a + b;
    if sum == 0.0 { 0.0 } else { sum.next_down() }
}

#[inline]
fn sum_above(a: f64, b: f64) -> f64 {
    let sum = a + b;
    if sum == 0.0 { 0.0 } else { sum.next_up() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Whether an interval holds x + error, |error| below half a unit in the last place
    /// of x.
    fn holds(interval: &Interval, x: f64, error: f64) -> bool {
        let low = if error < 0.0 {
            interval.low < x
        } else {
            interval.low <= x
        };
        let high = if error > 0.0 {
            interval.high > x
        } else {
            interval.high >= x
        };
        low && high
    }

    proptest! {
        #[test]
        fn operations_round_outward(a in -1e9..1e9, b in -1e-3..1e3, width in 0.0..1.0) {
            let (sum, product) = (a + b, a * b);
            // The rounding errors of sum (Knuth) and product (FMA).
            let part = sum - a;
            let rest = (a - (sum - part)) + (b - part);
            let [p, q] = [a, b].map(Interval::point);
            prop_assert!(holds(&p.plus(&q), sum, rest));
            prop_assert!(holds(&p.minus(&Interval::point(-b)), sum, rest));
            prop_assert!(holds(&p.times(&q), product, a.mul_add(b, -product)));
            prop_assert!(holds(&p.squared(), a * a, a.mul_add(a, -(a * a))));
            let quotient = p.over(&q).times(&q);
            prop_assert!(quotient.low <= a && a <= quotient.high);
            // Wide intervals hold the results at their ends and middle.
            let p = Interval::new(a, a + width);
            for x in [p.low, p.middle(), p.high] {
                prop_assert!(holds(&p.times(&q), x * b, x.mul_add(b, -(x * b))));
                prop_assert!(holds(&p.squared(), x * x, x.mul_add(x, -(x * x))));
            }
        }
    }

    #[test]
    fn half_lines_have_ends() {
        let (zero, line) = (Interval::ZERO, Interval::LINE);
        let positive = Interval::new(0.0, f64::INFINITY);
        let below = Interval::new(f64::NEG_INFINITY, -2.0);
        assert_eq!(zero.times(&line), zero);
        assert_eq!(
            positive.times(&below),
            Interval::new(f64::NEG_INFINITY, 0.0)
        );
        assert_eq!(line.plus(&below), line);
        assert_eq!(positive.minus(&positive), line);
        assert_eq!(line.squared(), positive);
        assert_eq!(below.squared().high, f64::INFINITY);
        // Overflow and underflow keep their sign.
        let vast = Interval::point(1e200).squared();
        assert_eq!((vast.low, vast.high), (f64::MAX, f64::INFINITY));
        let tiny = Interval::point(1e-200).times(&Interval::point(-1e-200));
        assert!(tiny.low < 0.0 && tiny.high == 0.0);
        let part = Interval::new(0.0, 0.25).inverse_of_positive();
        assert!(part.low < 4.0 && part.low > 3.9 && part.high == f64::INFINITY);
    }
}
