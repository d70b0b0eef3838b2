//! Real roots of polynomials of any degree, without a rounding.
//!
//! A number is a polynomial without double roots and an interval in which it has one
//! root. Intervals are found by halving, with Sturm's theorem to count; where a root
//! lies, before or behind a number, is the polynomial's sign there. Two numbers are
//! equal if what divides both polynomials has a root in both intervals; else the
//! intervals come apart by halving.

use super::dyadic::Dyadic;
use super::number::Number;
use super::polynomial::{Polynomial, remainders};
use super::surd::Surd;
use std::cmp::Ordering;
use std::sync::Arc;

/// The only root of `of` in `lo` < t < `hi`; `of` has opposite signs at these.
#[derive(Clone, Debug)]
pub struct Algebraic {
    of: Arc<Polynomial>,
    pub lo: Dyadic,
    pub hi: Dyadic,
}

/// How often two intervals are halved before it is asked whether their numbers are
/// equal, which takes longer.
const HALVINGS: usize = 64;

impl Algebraic {
    /// All real roots, each once, the lowest first. None of a constant, zero or not.
    /// No other root lies between the ends of an interval, or at one.
    pub fn roots(f: &Polynomial) -> Vec<Algebraic> {
        if f.degree() == 0 {
            return Vec::new();
        }
        let sturm = Sturm::of(f);
        let of = Arc::new(sturm.0[0].clone());
        let hi = of.bound();
        let lo = Dyadic::zero().minus(&hi);
        let mut found = Vec::new();
        let (at_lo, at_hi) = (sturm.variations(&lo), sturm.variations(&hi));
        let mut left = vec![((lo, at_lo), (hi, at_hi))];
        while let Some((lo, hi)) = left.pop() {
            match lo.1 - hi.1 {
                0 => {}
                1 => found.push(Algebraic {
                    of: of.clone(),
                    lo: lo.0,
                    hi: hi.0,
                }),
                _ => {
                    let middle = between(&of, &lo.0, &hi.0);
                    let at_middle = sturm.variations(&middle);
                    left.push(((middle.clone(), at_middle), hi));
                    left.push((lo, (middle, at_middle)));
                }
            }
        }
        found
    }

    pub fn of_surd(surd: &Surd<Dyadic>) -> Algebraic {
        // r t = p, or (r t − p)² = q, of which it is the lower or the upper root.
        let Surd { p, q, r, sign } = surd;
        let Ok(rational) = q.sign();
        let linear = [Dyadic::zero().minus(p), r.clone()];
        let coefficients = match rational.is_eq() {
            true => linear.to_vec(),
            false => {
                let twice = linear[0].times(r);
                let constant = p.squared().minus(q);
                vec![constant, twice.plus(&twice), r.squared()]
            }
        };
        let roots = Algebraic::roots(&Polynomial::of(&coefficients));
        let which = if *sign > 0.0 { roots.len() - 1 } else { 0 };
        roots[which].clone()
    }

    pub fn order_with(&self, x: &Dyadic) -> Ordering {
        if at_most(x, &self.lo) {
            return Ordering::Greater;
        }
        if at_most(&self.hi, x) {
            return Ordering::Less;
        }
        let sign = self.of.sign_at(x);
        if sign.is_eq() {
            Ordering::Equal
        } else if sign == self.of.sign_at(&self.lo) {
            Ordering::Greater
        } else {
            Ordering::Less
        }
    }

    pub fn order(&self, other: &Algebraic) -> Ordering {
        let (mut a, mut b) = (self.clone(), other.clone());
        for _ in 0..HALVINGS {
            if let Some(order) = a.apart(&b) {
                return order;
            }
            a.halve();
            b.halve();
        }
        let common = a.of.common(&b.of);
        loop {
            if let Some(order) = a.apart(&b) {
                return order;
            }
            // Neither end is a root of either.
            let lo = if at_most(&a.lo, &b.lo) { &b.lo } else { &a.lo };
            let hi = if at_most(&a.hi, &b.hi) { &a.hi } else { &b.hi };
            if common.sign_at(lo) != common.sign_at(hi) {
                return Ordering::Equal;
            }
            a.halve();
            b.halve();
        }
    }

    /// Where one interval ends before the other begins.
    fn apart(&self, other: &Algebraic) -> Option<Ordering> {
        if at_most(&self.hi, &other.lo) {
            Some(Ordering::Less)
        } else if at_most(&other.hi, &self.lo) {
            Some(Ordering::Greater)
        } else {
            None
        }
    }

    fn halve(&mut self) {
        let middle = between(&self.of, &self.lo, &self.hi);
        if self.of.sign_at(&middle) == self.of.sign_at(&self.lo) {
            self.lo = middle;
        } else {
            self.hi = middle;
        }
    }
}

/// A polynomial and its derivative, both divided by what divides both, and the
/// remainders that follow.
struct Sturm(Vec<Polynomial>);

impl Sturm {
    /// Of what is not constant.
    fn of(f: &Polynomial) -> Sturm {
        let of = |f: &Polynomial| remainders(f.clone(), f.derivative());
        let mut all = of(f);
        // Double roots are roots of the last.
        if let Some(last) = all.last().filter(|last| last.degree() > 0) {
            all = of(&f.primitive().divided(&last.primitive()));
        }
        Sturm(all)
    }

    /// How often signs change along the sequence: by so many more than at a later
    /// number as there are roots between (Sturm 1829).
    fn variations(&self, x: &Dyadic) -> usize {
        let signs = self.0.iter().map(|f| f.sign_at(x));
        let signs: Vec<Ordering> = signs.filter(|sign| sign.is_ne()).collect();
        signs.windows(2).filter(|pair| pair[0] != pair[1]).count()
    }
}

/// The middle, or a number beside it that is no root.
fn between(of: &Polynomial, lo: &Dyadic, hi: &Dyadic) -> Dyadic {
    let mut middle = lo.plus(hi).half();
    while of.sign_at(&middle).is_eq() {
        middle = middle.plus(lo).half();
    }
    middle
}

fn at_most(a: &Dyadic, b: &Dyadic) -> bool {
    let Ok(sign) = a.minus(b).sign();
    sign.is_le()
}
