//! Polynomials in t of degree two at most, and real roots without rounding.
//!
//! Roots of degree two at most are (p ± √q) / r (`surd`); those of polynomial surfaces, of
//! any degree, are a polynomial and an interval that holds one root (`algebraic`).

use super::algebraic::Algebraic;
use super::number::Number;
use super::surd::Surd;
use std::cmp::Ordering;
use std::ops::{Add, Mul, Sub};

/// The polynomial c₀ + c₁t + c₂t².
#[derive(Clone, Debug)]
pub struct Poly<N>(pub [N; 3]);

/// A real root of a polynomial.
#[derive(Clone, Debug)]
pub enum Root<N> {
    /// A root of a polynomial of degree two at most.
    Surd(Surd<N>),
    /// A root of a polynomial of any degree.
    Algebraic(Algebraic),
}

impl<N: Number> Poly<N> {
    /// Returns the constant polynomial x.
    pub fn constant(x: f64) -> Poly<N> {
        Poly([N::from_f64(x), N::zero(), N::zero()])
    }

    /// Returns c₀ + c₁t.
    pub fn linear(c0: N, c1: N) -> Poly<N> {
        Poly([c0, c1, N::zero()])
    }

    /// Returns the square of a polynomial of degree one at most.
    pub fn squared(&self) -> Poly<N> {
        self.clone() * self.clone()
    }

    /// Returns the sign before all roots, or behind all of them.
    pub fn sign_far_off(&self, before: bool) -> Result<Ordering, N::Undecided> {
        let [c0, c1, c2] = &self.0;
        let bend = c2.sign()?;
        if bend.is_ne() {
            return Ok(bend);
        }
        let slope = c1.sign()?;
        if slope.is_ne() {
            return Ok(if before { slope.reverse() } else { slope });
        }
        c0.sign()
    }

    /// Lists the real roots, each once and the lower first. A constant, zero or not, has
    /// none.
    pub fn roots(&self) -> Result<Vec<Root<N>>, N::Undecided> {
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
        let four = N::from_f64(4.0);
        let q = c1.squared().minus(&four.times(c2).times(c0));
        let surd = |sign: f64| Surd {
            p: negative(c1).with_sign_of(leading),
            q: q.clone(),
            r: c2.plus(c2).with_sign_of(leading),
            sign,
        };
        let roots = match q.sign()? {
            Ordering::Less => Vec::new(),
            // The double root in its simplest form.
            Ordering::Equal => vec![Surd {
                q: N::zero(),
                ..surd(1.0)
            }],
            Ordering::Greater => vec![surd(-1.0), surd(1.0)],
        };
        Ok(roots.into_iter().map(Root::Surd).collect())
    }
}

impl<N: Number> Root<N> {
    /// Returns the root p / r, where `sign` is the sign of r.
    pub fn fraction(p: N, r: N, sign: Ordering) -> Root<N> {
        Root::Surd(Surd {
            p: p.with_sign_of(sign),
            q: N::zero(),
            r: r.with_sign_of(sign),
            sign: 1.0,
        })
    }

    /// Returns the sign of a polynomial at this root.
    pub fn sign_of(&self, f: &Poly<N>) -> Result<Ordering, N::Undecided> {
        if let Root::Surd(surd) = self {
            return surd.sign_of(f);
        }
        // The sign far before all roots of f, reversed at each of them that lies before
        // this root.
        let mut sign = f.sign_far_off(true)?;
        let roots = f.roots()?;
        let touches = roots.len() == 1 && sign == f.sign_far_off(false)?;
        for root in &roots {
            match self.order(root)? {
                Ordering::Less => break,
                Ordering::Equal => return Ok(Ordering::Equal),
                Ordering::Greater if touches => {}
                Ordering::Greater => sign = sign.reverse(),
            }
        }
        Ok(sign)
    }

    /// Compares the root with a finite number.
    pub fn order_with(&self, x: f64) -> Result<Ordering, N::Undecided> {
        self.order_with_number(&N::from_f64(x))
    }

    /// Compares the root with a number.
    pub fn order_with_number(&self, x: &N) -> Result<Ordering, N::Undecided> {
        match self {
            Root::Surd(surd) => surd.order_with_number(x),
            Root::Algebraic(root) => Ok(root.order_with(&x.exactly()?)),
        }
    }

    /// Compares the root with another one.
    pub fn order(&self, other: &Root<N>) -> Result<Ordering, N::Undecided> {
        match (self, other) {
            (Root::Surd(a), Root::Surd(b)) => a.order(b),
            _ => Ok(self.algebraic()?.order(&other.algebraic()?)),
        }
    }

    fn algebraic(&self) -> Result<Algebraic, N::Undecided> {
        match self {
            Root::Surd(surd) => {
                let Surd { p, q, r, sign } = surd;
                let [p, q, r] = [p.exactly()?, q.exactly()?, r.exactly()?];
                let sign = *sign;
                Ok(Algebraic::from_surd(&Surd { p, q, r, sign }))
            }
            Root::Algebraic(root) => Ok(root.clone()),
        }
    }
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

/// Multiplies polynomials whose product has degree two at most: a constant and any other,
/// or two of degree one.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::approx::Approx;
    use crate::dyadic::Dyadic;
    use proptest::prelude::*;

    /// Short numbers, so that products coincide.
    fn number() -> impl Strategy<Value = f64> {
        (-40..40_i32).prop_map(|n| f64::from(n) / 8.0)
    }

    fn numbers() -> impl Strategy<Value = [f64; 3]> {
        prop::array::uniform3(number())
    }

    fn poly<N: Number>(c: [f64; 3]) -> Poly<N> {
        Poly(c.map(N::from_f64))
    }

    fn roots(c: [f64; 3]) -> Vec<Root<Dyadic>> {
        let Ok(roots) = poly(c).roots();
        roots
    }

    fn value(t: &Root<Dyadic>) -> f64 {
        crate::rounding::nearest(t)
    }

    #[test]
    fn equal_roots_of_different_polynomials_are_equal() {
        // √2 by t² = 2, by 3t² = 6; 1 + √2 by t² − 2t − 1; 2 by t² = 4 and by t = 2.
        let at = |c, i: usize| roots(c)[i].clone();
        let order = |a: &Root<Dyadic>, b: &Root<Dyadic>| {
            let (Ok(one), Ok(other)) = (a.order(b), b.order(a));
            assert_eq!(one, other.reverse());
            one
        };
        let sqrt2 = at([-2.0, 0.0, 1.0], 1);
        assert!(order(&sqrt2, &at([6.0, 0.0, -3.0], 1)).is_eq());
        assert!(order(&sqrt2, &at([6.0, 0.0, -3.0], 0)).is_gt());
        assert!(order(&at([-4.0, 0.0, 1.0], 1), &at([-2.0, 1.0, 0.0], 0)).is_eq());
        let more = at([-1.0, -2.0, 1.0], 1);
        assert!(order(&more, &sqrt2).is_gt());
        // The two f64 that bracket √2.
        let near = std::f64::consts::SQRT_2;
        let (Ok(below), Ok(above)) = (sqrt2.order_with(near), sqrt2.order_with(near.next_down()));
        assert!(below.is_lt() && above.is_gt());
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            failure_persistence: None,
            ..ProptestConfig::with_cases(5_000)
        })]

        /// A polynomial is zero at its roots and changes its sign there.
        #[test]
        fn roots_are_where_polynomials_vanish(c in numbers(), by in number()) {
            let found = roots(c);
            let q = c[1] * c[1] - 4.0 * c[2] * c[0];
            let count = match (c[2] == 0.0, q) {
                (true, _) => usize::from(c[1] != 0.0),
                (_, q) => usize::from(q >= 0.0) + usize::from(q > 0.0),
            };
            prop_assert_eq!(found.len(), count);
            for t in &found {
                let Ok(sign) = t.sign_of(&poly(c));
                prop_assert!(sign.is_eq());
                let Ok(sign) = t.sign_of(&poly(c.map(|x| x * by)));
                prop_assert!(sign.is_eq());
            }
            if let [low, high] = &found[..] {
                let Ok(order) = low.order(high);
                prop_assert!(order.is_lt());
                let Ok(slope) = low.sign_of(&poly([c[1], 2.0 * c[2], 0.0]));
                prop_assert_eq!(slope.is_gt(), c[2] < 0.0);
            }
        }

        /// Exact orders and signs are those of the rounded numbers wherever these differ by
        /// more than roundings, and a decided answer of f64 is the exact one.
        #[test]
        fn orders_are_those_of_numbers(a in numbers(), b in numbers(), x in number()) {
            for s in roots(a) {
                let Ok(with) = s.order_with(x);
                prop_assert_eq!(Some(with), value(&s).partial_cmp(&x));
                let Ok(sign) = s.sign_of(&poly(b));
                let at = b[0] + value(&s) * (b[1] + value(&s) * b[2]);
                prop_assert!(at.abs() < 1e-9 || sign == at.total_cmp(&0.0));
                for t in roots(b) {
                    let Ok(order) = s.order(&t);
                    let apart = value(&s) - value(&t);
                    prop_assert!(apart.abs() < 1e-12 || order == apart.total_cmp(&0.0));
                    prop_assert!(apart == 0.0 || order.is_ne());
                }
            }
            let (Ok(s), Ok(t)) = (poly::<Approx>(a).roots(), poly::<Approx>(b).roots()) else {
                return Ok(());
            };
            for (s, exact_s) in s.iter().zip(roots(a)) {
                let Ok(sign) = exact_s.sign_of(&poly(b));
                prop_assert!(s.sign_of(&poly(b)).is_ok_and(|known| known == sign)
                    || s.sign_of(&poly(b)).is_err());
                let (lo, hi) = (s.value().lo(), s.value().hi());
                let (Ok(low), Ok(high)) = (exact_s.order_with(lo), exact_s.order_with(hi));
                prop_assert!(low.is_ge() && high.is_le());
                for (t, exact_t) in t.iter().zip(roots(b)) {
                    let Ok(order) = exact_s.order(&exact_t);
                    prop_assert!(s.order(t).is_err() || s.order(t) == Ok(order));
                }
            }
        }
    }
}
