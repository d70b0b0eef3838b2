//! Polynomials in t of degree two at most, and their real roots without a
//! rounding.
//!
//! A root is (p ± √q) / r. Where it lies, before or behind a number, another root
//! or a sign change of another polynomial, is the sign of a sum of square roots,
//! which is found by squaring: no root is ever drawn to decide anything.

use super::number::Number;
use std::cmp::Ordering;
use std::ops::{Add, Mul, Sub};

/// c₀ + c₁t + c₂t².
#[derive(Clone, Debug)]
pub struct Poly<N>(pub [N; 3]);

/// (p + √q) / r, or (p − √q) / r; q ≥ 0, r > 0.
#[derive(Clone, Debug)]
pub struct Root<N> {
    pub p: N,
    pub q: N,
    pub r: N,
    /// 1 or −1.
    pub sign: f64,
}

impl<N: Number> Poly<N> {
    pub fn constant(x: f64) -> Poly<N> {
        Poly([N::of(x), N::zero(), N::zero()])
    }

    /// c₀ + c₁t.
    pub fn linear(c0: N, c1: N) -> Poly<N> {
        Poly([c0, c1, N::zero()])
    }

    pub fn squared(&self) -> Poly<N> {
        self.clone() * self.clone()
    }

    /// Zero for every t.
    pub fn vanishes(&self) -> Result<bool, N::Doubt> {
        for c in self.0.iter().rev() {
            if c.sign()?.is_ne() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Each once, the lower first. None of a constant, zero or not.
    pub fn roots(&self) -> Result<Vec<Root<N>>, N::Doubt> {
        let [c0, c1, c2] = &self.0;
        let negative = |x: &N| N::zero().minus(x);
        let leading = c2.sign()?;
        if leading.is_eq() {
            let slope = c1.sign()?;
            if slope.is_eq() {
                return Ok(Vec::new());
            }
            return Ok(vec![Root::fraction(negative(c0), c1.clone(), slope)]);
        }
        let four = N::of(4.0);
        let q = c1.squared().minus(&four.times(c2).times(c0));
        let root = |sign: f64| Root {
            p: negative(c1).with_sign_of(leading),
            q: q.clone(),
            r: c2.plus(c2).with_sign_of(leading),
            sign,
        };
        Ok(match q.sign()? {
            Ordering::Less => Vec::new(),
            // The same number in its simplest form.
            Ordering::Equal => vec![Root {
                q: N::zero(),
                ..root(1.0)
            }],
            Ordering::Greater => vec![root(-1.0), root(1.0)],
        })
    }
}

impl<N: Number> Root<N> {
    /// p / r, where `sign` is that of r.
    pub fn fraction(p: N, r: N, sign: Ordering) -> Root<N> {
        Root {
            p: p.with_sign_of(sign),
            q: N::zero(),
            r: r.with_sign_of(sign),
            sign: 1.0,
        }
    }

    /// The sign of a polynomial at this t.
    pub fn sign_of(&self, f: &Poly<N>) -> Result<Ordering, N::Doubt> {
        let ([c0, c1, c2], Root { p, q, r, .. }) = (&f.0, self);
        // r² f(t) = u + v √q.
        let u = c2.times(&p.squared().plus(q));
        let u = u.plus(&c1.times(p).times(r)).plus(&c0.times(&r.squared()));
        let v = c2.plus(c2).times(p).plus(&c1.times(r));
        sign_of_sum(&u, &v.times(&N::of(self.sign)), q)
    }

    /// Against a finite number.
    pub fn order_with(&self, x: f64) -> Result<Ordering, N::Doubt> {
        self.order_with_number(&N::of(x))
    }

    pub fn order_with_number(&self, x: &N) -> Result<Ordering, N::Doubt> {
        // r (t − x) = p − x r ± √q.
        let u = self.p.minus(&x.times(&self.r));
        sign_of_sum(&u, &N::of(self.sign), &self.q)
    }

    /// Against another root.
    pub fn order(&self, other: &Root<N>) -> Result<Ordering, N::Doubt> {
        let (a, b) = (self, other);
        // r_a r_b (a − b) = u + v √q_a + w √q_b.
        let u = a.p.times(&b.r).minus(&b.p.times(&a.r));
        let v = b.r.times(&N::of(a.sign));
        let w = a.r.times(&N::of(-b.sign));
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
        // Of opposite signs: the larger square wins.
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

/// The sign of u + v √q, q ≥ 0.
fn sign_of_sum<N: Number>(u: &N, v: &N, q: &N) -> Result<Ordering, N::Doubt> {
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
    // Of opposite signs: the larger square wins.
    Ok(match u.squared().minus(&v.squared().times(q)).sign()? {
        Ordering::Greater => left,
        Ordering::Equal => Ordering::Equal,
        Ordering::Less => right,
    })
}

impl<N: Number> Add for Poly<N> {
    type Output = Poly<N>;
    fn add(self, o: Poly<N>) -> Poly<N> {
        Poly(std::array::from_fn(|k| self.0[k].plus(&o.0[k])))
    }
}

impl<N: Number> Sub for Poly<N> {
    type Output = Poly<N>;
    fn sub(self, o: Poly<N>) -> Poly<N> {
        Poly(std::array::from_fn(|k| self.0[k].minus(&o.0[k])))
    }
}

/// Of degree two at most: a constant times anything, or two of degree one.
impl<N: Number> Mul for Poly<N> {
    type Output = Poly<N>;
    fn mul(self, o: Poly<N>) -> Poly<N> {
        let ([a0, a1, a2], [b0, b1, b2]) = (&self.0, &o.0);
        Poly([
            a0.times(b0),
            a0.times(b1).plus(&a1.times(b0)),
            a0.times(b2).plus(&a1.times(b1)).plus(&a2.times(b0)),
        ])
    }
}
