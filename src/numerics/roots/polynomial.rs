//! Polynomials in one variable: coefficients, validated once, and scaling by powers of
//! two.
//!
//! The coefficients are f64 and taken as exact. A power of two in front, and one in the
//! variable, only move the roots along the exponent's scale. [`Polynomial::scaled_into`]
//! gives the coefficients of p(2^k s) with the largest about 1, so that neither
//! coefficients of 1e300 nor subnormal ones leave the range of f64 in computations.

use crate::math::int::decoded;
use thiserror::Error;

/// The highest supported degree.
pub const MAX_DEGREE: usize = 128;

/// The reason why coefficients are rejected.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum PolynomialError {
    #[error("coefficient {index} is {value}; all of them must be finite numbers")]
    NotFinite { index: usize, value: f64 },
    #[error("the degree is {degree}; at most {MAX_DEGREE} is supported")]
    Degree { degree: usize },
    #[error("all coefficients are 0, so every number is a root; give one that is not")]
    Zero,
}

/// The polynomial Σ cᵢ tⁱ with finite cᵢ, the last of which is not 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Polynomial {
    coefficients: Vec<f64>,
}

impl Polynomial {
    /// Validates coefficients, the constant one first; trailing zeros are dropped. Fails
    /// if one is not finite, all are 0, or the degree exceeds [`MAX_DEGREE`].
    pub fn new(coefficients: &[f64]) -> Result<Polynomial, PolynomialError> {
        for (index, value) in coefficients.iter().enumerate() {
            if !value.is_finite() {
                let value = *value;
                return Err(PolynomialError::NotFinite { index, value });
            }
        }
        let last = coefficients.iter().rposition(|c| *c != 0.0);
        let degree = last.ok_or(PolynomialError::Zero)?;
        if degree > MAX_DEGREE {
            return Err(PolynomialError::Degree { degree });
        }
        Ok(Polynomial {
            coefficients: coefficients[..=degree].into(),
        })
    }

    pub fn degree(&self) -> usize {
        self.coefficients.len() - 1
    }

    /// Returns the coefficients, the constant one first.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// Divides by the highest power of t; returns the quotient and that power, the
    /// multiplicity of the root 0.
    pub(super) fn without_zero(&self) -> (Polynomial, u32) {
        let zeros = self.coefficients.iter().take_while(|c| **c == 0.0).count();
        let rest = Polynomial {
            coefficients: self.coefficients[zeros..].into(),
        };
        (rest, zeros as u32)
    }

    /// Returns p(−t).
    pub(super) fn mirrored(&self) -> Polynomial {
        let signed = |(i, c): (usize, &f64)| if i % 2 == 1 { -c } else { *c };
        let coefficients = self.coefficients.iter().enumerate().map(signed);
        Polynomial {
            coefficients: coefficients.collect(),
        }
    }

    /// Writes the coefficients of p(2^k s), times a power of two that makes the largest ½
    /// to 1. Coefficients below 2^−1022 of that lose bits or vanish, each by less than
    /// 2^−1074.
    pub(super) fn scaled_into(&self, k: i32, to: &mut Vec<f64>) {
        let place = |(i, c): (usize, &f64)| exponent(*c).map(|e| e + k * i as i32);
        let largest = self.coefficients.iter().enumerate().filter_map(place).max();
        let down = largest.unwrap_or(0) + 1;
        to.clear();
        let scaled = |(i, c): (usize, &f64)| times_power(*c, k * i as i32 - down);
        to.extend(self.coefficients.iter().enumerate().map(scaled));
    }

    /// Returns k so that every root has |t| < 2^k (Fujiwara 1916:
    /// 2 max |c_{n−i} / c_n|^{1/i}).
    pub(super) fn root_bound(&self) -> i32 {
        bound_above(self.coefficients.iter().rev())
    }

    /// Returns k so that every root has |t| > 2^k, by the bound of 1/t. The constant
    /// coefficient must not be 0.
    pub(super) fn root_bound_below(&self) -> i32 {
        -bound_above(self.coefficients.iter())
    }
}

/// Computes Fujiwara's bound from coefficients, the leading one first.
fn bound_above<'a>(mut coefficients: impl Iterator<Item = &'a f64>) -> i32 {
    let leading = coefficients.next().and_then(|c| exponent(*c)).unwrap_or(0);
    let bound = |(i, c): (i32, &f64)| {
        let ratio = exponent(*c)? + 1 - leading;
        Some(-(-ratio).div_euclid(i))
    };
    let largest = (1..).zip(coefficients).filter_map(bound).max();
    1 + largest.unwrap_or(-3000)
}

/// Returns e with 2^e ≤ |x| < 2^(e+1); `None` for 0.
pub(super) fn exponent(x: f64) -> Option<i32> {
    let (magnitude, power) = decoded(x);
    (magnitude != 0).then(|| power + 63 - magnitude.leading_zeros() as i32)
}

/// Returns x · 2^power, rounded once if it is subnormal.
pub(super) fn times_power(x: f64, power: i32) -> f64 {
    let two_to = |k: i32| f64::from_bits(((k + 1023) as u64) << 52);
    if (-1022..=1023).contains(&power) {
        return x * two_to(power);
    }
    // Scale to an exponent near 0 first, so that only the last step rounds.
    let Some(own) = exponent(x) else {
        return x;
    };
    let near = x * two_to((-own).clamp(-1022, 1022));
    let near = near * two_to((-own - 1022).max(0)) * two_to((-own + 1022).min(0));
    match own + power {
        total @ -1022..=1023 => near * two_to(total),
        total @ ..-1022 => near * two_to(-1000) * two_to((total + 1000).max(-1022)),
        _ => near * f64::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_finite_polynomials_of_some_degree_pass() {
        assert_eq!(Polynomial::new(&[]), Err(PolynomialError::Zero));
        assert_eq!(Polynomial::new(&[0.0, -0.0]), Err(PolynomialError::Zero));
        let said = Polynomial::new(&[1.0, f64::NAN]).unwrap_err().to_string();
        assert!(said.contains("coefficient 1 is NaN"), "{said}");
        assert!(Polynomial::new(&[f64::INFINITY]).is_err());
        let mut long = vec![0.0; 500];
        long[MAX_DEGREE] = 1.0;
        assert_eq!(Polynomial::new(&long).unwrap().degree(), MAX_DEGREE);
        long[MAX_DEGREE + 1] = 1.0;
        let error = PolynomialError::Degree {
            degree: MAX_DEGREE + 1,
        };
        assert_eq!(Polynomial::new(&long), Err(error));
    }

    #[test]
    fn powers_of_two_are_exact_over_the_whole_range() {
        let tiny = f64::from_bits(1);
        assert_eq!(exponent(tiny), Some(-1074));
        assert_eq!(exponent(f64::MAX), Some(1023));
        assert_eq!(exponent(1.0), Some(0));
        assert_eq!(exponent(0.0), None);
        assert_eq!(times_power(tiny, 2097), 2.0_f64.powi(1023));
        assert_eq!(times_power(f64::MAX, -2097), tiny * 2.0);
        assert_eq!(times_power(f64::MAX, -3000), 0.0);
        assert_eq!(times_power(3.0, -1074), 3.0 * tiny);
        assert_eq!(times_power(1.0, 1024), f64::INFINITY);
        assert_eq!(times_power(0.0, 5000), 0.0);
        assert_eq!(times_power(-1.5, -1030), -1.5 * 2.0_f64.powi(-1030));
    }

    #[test]
    fn bounds_hold_the_roots() {
        // The roots are near 1e-300 and 1e300.
        let p = Polynomial::new(&[1.0, -1e300, 1.0]).unwrap();
        assert!((997..=999).contains(&p.root_bound()), "{}", p.root_bound());
        assert!((-999..=-997).contains(&p.root_bound_below()));
        let p = Polynomial::new(&[-8.0, 0.0, 0.0, 1.0]).unwrap();
        assert!(p.root_bound() >= 2 && p.root_bound_below() < 1);
    }
}
