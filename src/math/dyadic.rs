//! Exact numbers of any size, up to a capacity, on the stack: integers times
//! powers of 2^64.
//!
//! A finite f64 is one; sums, differences and products of such are. [`Int`]
//! (super::int::Int) is faster, but has one size for each degree of a product,
//! and all numbers of a formula on one grid. Here limbs are as many as a number
//! has, without zeros at either end, and each number has its own power: formulas
//! of degree 30 are written as they are. What does not fit the capacity is lost,
//! and so is all that is computed from it: the caller takes a larger one.

use super::int::decoded;
use super::number::Number;
use std::cmp::Ordering;

/// ± Σ limbs[i] · 2^(64 (power + i)), i < len.
#[derive(Clone, Debug)]
pub struct Dyadic<const CAPACITY: usize> {
    limbs: [u64; CAPACITY],
    /// Limbs that are used; neither the first of them nor the last is 0.
    len: usize,
    power: i32,
    negative: bool,
    /// It did not fit.
    lost: bool,
}

impl<const CAPACITY: usize> Dyadic<CAPACITY> {
    const ZERO: Self = Dyadic {
        limbs: [0; CAPACITY],
        len: 0,
        power: 0,
        negative: false,
        lost: false,
    };

    fn lost() -> Self {
        Dyadic {
            lost: true,
            ..Self::ZERO
        }
    }

    /// m · 2^power.
    #[inline(never)]
    pub fn scaled(m: u64, power: i32, negative: bool) -> Self {
        const { assert!(CAPACITY >= 2) };
        let wide = u128::from(m) << power.rem_euclid(64);
        let mut number = Self::ZERO;
        (number.limbs[0], number.limbs[1]) = (wide as u64, (wide >> 64) as u64);
        (number.len, number.power) = (2, power.div_euclid(64));
        number.negative = negative;
        number.stripped()
    }

    /// Without zeros at the ends.
    #[inline(always)]
    fn stripped(mut self) -> Self {
        while self.len > 0 && self.limbs[self.len - 1] == 0 {
            self.len -= 1;
        }
        if self.len == 0 {
            return Self::ZERO;
        }
        let zeros = self.limbs.iter().take_while(|limb| **limb == 0).count();
        if zeros > 0 {
            self.limbs.copy_within(zeros..self.len, 0);
            self.len -= zeros;
            self.power += zeros as i32;
        }
        self
    }

    /// The limb of weight 2^(64 at).
    #[inline(always)]
    fn limb(&self, at: i32) -> u64 {
        let i = (at - self.power) as usize;
        if i < self.len { self.limbs[i] } else { 0 }
    }

    #[inline(never)]
    fn sum(&self, other: &Self, negate: bool) -> Self {
        if self.lost || other.lost {
            return Self::lost();
        }
        if other.len == 0 {
            return self.clone();
        }
        let negative = other.negative != negate;
        if self.len == 0 {
            return Dyadic {
                negative,
                ..other.clone()
            };
        }
        let low = self.power.min(other.power);
        let high = (self.power + self.len as i32).max(other.power + other.len as i32);
        let len = (high - low) as usize;
        if len + 1 > CAPACITY {
            return Self::lost();
        }
        let mut sum = Self::ZERO;
        (sum.power, sum.negative) = (low, self.negative);
        if self.negative == negative {
            let mut carry = false;
            for i in 0..len {
                let at = low + i as i32;
                let (x, over) = self.limb(at).overflowing_add(other.limb(at));
                let (x, again) = x.overflowing_add(u64::from(carry));
                (sum.limbs[i], carry) = (x, over | again);
            }
            sum.limbs[len] = u64::from(carry);
            sum.len = len + 1;
        } else {
            let mut borrow = false;
            for i in 0..len {
                let at = low + i as i32;
                let (x, under) = self.limb(at).overflowing_sub(other.limb(at));
                let (x, again) = x.overflowing_sub(u64::from(borrow));
                (sum.limbs[i], borrow) = (x, under | again);
            }
            sum.len = len;
            if borrow {
                // The other was larger: two's complement, and its sign.
                sum.negative = negative;
                let mut carry = true;
                for limb in &mut sum.limbs[..len] {
                    (*limb, carry) = (!*limb).overflowing_add(u64::from(carry));
                }
            }
        }
        sum.stripped()
    }

    #[inline(never)]
    fn product(&self, other: &Self) -> Self {
        if self.lost || other.lost {
            return Self::lost();
        }
        let len = self.len + other.len;
        if len > CAPACITY {
            return Self::lost();
        }
        let mut product = Self::ZERO;
        if self.len == 0 || other.len == 0 {
            return product;
        }
        for (i, x) in self.limbs[..self.len].iter().enumerate() {
            let mut carry = 0;
            let row = &mut product.limbs[i..];
            for (to, y) in row.iter_mut().zip(&other.limbs[..other.len]) {
                let sum = u128::from(*x) * u128::from(*y) + u128::from(*to) + u128::from(carry);
                (*to, carry) = (sum as u64, (sum >> 64) as u64);
            }
            row[other.len] = carry;
        }
        (product.len, product.power) = (len, self.power + other.power);
        product.negative = self.negative != other.negative;
        product.stripped()
    }

    pub fn negated(&self) -> Self {
        self.negated_if(true)
    }

    pub fn negated_if(&self, negate: bool) -> Self {
        Dyadic {
            negative: self.negative != (negate && self.len > 0),
            ..self.clone()
        }
    }
}

impl<const CAPACITY: usize> Number for Dyadic<CAPACITY> {
    fn of(x: f64) -> Self {
        let (m, power) = decoded(x);
        Self::scaled(m, power, x < 0.0)
    }

    fn plus(&self, other: &Self) -> Self {
        self.sum(other, false)
    }

    fn minus(&self, other: &Self) -> Self {
        self.sum(other, true)
    }

    fn times(&self, other: &Self) -> Self {
        self.product(other)
    }

    /// `None` where it is lost.
    fn sign(&self) -> Option<Ordering> {
        if self.lost {
            return None;
        }
        Some(match (self.len, self.negative) {
            (0, _) => Ordering::Equal,
            (_, true) => Ordering::Less,
            (_, false) => Ordering::Greater,
        })
    }

    fn displaced(o: f64, s: f64, d: f64, c: f64) -> Self {
        let from = Self::of(o).minus(&Self::of(c));
        if s == 0.0 {
            return from;
        }
        from.plus(&Self::of(s).times(&Self::of(d)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_bigint::{BigInt, BigUint};
    use proptest::prelude::*;

    /// Times 2^6400, which is more than what any of these has below 1.
    fn big<const N: usize>(x: &Dyadic<N>) -> BigInt {
        assert!(!x.lost && x.power > -100);
        assert!(x.len == 0 || x.limbs[0] != 0 && x.limbs[x.len - 1] != 0);
        assert!(x.len > 0 || !x.negative);
        let limbs = x.limbs[..x.len].iter();
        let digits = limbs.flat_map(|l| [*l as u32, (l >> 32) as u32]);
        let size = BigInt::from(BigUint::new(digits.collect()) << (64 * (x.power + 100)));
        if x.negative { -size } else { size }
    }

    fn exact(x: f64) -> BigInt {
        let (m, power) = decoded(x);
        let size = BigInt::from(m) << (6400 + power);
        if x < 0.0 { -size } else { size }
    }

    /// Of any size, or about 1, or with few bits.
    fn number() -> impl Strategy<Value = f64> {
        let any = any::<f64>().prop_filter("finite", |x| x.is_finite());
        let round = (-9_i32..10, -70..70).prop_map(|(m, k)| f64::from(m) * 2.0_f64.powi(k));
        prop_oneof![any, -2.0..2.0, round]
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            failure_persistence: None,
            ..ProptestConfig::with_cases(20_000)
        })]

        #[test]
        fn dyadic_numbers_compute(x in number(), y in number(), z in number()) {
            type D = Dyadic<200>;
            let (a, b, c) = (D::of(x), D::of(y), D::of(z));
            prop_assert_eq!(big(&a), exact(x));
            prop_assert_eq!(big(&a.plus(&b)), exact(x) + exact(y));
            prop_assert_eq!(big(&a.minus(&b)), exact(x) - exact(y));
            // Of many limbs, and equal numbers.
            let (p, q) = (a.times(&b).plus(&c), c.minus(&a.times(&b)));
            let product: BigInt = exact(x) * exact(y) >> 6400;
            let has_place = x.abs() * y.abs() > 1e-200 || x * y == 0.0 && (x == 0.0 || y == 0.0);
            if has_place {
                prop_assert_eq!(big(&p), &product + exact(z));
                prop_assert_eq!(big(&p.plus(&q)), exact(z) * 2);
                prop_assert_eq!(big(&p.minus(&q)), &product * 2);
                prop_assert_eq!(p.sign(), Some((product + exact(z)).cmp(&BigInt::ZERO)));
            }
            prop_assert_eq!(big(&p.minus(&p)), BigInt::ZERO);
            prop_assert_eq!(big(&a.negated()), -exact(x));
            let from = D::displaced(x, 0.25, y, z).times(&D::of(4.0));
            prop_assert_eq!(big(&from), exact(x) * 4 + exact(y) - exact(z) * 4);
            // What does not fit says so.
            let small = |x| Dyadic::<4>::of(x);
            let sum = small(x).plus(&small(y)).times(&small(z)).plus(&small(x));
            let full = a.plus(&b).times(&c).plus(&a);
            prop_assert!(sum.lost || sum.sign() == full.sign() && sum.len == full.len);
        }
    }

    #[test]
    fn what_is_lost_stays_lost() {
        let wide = Dyadic::<4>::of(1e300).plus(&Dyadic::of(1e-300));
        assert_eq!(wide.sign(), None);
        assert_eq!(wide.times(&Dyadic::of(0.0)).sign(), None);
        assert_eq!(Dyadic::of(1.0).minus(&wide).sign(), None);
    }
}
