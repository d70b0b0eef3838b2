//! Integers of a fixed size, on the stack: what exact predicates count in.
//!
//! A finite f64 is an integer times a power of two. So a predicate that adds,
//! subtracts and multiplies can be brought to one power of two ([`Grid`]) and
//! counted out in integers, whose length follows from the inputs' spread and the
//! predicate's degree alone: nothing rounds, overflows or vanishes, and the bits
//! are the same on every machine, with and without FMA. docs/NUMERICS.md has the
//! sizes, and compares with floating-point expansions (Shewchuk 1997).
//!
//! Sizes are type parameters; the caller names that of each product, and a
//! wrong one does not compile. That sums do not overflow is for the caller to
//! show: a [`Grid`] leaves [`SPARE`] bits.

use std::cmp::Ordering;

/// Two's complement, 64·N bits, the least limb first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Int<const N: usize>([u64; N]);

/// Bits that stay free above a number on a grid: one for the sign, one for a
/// difference of two, one for the sum of three triple products of such.
pub const SPARE: i32 = 3;

impl<const N: usize> Int<N> {
    pub const ZERO: Int<N> = Int([0; N]);

    #[inline(always)]
    pub fn of(x: i64) -> Int<N> {
        let mut limbs = [if x < 0 { u64::MAX } else { 0 }; N];
        limbs[0] = x as u64;
        Int(limbs)
    }

    /// x / 2^power, of a finite x; `None` where that is no integer. It has to
    /// fit.
    #[inline(always)]
    fn scaled(x: f64, power: i32) -> Option<Int<N>> {
        let (magnitude, own) = decoded(x);
        let mut limbs = [0; N];
        let shift = own - power;
        if magnitude == 0 {
            return Some(Int(limbs));
        }
        if shift < 0 {
            if magnitude.trailing_zeros() < shift.unsigned_abs() {
                return None;
            }
            limbs[0] = magnitude >> -shift;
        } else {
            let (limb, bits) = (shift as usize / 64, shift as usize % 64);
            let wide = u128::from(magnitude) << bits;
            limbs[limb] = wide as u64;
            if let Some(next) = limbs.get_mut(limb + 1) {
                *next = (wide >> 64) as u64;
            }
        }
        Some(Int(limbs).negated_if(x < 0.0))
    }

    #[inline(always)]
    pub fn is_negative(&self) -> bool {
        (self.0[N - 1] as i64) < 0
    }

    #[inline(always)]
    pub fn is_zero(&self) -> bool {
        self.0.iter().all(|limb| *limb == 0)
    }

    /// Against zero.
    #[inline(always)]
    pub fn sign(&self) -> Ordering {
        match self.is_negative() {
            true => Ordering::Less,
            false if self.is_zero() => Ordering::Equal,
            false => Ordering::Greater,
        }
    }

    #[inline(always)]
    pub fn plus(&self, other: &Int<N>) -> Int<N> {
        let mut limbs = [0; N];
        let mut carry = false;
        for i in 0..N {
            let (sum, over) = self.0[i].overflowing_add(other.0[i]);
            let (sum, again) = sum.overflowing_add(u64::from(carry));
            limbs[i] = sum;
            carry = over | again;
        }
        Int(limbs)
    }

    #[inline(always)]
    pub fn minus(&self, other: &Int<N>) -> Int<N> {
        let mut limbs = [0; N];
        let mut borrow = false;
        for i in 0..N {
            let (difference, under) = self.0[i].overflowing_sub(other.0[i]);
            let (difference, again) = difference.overflowing_sub(u64::from(borrow));
            limbs[i] = difference;
            borrow = under | again;
        }
        Int(limbs)
    }

    #[inline(always)]
    pub fn negated_if(&self, negate: bool) -> Int<N> {
        if negate { Int::ZERO.minus(self) } else { *self }
    }

    /// Long multiplication, N + M limbs. Only the top limb of a number has a
    /// sign, so the last row and the last column of the scheme are signed.
    #[inline(always)]
    pub fn times<const M: usize, const P: usize>(&self, other: &Int<M>) -> Int<P> {
        const { assert!(P == N + M) };
        let (a, b) = (&self.0, &other.0);
        let mut limbs = [0; P];
        for i in 0..N - 1 {
            let mut carry = 0;
            for j in 0..M - 1 {
                let sum = u128::from(a[i]) * u128::from(b[j])
                    + u128::from(limbs[i + j])
                    + u128::from(carry);
                limbs[i + j] = sum as u64;
                carry = (sum >> 64) as u64;
            }
            let sum = i128::from(a[i]) * i128::from(b[M - 1] as i64)
                + i128::from(limbs[i + M - 1] as i64)
                + i128::from(carry);
            limbs[i + M - 1] = sum as u64;
            limbs[i + M] = (sum >> 64) as u64;
        }
        let top = i128::from(a[N - 1] as i64);
        let mut carry = 0;
        for j in 0..M - 1 {
            let sum = top * i128::from(b[j]) + i128::from(limbs[N - 1 + j]) + i128::from(carry);
            limbs[N - 1 + j] = sum as u64;
            carry = (sum >> 64) as i64;
        }
        let sum =
            top * i128::from(b[M - 1] as i64) + i128::from(limbs[P - 2] as i64) + i128::from(carry);
        limbs[P - 2] = sum as u64;
        limbs[P - 1] = (sum >> 64) as u64;
        Int(limbs)
    }

    /// The magnitude shifted up until its top bit is set, as limbs, and its
    /// length in bits. Zero stays zero, of length 0.
    pub fn normalised(&self) -> ([u64; N], i32) {
        let magnitude = self.negated_if(self.is_negative()).0;
        let Some(top) = (0..N).rev().find(|i| magnitude[*i] != 0) else {
            return (magnitude, 0);
        };
        let bits = magnitude[top].leading_zeros();
        let mut limbs = [0; N];
        for i in (0..=top).rev() {
            let below = if i > 0 { magnitude[i - 1] } else { 0 };
            let wide = u128::from(magnitude[i]) << 64 | u128::from(below);
            limbs[N - 1 - top + i] = (wide << bits >> 64) as u64;
        }
        (limbs, (64 * (top + 1)) as i32 - bits as i32)
    }
}

impl<const N: usize> Ord for Int<N> {
    fn cmp(&self, other: &Int<N>) -> Ordering {
        let top = (self.0[N - 1] as i64).cmp(&(other.0[N - 1] as i64));
        let rest = || self.0.iter().rev().cmp(other.0.iter().rev());
        top.then_with(rest)
    }
}

impl<const N: usize> PartialOrd for Int<N> {
    fn partial_cmp(&self, other: &Int<N>) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// A finite |x| as m · 2^power, m < 2^53.
#[inline(always)]
pub fn decoded(x: f64) -> (u64, i32) {
    let bits = x.to_bits();
    let exponent = (bits >> 52 & 0x7ff) as i32;
    let fraction = bits & ((1 << 52) - 1);
    // Subnormals have no hidden bit, and the exponent of the least normal.
    let hidden = u64::from(exponent != 0) << 52;
    (fraction | hidden, exponent.max(1) - 1075)
}

/// Multiples of a power of two, which are counted in [`Int`]s.
#[derive(Clone, Copy, Debug)]
pub struct Grid<const N: usize> {
    /// Numbers have lower exponents than 2^(exponent − 1022); biased as in f64.
    exponent: i32,
}

impl<const N: usize> Grid<N> {
    /// The finest whose integers hold these points, below 2^(64N − [`SPARE`]).
    #[inline(always)]
    pub fn over<const K: usize>(points: &[[f64; 3]; K]) -> Grid<N> {
        let doubled = points.as_flattened().iter().map(|x| x.to_bits() << 1);
        let largest = doubled.fold(0, |m, x| if x > m { x } else { m });
        let exponent = ((largest >> 53) as i32).max(1);
        Grid { exponent }
    }

    /// For the points of both.
    #[inline(always)]
    pub fn and(self, other: Grid<N>) -> Grid<N> {
        let exponent = self.exponent.max(other.exponent);
        Grid { exponent }
    }

    /// Of the two that the integers count.
    #[inline(always)]
    pub fn power(self) -> i32 {
        self.exponent - 1022 - (64 * N as i32 - SPARE)
    }

    /// The points in integers; `None` where one falls between the grid's, or is
    /// not finite. N = 33 has all finite numbers on any grid.
    #[inline(always)]
    pub fn place<const K: usize>(self, points: &[[f64; 3]; K]) -> Option<[[Int<N>; 3]; K]> {
        if self.exponent == 0x7ff {
            return None;
        }
        let mut integers = [[Int::ZERO; 3]; K];
        let all = integers.as_flattened_mut().iter_mut();
        let all = all.zip(points.as_flattened());
        if N > 1 {
            for (integer, x) in all {
                *integer = Int::scaled(*x, self.power())?;
            }
            return Some(integers);
        }
        // Without branches, so that the compiler takes several at once.
        let mut lost = 0;
        for (integer, x) in all {
            let (magnitude, power) = decoded(*x);
            let high = magnitude << (64 - SPARE - 53);
            let down = (self.exponent - 1075 - power).min(63);
            let whole = high >> down;
            lost |= whole << down ^ high;
            integer.0[0] = if *x < 0.0 {
                whole.wrapping_neg()
            } else {
                whole
            };
        }
        (lost == 0).then_some(integers)
    }
}
