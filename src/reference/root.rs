//! Polynomials in t of degree two at most, and real roots without a rounding.
//!
//! Theirs are (p ± √q) / r (`surd`); those of polynomial surfaces, of any degree,
//! are what their polynomials have between two numbers (`algebraic`).

use super::algebraic::Algebraic;
use super::number::Number;
use super::surd::Surd;
use std::cmp::Ordering;
use std::ops::{Add, Mul, Sub};

/// c₀ + c₁t + c₂t².
#[derive(Clone, Debug)]
pub struct Poly<N>(pub [N; 3]);

/// A real root of a polynomial.
#[derive(Clone, Debug)]
pub enum Root<N> {
    /// Of one of degree two at most.
    Surd(Surd<N>),
    /// Of one of any degree.
    Algebraic(Algebraic),
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

    /// Far before t = 0 or far behind it.
    pub fn sign_far_off(&self, before: bool) -> Result<Ordering, N::Doubt> {
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
        let surd = |sign: f64| Surd {
            p: negative(c1).with_sign_of(leading),
            q: q.clone(),
            r: c2.plus(c2).with_sign_of(leading),
            sign,
        };
        let roots = match q.sign()? {
            Ordering::Less => Vec::new(),
            // The same number in its simplest form.
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
    /// p / r, where `sign` is that of r.
    pub fn fraction(p: N, r: N, sign: Ordering) -> Root<N> {
        Root::Surd(Surd {
            p: p.with_sign_of(sign),
            q: N::zero(),
            r: r.with_sign_of(sign),
            sign: 1.0,
        })
    }

    /// The sign of a polynomial at this t.
    pub fn sign_of(&self, f: &Poly<N>) -> Result<Ordering, N::Doubt> {
        if let Root::Surd(surd) = self {
            return surd.sign_of(f);
        }
        // That far before its roots, turned at each that lies before this one.
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

    /// Against a finite number.
    pub fn order_with(&self, x: f64) -> Result<Ordering, N::Doubt> {
        self.order_with_number(&N::of(x))
    }

    pub fn order_with_number(&self, x: &N) -> Result<Ordering, N::Doubt> {
        match self {
            Root::Surd(surd) => surd.order_with_number(x),
            Root::Algebraic(root) => Ok(root.order_with(&x.exactly()?)),
        }
    }

    /// Against another root.
    pub fn order(&self, other: &Root<N>) -> Result<Ordering, N::Doubt> {
        match (self, other) {
            (Root::Surd(a), Root::Surd(b)) => a.order(b),
            _ => Ok(self.algebraic()?.order(&other.algebraic()?)),
        }
    }

    fn algebraic(&self) -> Result<Algebraic, N::Doubt> {
        match self {
            Root::Surd(surd) => {
                let Surd { p, q, r, sign } = surd;
                let [p, q, r] = [p.exactly()?, q.exactly()?, r.exactly()?];
                let sign = *sign;
                Ok(Algebraic::of_surd(&Surd { p, q, r, sign }))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::approx::Approx;
    use crate::dyadic::Dyadic;
    use proptest::prelude::*;

    /// Short, so that products meet.
    fn number() -> impl Strategy<Value = f64> {
        (-40..40_i32).prop_map(|n| f64::from(n) / 8.0)
    }

    fn numbers() -> impl Strategy<Value = [f64; 3]> {
        prop::array::uniform3(number())
    }

    fn poly<N: Number>(c: [f64; 3]) -> Poly<N> {
        Poly(c.map(N::of))
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
        // The f64 on both sides of √2.
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

        /// Orders and signs are those of the rounded numbers wherever these differ
        /// by more than roundings; and f64 that is sure says the same.
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
