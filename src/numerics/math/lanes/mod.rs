//! Lanes: many numbers that take the same steps.
//!
//! [`Lanes`] is the smallest set of operations that the kernels use. f32 and
//! f64 are its one-lane cases, so the scalar path is the same source, not a
//! second one. Registers come from the crate `wide`, which `registers.rs` alone
//! names. The rules:
//!
//! - **Bits.** `+ − × ÷ √`, negation, `abs`, comparisons and `select` are
//!   correctly rounded or exact, so every width gives the same bits.
//! - **FMA.** [`Lanes::mul_add`] on f32 fuses where the target has FMA, and
//!   rounds twice where it has not, at every width alike. On f64 it *always*
//!   rounds twice: what `exact` decides must not depend on the machine. Nothing
//!   else fuses (rustc never contracts) but [`Lanes::product_error`], which is exact.
//! - **NaN.** `min(a, b)` is `if a < b { a } else { b }`, `max` the same with
//!   `>`: a NaN on the left gives b, on the right gives NaN. Comparisons with
//!   NaN are false.
//! - No reciprocal, reciprocal root or elementary function: they differ between
//!   processors.
//!
//! tests/lanes.rs holds the rules against scalar code, bit by bit.

mod one;
mod pair;
mod registers;

pub use pair::{PairMask, f64x16};
pub use registers::{
    Entries, Register, Table, WideMask, add_members, f32x4, f32x8, f32x16, f64x4, f64x8, table,
};

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// [`Lanes::min`], also where the type is known: there the method of the same
/// name that `wide` has would be meant, which takes three instructions for one.
#[inline(always)]
pub fn min<L: Lanes>(a: L, b: L) -> L {
    Lanes::min(a, b)
}

/// [`Lanes::max`], also where the type is known; see [`min`].
#[inline(always)]
pub fn max<L: Lanes>(a: L, b: L) -> L {
    Lanes::max(a, b)
}

/// x + y + z: the least two first, so that the bits are the same in whatever order
/// they come. NaN stays, as min and max with their operands swapped lose neither
/// number.
#[inline(always)]
pub fn unordered_sum<L: Lanes>(x: L, y: L, z: L) -> L {
    let (less, more) = (min(x, y), max(y, x));
    let (middle, most) = (min(more, z), max(z, more));
    (less + middle) + most
}

/// x + y + z: the least and the greatest first, so that if all signs change the sum's
/// sign does, too, and nothing else. Otherwise as [`unordered_sum`].
#[inline(always)]
pub fn odd_sum<L: Lanes>(x: L, y: L, z: L) -> L {
    let (less, more) = (min(x, y), max(y, x));
    let (least, z) = (min(less, z), max(z, less));
    let (middle, most) = (min(more, z), max(z, more));
    (least + most) + middle
}

/// One lane's type: f32 or f64.
pub trait Scalar: Copy + PartialOrd + Debug + Send + Sync + 'static {
    /// Half the distance from 1 to the next number: 2^-24 or 2^-53.
    const UNIT_ROUNDOFF: Self;
    const INFINITY: Self;
    /// The least normal number.
    const MIN_POSITIVE: Self;
    /// The largest finite number.
    const MAX: Self;
    fn from_f32(x: f32) -> Self;
    /// Rounded to nearest.
    fn from_f64(x: f64) -> Self;
    fn to_f64(self) -> f64;
    /// What [`Lanes::mul_add`] gives, bit by bit.
    fn scalar_mul_add(self, a: Self, b: Self) -> Self;
    /// The bits, zero-extended.
    fn bits(self) -> u64;
    /// A number of no meaning that carries 32 bits, for lanes of ids.
    fn carrying(bits: u32) -> Self;
}

/// The result of a comparison in each lane.
pub trait Mask:
    Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> + Debug
{
    fn splat(on: bool) -> Self;
    /// Lane i is on where bit i is set.
    fn from_bits(bits: u32) -> Self;
    /// Bit i is set where lane i is on; bits past the last lane are 0.
    fn bits(self) -> u32;
    fn any(self) -> bool;
    fn none(self) -> bool {
        !self.any()
    }
}

/// `COUNT` numbers of one type that are computed on together.
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
    /// As many lanes of f64: where object rays are computed.
    type Double: Lanes<Scalar = f64, Double = Self::Double, Ids = Self::Ids>;
    /// One lane.
    type Single: Lanes<Scalar = Self::Scalar>;
    /// `[Scalar; COUNT]`.
    type Array: Copy + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;
    /// `[u32; COUNT]`.
    type Ids: Copy + AsRef<[u32]> + AsMut<[u32]> + Send + Sync;
    const COUNT: usize;

    fn splat(x: Self::Scalar) -> Self;
    /// The first `COUNT` values of a slice; panics where it is shorter.
    fn load(from: &[Self::Scalar]) -> Self;
    /// Into the first `COUNT` places of a slice; panics where it is shorter.
    fn store(self, to: &mut [Self::Scalar]);
    fn to_array(self) -> Self::Array;
    fn ids(value: u32) -> Self::Ids;

    fn abs(self) -> Self;
    fn sqrt(self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    /// `self · a + b`; see the module's FMA rule.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// What the rounded product of two numbers has lost, exactly, but where that or
    /// a half of one of them leaves the range.
    fn product_error(self, by: Self, product: Self) -> Self;

    fn lt(self, other: Self) -> Self::Mask;
    fn le(self, other: Self) -> Self::Mask;
    fn gt(self, other: Self) -> Self::Mask;
    fn ge(self, other: Self) -> Self::Mask;
    fn eq(self, other: Self) -> Self::Mask;
    /// `yes` where the mask is on.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// Rounded to this type, to nearest.
    fn narrow(wide: Self::Double) -> Self;
    fn widen(self) -> Self::Double;

    /// f64 lanes.
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

    /// The least of all lanes, none of which is NaN.
    #[inline(always)]
    fn least(self) -> Self::Scalar {
        fold(self, |a, b| if b < a { b } else { a })
    }

    /// The greatest of all lanes, none of which is NaN.
    #[inline(always)]
    fn greatest(self) -> Self::Scalar {
        fold(self, |a, b| if b > a { b } else { a })
    }
}

/// [`Lanes::product_error`] where nothing fuses: by halves of the bits (Veltkamp), whose
/// products are exact (Dekker).
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

/// By halves, as registers like it.
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
