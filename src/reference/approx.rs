//! A number and a bound on its error.
//!
//! Running error analysis (Wilkinson; Higham, *Accuracy and Stability*, 3.3):
//! `value` is what plain f64 gives for the textbook formula, and each operation
//! carries along how far that may lie from exact arithmetic on the same input:
//! half a unit in the last place of its own, plus what its operands bring.
//!
//! A decision is *certain* when no number within the error would turn it.
//! NaN and overflow make every decision uncertain, never wrong.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// The exact number lies within `value ± error`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approx {
    pub value: f64,
    pub error: f64,
}

/// Half a unit in the last place of 1.
const UNIT: f64 = f64::EPSILON / 2.0;
/// The least positive number: twice what a product can lose to underflow.
const TINY: f64 = f64::from_bits(1);

impl Approx {
    pub fn exact(value: f64) -> Approx {
        Approx { value, error: 0.0 }
    }

    /// Any number of `[-reach, reach]`.
    pub fn anywhere(reach: f64) -> Approx {
        Approx {
            value: 0.0,
            error: reach,
        }
    }

    /// Any number of `[lo, hi]`.
    pub fn between(lo: f64, hi: f64) -> Approx {
        let value = lo * 0.5 + hi * 0.5;
        Approx::wrap(value, f64::max(hi - value, value - lo))
    }

    /// A result of one rounded operation; `inherited` is what the operands'
    /// errors make of it. The factor covers the rounding of this bound itself.
    fn rounded(value: f64, inherited: f64) -> Approx {
        Approx::wrap(value, inherited + value.abs() * UNIT)
    }

    fn wrap(value: f64, error: f64) -> Approx {
        Approx {
            value,
            error: error * (1.0 + 16.0 * UNIT),
        }
    }

    /// A number not above the exact one.
    pub fn lo(self) -> f64 {
        if self.error == 0.0 {
            self.value
        } else {
            (self.value - self.error).next_down()
        }
    }

    /// A number not below the exact one.
    pub fn hi(self) -> f64 {
        if self.error == 0.0 {
            self.value
        } else {
            (self.value + self.error).next_up()
        }
    }

    /// A number not above the exact magnitude.
    pub fn abs_lo(self) -> f64 {
        f64::max(self.lo(), -self.hi())
    }

    /// A number not below the exact magnitude.
    pub fn abs_hi(self) -> f64 {
        f64::max(self.hi(), -self.lo())
    }

    /// NaN is not certain of anything.
    pub fn certainly_above(self, limit: f64) -> bool {
        self.lo() > limit
    }

    pub fn certainly_below(self, limit: f64) -> bool {
        self.hi() < limit
    }

    /// In magnitude.
    pub fn certainly_beyond(self, reach: f64) -> bool {
        self.abs_lo() > reach
    }

    /// Whether the sign is certain.
    pub fn is_signed(self) -> bool {
        self.value.abs() > self.error
    }

    pub fn is_exactly_zero(self) -> bool {
        self.value == 0.0 && self.error == 0.0
    }

    pub fn squared(self) -> Approx {
        self * self
    }

    /// Of a number that is not negative, whatever its error says.
    pub fn sqrt(self) -> Approx {
        let root = f64::max(self.value, 0.0).sqrt();
        let inherited = if self.value > self.error {
            self.error / ((self.value - self.error).sqrt() + root)
        } else {
            (f64::max(self.value, 0.0) + self.error).sqrt()
        };
        Approx::rounded(root, inherited)
    }

    pub fn max(self, other: Approx) -> Approx {
        let lo = f64::max(self.lo(), other.lo());
        let hi = f64::max(self.hi(), other.hi());
        let value = f64::max(self.value, other.value);
        Approx::wrap(value, f64::max(hi - value, value - lo))
    }

    pub fn min(self, other: Approx) -> Approx {
        -(-self).max(-other)
    }

    /// Of two enclosures of the same number, the narrower one.
    pub fn or_sharper(self, other: Approx) -> Approx {
        if other.error < self.error || self.error.is_nan() {
            other
        } else {
            self
        }
    }

    pub fn less(self, other: Approx) -> Verdict {
        let yes = self.hi() < other.lo();
        let no = self.lo() >= other.hi();
        Verdict {
            holds: self.value < other.value,
            certain: yes || no,
        }
    }

    pub fn at_least(self, other: Approx) -> Verdict {
        let less = self.less(other);
        Verdict {
            holds: !less.holds,
            ..less
        }
    }

    pub fn at_least_zero(self) -> Verdict {
        self.at_least(Approx::exact(0.0))
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
        // A zero changes nothing.
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
        // The divisor's distance from zero is rounded too.
        Approx::rounded(value, inherited * (1.0 + 4.0 * UNIT) + 4.0 * TINY)
    }
}

/// What f64 says about a condition, and whether its error could turn that.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Verdict {
    pub holds: bool,
    pub certain: bool,
}

impl Verdict {
    pub const YES: Verdict = Verdict {
        holds: true,
        certain: true,
    };
    pub const NO: Verdict = Verdict {
        holds: false,
        certain: true,
    };
    /// Possible, but not the answer.
    pub const PERHAPS: Verdict = Verdict {
        holds: false,
        certain: false,
    };

    pub fn is_no(self) -> bool {
        self == Verdict::NO
    }

    pub fn is_yes(self) -> bool {
        self == Verdict::YES
    }

    pub fn and(self, other: Verdict) -> Verdict {
        if self.is_no() || other.is_no() {
            return Verdict::NO;
        }
        Verdict {
            holds: self.holds && other.holds,
            certain: self.certain && other.certain,
        }
    }
}

/// Three numbers with their errors.
pub type Approx3 = [Approx; 3];

pub fn exact3(v: [f64; 3]) -> Approx3 {
    v.map(Approx::exact)
}

pub fn add(a: Approx3, b: Approx3) -> Approx3 {
    std::array::from_fn(|k| a[k] + b[k])
}

pub fn sub(a: Approx3, b: Approx3) -> Approx3 {
    std::array::from_fn(|k| a[k] - b[k])
}

pub fn scaled(a: Approx3, s: Approx) -> Approx3 {
    a.map(|x| x * s)
}

pub fn dot(a: Approx3, b: Approx3) -> Approx {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn cross(a: Approx3, b: Approx3) -> Approx3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub fn values(a: Approx3) -> [f64; 3] {
    a.map(|x| x.value)
}
