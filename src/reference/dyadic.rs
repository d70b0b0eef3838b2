//! Exact numbers: integers of any length times powers of two (docs/numerics/oracle.md, O1).
//! All finite f64 are such numbers, and so are their sums, differences and products.

use super::number::Number;
use num_bigint::{BigInt, Sign};
use std::cmp::Ordering;
use std::convert::Infallible;

/// The number `integer` · 2^`power`.
#[derive(Clone, Debug)]
pub struct Dyadic {
    integer: BigInt,
    power: i64,
}

impl Dyadic {
    /// Returns `integer` · 2^`power`.
    pub fn new(integer: BigInt, power: i64) -> Dyadic {
        Dyadic { integer, power }
    }

    /// Returns 2^n.
    pub fn power_of_two(n: i64) -> Dyadic {
        Dyadic {
            integer: BigInt::from(1),
            power: n,
        }
    }

    /// Says whether the number is zero.
    pub fn is_zero(&self) -> bool {
        self.integer == BigInt::ZERO
    }

    /// Returns the exponent of the power of two.
    pub fn power(&self) -> i64 {
        self.power
    }

    /// Returns the integer that stands before 2^`power`, for a power no higher than the
    /// number's own.
    pub fn at_power(&self, power: i64) -> BigInt {
        &self.integer << (self.power - power)
    }

    /// Returns x and n with the number about x · 2^n and |x| between 2^63 and 2^64, or x
    /// zero.
    pub fn leading(&self) -> (f64, i64) {
        let drop = self.integer.bits() as i64 - 64;
        let top = if drop > 0 {
            &self.integer >> drop
        } else {
            &self.integer << -drop
        };
        let x = top.iter_u64_digits().next().unwrap_or(0) as f64;
        let negative = self.integer.sign() == Sign::Minus;
        (if negative { -x } else { x }, self.power + drop)
    }

    /// Returns an f64 near the number, not necessarily the nearest.
    pub fn rounded(&self) -> f64 {
        let (x, power) = self.leading();
        scaled(x, power)
    }

    /// Returns half of the number.
    pub fn half(&self) -> Dyadic {
        Dyadic {
            integer: self.integer.clone(),
            power: self.power - 1,
        }
    }
}

/// Returns x · 2^n in f64.
pub fn scaled(x: f64, n: i64) -> f64 {
    libm::scalbn(x, n.clamp(-5000, 5000) as i32)
}

impl Number for Dyadic {
    /// Every sign is known.
    type Undecided = Infallible;

    fn from_f64(x: f64) -> Dyadic {
        debug_assert!(x.is_finite());
        let bits = x.to_bits();
        let exponent = (bits >> 52 & 0x7ff) as i64;
        let fraction = bits & ((1 << 52) - 1);
        // Subnormals have no hidden bit, and the exponent of the least normal.
        let magnitude = if exponent == 0 {
            fraction
        } else {
            fraction | 1 << 52
        };
        // Trailing zeros are dropped, so that short numbers stay short.
        let zeros = magnitude.trailing_zeros() % 64;
        let integer = BigInt::from(magnitude >> zeros);
        Dyadic {
            integer: if x < 0.0 { -integer } else { integer },
            power: exponent.max(1) - 1075 + i64::from(zeros),
        }
    }

    fn plus(&self, other: &Dyadic) -> Dyadic {
        let power = self.power.min(other.power);
        Dyadic {
            integer: self.at_power(power) + other.at_power(power),
            power,
        }
    }

    fn minus(&self, other: &Dyadic) -> Dyadic {
        let power = self.power.min(other.power);
        Dyadic {
            integer: self.at_power(power) - other.at_power(power),
            power,
        }
    }

    fn times(&self, other: &Dyadic) -> Dyadic {
        Dyadic {
            integer: &self.integer * &other.integer,
            power: self.power + other.power,
        }
    }

    fn sign(&self) -> Result<Ordering, Infallible> {
        Ok(match self.integer.sign() {
            Sign::Minus => Ordering::Less,
            Sign::NoSign => Ordering::Equal,
            Sign::Plus => Ordering::Greater,
        })
    }

    fn exactly(&self) -> Result<Dyadic, Infallible> {
        Ok(self.clone())
    }
}
