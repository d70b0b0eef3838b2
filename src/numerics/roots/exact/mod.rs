//! Polynomials over the integers, which decide what f64 leaves open.
//!
//! The f64 coefficients of a polynomial are integers times one power of two, and points
//! on the line are dyadic. So signs, greatest common divisors and Descartes' counts are
//! exact. Square factors are removed first (`divisor.rs`). The square-free part is
//! isolated by subdivision (`descartes.rs`) or by Sturm's chain (`chain.rs`). Every root
//! is rounded to the nearest f64 by signs at f64 numbers and halfway between them
//! (`rounding.rs`).

mod chain;
mod descartes;
mod divisor;
mod rounding;

pub use chain::isolate_by_chain;
pub use descartes::{Isolated, isolate};
pub use divisor::{Factors, divisor, factors};
pub use rounding::{nearest, rounded};

use super::polynomial::Polynomial;
use crate::math::int::decoded;
use num_bigint::{BigInt, Sign};
use std::cmp::Ordering;

/// Integer coefficients, the constant one first; the last is not 0.
pub type Integers = Vec<BigInt>;

/// Converts f64 coefficients to integers by a common power of two, the largest one that
/// makes them integers.
pub fn integers(p: &Polynomial) -> Integers {
    let parts = p.coefficients().iter().map(|c| (decoded(*c), *c < 0.0));
    let odd = |m: u64, e: i32| (m >> m.trailing_zeros(), e + m.trailing_zeros() as i32);
    let parts: Vec<(u64, i32, bool)> = parts
        .map(|((m, e), negative)| match m {
            0 => (0, i32::MAX, false),
            _ => (odd(m, e).0, odd(m, e).1, negative),
        })
        .collect();
    let least = parts.iter().map(|(_, e, _)| *e).min().unwrap_or(0);
    let number = |(m, e, negative): &(u64, i32, bool)| match m {
        0 => BigInt::ZERO,
        m => {
            let size = BigInt::from(*m) << (e - least) as u32;
            if *negative { -size } else { size }
        }
    };
    parts.iter().map(number).collect()
}

/// The dyadic number m · 2^e.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Point {
    pub m: BigInt,
    pub e: i64,
}

impl Point {
    /// Converts s · 2^k for a finite s, exactly.
    pub fn of(s: f64, k: i32) -> Point {
        let (m, e) = decoded(s);
        let m = BigInt::from(m);
        Point {
            m: if s < 0.0 { -m } else { m },
            e: i64::from(e) + i64::from(k),
        }
    }

    /// Returns the exact midpoint.
    pub fn middle(&self, other: &Point) -> Point {
        let [a, b, e] = aligned(self, other);
        Point {
            m: a + b,
            e: i64::try_from(e).unwrap_or(0) - 1,
        }
        .reduced()
    }

    /// Makes m odd, or 0.
    fn reduced(self) -> Point {
        let zeros = self.m.trailing_zeros().unwrap_or(0);
        Point {
            m: self.m >> zeros,
            e: self.e + zeros as i64,
        }
    }
}

/// Returns both numerators over the common power of two, and its exponent.
fn aligned(a: &Point, b: &Point) -> [BigInt; 3] {
    let e = a.e.min(b.e);
    let over = |p: &Point| p.m.clone() << (p.e - e) as u64;
    [over(a), over(b), BigInt::from(e)]
}

impl PartialOrd for Point {
    fn partial_cmp(&self, other: &Point) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Point {
    fn cmp(&self, other: &Point) -> Ordering {
        let [a, b, _] = aligned(self, other);
        a.cmp(&b)
    }
}

/// Returns the sign of p at a point.
pub fn sign_at(p: &[BigInt], at: &Point) -> Ordering {
    let mut y = BigInt::ZERO;
    if at.e >= 0 {
        let x = at.m.clone() << at.e as u64;
        for c in p.iter().rev() {
            y = y * &x + c;
        }
    } else {
        // Evaluate p times 2^(−e n), which is an integer.
        let down = at.e.unsigned_abs();
        for (i, c) in p.iter().rev().enumerate() {
            y = y * &at.m + (c << (down * i as u64));
        }
    }
    order(&y)
}

/// Compares the only root between two points, where p changes its sign, with a third
/// point. `sign_low` is the sign of p at the lower end.
pub fn against(
    p: &[BigInt],
    (low, high): (&Point, &Point),
    sign_low: Ordering,
    at: &Point,
) -> Ordering {
    if at <= low {
        return Ordering::Greater;
    }
    if at >= high {
        return Ordering::Less;
    }
    match sign_at(p, at) {
        Ordering::Equal => Ordering::Equal,
        sign if sign == sign_low => Ordering::Greater,
        _ => Ordering::Less,
    }
}

/// Returns the sign of an integer.
pub fn order(x: &BigInt) -> Ordering {
    match x.sign() {
        Sign::Minus => Ordering::Less,
        Sign::NoSign => Ordering::Equal,
        Sign::Plus => Ordering::Greater,
    }
}

pub fn derivative(p: &[BigInt]) -> Integers {
    p.iter().enumerate().skip(1).map(|(i, c)| c * i).collect()
}

/// Drops leading zero coefficients; the zero polynomial becomes empty.
pub fn stripped(mut p: Integers) -> Integers {
    while p.last().is_some_and(|c| c.sign() == Sign::NoSign) {
        p.pop();
    }
    p
}

/// Divides by the greatest common divisor of the coefficients.
pub fn primitive(p: Integers) -> Integers {
    let mut content = BigInt::ZERO;
    for c in &p {
        content = common(content, c.clone());
        if content.bits() == 1 {
            return p;
        }
    }
    match content.sign() {
        Sign::NoSign => p,
        _ => p.into_iter().map(|c| c / &content).collect(),
    }
}

/// Computes the greatest common divisor of two integers, ≥ 0 (Euclid).
fn common(mut a: BigInt, mut b: BigInt) -> BigInt {
    while b.sign() != Sign::NoSign {
        (a, b) = (b.clone(), a % b);
    }
    if a.sign() == Sign::Minus { -a } else { a }
}

/// Divides p by q; `None` if the quotient is not a polynomial over the integers.
pub fn quotient(p: &[BigInt], q: &[BigInt]) -> Option<Integers> {
    let (n, m) = (p.len().checked_sub(1)?, q.len() - 1);
    if n < m {
        return None;
    }
    let mut rest = p.to_vec();
    let mut result = vec![BigInt::ZERO; n - m + 1];
    let leading = &q[m];
    for i in (0..=n - m).rev() {
        let factor = &rest[i + m] / leading;
        if &factor * leading != rest[i + m] {
            return None;
        }
        for j in 0..=m {
            rest[i + j] -= &factor * &q[j];
        }
        result[i] = factor;
    }
    rest.iter()
        .all(|c| c.sign() == Sign::NoSign)
        .then_some(result)
}
