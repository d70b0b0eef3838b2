//! Polynomials of any degree with integer coefficients of any length.

use super::dyadic::Dyadic;
use super::number::Number;
use num_bigint::{BigInt, Sign};
use std::cmp::Ordering;

/// The polynomial Σ c_k t^k. The last coefficient is not zero; the zero polynomial has no
/// coefficients.
#[derive(Clone, Debug, PartialEq)]
pub struct Polynomial(Vec<BigInt>);

impl Polynomial {
    /// Builds the polynomial with these coefficients times a power of two that makes them
    /// integers.
    pub fn from_dyadics(coefficients: &[Dyadic]) -> Polynomial {
        let powers = coefficients.iter().filter(|c| !c.is_zero());
        let power = powers.map(|c| c.power()).min().unwrap_or(0);
        let integer = |c: &Dyadic| match c.is_zero() {
            true => BigInt::ZERO,
            false => c.at_power(power),
        };
        Polynomial::trimmed(coefficients.iter().map(integer).collect())
    }

    /// Drops leading coefficients that are zero.
    fn trimmed(mut coefficients: Vec<BigInt>) -> Polynomial {
        while coefficients.last().is_some_and(|c| *c == BigInt::ZERO) {
            coefficients.pop();
        }
        Polynomial(coefficients)
    }

    /// Says whether this is the zero polynomial.
    pub fn is_zero(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the degree; 0 for the zero polynomial.
    pub fn degree(&self) -> usize {
        self.0.len().saturating_sub(1)
    }

    /// Returns the leading coefficient of a polynomial that is not zero.
    fn leading(&self) -> &BigInt {
        &self.0[self.degree()]
    }

    /// Returns the derivative.
    pub fn derivative(&self) -> Polynomial {
        let terms = self.0.iter().enumerate().skip(1);
        Polynomial(terms.map(|(k, c)| c * k).collect())
    }

    /// Evaluates the polynomial at m / 2^s by Horner's rule; the result's power of two is
    /// −s n.
    pub fn value_at(&self, x: &Dyadic) -> Dyadic {
        let scale = x.power().min(0).unsigned_abs();
        let m = x.at_power(x.power().min(0));
        let (mut value, mut shift) = (BigInt::ZERO, 0);
        for c in self.0.iter().rev() {
            value = value * &m + (c << shift);
            shift += scale;
        }
        Dyadic::new(value, -((scale * self.degree() as u64) as i64))
    }

    /// Returns the exact sign of the value at x.
    pub fn sign_at(&self, x: &Dyadic) -> Ordering {
        let Ok(sign) = self.value_at(x).sign();
        sign
    }

    /// Returns (1 + t)^n f((a + b t) / (1 + t)) times a power of two. It has a root above
    /// zero for each root of f between a and b.
    pub fn between(&self, a: &Dyadic, b: &Dyadic) -> Polynomial {
        // t = x / 2^s, then x = a + (b − a) y, then y = t / (1 + t).
        let power = a.power().min(b.power()).min(0);
        let (a, b) = (a.at_power(power), b.at_power(power));
        let mut all = self.0.clone();
        for (k, c) in all.iter_mut().enumerate() {
            *c <<= power.unsigned_abs() * (self.degree() - k) as u64;
        }
        translate(&mut all, &a);
        let (width, mut factor) = (b - a, BigInt::from(1));
        for c in &mut all {
            *c *= &factor;
            factor *= &width;
        }
        all.reverse();
        translate(&mut all, &BigInt::from(1));
        // Coefficients in reverse order stand for 1/t, which has as many positive roots.
        Polynomial::trimmed(all)
    }

    /// Counts the sign changes from one coefficient to the next. There are as many as roots
    /// above zero, or more by an even number (Descartes' rule of signs).
    pub fn variations(&self) -> usize {
        let signs = self.0.iter().map(sign).filter(|sign| sign.is_ne());
        let signs: Vec<Ordering> = signs.collect();
        signs.windows(2).filter(|pair| pair[0] != pair[1]).count()
    }

    /// Returns the sign before all roots, or behind all of them.
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

    /// Returns a power of two above the magnitudes of all roots: at least 2 max |c_{n−k} /
    /// c_n|^(1/k) (Fujiwara 1916). The polynomial must not be constant.
    pub fn bound(&self) -> Dyadic {
        let bits = |c: &BigInt| c.bits() as i64;
        let power = |k: usize| {
            // The binary logarithm of each ratio, rounded up by at most one.
            let ratio = bits(&self.0[self.degree() - k]) - bits(self.leading()) + 1;
            ratio.div_euclid(k as i64) + 1
        };
        let powers = (1..=self.degree()).map(power);
        Dyadic::power_of_two(powers.max().unwrap_or(0) + 1)
    }

    /// Returns the greatest common divisor times a number. Neither polynomial may be zero.
    /// Subresultants keep the coefficients of Euclid's algorithm integer and short (Brown
    /// and Traub 1971; Knuth, *The Art of Computer Programming* 2, 4.6.1, algorithm C).
    pub fn common(&self, other: &Polynomial) -> Polynomial {
        let (mut before, mut last) = if self.degree() < other.degree() {
            (other.clone(), self.clone())
        } else {
            (self.clone(), other.clone())
        };
        let (mut g, mut h) = (BigInt::from(1), BigInt::from(1));
        loop {
            let rest = before.remainder(&last);
            if rest.is_zero() {
                return last;
            }
            let gap = (before.degree() - last.degree()) as u32;
            let divisor = &g * h.pow(gap);
            let next = Polynomial(rest.0.iter().map(|c| c / &divisor).collect());
            before = std::mem::replace(&mut last, next);
            g = before.leading().clone();
            if gap > 0 {
                h = g.pow(gap) / h.pow(gap - 1);
            }
        }
    }

    /// Divides the polynomial by the greatest common divisor of its coefficients.
    pub fn primitive(&self) -> Polynomial {
        let all = self.0.iter().fold(BigInt::ZERO, common_divisor);
        Polynomial(self.0.iter().map(|c| c / &all).collect())
    }

    /// Divides a primitive polynomial by a primitive divisor. The quotient has integer
    /// coefficients (Gauss's lemma).
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

    /// Returns the pseudo-remainder: the polynomial times a power of the leading
    /// coefficient of `by`, less a multiple of `by`, with a degree below that of `by`.
    fn remainder(&self, by: &Polynomial) -> Polynomial {
        let mut rest = self.0.clone();
        while rest.len() >= by.0.len()
            && let Some(top) = rest.pop()
        {
            for c in &mut rest {
                *c *= by.leading();
            }
            let first = rest.len() - by.degree();
            for (c, b) in rest[first..].iter_mut().zip(&by.0) {
                *c -= &top * b;
            }
        }
        Polynomial::trimmed(rest)
    }
}

/// Returns the coefficients of f(t + by), by repeated Horner's rule.
fn translate(coefficients: &mut [BigInt], by: &BigInt) {
    for first in 0..coefficients.len() {
        for k in (first + 1..coefficients.len()).rev() {
            let next = by * &coefficients[k];
            coefficients[k - 1] += next;
        }
    }
}

/// Returns the greatest common divisor by Euclid's algorithm; never negative.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebraic::Algebraic;
    use proptest::prelude::*;

    fn polynomial(c: &[i64]) -> Polynomial {
        Polynomial::trimmed(c.iter().map(|c| BigInt::from(*c)).collect())
    }

    fn product(a: &Polynomial, b: &Polynomial) -> Polynomial {
        let mut all = vec![BigInt::ZERO; a.0.len() + b.0.len()];
        for (i, x) in a.0.iter().enumerate() {
            for (j, y) in b.0.iter().enumerate() {
                all[i + j] += x * y;
            }
        }
        Polynomial::trimmed(all)
    }

    /// The Sturm chain of f: the remainders of f and f′, negated each time (Sturm 1829).
    fn sturm(f: &Polynomial) -> Vec<Polynomial> {
        let mut all = vec![f.clone(), f.derivative()];
        loop {
            let [.., u, v] = &all[..] else { return all };
            let rest = u.remainder(v);
            if rest.is_zero() {
                return all;
            }
            let steps = u.degree() - v.degree() + 1;
            let turned = sign(v.leading()).is_lt() && steps % 2 == 1;
            let by = BigInt::from(if turned { 1 } else { -1 });
            let next = Polynomial(rest.0.iter().map(|c| c * &by).collect());
            all.push(next.primitive());
        }
    }

    fn roots_between(sturm: &[Polynomial], a: &Dyadic, b: &Dyadic) -> usize {
        let variations = |x: &Dyadic| {
            let signs = sturm.iter().map(|f| f.sign_at(x)).filter(|s| s.is_ne());
            let signs: Vec<Ordering> = signs.collect();
            signs.windows(2).filter(|pair| pair[0] != pair[1]).count()
        };
        variations(a) - variations(b)
    }

    fn coefficients() -> impl Strategy<Value = Vec<i64>> {
        prop::collection::vec(-9..10_i64, 1..6)
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            failure_persistence: None,
            ..ProptestConfig::with_cases(2000)
        })]

        /// There are as many intervals as Sturm's chain counts roots, with one root in
        /// each, for simple and for multiple roots; and no root lies outside the bound.
        #[test]
        fn intervals_hold_what_sturm_counts(a in coefficients(), b in coefficients()) {
            let (a, b) = (polynomial(&a), polynomial(&b));
            let f = product(&product(&a, &b), &b);
            prop_assume!(f.degree() > 0);
            let (all, end) = (sturm(&f), f.bound());
            let start = Dyadic::zero().minus(&end);
            let roots = Algebraic::roots(&f);
            prop_assert_eq!(roots.len(), roots_between(&all, &start, &end));
            let far = Dyadic::power_of_two(40);
            let outside = roots_between(&all, &Dyadic::zero().minus(&far), &far);
            prop_assert_eq!(roots.len(), outside);
            for root in &roots {
                prop_assert_eq!(roots_between(&all, &root.lo, &root.hi), 1);
            }
            for pair in roots.windows(2) {
                prop_assert!(pair[0].order(&pair[1]).is_lt());
            }
        }

        /// Quotients and common factors of products are those that the products were made
        /// of.
        #[test]
        fn products_come_apart(a in coefficients(), b in coefficients(), c in coefficients()) {
            let [a, b, c] = [a, b, c].map(|c| polynomial(&c));
            prop_assume!(!a.is_zero() && !b.is_zero() && !c.is_zero());
            let (ac, bc) = (product(&a, &c), product(&b, &c));
            let common = ac.common(&bc);
            prop_assert_eq!(common.degree(), a.common(&b).degree() + c.degree());
            prop_assert!(ac.remainder(&common).is_zero() && bc.remainder(&common).is_zero());
            prop_assert!(common.remainder(&c).is_zero());
            let (ac, c) = (ac.primitive(), c.primitive());
            prop_assert_eq!(product(&ac.divided(&c), &c), ac);
        }
    }
}
