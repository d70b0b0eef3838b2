//! Exact dyadic numbers of any size: integers times powers of 2⁶⁴, without heap
//! allocation per number.
//!
//! Every finite f64 is dyadic, and so are sums, differences and products of dyadic
//! numbers. The integers of [`super::int`] are faster, but have one fixed size per degree
//! of a product and need all numbers of a formula on one grid. A [`Dyadic`] has as many
//! limbs as it needs, without zeros at either end, and its own power, so formulas of
//! degree 30 are written as they stand. The limbs lie in a [`Space`] that [`exactly`] makes
//! for one question, filled from one end; a number is a handle to some of them. A number
//! that finds no room is *lost*, and so is every number computed from it.

use super::int::decoded;
use super::number::{ExactSign, Number};
use std::cell::Cell;
use std::cmp::Ordering;

/// Limbs that every question about finite numbers fits into. Lemma D11,
/// docs/numerics/exact.md.
const ENOUGH: usize = 1 << 15;

/// Limbs that most questions fit into. They are cleared each time, so they are few.
const USUAL: usize = 128;

/// Limbs that nearly all questions fit into, still on the stack.
const MANY: usize = 2048;

/// Answers a question with exact numbers. `ask` returns `None` if a number was lost; it is
/// asked in a small space on the stack, and again in larger ones. Panics if a number is
/// lost in the largest, too, which lemma D11 (docs/numerics/exact.md) excludes for finite
/// inputs.
pub fn exactly<T>(ask: &dyn Fn(&Space) -> Option<T>) -> T {
    let answer = ask(&Space::over(&mut [0; USUAL]));
    answer.unwrap_or_else(|| with_enough(ask))
}

#[cold]
#[inline(never)]
fn with_enough<T>(ask: &dyn Fn(&Space) -> Option<T>) -> T {
    let answer = ask(&Space::over(&mut [0; MANY]));
    let answer = answer.or_else(|| ask(&Space::over(&mut vec![0; ENOUGH])));
    answer.expect("the space holds what finite inputs give")
}

/// A stack of limbs in which [`Dyadic`] numbers are stored.
pub struct Space<'a> {
    limbs: &'a [Cell<u64>],
    used: Cell<usize>,
}

impl<'a> Space<'a> {
    /// Makes an empty space over a slice, whose contents do not matter.
    pub fn over(limbs: &'a mut [u64]) -> Space<'a> {
        Space {
            limbs: Cell::from_mut(limbs).as_slice_of_cells(),
            used: Cell::new(0),
        }
    }

    /// Reserves `len` limbs with unspecified contents and returns the index of the first;
    /// `None` if there is no room.
    #[inline(always)]
    fn take(&self, len: usize) -> Option<usize> {
        let first = self.used.get();
        if first + len > self.limbs.len() {
            return None;
        }
        self.used.set(first + len);
        Some(first)
    }
}

/// The number ± Σ limbs[first + i] · 2^(64 (power + i)) over i < len.
#[derive(Clone, Copy)]
pub struct Dyadic<'a> {
    space: &'a Space<'a>,
    first: usize,
    /// Number of limbs; the first and the last are not 0, and zero has none.
    len: usize,
    power: i32,
    negative: bool,
    /// Whether the number found no room.
    lost: bool,
}

impl<'a> Dyadic<'a> {
    #[inline(always)]
    fn zero(space: &'a Space<'a>) -> Self {
        Dyadic {
            space,
            first: 0,
            len: 0,
            power: 0,
            negative: false,
            lost: false,
        }
    }

    fn lost(space: &'a Space<'a>) -> Self {
        Dyadic {
            lost: true,
            ..Dyadic::zero(space)
        }
    }

    #[inline(always)]
    pub fn space(&self) -> &'a Space<'a> {
        self.space
    }

    #[inline(always)]
    fn limbs(&self) -> &'a [Cell<u64>] {
        &self.space.limbs[self.first..self.first + self.len]
    }

    /// Returns whether the number is negative, its limbs and its power:
    /// ± Σ `limbs[i]` · 2^(64 (power + i)). `None` if the number is lost.
    pub fn parts(&self) -> Option<(bool, Vec<u64>, i32)> {
        let limbs = self.limbs().iter().map(Cell::get).collect();
        (!self.lost).then_some((self.negative, limbs, self.power))
    }

    /// Drops zero limbs at both ends.
    #[inline(always)]
    fn stripped(mut self) -> Self {
        let limbs = self.limbs();
        while self.len > 0 && limbs[self.len - 1].get() == 0 {
            self.len -= 1;
        }
        if self.len == 0 {
            return Dyadic::zero(self.space);
        }
        let zeros = limbs.iter().take_while(|limb| limb.get() == 0).count();
        self.first += zeros;
        self.len -= zeros;
        self.power += zeros as i32;
        self
    }

    /// Returns the limb of weight 2^(64 at).
    #[inline(always)]
    fn limb(limbs: &[Cell<u64>], power: i32, at: i32) -> u64 {
        limbs.get((at - power) as usize).map_or(0, Cell::get)
    }

    #[inline(never)]
    fn sum(&self, other: &Self, negate: bool) -> Self {
        let space = self.space;
        if self.lost || other.lost {
            return Dyadic::lost(space);
        }
        let negative = other.negative != negate;
        if other.len == 0 {
            return *self;
        }
        if self.len == 0 {
            return Dyadic { negative, ..*other };
        }
        let low = self.power.min(other.power);
        let high = (self.power + self.len as i32).max(other.power + other.len as i32);
        let len = (high - low) as usize;
        let Some(first) = space.take(len + 1) else {
            return Dyadic::lost(space);
        };
        let to = &space.limbs[first..first + len + 1];
        let (x, y) = (self.limbs(), other.limbs());
        let pair = |i: usize| {
            let at = low + i as i32;
            let x = Dyadic::limb(x, self.power, at);
            (x, Dyadic::limb(y, other.power, at))
        };
        let mut sum = Dyadic {
            first,
            len,
            power: low,
            negative: self.negative,
            ..Dyadic::zero(space)
        };
        if self.negative == negative {
            let mut carry = false;
            for i in 0..len {
                let (x, y) = pair(i);
                let (x, over) = x.overflowing_add(y);
                let (x, again) = x.overflowing_add(u64::from(carry));
                to[i].set(x);
                carry = over | again;
            }
            to[len].set(u64::from(carry));
            sum.len = len + 1;
        } else {
            let mut borrow = false;
            for i in 0..len {
                let (x, y) = pair(i);
                let (x, under) = x.overflowing_sub(y);
                let (x, again) = x.overflowing_sub(u64::from(borrow));
                to[i].set(x);
                borrow = under | again;
            }
            if borrow {
                // `other` was larger: negate the two's complement and take the sign of
                // `other`.
                sum.negative = negative;
                let mut carry = true;
                for limb in &to[..len] {
                    let (x, over) = (!limb.get()).overflowing_add(u64::from(carry));
                    limb.set(x);
                    carry = over;
                }
            }
        }
        sum.stripped()
    }

    #[inline(never)]
    fn product(&self, other: &Self) -> Self {
        let space = self.space;
        if self.lost || other.lost {
            return Dyadic::lost(space);
        }
        if self.len == 0 || other.len == 0 {
            return Dyadic::zero(space);
        }
        let len = self.len + other.len;
        let Some(first) = space.take(len) else {
            return Dyadic::lost(space);
        };
        let to = &space.limbs[first..first + len];
        for limb in to {
            limb.set(0);
        }
        for (i, x) in self.limbs().iter().enumerate() {
            let (x, mut carry) = (u128::from(x.get()), 0);
            let row = &to[i..];
            for (to, y) in row.iter().zip(other.limbs()) {
                let sum = x * u128::from(y.get()) + u128::from(to.get()) + u128::from(carry);
                to.set(sum as u64);
                carry = (sum >> 64) as u64;
            }
            row[other.len].set(carry);
        }
        Dyadic {
            first,
            len,
            power: self.power + other.power,
            negative: self.negative != other.negative,
            ..Dyadic::zero(space)
        }
        .stripped()
    }

    #[inline(always)]
    pub fn negated(&self) -> Self {
        self.negated_if(true)
    }
}

impl<'a> Number for Dyadic<'a> {
    type Space = &'a Space<'a>;

    fn of(space: &'a Space<'a>, x: f64) -> Self {
        let (m, power) = decoded(x);
        Dyadic::scaled(space, m, power, x < 0.0)
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

    /// Returns the sign; `None` if the number is lost.
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

    fn displaced(space: &'a Space<'a>, o: f64, s: f64, d: f64, c: f64) -> Self {
        let of = |x| Dyadic::of(space, x);
        let from = of(o).minus(&of(c));
        if s == 0.0 {
            return from;
        }
        from.plus(&of(s).times(&of(d)))
    }
}

impl<'a> ExactSign for Dyadic<'a> {
    #[inline(never)]
    fn scaled(space: &'a Space<'a>, m: u64, power: i32, negative: bool) -> Self {
        let wide = u128::from(m) << power.rem_euclid(64);
        let Some(first) = space.take(2) else {
            return Dyadic::lost(space);
        };
        space.limbs[first].set(wide as u64);
        space.limbs[first + 1].set((wide >> 64) as u64);
        Dyadic {
            first,
            len: 2,
            power: power.div_euclid(64),
            negative,
            ..Dyadic::zero(space)
        }
        .stripped()
    }

    #[inline(always)]
    fn negated_if(&self, negate: bool) -> Self {
        Dyadic {
            negative: self.negative != (negate && self.len > 0),
            ..*self
        }
    }

    fn briefly<T>(space: &'a Space<'a>, f: impl FnOnce() -> T) -> T {
        let used = space.used.get();
        let result = f();
        space.used.set(used);
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_bigint::{BigInt, BigUint};
    use proptest::prelude::*;

    /// Returns the number times 2^6400, which makes all numbers of these tests integers.
    fn big(x: &Dyadic) -> BigInt {
        assert!(!x.lost && x.power > -100);
        assert!(x.len > 0 || !x.negative);
        let limbs = x.limbs();
        let ends = [limbs.first(), limbs.last()];
        assert!(ends.iter().flatten().all(|limb| limb.get() != 0));
        let digits = limbs
            .iter()
            .flat_map(|l| [l.get() as u32, (l.get() >> 32) as u32]);
        let size = BigInt::from(BigUint::new(digits.collect()) << (64 * (x.power + 100)));
        if x.negative { -size } else { size }
    }

    fn exact(x: f64) -> BigInt {
        let (m, power) = decoded(x);
        let size = BigInt::from(m) << (6400 + power);
        if x < 0.0 { -size } else { size }
    }

    /// Generates numbers of any size, of magnitude about 1, or with few bits.
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
        fn dyadic_numbers_compute(x in number(), y in number(), z in number(), room in 4_usize..60) {
            let mut limbs = [7; 2000];
            let space = Space::over(&mut limbs);
            let of = |x| Dyadic::of(&space, x);
            let (a, b, c) = (of(x), of(y), of(z));
            prop_assert_eq!(big(&a), exact(x));
            prop_assert_eq!(big(&a.plus(&b)), exact(x) + exact(y));
            prop_assert_eq!(big(&a.minus(&b)), exact(x) - exact(y));
            // Numbers of many limbs, and equal numbers.
            let (p, q) = (a.times(&b).plus(&c), c.minus(&a.times(&b)));
            let product: BigInt = (exact(x) * exact(y)) >> 6400;
            let has_place = x.abs() * y.abs() > 1e-200 || x == 0.0 || y == 0.0;
            if has_place {
                prop_assert_eq!(big(&p), &product + exact(z));
                prop_assert_eq!(big(&p.plus(&q)), exact(z) * 2);
                prop_assert_eq!(big(&p.minus(&q)), &product * 2);
                prop_assert_eq!(p.sign(), Some((product + exact(z)).cmp(&BigInt::ZERO)));
            }
            prop_assert_eq!(big(&p.minus(&p)), BigInt::ZERO);
            prop_assert_eq!(big(&a.negated_if(true)), -exact(x));
            let from = Dyadic::displaced(&space, x, 0.25, y, z).times(&of(4.0));
            prop_assert_eq!(big(&from), exact(x) * 4 + exact(y) - exact(z) * 4);
            // `briefly` gives back its room and leaves other numbers alone.
            let used = space.used.get();
            let again = Dyadic::briefly(&space, || p.times(&q).plus(&p).sign());
            prop_assert_eq!(again, p.times(&q).plus(&p).sign());
            prop_assert!(space.used.get() >= used);
            prop_assert_eq!(big(&a), exact(x));
            // A number that finds no room is marked as lost.
            let mut limbs = [7; 60];
            let small = Space::over(&mut limbs[..room]);
            let of = |x| Dyadic::of(&small, x);
            let sum = of(x).plus(&of(y)).times(&of(z)).plus(&of(x));
            let full = a.plus(&b).times(&c).plus(&a);
            prop_assert!(sum.lost || sum.sign() == full.sign() && sum.len == full.len);
        }
    }

    #[test]
    fn what_is_lost_stays_lost() {
        let mut limbs = [0; 40];
        let space = Space::over(&mut limbs);
        let of = |x| Dyadic::of(&space, x);
        let one = of(1.0);
        let sum = of(1e300).plus(&of(1e-300));
        assert_eq!(sum.sign(), Some(Ordering::Greater));
        let wide = sum.times(&sum);
        assert_eq!(wide.sign(), None);
        assert_eq!(wide.times(&Dyadic::zero(&space)).sign(), None);
        assert_eq!(one.minus(&wide).sign(), None);
        assert_eq!(one.sign(), Some(Ordering::Greater));
    }
}
