//! Polynomials of any degree with integer coefficients of any length.

use super::dyadic::Dyadic;
use super::number::Number;
use num_bigint::{BigInt, Sign};
use std::cmp::Ordering;

/// Σ c_k t^k; the last c is not zero, and zero has none.
#[derive(Clone, Debug, PartialEq)]
pub struct Polynomial(Vec<BigInt>);

impl Polynomial {
    /// With these coefficients, times some power of two.
    pub fn of(coefficients: &[Dyadic]) -> Polynomial {
        let is_zero = |c: &&Dyadic| {
            let Ok(sign) = c.sign();
            sign.is_eq()
        };
        let powers = coefficients
            .iter()
            .filter(|c| !is_zero(c))
            .map(|c| c.power());
        let power = powers.min().unwrap_or(0);
        let integer = |c: &Dyadic| match is_zero(&c) {
            true => BigInt::ZERO,
            false => c.at_power(power),
        };
        Polynomial::trimmed(coefficients.iter().map(integer).collect())
    }

    fn trimmed(mut coefficients: Vec<BigInt>) -> Polynomial {
        while coefficients.last().is_some_and(|c| *c == BigInt::ZERO) {
            coefficients.pop();
        }
        Polynomial(coefficients)
    }

    pub fn is_zero(&self) -> bool {
        self.0.is_empty()
    }

    /// Of zero 0, too.
    pub fn degree(&self) -> usize {
        self.0.len().saturating_sub(1)
    }

    /// Of what is not zero.
    fn leading(&self) -> &BigInt {
        &self.0[self.degree()]
    }

    pub fn derivative(&self) -> Polynomial {
        let terms = self.0.iter().enumerate().skip(1);
        Polynomial(terms.map(|(k, c)| c * k).collect())
    }

    /// By Horner's rule, at m / 2^s times 2^(s n).
    pub fn sign_at(&self, x: &Dyadic) -> Ordering {
        let scale = x.power().min(0).unsigned_abs();
        let m = x.at_power(x.power().min(0));
        let (mut value, mut shift) = (BigInt::ZERO, 0);
        for c in self.0.iter().rev() {
            value = value * &m + (c << shift);
            shift += scale;
        }
        sign(&value)
    }

    /// Far before t = 0 or far behind it.
    pub fn sign_far_off(&self, before: bool) -> Ordering {
        let Some(leading) = self.0.last() else {
            return Ordering::Equal;
        };
        let turned = before && self.degree() % 2 == 1;
        if turned {
            sign(leading).reverse()
        } else {
            sign(leading)
        }
    }

    /// A power of two above the magnitudes of all roots: 2 max |c_{n−k} / c_n|^(1/k)
    /// (Fujiwara 1916). Of what is not constant.
    pub fn bound(&self) -> Dyadic {
        let bits = |c: &BigInt| c.bits() as i64;
        let power = |k: usize| {
            // Each less than 2^bits, and no less than half of that.
            let ratio = bits(&self.0[self.degree() - k]) - bits(self.leading()) + 1;
            ratio.div_euclid(k as i64) + 1
        };
        let powers = (1..=self.degree()).map(power);
        Dyadic::power_of_two(powers.max().unwrap_or(0) + 1)
    }

    /// What divides both. Neither is zero.
    pub fn common(&self, other: &Polynomial) -> Polynomial {
        let (high, low) = if self.degree() < other.degree() {
            (other, self)
        } else {
            (self, other)
        };
        let mut all = remainders(high.clone(), low.clone());
        all.pop().expect("two at least")
    }

    /// Divided by what divides all coefficients.
    pub fn primitive(&self) -> Polynomial {
        let content = self
            .0
            .iter()
            .fold(BigInt::ZERO, |all, c| common_divisor(all, c));
        Polynomial(self.0.iter().map(|c| c / &content).collect())
    }

    /// Of primitive ones, by one that divides it: the quotient is one of integers
    /// (Gauss's lemma).
    pub fn divided(&self, by: &Polynomial) -> Polynomial {
        let mut rest = self.0.clone();
        let mut quotient = Vec::new();
        while rest.len() >= by.0.len()
            && let Some(top) = rest.pop()
        {
            let factor = top / by.leading();
            let first = rest.len() - by.degree();
            for (c, b) in rest[first..].iter_mut().zip(&by.0) {
                *c -= &factor * b;
            }
            quotient.push(factor);
        }
        quotient.reverse();
        Polynomial::trimmed(quotient)
    }

    /// `by` to the power of so many steps as there are, times this, less a multiple of
    /// `by`, of lower degree than it; with |leading| for leading, so that no sign turns.
    fn remainder(&self, by: &Polynomial) -> Polynomial {
        let size = BigInt::from(by.leading().magnitude().clone());
        let is_negative = by.leading().sign() == Sign::Minus;
        let mut rest = self.0.clone();
        while rest.len() >= by.0.len()
            && let Some(top) = rest.pop()
        {
            let top = if is_negative { -top } else { top };
            for c in &mut rest {
                *c *= &size;
            }
            let first = rest.len() - by.degree();
            for (c, b) in rest[first..].iter_mut().zip(&by.0) {
                *c -= &top * b;
            }
        }
        Polynomial::trimmed(rest)
    }
}

/// u, v, and what remains of each divided by the next, with the other sign, times a
/// positive number; the last divides all. The numbers are those that keep
/// coefficients integer and short: subresultants (Brown and Traub 1971; Knuth, The
/// Art of Computer Programming 2, 4.6.1, algorithm C). v has no higher degree; neither
/// is zero.
pub fn remainders(u: Polynomial, v: Polynomial) -> Vec<Polynomial> {
    let (mut g, mut h) = (BigInt::from(1), BigInt::from(1));
    let (mut before, mut last) = (u, v);
    let mut all = Vec::new();
    loop {
        let rest = before.remainder(&last);
        let gap = (before.degree() - last.degree()) as u32;
        let divisor = -&g * h.pow(gap);
        g = last.leading().magnitude().clone().into();
        if gap > 0 {
            h = g.pow(gap) / h.pow(gap - 1);
        }
        all.push(std::mem::replace(&mut before, last));
        if rest.is_zero() {
            all.push(before);
            return all;
        }
        last = Polynomial(rest.0.iter().map(|c| c / &divisor).collect());
    }
}

/// By Euclid's algorithm; not negative.
fn common_divisor(a: BigInt, b: &BigInt) -> BigInt {
    let (mut a, mut b) = (a, b.clone());
    while b != BigInt::ZERO {
        let rest = &a % &b;
        a = std::mem::replace(&mut b, rest);
    }
    a.magnitude().clone().into()
}

fn sign(x: &BigInt) -> Ordering {
    match x.sign() {
        Sign::Minus => Ordering::Less,
        Sign::NoSign => Ordering::Equal,
        Sign::Plus => Ordering::Greater,
    }
}
