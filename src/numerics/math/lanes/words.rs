//! Lanes of 32-bit words: integers modulo 2^32 for hashes and tables of bits.

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, BitXor, Mul, Not, Shl, Shr, Sub};

/// `COUNT` words on which the same operations are performed. Sums, differences and
/// products wrap; shifts are by fewer than 32 bits.
pub trait Words:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
    + Not<Output = Self>
    + Shl<u32, Output = Self>
    + Shr<u32, Output = Self>
{
    /// The words in memory, `[u32; COUNT]`.
    type Array: Copy + AsRef<[u32]> + AsMut<[u32]>;
    const COUNT: usize;

    fn splat(x: u32) -> Self;
    /// Loads the first `COUNT` words of a slice; panics if it is shorter.
    fn load(from: &[u32]) -> Self;
    fn to_array(self) -> Self::Array;
    /// Returns whether any word has a bit set.
    fn any(self) -> bool;
    /// Reverses the order of the bits of each word.
    fn reverse_bits(self) -> Self;
    /// Returns the entry of a table that the lowest three bits of each word name.
    fn entries(self, table: &[u32; 8]) -> Self;

    #[inline(always)]
    fn lane(self, i: usize) -> u32 {
        self.to_array().as_ref()[i]
    }

    /// Collects one word per lane; `of(i)` is that of lane i.
    #[inline(always)]
    fn of_lanes(of: impl Fn(usize) -> u32) -> Self {
        let mut words = Self::splat(0).to_array();
        for (i, word) in words.as_mut().iter_mut().enumerate() {
            *word = of(i);
        }
        Self::load(words.as_ref())
    }
}

/// Reverses bits by exchanging neighbours, pairs, nibbles, bytes and halves.
#[cfg_attr(target_feature = "avx2", allow(dead_code))]
#[inline(always)]
pub(super) fn reversed_by_swaps<W: Words>(x: W) -> W {
    let swap =
        |x: W, mask: u32, by: u32| ((x >> by) & W::splat(mask)) | ((x & W::splat(mask)) << by);
    let x = swap(x, 0x5555_5555, 1);
    let x = swap(x, 0x3333_3333, 2);
    let x = swap(x, 0x0f0f_0f0f, 4);
    let x = swap(x, 0x00ff_00ff, 8);
    (x >> 16) | (x << 16)
}

/// One word: the one-lane case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub struct Word(pub u32);

macro_rules! word_operator {
    ($op:ident, $f:ident, $by:expr) => {
        impl $op for Word {
            type Output = Word;
            #[inline(always)]
            fn $f(self, o: Word) -> Word {
                Word($by(self.0, o.0))
            }
        }
    };
}

word_operator!(Add, add, u32::wrapping_add);
word_operator!(Sub, sub, u32::wrapping_sub);
word_operator!(Mul, mul, u32::wrapping_mul);
word_operator!(BitAnd, bitand, BitAnd::bitand);
word_operator!(BitOr, bitor, BitOr::bitor);
word_operator!(BitXor, bitxor, BitXor::bitxor);

impl Not for Word {
    type Output = Word;
    #[inline(always)]
    fn not(self) -> Word {
        Word(!self.0)
    }
}

impl Shl<u32> for Word {
    type Output = Word;
    #[inline(always)]
    fn shl(self, by: u32) -> Word {
        Word(self.0 << by)
    }
}

impl Shr<u32> for Word {
    type Output = Word;
    #[inline(always)]
    fn shr(self, by: u32) -> Word {
        Word(self.0 >> by)
    }
}

impl Words for Word {
    type Array = [u32; 1];
    const COUNT: usize = 1;

    #[inline(always)]
    fn splat(x: u32) -> Word {
        Word(x)
    }
    #[inline(always)]
    fn load(from: &[u32]) -> Word {
        Word(from[0])
    }
    #[inline(always)]
    fn to_array(self) -> [u32; 1] {
        [self.0]
    }
    #[inline(always)]
    fn any(self) -> bool {
        self.0 != 0
    }
    #[inline(always)]
    fn reverse_bits(self) -> Word {
        Word(self.0.reverse_bits())
    }
    #[inline(always)]
    fn entries(self, table: &[u32; 8]) -> Word {
        Word(table[(self.0 & 7) as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::{Lanes, f32x4, f32x8, f32x16, f64x4, f64x8, f64x16};

    /// Words of all patterns of bits that a generator of full period meets.
    fn some_words() -> Vec<u32> {
        let next = |x: &u32| Some(x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
        let mut words: Vec<u32> = std::iter::successors(Some(1), next).take(256).collect();
        words.extend([0, 1, 7, 8, u32::MAX, 1 << 31, 0x00ff_ffff, 0x0080_0000]);
        words
    }

    fn agrees_with_u32<W: Words>() {
        let words = some_words();
        let table = std::array::from_fn(|i| words[i]);
        for at in words.windows(W::COUNT + 1) {
            let (x, y) = (W::load(at), W::load(&at[1..]));
            for i in 0..W::COUNT {
                let (a, b) = (at[i], at[i + 1]);
                assert_eq!((x + y).lane(i), a.wrapping_add(b));
                assert_eq!((x - y).lane(i), a.wrapping_sub(b));
                assert_eq!((x * y).lane(i), a.wrapping_mul(b));
                assert_eq!((x & y).lane(i), a & b);
                assert_eq!((x | y).lane(i), a | b);
                assert_eq!((x ^ y).lane(i), a ^ b);
                assert_eq!((!x).lane(i), !a);
                for by in [0, 1, 9, 16, 31] {
                    assert_eq!((x << by).lane(i), a << by);
                    assert_eq!((x >> by).lane(i), a >> by);
                }
                assert_eq!(x.reverse_bits().lane(i), a.reverse_bits());
                assert_eq!(x.entries(&table).lane(i), table[(a & 7) as usize]);
                let one = W::of_lanes(|k| u32::from(k == i) << (a & 31));
                assert!(one.any() && !W::splat(0).any());
            }
        }
    }

    #[test]
    fn words_are_integers_modulo_two_to_the_32() {
        agrees_with_u32::<Word>();
        agrees_with_u32::<crate::math::lanes::u32x4>();
        agrees_with_u32::<crate::math::lanes::u32x8>();
        agrees_with_u32::<crate::math::lanes::u32x16>();
    }

    fn splits<L: Lanes>(exponents: std::ops::RangeInclusive<i32>) {
        use crate::math::lanes::Scalar;
        for e in exponents {
            let power = L::power_of_two(L::from_f64(f64::from(e)));
            let expected = libm::ldexp(1.0, e);
            assert_eq!(power.lane(L::COUNT - 1).to_f64(), expected);
            for m in [1.0, 1.5, 1.999_999] {
                let m = L::Scalar::from_f64(m).to_f64();
                let (mantissa, exponent) = L::from_f64(m * expected).split_exponent();
                assert_eq!(mantissa.lane(0).to_f64(), m);
                assert_eq!(exponent.lane(L::COUNT - 1).to_f64(), f64::from(e));
            }
        }
        for i in some_words() {
            let i = i & 0x00ff_ffff;
            let float = L::from_words(L::Words::splat(i)).lane(L::COUNT - 1);
            assert_eq!(float.to_f64(), f64::from(i));
        }
    }

    #[test]
    fn exponents_split_and_words_convert_exactly() {
        splits::<f32>(-126..=127);
        splits::<f32x4>(-126..=127);
        splits::<f32x8>(-126..=127);
        splits::<f32x16>(-126..=127);
        splits::<f64>(-1022..=1023);
        splits::<f64x4>(-1022..=1023);
        splits::<f64x8>(-1022..=1023);
        splits::<f64x16>(-1022..=1023);
        assert_eq!(<f32 as Lanes>::power_of_two(-127.0), 0.0);
        assert_eq!(<f32 as Lanes>::power_of_two(128.0), f32::INFINITY);
    }
}
