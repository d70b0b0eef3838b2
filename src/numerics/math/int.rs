//! Integers of fixed size on the stack, for exact predicates.
//!
//! A finite f64 is an integer times a power of two. So a predicate made of sums,
//! differences and products can be brought to one power of two ([`Grid`]) and evaluated
//! in integers whose length follows from the spread of the inputs and the degree of the
//! predicate. Nothing rounds, overflows or underflows, and the bits are the same on every
//! machine, with and without FMA. Lemmas D7 and D8 (docs/numerics/exact.md) derive the
//! sizes; docs/decisions/001-integers-not-expansions.md compares with floating-point
//! expansions (Shewchuk 1997).
//!
//! Sizes are type parameters. The caller names the size of each product, and a wrong size
//! does not compile. The caller also shows that sums do not overflow: a [`Grid`] leaves
//! [`SPARE`] bits.

use std::cmp::Ordering;

/// A two's complement integer of 64·N bits, the least limb first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Int<const N: usize>([u64; N]);

/// Bits that stay free above a number on a grid: one for the sign, one for a difference
/// of two numbers, one for a sum of three triple products of differences. Lemma D7,
/// docs/numerics/exact.md.
pub const SPARE: i32 = 3;

/// Number of limbs of the shorter factor from which a product skips zero limbs.
const LONG: usize = 8;

impl<const N: usize> Int<N> {
    pub const ZERO: Int<N> = Int([0; N]);

    #[inline(always)]
    pub fn of(x: i64) -> Int<N> {
        let mut limbs = [if x < 0 { u64::MAX } else { 0 }; N];
        limbs[0] = x as u64;
        Int(limbs)
    }

    /// Returns x / 2^power for a finite x; `None` if it is not an integer. The caller
    /// ensures that it fits into N limbs.
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

    /// Returns the sign.
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

    /// Multiplies: schoolbook multiplication of N by M limbs. Only the top limb of a
    /// number has a sign, so the last row and the last column of the scheme are signed.
    #[inline(always)]
    pub fn times<const M: usize, const P: usize>(&self, other: &Int<M>) -> Int<P> {
        const { assert!(P == N + M) };
        if N.min(M) >= LONG {
            return self.times_sparse(other);
        }
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

    /// Multiplies as [`Int::times`] does, for magnitudes that are mostly zero limbs:
    /// numbers are this long only if others have a very different size, and each has only
    /// 53 bits.
    #[inline(never)]
    fn times_sparse<const M: usize, const P: usize>(&self, other: &Int<M>) -> Int<P> {
        let a = self.negated_if(self.is_negative()).0;
        let b = other.negated_if(other.is_negative()).0;
        let start = b.iter().position(|limb| *limb != 0).unwrap_or(M);
        let end = b.iter().rposition(|limb| *limb != 0).map_or(M, |i| i + 1);
        let mut limbs = [0; P];
        for i in (0..N).filter(|i| a[*i] != 0) {
            let mut carry = 0;
            for j in start..end {
                let sum = u128::from(a[i]) * u128::from(b[j])
                    + u128::from(limbs[i + j])
                    + u128::from(carry);
                limbs[i + j] = sum as u64;
                carry = (sum >> 64) as u64;
            }
            // No earlier row reached this limb. If `other` is 0 (`start` = `end` = M)
            // nothing is stored: the limb may not exist.
            if start < end {
                limbs[i + end] = carry;
            }
        }
        Int(limbs).negated_if(self.is_negative() != other.is_negative())
    }

    /// Returns the magnitude, shifted up until its top bit is set, and its length in
    /// bits. Zero stays zero, with length 0.
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

/// Decodes |x| of a finite x as m · 2^power with m < 2^53; returns (m, power).
#[inline(always)]
pub fn decoded(x: f64) -> (u64, i32) {
    let bits = x.to_bits();
    let exponent = (bits >> 52 & 0x7ff) as i32;
    let fraction = bits & ((1 << 52) - 1);
    // Subnormals have no hidden bit, and the exponent of the least normal number.
    let hidden = u64::from(exponent != 0) << 52;
    (fraction | hidden, exponent.max(1) - 1075)
}

/// The multiples of a power of two, counted in [`Int`]s.
#[derive(Clone, Copy, Debug)]
pub struct Grid<const N: usize> {
    /// Biased exponent as in f64; numbers on the grid are below 2^(exponent − 1022).
    exponent: i32,
}

impl<const N: usize> Grid<N> {
    /// Returns the finest grid whose integers hold these points, which are below
    /// 2^(64N − [`SPARE`]).
    #[inline(always)]
    pub fn over<const K: usize>(points: &[[f64; 3]; K]) -> Grid<N> {
        let doubled = points.as_flattened().iter().map(|x| x.to_bits() << 1);
        let largest = doubled.fold(0, |m, x| if x > m { x } else { m });
        let exponent = ((largest >> 53) as i32).max(1);
        Grid { exponent }
    }

    /// Returns the coarser of two grids, which holds the points of both.
    #[inline(always)]
    pub fn and(self, other: Grid<N>) -> Grid<N> {
        let exponent = self.exponent.max(other.exponent);
        Grid { exponent }
    }

    /// The grid's numbers are integers times 2 to this power. Lemma D7,
    /// docs/numerics/exact.md.
    #[inline(always)]
    pub fn power(self) -> i32 {
        self.exponent - 1022 - (64 * N as i32 - SPARE)
    }

    /// Converts the points to integers; `None` if a coordinate lies between grid points
    /// or is not finite. With N = 33 every finite number lies on every grid (lemma D8,
    /// docs/numerics/exact.md).
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
        // The loop has no branches, so that the compiler vectorises it. 53 bits of
        // magnitude below [`SPARE`] free bits: lemma D7, docs/numerics/exact.md.
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

#[cfg(test)]
mod tests {
    use super::*;
    use num_bigint::{BigInt, BigUint};
    use proptest::prelude::*;

    fn big<const N: usize>(x: &Int<N>) -> BigInt {
        let digits = x.0.iter().flat_map(|l| [*l as u32, (l >> 32) as u32]);
        let unsigned = BigInt::from(BigUint::new(digits.collect()));
        let wrap = BigInt::from(u8::from(x.is_negative())) << (64 * N);
        unsigned - wrap
    }

    /// Generates integers with many limbs at the ends of their range.
    fn integer<const N: usize>() -> impl Strategy<Value = Int<N>> {
        let limb = prop_oneof![
            Just(0),
            Just(u64::MAX),
            Just(1),
            Just(1 << 63),
            any::<u64>()
        ];
        proptest::collection::vec(limb, N).prop_map(|limbs| Int(std::array::from_fn(|i| limbs[i])))
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            failure_persistence: None,
            ..ProptestConfig::with_cases(20_000)
        })]

        #[test]
        fn integers_compute(a in integer::<1>(), b in integer::<2>(), c in integer::<3>(), d in integer::<3>()) {
            prop_assert_eq!(big(&a.times::<2, 3>(&b)), big(&a) * big(&b));
            prop_assert_eq!(big(&b.times::<1, 3>(&a)), big(&a) * big(&b));
            prop_assert_eq!(big(&a.times::<1, 2>(&a)), big(&a) * big(&a));
            prop_assert_eq!(big(&c.times::<3, 6>(&d)), big(&c) * big(&d));
            prop_assert_eq!(big(&c.times_sparse::<3, 6>(&d)), big(&c) * big(&d));
            prop_assert_eq!(big(&a.times_sparse::<3, 4>(&d)), big(&a) * big(&d));
            prop_assert_eq!(c.cmp(&d), big(&c).cmp(&big(&d)));
            prop_assert_eq!(c.sign(), big(&c).cmp(&BigInt::ZERO));
            // Sums are formed in one more limb, since they wrap around in three.
            let wide = |x: &Int<3>| x.times::<1, 4>(&Int::of(1));
            prop_assert_eq!(big(&wide(&c).plus(&wide(&d))), big(&c) + big(&d));
            prop_assert_eq!(big(&wide(&c).minus(&wide(&d))), big(&c) - big(&d));
            let (limbs, length) = wide(&c).normalised();
            prop_assert_eq!(length as u64, big(&c).bits());
            // The normalised limbs read as a signed number: its top bit is set, so it is
            // negative unless it is zero.
            let top = BigInt::from(big(&c).magnitude() << (256 - length));
            let wrap = BigInt::from(u8::from(length > 0)) << 256;
            prop_assert_eq!(big(&Int(limbs)), top - wrap);
        }

        #[test]
        fn grids_count_their_numbers(x in any::<[f64; 3]>(), same in any::<bool>(), k in -60..9) {
            // Three numbers of any size, or of similar size.
            let x = if same { [x[0], x[0] * 2.0_f64.powi(k), -x[0]] } else { x };
            let finite = x.iter().all(|x| x.is_finite());
            prop_assert_eq!(counted::<33>(x), finite);
            let fits = [counted::<1>(x), counted::<2>(x), counted::<4>(x)];
            prop_assert!(fits.is_sorted());
            if same && finite && x[0].abs() > 1e-280 && x[1].abs() > 1e-280 {
                // The smallest has 53 bits, and the grid 61.
                prop_assert!(fits[0] || k < -8);
                prop_assert!(fits[1]);
            }
        }
    }

    /// Whether the finest grid holds these numbers; asserts that each keeps its value.
    fn counted<const N: usize>(x: [f64; 3]) -> bool {
        let grid = Grid::<N>::over(&[x]);
        let Some([integers]) = grid.place(&[x]) else {
            return false;
        };
        for (x, integer) in x.iter().zip(&integers) {
            let (magnitude, power) = decoded(*x);
            let exact = BigInt::from(magnitude) * if *x < 0.0 { -1 } else { 1 };
            assert!(big(integer).bits() <= 64 * N as u64 - SPARE as u64);
            let least = power.min(grid.power());
            assert_eq!(
                big(integer) << (grid.power() - least),
                exact << (power - least)
            );
        }
        true
    }
}
