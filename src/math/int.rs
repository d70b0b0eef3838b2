//! Integers of a fixed size, on the stack: what exact predicates count in.
//!
//! A finite f64 is an integer times a power of two. So a predicate that adds,
//! subtracts and multiplies can be brought to one power of two ([`on_grid`]) and
//! counted out in integers, whose length follows from the inputs' spread and the
//! predicate's degree alone: nothing rounds, overflows or vanishes, and the bits
//! are the same on every machine, with and without FMA. docs/NUMERICS.md has the
//! sizes, and compares with floating-point expansions (Shewchuk 1997).
//!
//! Sizes are type parameters; the caller names that of each product, and a
//! wrong one does not compile. That sums do not overflow is for the caller to
//! show: [`on_grid`] leaves [`SPARE`] bits.

use std::cmp::Ordering;

/// Two's complement, 64·N bits, the least limb first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Int<const N: usize>([u64; N]);

/// Bits that stay free above a number on a grid: one for the sign, one for a
/// difference of two, one for the sum of three triple products of such.
pub const SPARE: i32 = 3;

impl<const N: usize> Int<N> {
    pub const ZERO: Int<N> = Int([0; N]);

    pub fn of(x: i64) -> Int<N> {
        let mut limbs = [if x < 0 { u64::MAX } else { 0 }; N];
        limbs[0] = x as u64;
        Int(limbs)
    }

    /// x / 2^power, of a finite x; `None` where that is no integer. It has to
    /// fit.
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
pub fn decoded(x: f64) -> (u64, i32) {
    let bits = x.to_bits();
    let exponent = (bits >> 52 & 0x7ff) as i32;
    let fraction = bits & ((1 << 52) - 1);
    // Subnormals have no hidden bit, and the exponent of the least normal.
    let hidden = u64::from(exponent != 0) << 52;
    (fraction | hidden, exponent.max(1) - 1075)
}

/// Numbers as integers times one power of two, each below 2^(64N − [`SPARE`]);
/// `None` where they are spread too far for that, or one is not finite. N = 33
/// holds any numbers.
#[inline(always)]
pub fn on_grid<const N: usize, const K: usize>(numbers: &[f64; K]) -> Option<([Int<N>; K], i32)> {
    let largest = numbers.iter().fold(0, |m, x| (x.to_bits() << 1).max(m));
    let exponent = (largest >> 53) as i32;
    if exponent == 0x7ff {
        return None;
    }
    // Every |x| is below 2^(exponent − 1022).
    let power = exponent - 1022 - (64 * N as i32 - SPARE);
    let mut integers = [Int::ZERO; K];
    if N == 1 {
        // By multiplication, which the compiler does for several at once. Scale
        // and its inverse are normal numbers, or the size is refused.
        if !(-1022..=1022).contains(&power) {
            return None;
        }
        let (scale, inverse) = (power_of_two(-power), power_of_two(power));
        let mut whole = true;
        for (integer, x) in integers.iter_mut().zip(numbers) {
            let scaled = (x * scale) as i64;
            whole &= scaled as f64 * inverse == *x;
            *integer = Int::of(scaled);
        }
        return whole.then_some((integers, power));
    }
    for (integer, x) in integers.iter_mut().zip(numbers) {
        *integer = Int::scaled(*x, power)?;
    }
    Some((integers, power))
}

/// 2^power, −1022 ≤ power ≤ 1023.
fn power_of_two(power: i32) -> f64 {
    f64::from_bits(((power + 1023) as u64) << 52)
}
