//! Intervals in which roots are sought.

use std::ops::Bound;

/// An interval of the line; each end is included, excluded or absent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    pub low: Bound<f64>,
    pub high: Bound<f64>,
}

impl Interval {
    /// The whole real line.
    pub const LINE: Interval = Interval {
        low: Bound::Unbounded,
        high: Bound::Unbounded,
    };

    /// Returns (low, high), the interval of rays; infinite ends are allowed.
    pub fn open(low: f64, high: f64) -> Interval {
        Interval {
            low: Bound::Excluded(low),
            high: Bound::Excluded(high),
        }
    }

    /// Returns (low, high], the interval of Sturm's theorem.
    pub fn half_open(low: f64, high: f64) -> Interval {
        Interval {
            low: Bound::Excluded(low),
            high: Bound::Included(high),
        }
    }

    /// Returns the lower end, or −∞.
    pub(super) fn from(&self) -> f64 {
        match self.low {
            Bound::Included(x) | Bound::Excluded(x) => x,
            Bound::Unbounded => f64::NEG_INFINITY,
        }
    }

    /// Returns the upper end, or +∞.
    pub(super) fn to(&self) -> f64 {
        match self.high {
            Bound::Included(x) | Bound::Excluded(x) => x,
            Bound::Unbounded => f64::INFINITY,
        }
    }

    /// Whether the interval may contain a number; false if an end is NaN.
    pub(super) fn is_sound(&self) -> bool {
        self.from() <= self.to()
    }

    /// Reflects the interval at 0.
    pub(super) fn mirrored(&self) -> Interval {
        let negated = |end: Bound<f64>| end.map(|x| -x);
        Interval {
            low: negated(self.high),
            high: negated(self.low),
        }
    }

    /// Whether the interval contains a number that is known by its order. `order(x)`
    /// compares the number with an end x.
    pub(super) fn holds(&self, order: impl Fn(f64) -> std::cmp::Ordering) -> bool {
        use std::cmp::Ordering::{Greater, Less};
        let above = match self.low {
            Bound::Included(x) => order(x) != Less,
            Bound::Excluded(x) => order(x) == Greater,
            Bound::Unbounded => true,
        };
        above
            && match self.high {
                Bound::Included(x) => order(x) != Greater,
                Bound::Excluded(x) => order(x) == Less,
                Bound::Unbounded => true,
            }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_belong_as_they_say() {
        let inside = |interval: Interval, x: f64| interval.holds(|end| x.total_cmp(&end));
        let half = Interval::half_open(-1.0, 2.0);
        assert!(!inside(half, -1.0) && inside(half, 0.0) && inside(half, 2.0));
        assert!(inside(half.mirrored(), 1.0 - 1e-9) && !inside(half.mirrored(), 1.0));
        assert!(inside(half.mirrored(), -2.0));
        assert!(!inside(Interval::open(0.0, 1.0), 1.0));
        assert!(inside(Interval::LINE, 1e308));
        assert!(Interval::open(0.0, f64::INFINITY).is_sound());
        assert!(!Interval::open(0.0, f64::NAN).is_sound());
        assert!(!Interval::open(1.0, 0.0).is_sound());
    }
}
