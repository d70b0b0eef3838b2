//! Exact numbers: integers of any length times powers of two, and their quotients.

use num_bigint::{BigInt, Sign};
use std::cmp::Ordering;
use std::ops::{Add, Mul, Neg, Sub};

/// `integer` · 2^`power`.
#[derive(Clone, Debug)]
pub struct Exact {
    pub integer: BigInt,
    pub power: i64,
}

/// (m, p) of a finite |x| = m · 2^p.
pub fn decode(x: f64) -> (u64, i64) {
    let (exponent, fraction) = ((x.to_bits() >> 52 & 0x7ff) as i64, x.to_bits() << 12 >> 12);
    match exponent {
        0 => (fraction, -1074),
        _ => (fraction + (1 << 52), exponent - 1075),
    }
}

impl From<f64> for Exact {
    fn from(x: f64) -> Exact {
        assert!(x.is_finite());
        let (m, power) = decode(x);
        let zeros = if m == 0 { 0 } else { m.trailing_zeros() };
        let integer = BigInt::from(m >> zeros);
        Exact {
            integer: if x < 0.0 { -integer } else { integer },
            power: if m == 0 { 0 } else { power + i64::from(zeros) },
        }
    }
}

fn aligned(a: &Exact, b: &Exact, op: impl Fn(&BigInt, &BigInt) -> BigInt) -> Exact {
    // A zero must not drag the other down to its power.
    if a.integer.sign() == Sign::NoSign || b.integer.sign() == Sign::NoSign {
        let power = if a.integer.sign() == Sign::NoSign {
            b.power
        } else {
            a.power
        };
        return Exact {
            integer: op(&a.integer, &b.integer),
            power,
        };
    }
    let power = a.power.min(b.power);
    let at = |x: &Exact| &x.integer << (x.power - power);
    Exact {
        integer: op(&at(a), &at(b)),
        power,
    }
}

impl Add for &Exact {
    type Output = Exact;
    fn add(self, o: &Exact) -> Exact {
        aligned(self, o, |a, b| a + b)
    }
}

impl Sub for &Exact {
    type Output = Exact;
    fn sub(self, o: &Exact) -> Exact {
        aligned(self, o, |a, b| a - b)
    }
}

impl Mul for &Exact {
    type Output = Exact;
    fn mul(self, o: &Exact) -> Exact {
        Exact {
            integer: &self.integer * &o.integer,
            power: self.power + o.power,
        }
    }
}

impl Neg for &Exact {
    type Output = Exact;
    fn neg(self) -> Exact {
        Exact {
            integer: -&self.integer,
            power: self.power,
        }
    }
}

impl Exact {
    pub fn int(x: i32) -> Exact {
        f64::from(x).into()
    }

    /// How it compares with 0.
    pub fn sign(&self) -> Ordering {
        self.integer.cmp(&BigInt::ZERO)
    }

    /// −1, 0 or 1.
    pub fn signum(&self) -> i32 {
        self.sign() as i32
    }

    pub fn order(&self, other: &Exact) -> Ordering {
        (self - other).sign()
    }

    pub fn abs(&self) -> Exact {
        if self.sign().is_lt() {
            -self
        } else {
            self.clone()
        }
    }

    /// |self| / |other| in parts per million, rounded down.
    pub fn millionths_of(&self, other: &Exact) -> u64 {
        let power = self.power.min(other.power);
        let at = |x: &Exact| x.integer.magnitude() << (x.power - power);
        let parts = at(self) * 1_000_000_u32 / at(other);
        parts.iter_u64_digits().next().unwrap_or(0)
    }
}

/// `top` / `bottom`, `bottom` > 0.
#[derive(Clone, Debug)]
pub struct Quotient {
    pub top: Exact,
    pub bottom: Exact,
}

impl From<f64> for Quotient {
    fn from(x: f64) -> Quotient {
        Quotient {
            top: x.into(),
            bottom: 1.0.into(),
        }
    }
}

impl Quotient {
    /// `bottom` is not 0.
    pub fn new(top: Exact, bottom: Exact) -> Quotient {
        match bottom.sign() {
            Ordering::Less => Quotient {
                top: -&top,
                bottom: -&bottom,
            },
            _ => Quotient { top, bottom },
        }
    }

    pub fn order(&self, o: &Quotient) -> Ordering {
        (&(&self.top * &o.bottom) - &(&o.top * &self.bottom)).sign()
    }
}

pub type Vector = [Exact; 3];

pub fn vector(v: [f64; 3]) -> Vector {
    v.map(Exact::from)
}

pub fn minus(a: &Vector, b: &Vector) -> Vector {
    [0, 1, 2].map(|k| &a[k] - &b[k])
}

pub fn dot(a: &Vector, b: &Vector) -> Exact {
    &(&(&a[0] * &b[0]) + &(&a[1] * &b[1])) + &(&a[2] * &b[2])
}
