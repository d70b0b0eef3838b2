//! Lanes in a pair of registers.

use super::{Lanes, Mask, WideMask, Words, f64x8, u32x16};
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// Sixteen lanes of f64 in two registers of eight.
#[allow(non_camel_case_types)]
#[derive(Clone, Copy, Debug)]
pub struct f64x16 {
    lo: f64x8,
    hi: f64x8,
}

/// The mask of [`f64x16`].
#[derive(Clone, Copy, Debug)]
pub struct PairMask {
    lo: WideMask<f64x8>,
    hi: WideMask<f64x8>,
}

macro_rules! pair_operator {
    ($op:ident, $f:ident, $t:ident) => {
        impl $op for $t {
            type Output = $t;
            #[inline(always)]
            fn $f(self, o: $t) -> $t {
                $t {
                    lo: self.lo.$f(o.lo),
                    hi: self.hi.$f(o.hi),
                }
            }
        }
    };
}

pair_operator!(Add, add, f64x16);
pair_operator!(Sub, sub, f64x16);
pair_operator!(Mul, mul, f64x16);
pair_operator!(Div, div, f64x16);
pair_operator!(BitAnd, bitand, PairMask);
pair_operator!(BitOr, bitor, PairMask);

impl Neg for f64x16 {
    type Output = f64x16;
    #[inline(always)]
    fn neg(self) -> f64x16 {
        f64x16 {
            lo: -self.lo,
            hi: -self.hi,
        }
    }
}

impl Not for PairMask {
    type Output = PairMask;
    #[inline(always)]
    fn not(self) -> PairMask {
        PairMask {
            lo: !self.lo,
            hi: !self.hi,
        }
    }
}

impl Mask for PairMask {
    #[inline(always)]
    fn splat(on: bool) -> PairMask {
        PairMask {
            lo: Mask::splat(on),
            hi: Mask::splat(on),
        }
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> PairMask {
        PairMask {
            lo: Mask::from_bits(bits),
            hi: Mask::from_bits(bits >> 8),
        }
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        self.lo.bits() | self.hi.bits() << 8
    }
    #[inline(always)]
    fn any(self) -> bool {
        (self.lo | self.hi).any()
    }
}

macro_rules! pairwise {
    ($($f:ident($($arg:ident),*) -> $out:ident;)*) => {$(
        #[inline(always)]
        fn $f(self, $($arg: Self),*) -> $out {
            $out {
                lo: Lanes::$f(self.lo, $($arg.lo),*),
                hi: Lanes::$f(self.hi, $($arg.hi),*),
            }
        }
    )*};
}

impl Lanes for f64x16 {
    type Scalar = f64;
    type Mask = PairMask;
    type Double = f64x16;
    type Single = f64;
    type Array = [f64; 16];
    type Ids = [u32; 16];
    type Words = u32x16;
    const COUNT: usize = 16;

    pairwise! {
        abs() -> f64x16;
        sqrt() -> f64x16;
        min(other) -> f64x16;
        max(other) -> f64x16;
        mul_add(a, b) -> f64x16;
        product_error(by, product) -> f64x16;
        lt(other) -> PairMask;
        le(other) -> PairMask;
        gt(other) -> PairMask;
        ge(other) -> PairMask;
        eq(other) -> PairMask;
    }

    #[inline(always)]
    fn splat(x: f64) -> f64x16 {
        f64x16 {
            lo: f64x8::splat(x),
            hi: f64x8::splat(x),
        }
    }
    #[inline(always)]
    fn load(from: &[f64]) -> f64x16 {
        f64x16 {
            lo: Lanes::load(&from[..8]),
            hi: Lanes::load(&from[8..16]),
        }
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        self.lo.store(&mut to[..8]);
        self.hi.store(&mut to[8..16]);
    }
    #[inline(always)]
    fn to_array(self) -> [f64; 16] {
        let mut lanes = [0.0; 16];
        self.store(&mut lanes);
        lanes
    }
    #[inline(always)]
    fn ids(value: u32) -> [u32; 16] {
        [value; 16]
    }
    #[inline(always)]
    fn select(mask: PairMask, yes: f64x16, no: f64x16) -> f64x16 {
        f64x16 {
            lo: Lanes::select(mask.lo, yes.lo, no.lo),
            hi: Lanes::select(mask.hi, yes.hi, no.hi),
        }
    }
    #[inline(always)]
    fn narrow(wide: f64x16) -> f64x16 {
        wide
    }
    #[inline(always)]
    fn widen(self) -> f64x16 {
        self
    }
    #[inline(always)]
    fn split_exponent(self) -> (f64x16, f64x16) {
        let (lo, hi) = (self.lo.split_exponent(), self.hi.split_exponent());
        let pair = |lo, hi| f64x16 { lo, hi };
        (pair(lo.0, hi.0), pair(lo.1, hi.1))
    }
    #[inline(always)]
    fn power_of_two(k: f64x16) -> f64x16 {
        f64x16 {
            lo: Lanes::power_of_two(k.lo),
            hi: Lanes::power_of_two(k.hi),
        }
    }
    #[inline(always)]
    fn from_words(words: u32x16) -> f64x16 {
        let words = Words::to_array(words);
        Lanes::load(&words.map(f64::from))
    }
}
