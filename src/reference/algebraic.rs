//! Real roots of polynomials of any degree, without a rounding.
//!
//! A number is a polynomial and an interval in which it has one root, not a double
//! one. Intervals are found by halving, with Descartes' rule of signs to count
//! (Collins and Akritas 1976). Where a root lies, before or behind a number, is the
//! polynomial's sign there. Two numbers are equal if what divides both polynomials has
//! a root in both intervals; else the intervals come apart by halving.

use super::dyadic::{Dyadic, scaled};
use super::number::Number;
use super::polynomial::Polynomial;
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

/// How often the interval that holds all roots is halved before it is asked whether
/// two are one, which takes longer.
const DEEPEST: usize = 40;

/// How often two intervals are halved before it is asked whether their numbers are
/// equal, which takes longer.
const HALVINGS: usize = 64;

const NEWTON_STEPS: usize = 32;

impl Algebraic {
    /// All real roots, each once, the lowest first. None of a constant, zero or not.
    /// No other root lies between the ends of an interval, or at one.
    pub fn roots(f: &Polynomial) -> Vec<Algebraic> {
        if f.degree() == 0 {
            return Vec::new();
        }
        isolated(f, DEEPEST).unwrap_or_else(|| {
            // Without double roots halving comes to an end.
            let double = f.common(&f.derivative());
            let simple = f.primitive().divided(&double.primitive());
            isolated(&simple, usize::MAX).unwrap_or_default()
        })
    }

    pub fn of_surd(surd: &Surd<Dyadic>) -> Algebraic {
        // r t = p, or (r t − p)² = q, of which it is the lower or the upper root.
        let Surd { p, q, r, sign } = surd;
        let linear = [Dyadic::zero().minus(p), r.clone()];
        let coefficients = match q.is_zero() {
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

    /// By Newton's method from the middle, with rounded steps. It may be anything.
    pub fn guess(&self) -> f64 {
        let slope = self.of.derivative();
        let mut t = self.lo.plus(&self.hi).half().rounded();
        for _ in 0..NEWTON_STEPS {
            if !t.is_finite() {
                break;
            }
            let at = Dyadic::of(t);
            let ((f, f_power), (s, s_power)) = (
                self.of.value_at(&at).leading(),
                slope.value_at(&at).leading(),
            );
            let step = scaled(f / s, f_power - s_power);
            t -= step;
            if !(step.abs() > t.abs() * f64::EPSILON) {
                break;
            }
        }
        t
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
        let middle = middle(&self.of, &self.lo, &self.hi);
        if self.of.sign_at(&middle) == self.of.sign_at(&self.lo) {
            self.lo = middle;
        } else {
            self.hi = middle;
        }
    }
}

/// The roots, or `None` where some do not come apart in so many halvings.
fn isolated(f: &Polynomial, most: usize) -> Option<Vec<Algebraic>> {
    let of = Arc::new(f.clone());
    let bound = f.bound();
    let mut left = vec![(Dyadic::zero().minus(&bound), bound, 0)];
    let mut found = Vec::new();
    while let Some((lo, hi, depth)) = left.pop() {
        // As many roots, or more by an even number.
        match f.between(&lo, &hi).variations() {
            0 => {}
            1 => {
                let of = of.clone();
                found.push(Algebraic { of, lo, hi });
            }
            _ if depth == most => return None,
            _ => {
                let middle = middle(f, &lo, &hi);
                left.push((middle.clone(), hi, depth + 1));
                left.push((lo, middle, depth + 1));
            }
        }
    }
    Some(found)
}

/// The middle, or a number beside it that is no root.
fn middle(of: &Polynomial, lo: &Dyadic, hi: &Dyadic) -> Dyadic {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::root::{Poly, Root};
    use crate::rounding::nearest;

    fn roots(c: &[f64]) -> Vec<Algebraic> {
        let c: Vec<Dyadic> = c.iter().map(|c| Dyadic::of(*c)).collect();
        Algebraic::roots(&Polynomial::of(&c))
    }

    fn order(a: &Algebraic, b: &Algebraic) -> Ordering {
        let order = a.order(b);
        assert_eq!(order, b.order(a).reverse());
        order
    }

    #[test]
    fn equal_numbers_of_different_polynomials_are_equal() {
        // √2 by t² = 2, by t⁴ = 4, by (t² − 2)(t − 1), and as a surd; and ³√2.
        let two = &roots(&[-2.0, 0.0, 1.0])[1];
        let four = &roots(&[-4.0, 0.0, 0.0, 0.0, 1.0])[1];
        let more = &roots(&[2.0, -2.0, -1.0, 1.0])[2];
        let Ok(surds) = Poly([-2.0, 0.0, 1.0].map(Dyadic::of)).roots();
        assert!(order(two, four).is_eq() && order(two, more).is_eq());
        for root in [two, four, more] {
            let root = Root::Algebraic(root.clone());
            assert_eq!(surds[1].order(&root), Ok(Ordering::Equal));
            assert_eq!(surds[0].order(&root), Ok(Ordering::Less));
            assert_eq!(nearest(&root), std::f64::consts::SQRT_2);
            let Ok(below) = root.order_with(std::f64::consts::SQRT_2);
            let Ok(above) = root.order_with(std::f64::consts::SQRT_2.next_down());
            assert!(below.is_lt() && above.is_gt());
        }
        let cubic = &roots(&[-2.0, 0.0, 0.0, 1.0])[0];
        assert!(order(cubic, two).is_lt());
        assert_eq!(nearest(&Root::Algebraic(cubic.clone())), libm::cbrt(2.0));
    }

    #[test]
    fn close_numbers_are_not_equal() {
        // t² = 2 and t² = 2 + 2^−300.
        let near = Dyadic::of(2.0).plus(&Dyadic::power_of_two(-300));
        let c = [Dyadic::zero().minus(&near), Dyadic::zero(), Dyadic::of(1.0)];
        let above = &Algebraic::roots(&Polynomial::of(&c))[1];
        assert!(order(&roots(&[-2.0, 0.0, 1.0])[1], above).is_lt());
        // Both in one polynomial.
        let mut product = vec![Dyadic::zero(); 5];
        for (i, x) in c.iter().enumerate() {
            product[i] = product[i].minus(&x.plus(x));
            product[i + 2] = product[i + 2].plus(x);
        }
        let both = Algebraic::roots(&Polynomial::of(&product));
        assert_eq!(both.len(), 4);
        assert!(order(&both[3], above).is_eq() && order(&both[2], above).is_lt());
    }

    #[test]
    fn numbers_that_are_f64_are_known_as_such() {
        // (t − 1/2)³ t (t + 3)².
        let all = roots(&[0.0, -1.125, 6.0, -9.125, 0.75, 4.5, 1.0]);
        let values = [-3.0, 0.0, 0.5];
        assert_eq!(all.len(), 3);
        for (root, value) in all.iter().zip(values) {
            assert!(root.order_with(&Dyadic::of(value)).is_eq());
            assert!(root.order_with(&Dyadic::of(value.next_up())).is_lt());
            assert_eq!(nearest(&Root::Algebraic(root.clone())), value);
        }
        assert!(roots(&[]).is_empty() && roots(&[0.0]).is_empty() && roots(&[7.0]).is_empty());
        // At the ends of what f64 holds.
        let tiny = f64::from_bits(1);
        assert_eq!(
            nearest(&Root::Algebraic(roots(&[-tiny, 1.0])[0].clone())),
            tiny
        );
        let beyond = Root::Algebraic(roots(&[-1e300, 1e-300])[0].clone());
        assert_eq!(nearest(&beyond), f64::INFINITY);
    }
}
