//! Intervals of real numbers, rounded outward.
//!
//! Ends are f64 and may be infinite: the interval is what lies between them, infinity
//! never belongs to it, so zero times a half-line is zero. Every operation is rounded to
//! nearest and then goes one step outward, which is at least half a unit in the last
//! place. A sum that is 0 is exact, and so is a product with a power of two; none crosses
//! the zero that its factors' signs put it behind. Overflow gives infinite ends, never
//! NaN: a lower end is never +∞ and an upper one never −∞ (Hickey, Ju, van Emden: Interval
//! Precision: from Principles to Implementation, JACM 2001).

use super::is_power_of_two;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    pub low: f64,
    /// ≥ `low`.
    pub high: f64,
}

impl Interval {
    pub const LINE: Interval = Interval {
        low: f64::NEG_INFINITY,
        high: f64::INFINITY,
    };

    pub const ZERO: Interval = Interval::new(0.0, 0.0);

    /// Without a number in it; not to be worked with.
    pub const NONE: Interval = Interval::new(f64::NAN, f64::NAN);

    #[inline]
    pub const fn new(low: f64, high: f64) -> Interval {
        Interval { low, high }
    }

    /// Of a finite number.
    #[inline]
    pub fn point(x: f64) -> Interval {
        if x.is_finite() {
            Interval::new(x, x)
        } else {
            Interval::LINE
        }
    }

    /// What is rounded to a number, and a little more.
    pub fn around(x: f64) -> Interval {
        Interval::point(x).padded(2.0 * f64::EPSILON)
    }

    #[inline]
    pub fn is_none(&self) -> bool {
        self.low.is_nan()
    }

    /// Ends that are off by so much of themselves, at most.
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

    /// All of both, and what is between them.
    pub fn hull(&self, other: &Interval) -> Interval {
        Interval {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// What both have.
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

    /// Of a finite interval, some number between its ends.
    #[inline]
    pub fn middle(&self) -> f64 {
        // Halves of the smallest numbers round.
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
            // A corner of zero and infinity is NaN, which `min` and `max` pass over; the
            // other corner at that zero is 0, or the zero's other end gives the infinity.
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

    /// By a power of two: nothing is lost, where nothing leaves the range.
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

    /// By one without zero.
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

    /// By repeated squares.
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

    /// 1 / x for those x > 0 of an interval without negative ones.
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

    /// 1 where nothing is negative, −1 where nothing is positive.
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

    /// Whether an interval holds x + error, |error| below half a unit of x.
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
            // Knuth's sum, and the product's rest.
            let part = sum - a;
            let rest = (a - (sum - part)) + (b - part);
            let [p, q] = [a, b].map(Interval::point);
            prop_assert!(holds(&p.plus(&q), sum, rest));
            prop_assert!(holds(&p.minus(&Interval::point(-b)), sum, rest));
            prop_assert!(holds(&p.times(&q), product, a.mul_add(b, -product)));
            prop_assert!(holds(&p.squared(), a * a, a.mul_add(a, -(a * a))));
            let quotient = p.over(&q).times(&q);
            prop_assert!(quotient.low <= a && a <= quotient.high);
            // And over wider ones, at the ends.
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
        // Overflow and underflow stay on their side.
        let vast = Interval::point(1e200).squared();
        assert_eq!((vast.low, vast.high), (f64::MAX, f64::INFINITY));
        let tiny = Interval::point(1e-200).times(&Interval::point(-1e-200));
        assert!(tiny.low < 0.0 && tiny.high == 0.0);
        let part = Interval::new(0.0, 0.25).inverse_of_positive();
        assert!(part.low < 4.0 && part.low > 3.9 && part.high == f64::INFINITY);
    }
}
