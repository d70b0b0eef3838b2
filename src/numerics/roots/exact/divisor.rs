//! Square-free decomposition (Yun 1976), with modular greatest common divisors (Brown
//! 1971).
//!
//! Modulo a prime that divides neither leading coefficient, the degree of a greatest
//! common divisor can only be too high. So one prime modulo which p and p' are coprime
//! proves that p is square-free, in n² short operations. Otherwise images modulo several
//! primes are csg by the Chinese remainder theorem until the result divides both
//! polynomials, which proves it.

use super::{Integers, derivative, primitive, quotient, stripped};
use num_bigint::{BigInt, Sign};

/// The square-free decomposition p = Π factor^multiplicity, up to a constant.
#[derive(Clone, Debug)]
pub struct Factors {
    /// Factors and multiplicities. Each factor has simple roots only, and no two have a
    /// common root.
    pub rows: Vec<(Integers, u32)>,
    /// The product of the factors, which has every root of p once.
    pub square_free: Integers,
}

/// Decomposes a polynomial of degree ≥ 1. `None` if 2000 primes do not suffice, which no
/// polynomial with f64 coefficients has needed so far.
pub fn factors(p: &[BigInt]) -> Option<Factors> {
    let alone = |p: &[BigInt]| Factors {
        rows: vec![(p.to_vec(), 1)],
        square_free: p.to_vec(),
    };
    if p.len() < 3 || is_surely_square_free(p) {
        return Some(alone(p));
    }
    let p = primitive(p.to_vec());
    let slope = derivative(&p);
    let common = divisor(&p, &slope)?;
    if common.len() == 1 {
        return Some(alone(&p));
    }
    let square_free = quotient(&p, &common)?;
    let mut rows = Vec::new();
    let mut rest = square_free.clone();
    let mut d = difference(&quotient(&slope, &common)?, &derivative(&rest));
    for multiplicity in 1.. {
        if rest.len() == 1 {
            break;
        }
        let factor = match d.is_empty() {
            true => rest.clone(),
            false => divisor(&rest, &d)?,
        };
        rest = quotient(&rest, &factor)?;
        let next = if d.is_empty() {
            Vec::new()
        } else {
            quotient(&d, &factor)?
        };
        d = difference(&next, &derivative(&rest));
        if factor.len() > 1 {
            rows.push((factor, multiplicity));
        }
    }
    Some(Factors { rows, square_free })
}

fn difference(a: &[BigInt], b: &[BigInt]) -> Integers {
    let at = |p: &[BigInt], i: usize| p.get(i).cloned().unwrap_or_default();
    let len = a.len().max(b.len());
    stripped((0..len).map(|i| at(a, i) - at(b, i)).collect())
}

/// Whether p and p' are coprime modulo one of three primes, which proves that p is
/// square-free.
fn is_surely_square_free(p: &[BigInt]) -> bool {
    let slope = derivative(p);
    Primes::new().take(3).any(|m| {
        let (a, b) = (residues(p, m), residues(&slope, m));
        a.last() != Some(&0) && b.last() != Some(&0) && divisor_modulo(a, b, m).len() == 1
    })
}

/// Computes the primitive greatest common divisor with a positive leading coefficient.
/// `None` if a polynomial is empty or primes run out.
pub fn divisor(a: &[BigInt], b: &[BigInt]) -> Option<Integers> {
    let (Some(leading), Some(other)) = (a.last(), b.last()) else {
        return None;
    };
    // A multiple of the divisor's leading coefficient, by which images are scaled.
    let scale = leading;
    let mut sum: Integers = Vec::new();
    let mut modulus = BigInt::from(1);
    let mut steady = 0;
    for m in Primes::new().take(2000) {
        if residue(leading, m) == 0 || residue(other, m) == 0 {
            continue;
        }
        let image = divisor_modulo(residues(a, m), residues(b, m), m);
        if image.len() == 1 {
            return Some(vec![BigInt::from(1)]);
        }
        let factor = residue(scale, m);
        let image: Vec<u64> = image.iter().map(|x| times(*x, factor, m)).collect();
        if sum.is_empty() || image.len() < sum.len() {
            // Restart: all earlier primes gave too high a degree.
            sum = image
                .iter()
                .map(|x| symmetric(BigInt::from(*x), m))
                .collect();
            modulus = BigInt::from(m);
            steady = 0;
            continue;
        }
        if image.len() > sum.len() {
            continue;
        }
        let inverse = inverse(residue(&modulus, m), m);
        let next = &modulus * m;
        let half = &next >> 1_u32;
        let mut changed = false;
        for (c, x) in sum.iter_mut().zip(&image) {
            let off = (x + m - residue(c, m)) % m;
            if off != 0 {
                changed = true;
                *c += &modulus * times(off, inverse, m);
                if *c > half {
                    *c -= &next;
                }
            }
        }
        modulus = next;
        steady = if changed { 0 } else { steady + 1 };
        if steady >= 1 {
            let mut candidate = primitive(sum.clone());
            if candidate.last().is_some_and(|c| c.sign() == Sign::Minus) {
                candidate.iter_mut().for_each(|c| *c = -&*c);
            }
            if quotient(a, &candidate).is_some() && divides(b, &candidate) {
                return Some(candidate);
            }
        }
    }
    None
}

/// Whether the candidate divides b. b need not be primitive, but the candidate is, so
/// division over the integers decides.
fn divides(b: &[BigInt], candidate: &[BigInt]) -> bool {
    quotient(b, candidate).is_some()
}

/// Returns the representative of x modulo m with the least magnitude.
fn symmetric(x: BigInt, m: u64) -> BigInt {
    if x > BigInt::from(m / 2) { x - m } else { x }
}

/// Returns x modulo m, in 0..m.
fn residue(x: &BigInt, m: u64) -> u64 {
    let rest = x % m;
    let rest = if rest.sign() == Sign::Minus {
        rest + m
    } else {
        rest
    };
    u64::try_from(rest).unwrap_or(0)
}

fn residues(p: &[BigInt], m: u64) -> Vec<u64> {
    p.iter().map(|c| residue(c, m)).collect()
}

/// Computes the monic greatest common divisor modulo a prime; leading coefficients must
/// not be 0.
fn divisor_modulo(mut a: Vec<u64>, mut b: Vec<u64>, m: u64) -> Vec<u64> {
    if a.len() < b.len() {
        std::mem::swap(&mut a, &mut b);
    }
    while !b.is_empty() {
        let inverse = inverse(b[b.len() - 1], m);
        while a.len() >= b.len() {
            let factor = times(a[a.len() - 1], inverse, m);
            let shift = a.len() - b.len();
            for (j, b) in b.iter().enumerate() {
                let product = times(factor, *b, m);
                a[shift + j] = (a[shift + j] + m - product) % m;
            }
            while a.last() == Some(&0) {
                a.pop();
            }
        }
        std::mem::swap(&mut a, &mut b);
    }
    let inverse = inverse(a[a.len() - 1], m);
    a.iter().map(|x| times(*x, inverse, m)).collect()
}

fn times(a: u64, b: u64, m: u64) -> u64 {
    (u128::from(a) * u128::from(b) % u128::from(m)) as u64
}

fn power(mut base: u64, mut exponent: u64, m: u64) -> u64 {
    let mut result = 1;
    while exponent > 0 {
        if exponent & 1 == 1 {
            result = times(result, base, m);
        }
        base = times(base, base, m);
        exponent >>= 1;
    }
    result
}

/// Inverts x modulo a prime (Fermat's little theorem).
fn inverse(x: u64, m: u64) -> u64 {
    power(x, m - 2, m)
}

/// The primes below 2^62, descending.
struct Primes(u64);

/// The first primes as 2^62 minus this; nearly every question needs no others.
const KNOWN: [u64; 24] = [
    57, 87, 117, 143, 153, 167, 171, 195, 203, 273, 287, 317, 443, 483, 495, 575, 581, 603, 633,
    663, 765, 773, 777, 791,
];

impl Primes {
    fn new() -> Primes {
        Primes(1 << 62)
    }
}

impl Iterator for Primes {
    type Item = u64;

    fn next(&mut self) -> Option<u64> {
        let below = (1 << 62) - self.0;
        if let Some(known) = KNOWN.iter().find(|known| **known > below) {
            self.0 = (1 << 62) - known;
            return Some(self.0);
        }
        loop {
            self.0 -= 1;
            if is_prime(self.0) {
                return Some(self.0);
            }
        }
    }
}

/// Tests for a prime (Miller and Rabin); these bases decide all numbers below 2^64
/// (Sorenson and Webster 2015).
fn is_prime(x: u64) -> bool {
    const BASES: [u64; 12] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37];
    if BASES.iter().any(|b| x.is_multiple_of(*b)) {
        return false;
    }
    let shift = (x - 1).trailing_zeros();
    let passes = |base: &u64| {
        let mut y = power(*base, (x - 1) >> shift, x);
        if y == 1 || y == x - 1 {
            return true;
        }
        for _ in 1..shift {
            y = times(y, y, x);
            if y == x - 1 {
                return true;
            }
        }
        false
    };
    BASES.iter().all(passes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(c: &[i64]) -> Integers {
        c.iter().map(|c| BigInt::from(*c)).collect()
    }

    fn product(a: &[BigInt], b: &[BigInt]) -> Integers {
        let mut c = vec![BigInt::ZERO; a.len() + b.len() - 1];
        for (i, a) in a.iter().enumerate() {
            for (j, b) in b.iter().enumerate() {
                c[i + j] += a * b;
            }
        }
        c
    }

    #[test]
    fn square_factors_come_off_with_their_multiplicities() {
        // (3t − 1) (t² + 1)² (3t + 5 · 2^300)³ · 12.
        let (a, b) = (of(&[-1, 3]), of(&[1, 0, 1]));
        let c = vec![BigInt::from(5) << 300_u32, BigInt::from(3)];
        let mut p = of(&[12]);
        for factor in [&a, &b, &b, &c, &c, &c] {
            p = product(&p, factor);
        }
        let found = factors(&p).unwrap();
        assert_eq!(found.rows, [(a.clone(), 1), (b.clone(), 2), (c.clone(), 3)]);
        assert_eq!(found.square_free, product(&product(&a, &b), &c));
        let alone = factors(&product(&a, &c)).unwrap();
        assert_eq!(alone.rows.len(), 1);
        assert_eq!(alone.rows[0].1, 1);
        let fifth = (0..5).fold(of(&[7]), |p, _| product(&p, &of(&[-1, 1])));
        assert_eq!(factors(&fifth).unwrap().rows, [(of(&[-1, 1]), 5)]);
    }

    #[test]
    fn primes_are_prime() {
        let primes: Vec<u64> = Primes::new().take(3).collect();
        assert_eq!(primes[0], (1 << 62) - 57);
        // The table omits no prime.
        let mut found = KNOWN.iter().map(|known| (1 << 62) - known);
        let last = *KNOWN.last().unwrap();
        let all = (1..=last)
            .map(|below| (1 << 62) - below)
            .filter(|x| is_prime(*x));
        assert!(all.eq(&mut found));
        assert!(primes.windows(2).all(|w| w[1] < w[0]));
        assert!(!is_prime(3_215_031_751) && !is_prime(41 * 43) && is_prime(1_000_000_007));
    }
}
