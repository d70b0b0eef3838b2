//! Roots of polynomials of degree two at most: (p ± √q) / r.
//!
//! Where such a root lies, before or behind a number, another root or a sign change of
//! another polynomial, is the sign of a sum of square roots, which is found by squaring
//! (docs/numerics/oracle.md, O5). No decision takes a square root.

use super::number::Number;
use super::root::Poly;
use std::cmp::Ordering;

/// The number (p + √q) / r or (p − √q) / r, with q ≥ 0 and r > 0.
#[derive(Clone, Debug)]
pub struct Surd<N> {
    pub p: N,
    pub q: N,
    pub r: N,
    /// The sign before √q: 1 or −1.
    pub sign: f64,
}

impl<N: Number> Surd<N> {
    /// Returns the sign of a polynomial at this root.
    pub fn sign_of(&self, f: &Poly<N>) -> Result<Ordering, N::Undecided> {
        let ([c0, c1, c2], Surd { p, q, r, .. }) = (&f.0, self);
        // r² f(t) = u + v √q.
        let u = c2.times(&p.squared().plus(q));
        let u = u.plus(&c1.times(p).times(r)).plus(&c0.times(&r.squared()));
        let v = c2.plus(c2).times(p).plus(&c1.times(r));
        sign_of_sum(&u, &v.times(&N::from_f64(self.sign)), q)
    }

    /// Compares the root with a number.
    pub fn order_with_number(&self, x: &N) -> Result<Ordering, N::Undecided> {
        // r (t − x) = p − x r ± √q.
        let u = self.p.minus(&x.times(&self.r));
        sign_of_sum(&u, &N::from_f64(self.sign), &self.q)
    }

    /// Compares the root with another one.
    pub fn order(&self, other: &Surd<N>) -> Result<Ordering, N::Undecided> {
        let (a, b) = (self, other);
        // r_a r_b (a − b) = u + v √q_a + w √q_b.
        let u = a.p.times(&b.r).minus(&b.p.times(&a.r));
        let v = b.r.times(&N::from_f64(a.sign));
        let w = a.r.times(&N::from_f64(-b.sign));
        let left = sign_of_sum(&u, &v, &a.q)?;
        let right = if b.q.sign()?.is_eq() {
            Ordering::Equal
        } else {
            w.sign()?
        };
        if right.is_eq() || left == right {
            return Ok(left);
        }
        if left.is_eq() {
            return Ok(right);
        }
        // The signs are opposite, so the larger square wins.
        let squares = u.squared().plus(&v.squared().times(&a.q));
        let squares = squares.minus(&w.squared().times(&b.q));
        let mixed = u.plus(&u).times(&v);
        Ok(match sign_of_sum(&squares, &mixed, &a.q)? {
            Ordering::Greater => left,
            Ordering::Equal => Ordering::Equal,
            Ordering::Less => right,
        })
    }
}

/// Returns the sign of u + v √q, for q ≥ 0.
fn sign_of_sum<N: Number>(u: &N, v: &N, q: &N) -> Result<Ordering, N::Undecided> {
    let left = u.sign()?;
    if q.sign()?.is_eq() {
        return Ok(left);
    }
    let right = v.sign()?;
    if right.is_eq() || left == right {
        return Ok(left);
    }
    if left.is_eq() {
        return Ok(right);
    }
    // The signs are opposite, so the larger square wins.
    Ok(match u.squared().minus(&v.squared().times(q)).sign()? {
        Ordering::Greater => left,
        Ordering::Equal => Ordering::Equal,
        Ordering::Less => right,
    })
}
