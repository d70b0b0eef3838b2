//! Constants of expressions, folded before they become f64.
//!
//! A constant is a fraction of integers and exact, with two exceptions. Square roots
//! that are no fraction and π are known to 512 bits, and so are fractions that have
//! grown beyond 8192 bits. Where such numbers cancel to less than 2^−400 of what they
//! were, the difference is 0: sqrt(5)^2 − 5 is. A constant is rounded to f64 once, when
//! it is put on a tape.

use num_bigint::{BigInt, Sign};
use std::sync::LazyLock;

/// Bits of what cannot be exact.
const PRECISION: i64 = 512;

/// Bits that a fraction may have, both parts together, and stay exact.
const LARGEST_EXACT: u64 = 8192;

/// Magnitudes are below 2 to this power, and above its inverse.
const LARGEST_POWER: i64 = 4096;

/// Inexact differences this many powers of 2 below their operands are 0.
const CANCELLED: i64 = 400;

/// Why there is no such constant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoConstant {
    TooLarge,
    TooSmall,
    DividedByZero,
    RootOfNegative,
}

impl NoConstant {
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

#[derive(Clone, Debug)]
pub struct Rational {
    top: BigInt,
    /// Above 0.
    bottom: BigInt,
    is_exact: bool,
}

impl Rational {
    pub fn whole(value: i64) -> Rational {
        Rational::exact(BigInt::from(value), BigInt::from(1))
    }

    fn exact(top: BigInt, bottom: BigInt) -> Rational {
        Rational {
            top,
            bottom,
            is_exact: true,
        }
    }

    /// Of a finite number; exactly.
    pub fn of(value: f64) -> Rational {
        let (magnitude, power) = crate::math::int::decoded(value);
        let top = BigInt::from(magnitude);
        let top = if value < 0.0 { -top } else { top };
        let [up, down] = [power, -power].map(|p| p.max(0) as u32);
        Rational::exact(top << up, BigInt::from(1) << down)
    }

    /// Of digits with a point or without, before and after which there may be none,
    /// times a power of ten.
    pub fn decimal(whole: &str, part: &str, exponent: i64) -> Result {
        let digits: String = [whole, part].concat();
        let digits = digits.trim_start_matches('0');
        if digits.is_empty() {
            return Ok(Rational::whole(0));
        }
        // The value is below 10 to this power, and not below a tenth of that.
        let length = digits.len() as i64;
        let power = exponent.saturating_sub(part.len() as i64);
        if power.saturating_add(length) > LARGEST_POWER {
            return Err(NoConstant::TooLarge);
        }
        if power.saturating_add(length) < -LARGEST_POWER {
            return Err(NoConstant::TooSmall);
        }
        let top = BigInt::parse_bytes(digits.as_bytes(), 10).unwrap_or_default();
        let [up, down] = [power, -power].map(|p| BigInt::from(10).pow(p.max(0) as u32));
        Rational::exact(top * up, down).kept()
    }

    pub fn pi() -> Rational {
        static PI: LazyLock<Rational> = LazyLock::new(machin);
        PI.clone()
    }

    pub fn sign(&self) -> Sign {
        self.top.sign()
    }

    pub fn is_zero(&self) -> bool {
        self.sign() == Sign::NoSign
    }

    pub fn is_one(&self) -> bool {
        self.top == self.bottom
    }

    pub fn equals(&self, other: &Rational) -> bool {
        &self.top * &other.bottom == &other.top * &self.bottom
    }

    pub fn negated(mut self) -> Rational {
        self.top = -self.top;
        self
    }

    pub fn magnitude(self) -> Rational {
        match self.sign() {
            Sign::Minus => self.negated(),
            _ => self,
        }
    }

    pub fn plus(&self, other: &Rational) -> Result {
        let sum = Rational {
            top: &self.top * &other.bottom + &other.top * &self.bottom,
            bottom: &self.bottom * &other.bottom,
            is_exact: self.is_exact && other.is_exact,
        };
        let power = self.power().max(other.power());
        if !sum.is_exact && sum.power() < power - CANCELLED {
            return Ok(Rational::whole(0));
        }
        sum.kept()
    }

    pub fn times(&self, other: &Rational) -> Result {
        let product = Rational {
            top: &self.top * &other.top,
            bottom: &self.bottom * &other.bottom,
            is_exact: self.is_exact && other.is_exact,
        };
        product.kept()
    }

    pub fn over(&self, other: &Rational) -> Result {
        let [top, bottom] = match other.sign() {
            Sign::NoSign => return Err(NoConstant::DividedByZero),
            Sign::Plus => [&self.top * &other.bottom, &self.bottom * &other.top],
            Sign::Minus => [-(&self.top * &other.bottom), -(&self.bottom * &other.top)],
        };
        let is_exact = self.is_exact && other.is_exact;
        let quotient = Rational {
            top,
            bottom,
            is_exact,
        };
        quotient.kept()
    }

    /// By repeated squares; to the power 0 it is 1.
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

    /// √(a/b) = √(ab) / b: exact if ab is a square.
    pub fn root(&self) -> Result {
        if self.sign() == Sign::Minus {
            return Err(NoConstant::RootOfNegative);
        }
        let square = &self.top * &self.bottom;
        let root = square.sqrt();
        if &root * &root == square {
            let root = Rational {
                top: root,
                bottom: self.bottom.clone(),
                is_exact: self.is_exact,
            };
            return root.kept();
        }
        let shift = (PRECISION + 1 - root.bits() as i64).max(0) as u64;
        let root = Rational {
            top: (square << (2 * shift)).sqrt(),
            bottom: &self.bottom << shift,
            is_exact: false,
        };
        root.kept()
    }

    /// If it is one, 0 or above, and no larger than any exponent can be.
    pub fn as_exponent(&self) -> Option<u32> {
        let quotient = &self.top / &self.bottom;
        let is_whole = &quotient * &self.bottom == self.top;
        u32::try_from(quotient).ok().filter(|_| is_whole)
    }

    /// Whole and positive, but no exponent.
    pub fn is_large_exponent(&self) -> bool {
        let quotient = &self.top / &self.bottom;
        &quotient * &self.bottom == self.top && quotient > BigInt::from(u32::MAX)
    }

    /// The nearest f64, ties to even.
    pub fn rounded(&self) -> std::result::Result<f64, NoConstant> {
        if self.is_zero() {
            return Ok(0.0);
        }
        let magnitude = BigInt::from(self.top.magnitude().clone());
        // The value is between 2^(power − 1) and 2^(power + 1), so that the quotient on a
        // grid of `last` has 53 or 54 bits, or fewer where f64 has no finer grid.
        let mut last = (self.power() - 53).max(-1074);
        let quotient = loop {
            let [up, down] = [-last, last].map(|p| p.max(0) as u64);
            let (top, bottom) = (&magnitude << up, &self.bottom << down);
            let quotient = &top / &bottom;
            if quotient.bits() > 53 {
                last += 1;
                continue;
            }
            let rest: BigInt = (top - &quotient * &bottom) << 1_u32;
            let odd = quotient.bit(0);
            let is_up = rest > bottom || rest == bottom && odd;
            break if is_up { quotient + 1 } else { quotient };
        };
        // Of 54 bits at most if it was rounded up, and then the lower ones are 0.
        let quotient = u64::try_from(quotient).unwrap_or(u64::MAX);
        let value = libm::ldexp(quotient as f64, last as i32);
        match value {
            0.0 => Err(NoConstant::TooSmall),
            _ if value.is_infinite() => Err(NoConstant::TooLarge),
            _ if self.sign() == Sign::Minus => Ok(-value),
            _ => Ok(value),
        }
    }

    /// Its magnitude is between 2^(power − 1) and 2^(power + 1).
    fn power(&self) -> i64 {
        match self.is_zero() {
            true => i64::MIN / 2,
            false => self.top.bits() as i64 - self.bottom.bits() as i64,
        }
    }

    /// Within what is kept of a number.
    fn kept(mut self) -> Result {
        if self.is_zero() {
            return Ok(Rational::whole(0));
        }
        let power = self.power();
        if power > LARGEST_POWER {
            return Err(NoConstant::TooLarge);
        }
        if power < -LARGEST_POWER {
            return Err(NoConstant::TooSmall);
        }
        let zeros = |n: &BigInt| n.trailing_zeros().unwrap_or(0);
        let common = zeros(&self.top).min(zeros(&self.bottom));
        self.top >>= common;
        self.bottom >>= common;
        let bits = self.top.bits() + self.bottom.bits();
        if bits <= LARGEST_EXACT {
            return Ok(self);
        }
        let shift = PRECISION - power;
        let [up, down] = [shift, -shift].map(|s| s.max(0) as u64);
        let (top, bottom) = (self.top << up, self.bottom << down);
        Ok(Rational {
            top: (top / bottom) << down,
            bottom: BigInt::from(1) << up,
            is_exact: false,
        })
    }
}

/// π = 16 arctan(1/5) − 4 arctan(1/239) (Machin 1706), by the series, to some bits
/// more than the precision.
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
        top: arctan_of_inverse(5) * 16 - arctan_of_inverse(239) * 4,
        bottom: one,
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
        let half = Rational::of(f64::EPSILON / 2.0);
        let one = whole(1);
        assert_eq!(one.plus(&half).unwrap().rounded(), Ok(1.0));
        let odd = Rational::of(1.0 + f64::EPSILON);
        assert_eq!(
            odd.plus(&half).unwrap().rounded(),
            Ok(1.0 + 2.0 * f64::EPSILON)
        );
        let more = half.plus(&Rational::of(1e-300)).unwrap();
        assert_eq!(
            one.plus(&more).unwrap().rounded(),
            Ok(1.0 + f64::EPSILON),
            "1e-300 counts"
        );
        for value in [0.0, -1.5, f64::MAX, f64::MIN_POSITIVE, 5e-324, -2.2e-308] {
            assert_eq!(Rational::of(value).rounded(), Ok(value), "{value:e}");
        }
        let tiny = Rational::of(5e-324);
        let three = tiny.times(&whole(3)).unwrap();
        assert_eq!(three.over(&whole(2)).unwrap().rounded(), Ok(1e-323));
        assert_eq!(
            tiny.over(&whole(2)).unwrap().rounded(),
            Err(NoConstant::TooSmall)
        );
        let twice = Rational::of(f64::MAX).times(&whole(2)).unwrap();
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
        assert!(!five.plus(&Rational::of(-5.000001)).unwrap().is_zero());
    }

    #[test]
    fn fractions_do_not_grow_without_end() {
        let (mut value, mut near) = (ratio(3, 7), 3.0 / 7.0);
        for i in 1..1000 {
            let term = ratio(1, 9_999_991 + i);
            value = value.plus(&term).unwrap();
            near += 1.0 / f64::from(9_999_991 + i as i32);
            let bits = value.top.bits() + value.bottom.bits();
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
