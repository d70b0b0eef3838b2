//! Arithmetic in which formulas are evaluated: f64, and ranges.
//!
//! An f64 value lies in the range that is computed from ranges of its operands, because every
//! operation is rounded to nearest and its range is rounded outward by more (V7,
//! docs/numerics/level-sets.md).

use super::{Binary, Unary};
use crate::math::Interval;
use std::f64::consts::{FRAC_PI_2, PI};

/// Arithmetic with the operations of formulas.
pub trait Real: Copy {
    fn constant(x: f64) -> Self;
    fn plus(self, other: Self) -> Self;
    fn minus(self, other: Self) -> Self;
    fn times(self, other: Self) -> Self;
    fn over(self, other: Self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    /// Raises the value to a whole power ≥ 1.
    fn power(self, exponent: u32) -> Self;
    fn unary(self, function: Unary) -> Self;
    /// Returns sine and cosine.
    fn sin_cos(self) -> [Self; 2];
    /// Returns the derivative of |x|: −1, 1, or what lies between.
    fn direction(self) -> Self;
    /// Selects `below` if this is below zero, `above` if it is above, or their hull if it may be
    /// either.
    fn choice(self, below: Self, above: Self) -> Self;

    #[inline(always)]
    fn binary(self, operator: Binary, other: Self) -> Self {
        match operator {
            Binary::Sum => self.plus(other),
            Binary::Difference => self.minus(other),
            Binary::Product => self.times(other),
            Binary::Quotient => self.over(other),
            Binary::Min => self.min(other),
            Binary::Max => self.max(other),
        }
    }
}

impl Real for f64 {
    #[inline]
    fn constant(x: f64) -> f64 {
        x
    }

    #[inline]
    fn plus(self, other: f64) -> f64 {
        self + other
    }

    #[inline]
    fn minus(self, other: f64) -> f64 {
        self - other
    }

    #[inline]
    fn times(self, other: f64) -> f64 {
        self * other
    }

    #[inline]
    fn over(self, other: f64) -> f64 {
        self / other
    }

    /// Returns NaN if either is NaN, unlike std's.
    #[inline]
    fn min(self, other: f64) -> f64 {
        if self < other || self.is_nan() {
            self
        } else {
            other
        }
    }

    #[inline]
    fn max(self, other: f64) -> f64 {
        if self > other || self.is_nan() {
            self
        } else {
            other
        }
    }

    fn power(self, exponent: u32) -> f64 {
        let (mut square, mut rest) = (self, exponent);
        let mut result = 1.0;
        while rest > 0 {
            if rest & 1 == 1 {
                result *= square;
            }
            rest >>= 1;
            if rest > 0 {
                square *= square;
            }
        }
        result
    }

    fn unary(self, function: Unary) -> f64 {
        match function {
            Unary::Abs => self.abs(),
            Unary::Sqrt => self.sqrt(),
            Unary::Exp => libm::exp(self),
            Unary::Ln => libm::log(self),
            Unary::Sin => libm::sin(self),
            Unary::Cos => libm::cos(self),
            Unary::Tan => libm::tan(self),
            Unary::Asin => libm::asin(self),
            Unary::Acos => libm::acos(self),
            Unary::Atan => libm::atan(self),
            Unary::Sinh => libm::sinh(self),
            Unary::Cosh => libm::cosh(self),
            Unary::Tanh => libm::tanh(self),
        }
    }

    fn sin_cos(self) -> [f64; 2] {
        let (sin, cos) = libm::sincos(self);
        [sin, cos]
    }

    fn direction(self) -> f64 {
        if self < 0.0 { -1.0 } else { 1.0 }
    }

    fn choice(self, below: f64, above: f64) -> f64 {
        if self < 0.0 { below } else { above }
    }
}

/// A bound on the relative error of libm's elementary functions: eight roundings 2⁻⁵², where libm
/// itself states about one (V7, docs/numerics/level-sets.md).
const OFF: f64 = 8.0 * f64::EPSILON;

/// Arguments beyond this have the range [−1, 1]: their place in the period is not computed.
const FAR: f64 = (1_u64 << 30) as f64;

/// A bound on the error of a place in the period, in turns (V7, docs/numerics/level-sets.md).
const TURNS_OFF: f64 = 1e-6;

/// An interval that holds a formula's f64 values over a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    pub values: Interval,
    /// Whether some points may have no value, or a pole.
    pub is_partial: bool,
}

impl Range {
    pub fn new(values: Interval) -> Range {
        Range {
            values,
            is_partial: false,
        }
    }

    /// The range of a function that has no value anywhere.
    pub const NONE: Range = Range {
        values: Interval::NONE,
        is_partial: true,
    };

    pub fn is_none(&self) -> bool {
        self.values.is_none()
    }

    /// Says whether every point has a finite value.
    pub fn is_whole(&self) -> bool {
        self.values.is_finite() && !self.is_partial
    }

    /// Returns whether all values are below zero; `None` if the sign is not known. A point without
    /// a value counts as above.
    pub fn sign(&self) -> Option<bool> {
        if self.is_none() {
            return Some(false);
        }
        let below = self.values.high < 0.0;
        let is_known = self.values.excludes_zero() && !(below && self.is_partial);
        is_known.then_some(below)
    }

    #[inline(always)]
    fn joined(&self, other: &Range, of: impl FnOnce(&Interval, &Interval) -> Interval) -> Range {
        if self.is_none() || other.is_none() {
            return Range::NONE;
        }
        Range {
            values: of(&self.values, &other.values),
            is_partial: self.is_partial || other.is_partial,
        }
    }

    #[inline(always)]
    fn map(&self, of: impl FnOnce(&Interval) -> Interval) -> Range {
        match self.is_none() {
            true => *self,
            false => Range {
                values: of(&self.values),
                ..*self
            },
        }
    }

    /// Applies a monotonically rising function.
    fn rising(&self, function: Unary) -> Range {
        self.map(|x| rising(x, function, &Interval::LINE))
    }

    /// Applies a rising function that is defined on `domain` only.
    fn rising_in(&self, function: Unary, domain: Interval, range: &Interval) -> Range {
        let known = self.values.common(&domain);
        // The logarithm of 0 is not finite.
        let is_end = |x: f64| function == Unary::Ln && x <= 0.0;
        if known.is_none() || is_end(known.high) {
            return Range::NONE;
        }
        Range {
            values: rising(&known, function, range),
            is_partial: self.is_partial || known != self.values || is_end(known.low),
        }
    }
}

impl Real for Range {
    #[inline]
    fn constant(x: f64) -> Range {
        Range::new(Interval::point(x))
    }

    #[inline]
    fn plus(self, other: Range) -> Range {
        self.joined(&other, Interval::plus)
    }

    #[inline]
    fn minus(self, other: Range) -> Range {
        self.joined(&other, Interval::minus)
    }

    #[inline]
    fn times(self, other: Range) -> Range {
        self.joined(&other, Interval::times)
    }

    #[inline]
    fn over(self, other: Range) -> Range {
        if other.values.excludes_zero() {
            return self.joined(&other, Interval::over);
        }
        if self.is_none() || other.is_none() || other.values == Interval::ZERO {
            return Range::NONE;
        }
        Range {
            values: Interval::LINE,
            is_partial: true,
        }
    }

    #[inline]
    fn min(self, other: Range) -> Range {
        self.joined(&other, |a, b| {
            Interval::new(a.low.min(b.low), a.high.min(b.high))
        })
    }

    #[inline]
    fn max(self, other: Range) -> Range {
        self.joined(&other, |a, b| {
            Interval::new(a.low.max(b.low), a.high.max(b.high))
        })
    }

    fn power(self, exponent: u32) -> Range {
        self.map(|x| power(x, exponent))
    }

    fn unary(self, function: Unary) -> Range {
        let unit = Interval::new(-1.0, 1.0);
        let positive = Interval::new(0.0, f64::INFINITY);
        match function {
            Unary::Abs => self.map(magnitude),
            Unary::Sqrt => self.rising_in(function, positive, &positive),
            Unary::Ln => self.rising_in(function, positive, &Interval::LINE),
            Unary::Asin => self.rising_in(function, unit, &Interval::LINE),
            Unary::Acos => {
                let asin = self.rising_in(Unary::Asin, unit, &Interval::LINE);
                asin.map(|x| Interval::around(FRAC_PI_2).minus(x))
            }
            Unary::Exp => self.map(|x| rising(x, function, &positive)),
            Unary::Tanh => self.map(|x| rising(x, function, &unit)),
            Unary::Atan | Unary::Sinh => self.rising(function),
            Unary::Cosh => {
                let range = Interval::new(1.0, f64::INFINITY);
                self.map(|x| rising(&magnitude(x), function, &range))
            }
            Unary::Sin => self.sin_cos()[0],
            Unary::Cos => self.sin_cos()[1],
            Unary::Tan => {
                let [_, cos] = self.sin_cos();
                if cos.values.excludes_zero() && self.values.width() < PI {
                    return self.rising(function);
                }
                Range {
                    is_partial: true,
                    ..self.map(|_| Interval::LINE)
                }
            }
        }
    }

    fn sin_cos(self) -> [Range; 2] {
        let unit = Interval::new(-1.0, 1.0);
        let x = self.values;
        if !(x.max_abs() < FAR) || x.width() >= 2.0 * PI {
            return [self.map(|_| unit); 2];
        }
        let (low, high) = (Real::sin_cos(x.low), Real::sin_cos(x.high));
        let of = |values: Interval| Range { values, ..self };
        [
            of(wave(&x, [low[0], high[0]], FRAC_PI_2)),
            of(wave(&x, [low[1], high[1]], 0.0)),
        ]
    }

    fn direction(self) -> Range {
        let [down, up] = [-1.0, 1.0].map(Range::constant);
        self.choice(down, up)
    }

    fn choice(self, below: Range, above: Range) -> Range {
        if self.values.high < 0.0 {
            below
        } else if self.values.low > 0.0 {
            above
        } else {
            below.joined(&above, Interval::hull)
        }
    }
}

fn magnitude(x: &Interval) -> Interval {
    if x.high <= 0.0 {
        x.negated()
    } else if x.low >= 0.0 {
        *x
    } else {
        Interval::new(0.0, x.max_abs())
    }
}

fn power(x: &Interval, exponent: u32) -> Interval {
    if !x.is_finite() {
        return x.power(exponent);
    }
    let end = |x: f64| Interval::point(x).power(exponent);
    let (low, high) = (end(x.low), end(x.high));
    match exponent.is_multiple_of(2) && x.holds(0.0) {
        true => low.hull(&high).hull(&Interval::ZERO),
        false => low.hull(&high),
    }
}

/// Returns the interval of a rising function where it is defined, cut to the function's own range.
fn rising(x: &Interval, function: Unary, range: &Interval) -> Interval {
    let (low, high) = (x.low.unary(function), x.high.unary(function));
    // A value that overflows f64 is still a real number.
    let low = low.min(f64::MAX);
    let high = high.max(-f64::MAX);
    Interval::new(low, high).padded(OFF).common(range)
}

/// Returns the interval of a sine whose maximum 1 lies at `top`, given its values at the ends.
fn wave(x: &Interval, [a, b]: [f64; 2], top: f64) -> Interval {
    let unit = Interval::new(-1.0, 1.0);
    // Says whether a place lies in the interval, up to whole turns.
    let meets = |place: f64| {
        let turns = |x: f64| (x - place) / (2.0 * PI);
        let first = (turns(x.low) - TURNS_OFF).ceil();
        first <= (turns(x.high) + TURNS_OFF).floor()
    };
    let mut values = Interval::new(a.min(b), a.max(b)).padded(OFF);
    if meets(top) {
        values.high = 1.0;
    }
    if meets(top + PI) {
        values.low = -1.0;
    }
    values.common(&unit)
}
