//! SIMD lanes: numbers on which the same operations are performed together.
//!
//! [`Lanes`] is the smallest set of operations that the kernels use. f32 and f64 are its
//! one-lane cases, so the scalar path is the same source. Registers come from the crate
//! `wide`, which only `registers.rs` names. The rules:
//!
//! - **Bits.** `+ − × ÷ √`, negation, `abs`, comparisons and `select` are correctly
//!   rounded or exact, so every width gives the same bits.
//! - **FMA.** [`Lanes::mul_add`] on f32 fuses where the target has FMA and rounds twice
//!   elsewhere, at every width alike. On f64 it *always* rounds twice, because exact
//!   answers must not depend on the machine. Nothing else fuses (rustc never contracts)
//!   except [`Lanes::product_error`], which is exact.
//! - **NaN.** `min(a, b)` is `if a < b { a } else { b }`, and `max` the same with `>`: a
//!   NaN on the left gives b, a NaN on the right gives NaN. Comparisons with NaN are
//!   false.
//! - **Absent operations.** There is no reciprocal, reciprocal square root or elementary
//!   function of the registers', since their bits differ between processors. Elementary
//!   functions made of the operations here are in `math::elementary`.
//!
//! tests/kernels/lanes/ compares every operation with scalar code, bit by bit.

/// Defines the operations on exponents of `Lanes` for `$w`, of scalars `$s` with `$bits`.
/// `$to` and `$from` exchange lanes for their bits, `$splat` repeats bits.
macro_rules! exponents {
    ($w:ident, $s:ident, $bits:ident, $to:expr, $from:expr, $splat:expr) => {
        #[inline(always)]
        fn split_exponent(self) -> (Self, Self) {
            // A number from 2^23 (2^52) on whose unit is 1: an integer put into its low bits
            // is added to it, so the difference is the integer.
            const FRACTION: u32 = $s::MANTISSA_DIGITS - 1;
            const LARGE: $s = ((1 as $bits) << FRACTION) as $s;
            const BIAS: $s = ($s::MAX_EXP - 1) as $s;
            let bits = $to(self);
            let fraction = bits & $splat((1 << FRACTION) - 1);
            let mantissa = $from(fraction | $splat((1.0 as $s).to_bits()));
            let exponent = $from((bits >> FRACTION) | $splat(LARGE.to_bits()));
            (mantissa, exponent - Self::splat(LARGE + BIAS))
        }
        #[inline(always)]
        fn power_of_two(k: Self) -> Self {
            const FRACTION: u32 = $s::MANTISSA_DIGITS - 1;
            const LARGE: $s = ((1 as $bits) << FRACTION) as $s;
            const BIAS: $s = ($s::MAX_EXP - 1) as $s;
            $from($to(k + Self::splat(LARGE + BIAS)) << FRACTION)
        }
    };
}
use exponents;

mod one;
mod pair;
mod registers;
mod words;

pub use pair::{PairMask, f64x16};
pub use registers::{
    Entries, Register, Table, WideMask, add_members, f32x4, f32x8, f32x16, f64x4, f64x8, table,
    u32x4, u32x8, u32x16,
};
pub use words::{Word, Words};

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// Calls [`Lanes::min`]. On a concrete register type the method syntax would call
/// `wide`'s own `min`, which takes three instructions instead of one.
#[inline(always)]
pub fn min<L: Lanes>(a: L, b: L) -> L {
    Lanes::min(a, b)
}

/// Calls [`Lanes::max`]; see [`min`] for the reason.
#[inline(always)]
pub fn max<L: Lanes>(a: L, b: L) -> L {
    Lanes::max(a, b)
}

/// Returns x + y + z with the same bits for every order of the arguments: the two least
/// are added first. A NaN argument gives NaN, since the swapped operands of min and max
/// lose neither number. Lemma A5, docs/numerics/transforms.md.
#[inline(always)]
pub fn unordered_sum<L: Lanes>(x: L, y: L, z: L) -> L {
    let (less, more) = (min(x, y), max(y, x));
    let (middle, most) = (min(more, z), max(z, more));
    (less + middle) + most
}

/// Returns x + y + z with the same bits for every order of the arguments, and exactly
/// negated if all signs change: the least and the greatest are added first. NaN as in
/// [`unordered_sum`]. Lemma A5, docs/numerics/transforms.md.
#[inline(always)]
pub fn odd_sum<L: Lanes>(x: L, y: L, z: L) -> L {
    let (less, more) = (min(x, y), max(y, x));
    let (least, z) = (min(less, z), max(z, less));
    let (middle, most) = (min(more, z), max(z, more));
    (least + most) + middle
}

/// The type of one lane: f32 or f64.
pub trait Scalar: Copy + PartialOrd + Debug + Send + Sync + 'static {
    /// Unit roundoff u, half the distance from 1 to the next number: 2⁻²⁴ or 2⁻⁵³.
    const UNIT_ROUNDOFF: Self;
    const INFINITY: Self;
    /// The least positive normal number.
    const MIN_POSITIVE: Self;
    /// The largest finite number.
    const MAX: Self;
    fn from_f32(x: f32) -> Self;
    /// Rounds to nearest.
    fn from_f64(x: f64) -> Self;
    fn to_f64(self) -> f64;
    /// Computes [`Lanes::mul_add`] of one lane, with the same bits.
    fn scalar_mul_add(self, a: Self, b: Self) -> Self;
    /// Returns the bits, zero-extended to 64.
    fn bits(self) -> u64;
    /// Makes a value that carries 32 bits in its representation, for lanes of ids. Its
    /// numeric value has no meaning.
    fn carrying(bits: u32) -> Self;
}

/// A boolean per lane, the result of a comparison.
pub trait Mask:
    Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> + Debug
{
    fn splat(on: bool) -> Self;
    /// Makes a mask in which lane i is on if bit i is set.
    fn from_bits(bits: u32) -> Self;
    /// Returns bits of which bit i is set if lane i is on; bits past the last lane are 0.
    fn bits(self) -> u32;
    fn any(self) -> bool;
    fn none(self) -> bool {
        !self.any()
    }
}

/// `COUNT` numbers of one type on which operations are performed together.
pub trait Lanes:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    type Scalar: Scalar;
    type Mask: Mask;
    /// The type with as many lanes of f64. Object rays are computed in it.
    type Double: Lanes<Scalar = f64, Double = Self::Double, Ids = Self::Ids, Words = Self::Words>;
    /// The one-lane type of the same precision.
    type Single: Lanes<Scalar = Self::Scalar>;
    /// The lanes in memory, `[Scalar; COUNT]`.
    type Array: Copy + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;
    /// One id per lane, `[u32; COUNT]`.
    type Ids: Copy + AsRef<[u32]> + AsMut<[u32]> + Send + Sync;
    /// One u32 per lane, for hashes and other arithmetic of bits.
    type Words: Words;
    const COUNT: usize;

    fn splat(x: Self::Scalar) -> Self;
    /// Loads the first `COUNT` values of a slice; panics if it is shorter.
    fn load(from: &[Self::Scalar]) -> Self;
    /// Stores into the first `COUNT` places of a slice; panics if it is shorter.
    fn store(self, to: &mut [Self::Scalar]);
    fn to_array(self) -> Self::Array;
    fn ids(value: u32) -> Self::Ids;

    fn abs(self) -> Self;
    fn sqrt(self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    /// Computes `self · a + b`; the module's FMA rule states the rounding.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// Returns the exact error `self · by − product` of a rounded product. Exact unless
    /// the product, or one of the halves of a factor, leaves the range.
    fn product_error(self, by: Self, product: Self) -> Self;

    fn lt(self, other: Self) -> Self::Mask;
    fn le(self, other: Self) -> Self::Mask;
    fn gt(self, other: Self) -> Self::Mask;
    fn ge(self, other: Self) -> Self::Mask;
    fn eq(self, other: Self) -> Self::Mask;
    /// Returns `yes` in the lanes where the mask is on, and `no` elsewhere.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// Converts f64 lanes to this type, rounding to nearest.
    fn narrow(wide: Self::Double) -> Self;
    /// Converts to f64 lanes, exactly.
    fn widen(self) -> Self::Double;

    /// Splits positive normal numbers x = m·2ᵉ into m in [1, 2) and the integer e, exactly.
    /// Other numbers give some number without a meaning.
    fn split_exponent(self) -> (Self, Self);
    /// Returns 2ᵏ of integers k in the exponent range of normal numbers. The next integer
    /// below it gives 0, the next above infinity; others give a number without a meaning.
    fn power_of_two(k: Self) -> Self;
    /// Converts integers below 2²⁴, exactly. Larger ones give a number without a meaning.
    fn from_words(words: Self::Words) -> Self;

    /// Whether the lanes are f64.
    #[inline(always)]
    fn is_double() -> bool {
        size_of::<Self::Scalar>() == 8
    }

    #[inline(always)]
    fn zero() -> Self {
        Self::splat(Self::Scalar::from_f32(0.0))
    }

    #[inline(always)]
    fn lane(&self, i: usize) -> Self::Scalar {
        self.to_array().as_ref()[i]
    }

    #[inline(always)]
    fn with_lane(self, i: usize, x: Self::Scalar) -> Self {
        let mut lanes = self.to_array();
        lanes.as_mut()[i] = x;
        Self::load(lanes.as_ref())
    }

    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        Self::splat(Self::Scalar::from_f64(x))
    }

    #[inline(always)]
    fn from_f32(x: f32) -> Self {
        Self::splat(Self::Scalar::from_f32(x))
    }

    /// Returns the least lane; no lane may be NaN.
    #[inline(always)]
    fn least(self) -> Self::Scalar {
        fold(self, |a, b| if b < a { b } else { a })
    }

    /// Returns the greatest lane; no lane may be NaN.
    #[inline(always)]
    fn greatest(self) -> Self::Scalar {
        fold(self, |a, b| if b > a { b } else { a })
    }
}

/// Computes [`Lanes::product_error`] without FMA: both factors are split into halves of
/// their bits (Veltkamp), whose products are exact (Dekker).
#[cfg(not(target_feature = "fma"))]
#[inline(always)]
fn error_by_halves<L: Lanes>(x: L, y: L, product: L) -> L {
    let bits = if L::is_double() { 27 } else { 12 };
    let factor = L::from_f64(f64::from((1_u32 << bits) + 1));
    let halves = |x: L| {
        let shifted = x * factor;
        let high = shifted - (shifted - x);
        (high, x - high)
    };
    let ((x1, x2), (y1, y2)) = (halves(x), halves(y));
    ((x1 * y1 - product) + x1 * y2 + x2 * y1) + x2 * y2
}

/// Reduces by halves, which suits registers.
#[inline(always)]
fn fold<L: Lanes>(x: L, pick: impl Fn(L::Scalar, L::Scalar) -> L::Scalar) -> L::Scalar {
    let mut lanes = x.to_array();
    let lanes = lanes.as_mut();
    let mut half = L::COUNT / 2;
    while half > 0 {
        for i in 0..half {
            lanes[i] = pick(lanes[i], lanes[i + half]);
        }
        half /= 2;
    }
    lanes[0]
}
