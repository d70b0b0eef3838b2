//! The one-lane case: plain f32 and f64.

use super::{Lanes, Mask, Scalar, Word};

impl Scalar for f32 {
    const UNIT_ROUNDOFF: f32 = f32::EPSILON * 0.5;
    const INFINITY: f32 = f32::INFINITY;
    const MIN_POSITIVE: f32 = f32::MIN_POSITIVE;
    const MAX: f32 = f32::MAX;
    #[inline(always)]
    fn from_f32(x: f32) -> f32 {
        x
    }
    #[inline(always)]
    fn from_f64(x: f64) -> f32 {
        x as f32
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    #[inline(always)]
    fn scalar_mul_add(self, a: f32, b: f32) -> f32 {
        mul_add_f32(self, a, b)
    }
    #[inline(always)]
    fn bits(self) -> u64 {
        u64::from(self.to_bits())
    }
    #[inline(always)]
    fn carrying(bits: u32) -> f32 {
        f32::from_bits(bits)
    }
}

impl Scalar for f64 {
    const UNIT_ROUNDOFF: f64 = f64::EPSILON * 0.5;
    const INFINITY: f64 = f64::INFINITY;
    const MIN_POSITIVE: f64 = f64::MIN_POSITIVE;
    const MAX: f64 = f64::MAX;
    #[inline(always)]
    fn from_f32(x: f32) -> f64 {
        f64::from(x)
    }
    #[inline(always)]
    fn from_f64(x: f64) -> f64 {
        x
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
    #[inline(always)]
    fn scalar_mul_add(self, a: f64, b: f64) -> f64 {
        self * a + b
    }
    #[inline(always)]
    fn bits(self) -> u64 {
        self.to_bits()
    }
    #[inline(always)]
    fn carrying(bits: u32) -> f64 {
        f64::from_bits(u64::from(bits))
    }
}

impl Mask for bool {
    #[inline(always)]
    fn splat(on: bool) -> bool {
        on
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> bool {
        bits & 1 != 0
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self)
    }
    #[inline(always)]
    fn any(self) -> bool {
        self
    }
}

macro_rules! one_lane {
    ($t:ident, $bits:ident, $mul_add:expr) => {
        impl Lanes for $t {
            type Scalar = $t;
            type Mask = bool;
            type Double = f64;
            type Single = $t;
            type Array = [$t; 1];
            type Ids = [u32; 1];
            type Words = Word;
            const COUNT: usize = 1;

            #[inline(always)]
            fn splat(x: $t) -> $t {
                x
            }
            #[inline(always)]
            fn load(from: &[$t]) -> $t {
                from[0]
            }
            #[inline(always)]
            fn store(self, to: &mut [$t]) {
                to[0] = self;
            }
            #[inline(always)]
            fn to_array(self) -> [$t; 1] {
                [self]
            }
            #[inline(always)]
            fn ids(value: u32) -> [u32; 1] {
                [value]
            }
            #[inline(always)]
            fn abs(self) -> $t {
                $t::abs(self)
            }
            #[inline(always)]
            fn sqrt(self) -> $t {
                $t::sqrt(self)
            }
            #[inline(always)]
            fn min(self, other: $t) -> $t {
                if self < other { self } else { other }
            }
            #[inline(always)]
            fn max(self, other: $t) -> $t {
                if self > other { self } else { other }
            }
            #[inline(always)]
            fn mul_add(self, a: $t, b: $t) -> $t {
                $mul_add(self, a, b)
            }
            #[cfg(target_feature = "fma")]
            #[inline(always)]
            fn product_error(self, by: $t, product: $t) -> $t {
                $t::mul_add(self, by, -product)
            }
            #[cfg(not(target_feature = "fma"))]
            #[inline(always)]
            fn product_error(self, by: $t, product: $t) -> $t {
                super::error_by_halves(self, by, product)
            }
            #[inline(always)]
            fn lt(self, other: $t) -> bool {
                self < other
            }
            #[inline(always)]
            fn le(self, other: $t) -> bool {
                self <= other
            }
            #[inline(always)]
            fn gt(self, other: $t) -> bool {
                self > other
            }
            #[inline(always)]
            fn ge(self, other: $t) -> bool {
                self >= other
            }
            #[inline(always)]
            fn eq(self, other: $t) -> bool {
                self == other
            }
            #[inline(always)]
            fn select(mask: bool, yes: $t, no: $t) -> $t {
                if mask { yes } else { no }
            }
            #[inline(always)]
            fn narrow(wide: f64) -> $t {
                wide as $t
            }
            #[inline(always)]
            fn widen(self) -> f64 {
                self as f64
            }
            super::exponents!($t, $t, $bits, |x: $t| x.to_bits(), $t::from_bits, |x| x);
            #[inline(always)]
            fn from_words(words: Word) -> $t {
                words.0 as $t
            }
        }
    };
}

#[inline(always)]
fn mul_add_f32(x: f32, a: f32, b: f32) -> f32 {
    if cfg!(target_feature = "fma") {
        x.mul_add(a, b)
    } else {
        x * a + b
    }
}

one_lane!(f32, u32, mul_add_f32);
one_lane!(f64, u64, |x: f64, a, b| x * a + b);
