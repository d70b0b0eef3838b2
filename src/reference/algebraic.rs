//! Real roots of polynomials of any degree, without rounding (docs/numerics/oracle.md, O3
//! and O5).
//!
//! A number is a polynomial and an interval in which the polynomial has one root, a simple
//! one. Intervals are found by halving; Descartes' rule of signs counts their roots
//! (Collins and Akritas 1976). The polynomial's sign at a number says whether the root lies
//! before or behind that number. Two roots are equal if the greatest common divisor of
//! their polynomials has a root in both intervals; otherwise halving separates the
//! intervals.

use super::dyadic::{Dyadic, scaled};
use super::number::Number;
use super::polynomial::Polynomial;
use super::surd::Surd;
use std::cmp::Ordering;
use std::sync::Arc;

/// The only root of the polynomial in `lo` < t < `hi`, where its signs are opposite.
#[derive(Clone, Debug)]
pub struct Algebraic {
    polynomial: Arc<Polynomial>,
    pub lo: Dyadic,
    pub hi: Dyadic,
}

/// How often the interval of all roots is halved before multiple roots are divided out,
/// which takes longer (O3).
const DEEPEST: usize = 40;

/// How often two intervals are halved before their numbers are tested for equality, which
/// takes longer.
const HALVINGS: usize = 64;

/// The most steps of Newton's method that a guess takes.
const NEWTON_STEPS: usize = 32;

impl Algebraic {
    /// Finds all real roots, each once and the lowest first. A constant, zero or not, has
    /// none. No other root lies in an interval or at one of its ends.
    pub fn roots(f: &Polynomial) -> Vec<Algebraic> {
        if f.degree() == 0 {
            return Vec::new();
        }
        isolated(f, DEEPEST).unwrap_or_else(|| {
            // Without multiple roots, halving terminates.
            let double = f.common(&f.derivative());
            let simple = f.primitive().divided(&double.primitive());
            isolated(&simple, usize::MAX).unwrap_or_default()
        })
    }

    /// Converts a root of degree two at most.
    pub fn from_surd(surd: &Surd<Dyadic>) -> Algebraic {
        // The surd is the root of r t = p, or the lower or upper root of (r t − p)² = q.
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
        let roots = Algebraic::roots(&Polynomial::from_dyadics(&coefficients));
        let which = if *sign > 0.0 { roots.len() - 1 } else { 0 };
        roots[which].clone()
    }

    /// Compares the root with a number.
    pub fn order_with(&self, x: &Dyadic) -> Ordering {
        if at_most(x, &self.lo) {
            return Ordering::Greater;
        }
        if at_most(&self.hi, x) {
            return Ordering::Less;
        }
        let sign = self.polynomial.sign_at(x);
        if sign.is_eq() {
            Ordering::Equal
        } else if sign == self.polynomial.sign_at(&self.lo) {
            Ordering::Greater
        } else {
            Ordering::Less
        }
    }

    /// Compares the root with another one.
    pub fn order(&self, other: &Algebraic) -> Ordering {
        let (mut a, mut b) = (self.clone(), other.clone());
        for _ in 0..HALVINGS {
            if let Some(order) = a.apart(&b) {
                return order;
            }
            a.halve();
            b.halve();
        }
        let common = a.polynomial.common(&b.polynomial);
        loop {
            if let Some(order) = a.apart(&b) {
                return order;
            }
            // Neither end of the common interval is a root of either polynomial.
            let lo = if at_most(&a.lo, &b.lo) { &b.lo } else { &a.lo };
            let hi = if at_most(&a.hi, &b.hi) { &a.hi } else { &b.hi };
            if common.sign_at(lo) != common.sign_at(hi) {
                return Ordering::Equal;
            }
            a.halve();
            b.halve();
        }
    }

    /// Approximates the root by Newton's method from the interval's middle, in rounded
    /// steps and without an error bound.
    pub fn guess(&self) -> f64 {
        let slope = self.polynomial.derivative();
        let mut t = self.lo.plus(&self.hi).half().rounded();
        for _ in 0..NEWTON_STEPS {
            if !t.is_finite() {
                break;
            }
            let at = Dyadic::from_f64(t);
            let ((f, f_power), (s, s_power)) = (
                self.polynomial.value_at(&at).leading(),
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

    /// Returns the order if one interval ends before the other begins.
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
        let middle = middle(&self.polynomial, &self.lo, &self.hi);
        if self.polynomial.sign_at(&middle) == self.polynomial.sign_at(&self.lo) {
            self.lo = middle;
        } else {
            self.hi = middle;
        }
    }
}

/// Isolates the roots in intervals, or returns `None` if some are not separated by `most`
/// halvings.
fn isolated(f: &Polynomial, most: usize) -> Option<Vec<Algebraic>> {
    let polynomial = Arc::new(f.clone());
    let bound = f.bound();
    let mut left = vec![(Dyadic::zero().minus(&bound), bound, 0)];
    let mut found = Vec::new();
    while let Some((lo, hi, depth)) = left.pop() {
        // Descartes' rule counts the roots, or more by an even number.
        match f.between(&lo, &hi).variations() {
            0 => {}
            1 => {
                let polynomial = polynomial.clone();
                found.push(Algebraic { polynomial, lo, hi });
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

/// Returns the middle, or a number below it that is no root.
fn middle(f: &Polynomial, lo: &Dyadic, hi: &Dyadic) -> Dyadic {
    let mut middle = lo.plus(hi).half();
    while f.sign_at(&middle).is_eq() {
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
        let c: Vec<Dyadic> = c.iter().map(|c| Dyadic::from_f64(*c)).collect();
        Algebraic::roots(&Polynomial::from_dyadics(&c))
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
        let Ok(surds) = Poly([-2.0, 0.0, 1.0].map(Dyadic::from_f64)).roots();
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
        let near = Dyadic::from_f64(2.0).plus(&Dyadic::power_of_two(-300));
        let c = [
            Dyadic::zero().minus(&near),
            Dyadic::zero(),
            Dyadic::from_f64(1.0),
        ];
        let above = &Algebraic::roots(&Polynomial::from_dyadics(&c))[1];
        assert!(order(&roots(&[-2.0, 0.0, 1.0])[1], above).is_lt());
        // Both roots in one polynomial.
        let mut product = vec![Dyadic::zero(); 5];
        for (i, x) in c.iter().enumerate() {
            product[i] = product[i].minus(&x.plus(x));
            product[i + 2] = product[i + 2].plus(x);
        }
        let both = Algebraic::roots(&Polynomial::from_dyadics(&product));
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
            assert!(root.order_with(&Dyadic::from_f64(value)).is_eq());
            assert!(root.order_with(&Dyadic::from_f64(value.next_up())).is_lt());
            assert_eq!(nearest(&Root::Algebraic(root.clone())), value);
        }
        assert!(roots(&[]).is_empty() && roots(&[0.0]).is_empty() && roots(&[7.0]).is_empty());
        // The ends of the range of f64.
        let tiny = f64::from_bits(1);
        assert_eq!(
            nearest(&Root::Algebraic(roots(&[-tiny, 1.0])[0].clone())),
            tiny
        );
        let beyond = Root::Algebraic(roots(&[-1e300, 1e-300])[0].clone());
        assert_eq!(nearest(&beyond), f64::INFINITY);
    }
}
