//! Rational constants: the constants of expressions, folded before they are rounded to f64.
//!
//! A constant is an exact fraction of integers, with two exceptions: irrational square
//! roots and π are kept to 512 bits, and so are fractions that have grown beyond 8192 bits.
//! If a sum of such inexact numbers is less than 2^−400 of its larger operand, it counts as
//! 0; sqrt(5)^2 − 5 does. A constant is rounded to f64 once, when it becomes the step of a
//! tape.

use num_bigint::{BigInt, Sign};
use std::sync::LazyLock;

/// Bits of an inexact number.
const PRECISION: i64 = 512;

/// Limit on the bits of an exact fraction, numerator and denominator together.
const LARGEST_EXACT: u64 = 8192;

/// Limit on the exponent: magnitudes are about 2^−4096 to 2^4096.
const LARGEST_POWER: i64 = 4096;

/// An inexact sum counts as 0 if it is smaller than its larger operand by more than 2 to
/// this power.
const CANCELLED: i64 = 400;

/// The reasons why a constant cannot be represented.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoConstant {
    TooLarge,
    TooSmall,
    DividedByZero,
    RootOfNegative,
}

impl NoConstant {
    /// The message for users, without a place.
    pub fn message(self) -> &'static str {
        match self {
            NoConstant::TooLarge => "this constant is too large for a number",
            NoConstant::TooSmall => "this constant is not 0, but too small for a number",
            NoConstant::DividedByZero => "this divides by 0",
            NoConstant::RootOfNegative => "this is the square root of a negative number",
        }
    }
}

type Result = std::result::Result<Rational, NoConstant>;

/// A constant: a fraction, exact or rounded to [`PRECISION`] bits.
#[derive(Clone, Debug)]
pub struct Rational {
    numerator: BigInt,
    /// Positive.
    denominator: BigInt,
    is_exact: bool,
}

impl Rational {
    /// An integer, exactly.
    pub fn whole(value: i64) -> Rational {
        Rational::exact(BigInt::from(value), BigInt::from(1))
    }

    fn exact(numerator: BigInt, denominator: BigInt) -> Rational {
        Rational {
            numerator,
            denominator,
            is_exact: true,
        }
    }

    /// Converts a finite f64, exactly.
    pub fn from_f64(value: f64) -> Rational {
        let (magnitude, power) = crate::math::int::decoded(value);
        let numerator = BigInt::from(magnitude);
        let numerator = if value < 0.0 { -numerator } else { numerator };
        let [up, down] = [power, -power].map(|p| p.max(0) as u32);
        Rational::exact(numerator << up, BigInt::from(1) << down)
    }

    /// Converts the decimal number `whole`.`part` × 10^`exponent`; either string of digits
    /// may be empty. Fails if the magnitude is beyond the limits, before it is computed.
    pub fn decimal(whole: &str, part: &str, exponent: i64) -> Result {
        let digits: String = [whole, part].concat();
        let digits = digits.trim_start_matches('0');
        if digits.is_empty() {
            return Ok(Rational::whole(0));
        }
        // The value is at least 10^(power + length − 1) and below 10^(power + length).
        let length = digits.len() as i64;
        let power = exponent.saturating_sub(part.len() as i64);
        if power.saturating_add(length) > LARGEST_POWER {
            return Err(NoConstant::TooLarge);
        }
        if power.saturating_add(length) < -LARGEST_POWER {
            return Err(NoConstant::TooSmall);
        }
        let numerator = BigInt::parse_bytes(digits.as_bytes(), 10).unwrap_or_default();
        let [up, down] = [power, -power].map(|p| BigInt::from(10).pow(p.max(0) as u32));
        Rational::exact(numerator * up, down).normalized()
    }

    /// π to [`PRECISION`] bits.
    pub fn pi() -> Rational {
        static PI: LazyLock<Rational> = LazyLock::new(machin);
        PI.clone()
    }

    pub fn sign(&self) -> Sign {
        self.numerator.sign()
    }

    pub fn is_zero(&self) -> bool {
        self.sign() == Sign::NoSign
    }

    /// Whether the value is 1.
    pub fn is_one(&self) -> bool {
        self.numerator == self.denominator
    }

    /// Whether two values are equal; fractions need not be reduced.
    pub fn equals(&self, other: &Rational) -> bool {
        &self.numerator * &other.denominator == &other.numerator * &self.denominator
    }

    pub fn negated(mut self) -> Rational {
        self.numerator = -self.numerator;
        self
    }

    /// The absolute value.
    pub fn magnitude(self) -> Rational {
        match self.sign() {
            Sign::Minus => self.negated(),
            _ => self,
        }
    }

    /// Adds; an inexact sum that cancels is 0. Fails if the sum is beyond the limits.
    pub fn plus(&self, other: &Rational) -> Result {
        let sum = Rational {
            numerator: &self.numerator * &other.denominator + &other.numerator * &self.denominator,
            denominator: &self.denominator * &other.denominator,
            is_exact: self.is_exact && other.is_exact,
        };
        let power = self.exponent().max(other.exponent());
        if !sum.is_exact && sum.exponent() < power - CANCELLED {
            return Ok(Rational::whole(0));
        }
        sum.normalized()
    }

    /// Multiplies; fails if the product is beyond the limits.
    pub fn times(&self, other: &Rational) -> Result {
        let product = Rational {
            numerator: &self.numerator * &other.numerator,
            denominator: &self.denominator * &other.denominator,
            is_exact: self.is_exact && other.is_exact,
        };
        product.normalized()
    }

    /// Divides; fails if `other` is 0 or the quotient is beyond the limits.
    pub fn over(&self, other: &Rational) -> Result {
        let [numerator, denominator] = match other.sign() {
            Sign::NoSign => return Err(NoConstant::DividedByZero),
            Sign::Plus => [
                &self.numerator * &other.denominator,
                &self.denominator * &other.numerator,
            ],
            Sign::Minus => [
                -(&self.numerator * &other.denominator),
                -(&self.denominator * &other.numerator),
            ],
        };
        let is_exact = self.is_exact && other.is_exact;
        let quotient = Rational {
            numerator,
            denominator,
            is_exact,
        };
        quotient.normalized()
    }

    /// Raises to a power by repeated squaring; the power 0 is 1, also of 0. Fails if a value
    /// on the way is beyond the limits.
    pub fn to_the(&self, exponent: u32) -> Result {
        let (mut square, mut rest) = (self.clone(), exponent);
        let mut product = Rational::whole(1);
        while rest > 0 {
            if rest & 1 == 1 {
                product = product.times(&square)?;
            }
            rest >>= 1;
            if rest > 0 {
                square = square.times(&square)?;
            }
        }
        Ok(product)
    }

    /// Takes the square root as √(a/b) = √(ab) / b, which is exact if ab is a square. Fails
    /// for negative values.
    pub fn root(&self) -> Result {
        if self.sign() == Sign::Minus {
            return Err(NoConstant::RootOfNegative);
        }
        let square = &self.numerator * &self.denominator;
        let root = square.sqrt();
        if &root * &root == square {
            let root = Rational {
                numerator: root,
                denominator: self.denominator.clone(),
                is_exact: self.is_exact,
            };
            return root.normalized();
        }
        let shift = (PRECISION + 1 - root.bits() as i64).max(0) as u64;
        let root = Rational {
            numerator: (square << (2 * shift)).sqrt(),
            denominator: &self.denominator << shift,
            is_exact: false,
        };
        root.normalized()
    }

    /// Converts to a u32; `None` if the value is no integer, negative or too large.
    pub fn as_exponent(&self) -> Option<u32> {
        let quotient = &self.numerator / &self.denominator;
        let is_whole = &quotient * &self.denominator == self.numerator;
        u32::try_from(quotient).ok().filter(|_| is_whole)
    }

    /// Whether the value is an integer larger than u32 can hold.
    pub fn is_large_exponent(&self) -> bool {
        let quotient = &self.numerator / &self.denominator;
        &quotient * &self.denominator == self.numerator && quotient > BigInt::from(u32::MAX)
    }

    /// Rounds to the nearest f64, ties to even. Fails if the result is infinite, or 0 for a
    /// value that is not 0.
    pub fn rounded(&self) -> std::result::Result<f64, NoConstant> {
        if self.is_zero() {
            return Ok(0.0);
        }
        let magnitude = BigInt::from(self.numerator.magnitude().clone());
        // The value is between 2^(power − 1) and 2^(power + 1), so its quotient by 2^last has
        // 53 or 54 bits, or fewer where f64 is subnormal.
        let mut last = (self.exponent() - 53).max(-1074);
        let quotient = loop {
            let [up, down] = [-last, last].map(|p| p.max(0) as u64);
            let (numerator, denominator) = (&magnitude << up, &self.denominator << down);
            let quotient = &numerator / &denominator;
            if quotient.bits() > 53 {
                last += 1;
                continue;
            }
            let rest: BigInt = (numerator - &quotient * &denominator) << 1_u32;
            let odd = quotient.bit(0);
            let is_up = rest > denominator || rest == denominator && odd;
            break if is_up { quotient + 1 } else { quotient };
        };
        // Rounding up can give 54 bits, of which the lower 53 are 0, so f64 holds it.
        let quotient = u64::try_from(quotient).unwrap_or(u64::MAX);
        let value = libm::ldexp(quotient as f64, last as i32);
        match value {
            0.0 => Err(NoConstant::TooSmall),
            _ if value.is_infinite() => Err(NoConstant::TooLarge),
            _ if self.sign() == Sign::Minus => Ok(-value),
            _ => Ok(value),
        }
    }

    /// An exponent such that the magnitude is between 2^(power − 1) and 2^(power + 1); very
    /// low for 0.
    fn exponent(&self) -> i64 {
        match self.is_zero() {
            true => i64::MIN / 2,
            false => self.numerator.bits() as i64 - self.denominator.bits() as i64,
        }
    }

    /// Brings a result into the form that is kept: removes common powers of 2, and rounds
    /// fractions of too many bits. Fails if the magnitude is beyond the limits.
    fn normalized(mut self) -> Result {
        if self.is_zero() {
            return Ok(Rational::whole(0));
        }
        let power = self.exponent();
        if power > LARGEST_POWER {
            return Err(NoConstant::TooLarge);
        }
        if power < -LARGEST_POWER {
            return Err(NoConstant::TooSmall);
        }
        let zeros = |n: &BigInt| n.trailing_zeros().unwrap_or(0);
        let common = zeros(&self.numerator).min(zeros(&self.denominator));
        self.numerator >>= common;
        self.denominator >>= common;
        let bits = self.numerator.bits() + self.denominator.bits();
        if bits <= LARGEST_EXACT {
            return Ok(self);
        }
        let shift = PRECISION - power;
        let [up, down] = [shift, -shift].map(|s| s.max(0) as u64);
        let (numerator, denominator) = (self.numerator << up, self.denominator << down);
        Ok(Rational {
            numerator: (numerator / denominator) << down,
            denominator: BigInt::from(1) << up,
            is_exact: false,
        })
    }
}

/// Computes π = 16 arctan(1/5) − 4 arctan(1/239) (Machin 1706) by the arctangent's series,
/// with guard bits beyond [`PRECISION`].
fn machin() -> Rational {
    const GUARD: i64 = 32;
    let one = BigInt::from(1) << (PRECISION + GUARD);
    let arctan_of_inverse = |n: i32| {
        let (mut term, mut sum) = (&one / n, BigInt::from(0));
        let mut odd = 1;
        while term.sign() != Sign::NoSign {
            match odd % 4 {
                1 => sum += &term / odd,
                _ => sum -= &term / odd,
            }
            term /= n * n;
            odd += 2;
        }
        sum
    };
    Rational {
        numerator: arctan_of_inverse(5) * 16 - arctan_of_inverse(239) * 4,
        denominator: one,
        is_exact: false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn whole(value: i64) -> Rational {
        Rational::whole(value)
    }

    fn ratio(a: i64, b: i64) -> Rational {
        whole(a).over(&whole(b)).unwrap()
    }

    #[test]
    fn constants_are_the_nearest_numbers() {
        let golden = ratio(1, 2)
            .plus(&whole(5).root().unwrap().over(&whole(2)).unwrap())
            .unwrap();
        // (3 + √5)/2 = 2.618033988749894848204586834365638117720…
        let square = golden.to_the(2).unwrap();
        assert_eq!(square.rounded(), Ok(2.618_033_988_749_895));
        assert_eq!(ratio(18561, 6550).rounded(), Ok(18561.0 / 6550.0));
        assert_eq!(ratio(-9, 80).rounded(), Ok(-0.1125));
        assert_eq!(ratio(1, 3).rounded(), Ok(1.0 / 3.0));
        assert_eq!(Rational::pi().rounded(), Ok(std::f64::consts::PI));
        // More digits of π: 3.14159265358979323846264338327950288 4197169399375105820974944…
        let digits = Rational::decimal("3", "14159265358979323846264338327950288", 0).unwrap();
        let rest = Rational::pi().plus(&digits.negated()).unwrap();
        assert_eq!(rest.rounded(), Ok(4.197_169_399_375_106e-36));
        assert_eq!(whole(2).root().unwrap().rounded(), Ok(2_f64.sqrt()));
        assert_eq!(ratio(9, 16).root().unwrap().rounded(), Ok(0.75));
    }

    #[test]
    fn rounding_is_to_nearest_and_to_even() {
        let half = Rational::from_f64(f64::EPSILON / 2.0);
        let one = whole(1);
        assert_eq!(one.plus(&half).unwrap().rounded(), Ok(1.0));
        let odd = Rational::from_f64(1.0 + f64::EPSILON);
        assert_eq!(
            odd.plus(&half).unwrap().rounded(),
            Ok(1.0 + 2.0 * f64::EPSILON)
        );
        let more = half.plus(&Rational::from_f64(1e-300)).unwrap();
        assert_eq!(
            one.plus(&more).unwrap().rounded(),
            Ok(1.0 + f64::EPSILON),
            "1e-300 counts"
        );
        for value in [0.0, -1.5, f64::MAX, f64::MIN_POSITIVE, 5e-324, -2.2e-308] {
            assert_eq!(Rational::from_f64(value).rounded(), Ok(value), "{value:e}");
        }
        let tiny = Rational::from_f64(5e-324);
        let three = tiny.times(&whole(3)).unwrap();
        assert_eq!(three.over(&whole(2)).unwrap().rounded(), Ok(1e-323));
        assert_eq!(
            tiny.over(&whole(2)).unwrap().rounded(),
            Err(NoConstant::TooSmall)
        );
        let twice = Rational::from_f64(f64::MAX).times(&whole(2)).unwrap();
        assert_eq!(twice.rounded(), Err(NoConstant::TooLarge));
    }

    #[test]
    fn decimals_are_read_as_f64_does() {
        for (whole, part, exponent) in [
            ("1", "", -3),
            ("", "5", 0),
            ("0", "1", 0),
            ("1", "7976931348623157", 308),
            ("2", "2250738585072011", -308),
            ("9007199254740993", "", 0),
            ("123456789012345678901234567890", "123", -40),
            ("0000", "000", 99_999),
        ] {
            let text = format!("0{whole}.{part}0e{exponent}");
            let value = Rational::decimal(whole, part, exponent).unwrap().rounded();
            assert_eq!(value, Ok(text.parse().unwrap()), "{text}");
        }
        let of = |exponent| Rational::decimal("1", "", exponent).map(|_| ());
        assert_eq!(of(i64::MAX), Err(NoConstant::TooLarge));
        assert_eq!(of(i64::MIN), Err(NoConstant::TooSmall));
        assert_eq!(of(4000), Err(NoConstant::TooLarge));
    }

    #[test]
    fn what_cancels_is_zero() {
        let five = whole(5).root().unwrap().to_the(2).unwrap();
        assert!(!five.is_exact);
        assert_eq!(five.rounded(), Ok(5.0));
        assert!(five.plus(&whole(-5)).unwrap().is_zero());
        assert!(ratio(1, 3).plus(&ratio(2, 3)).unwrap().equals(&ratio(7, 7)));
        assert!(!five.plus(&Rational::from_f64(-5.000001)).unwrap().is_zero());
    }

    #[test]
    fn fractions_do_not_grow_without_end() {
        let (mut value, mut near) = (ratio(3, 7), 3.0 / 7.0);
        for i in 1..1000 {
            let term = ratio(1, 9_999_991 + i);
            value = value.plus(&term).unwrap();
            near += 1.0 / f64::from(9_999_991 + i as i32);
            let bits = value.numerator.bits() + value.denominator.bits();
            assert!(bits <= 8192, "{bits}");
        }
        let found = value.rounded().unwrap();
        assert!((found - near).abs() < 1e-13, "{found} {near}");
        assert_eq!(whole(2).to_the(1 << 13).err(), Some(NoConstant::TooLarge));
        assert_eq!(
            ratio(1, 2).to_the(1 << 13).err(),
            Some(NoConstant::TooSmall)
        );
        assert_eq!(
            whole(1).over(&whole(0)).err(),
            Some(NoConstant::DividedByZero)
        );
        assert_eq!(whole(-2).root().err(), Some(NoConstant::RootOfNegative));
        assert_eq!(whole(24).as_exponent(), Some(24));
        assert_eq!(ratio(5, 2).as_exponent(), None);
        assert_eq!(whole(-1).as_exponent(), None);
    }
}
