//! Lanes: many numbers that take the same steps.
//!
//! [`Lanes`] is the smallest set of operations that the kernels use. f32 and
//! f64 are its one-lane cases, so the scalar path is the same source, not a
//! second one. This file alone names the crate `wide`, and states the rules:
//!
//! - **Bits.** `+ − × ÷ √`, negation, `abs`, comparisons and `select` are
//!   correctly rounded or exact, so every width gives the same bits.
//! - **FMA.** [`Lanes::mul_add`] on f32 fuses where the target has FMA, and
//!   rounds twice where it has not, at every width alike. On f64 it *always*
//!   rounds twice: what `exact` decides must not depend on the machine. Nothing
//!   else fuses (rustc never contracts).
//! - **NaN.** `min(a, b)` is `if a < b { a } else { b }`, `max` the same with
//!   `>`: a NaN on the left gives b, on the right gives NaN. Comparisons with
//!   NaN are false.
//! - No reciprocal, reciprocal root or elementary function: they differ between
//!   processors.
//!
//! tests/lanes.rs holds the rules against scalar code, bit by bit.

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

pub use wide::{f32x4, f32x8, f32x16, f64x4, f64x8};

/// One register of f32, at least eight: what the children of a wide node are
/// met in, whatever the packets' own width.
#[cfg(target_feature = "avx512f")]
pub type Register = f32x16;
#[cfg(not(target_feature = "avx512f"))]
pub type Register = f32x8;

/// Sets of 32 members, one in each lane of a [`Register`] (whose numbers mean
/// nothing): adds the members of `bits` to the sets of the lanes in `mask`.
#[inline(always)]
pub fn add_members(mask: <Register as Lanes>::Mask, sets: Register, bits: u32) -> Register {
    sets | (mask.0 & Register::splat(f32::from_bits(bits)))
}

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

/// One lane's type: f32 or f64.
pub trait Scalar: Copy + PartialOrd + Debug + Send + Sync + 'static {
    /// Half the distance from 1 to the next number: 2^-24 or 2^-53.
    const UNIT_ROUNDOFF: Self;
    const INFINITY: Self;
    /// The least normal number.
    const MIN_POSITIVE: Self;
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

impl Scalar for f32 {
    const UNIT_ROUNDOFF: f32 = f32::EPSILON * 0.5;
    const INFINITY: f32 = f32::INFINITY;
    const MIN_POSITIVE: f32 = f32::MIN_POSITIVE;
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
    fn lane(self, i: usize) -> Self::Scalar {
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
    ($t:ident, $mul_add:expr) => {
        impl Lanes for $t {
            type Scalar = $t;
            type Mask = bool;
            type Double = f64;
            type Single = $t;
            type Array = [$t; 1];
            type Ids = [u32; 1];
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

one_lane!(f32, mul_add_f32);
one_lane!(f64, |x: f64, a, b| x * a + b);

/// The mask of a `wide` type: all bits of a lane set, or none.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct WideMask<W>(W);

/// Reductions by registers of half the width: left to itself the compiler takes
/// registers to pieces for them.
macro_rules! by_halves {
    ($half:ident, $count:literal) => {
        #[inline(always)]
        fn least(self) -> Self::Scalar {
            let lanes = Lanes::to_array(self);
            let (low, high) = lanes.split_at($count);
            Lanes::least(Lanes::min(<$half as Lanes>::load(low), Lanes::load(high)))
        }
        #[inline(always)]
        fn greatest(self) -> Self::Scalar {
            let lanes = Lanes::to_array(self);
            let (low, high) = lanes.split_at($count);
            Lanes::greatest(Lanes::max(<$half as Lanes>::load(low), Lanes::load(high)))
        }
    };
}

macro_rules! wide_lanes {
    ($w:ident, $s:ident, $bits:ident, $count:literal, $double:ident, $mul_add:expr
        $(, $half:ident, $half_count:literal)?) => {
        impl BitAnd for WideMask<$w> {
            type Output = Self;
            #[inline(always)]
            fn bitand(self, o: Self) -> Self {
                WideMask(self.0 & o.0)
            }
        }
        impl BitOr for WideMask<$w> {
            type Output = Self;
            #[inline(always)]
            fn bitor(self, o: Self) -> Self {
                WideMask(self.0 | o.0)
            }
        }
        impl Not for WideMask<$w> {
            type Output = Self;
            #[inline(always)]
            fn not(self) -> Self {
                WideMask(!self.0)
            }
        }
        impl Mask for WideMask<$w> {
            #[inline(always)]
            fn splat(on: bool) -> Self {
                WideMask($w::splat($s::from_bits(if on { $bits::MAX } else { 0 })))
            }
            #[inline(always)]
            fn from_bits(bits: u32) -> Self {
                let lanes: [$s; $count] = std::array::from_fn(|i| {
                    $s::from_bits(if bits >> i & 1 != 0 { $bits::MAX } else { 0 })
                });
                WideMask($w::from(lanes))
            }
            #[inline(always)]
            fn bits(self) -> u32 {
                self.0.to_bitmask() as u32
            }
            #[inline(always)]
            fn any(self) -> bool {
                self.0.any()
            }
        }
        impl Lanes for $w {
            type Scalar = $s;
            type Mask = WideMask<$w>;
            type Double = $double;
            type Single = $s;
            type Array = [$s; $count];
            type Ids = [u32; $count];
            const COUNT: usize = $count;

            #[inline(always)]
            fn splat(x: $s) -> Self {
                <$w>::splat(x)
            }
            #[inline(always)]
            fn load(from: &[$s]) -> Self {
                let lanes: [$s; $count] = from[..$count].try_into().unwrap();
                <$w>::from(lanes)
            }
            #[inline(always)]
            fn store(self, to: &mut [$s]) {
                to[..$count].copy_from_slice(&self.to_array());
            }
            #[inline(always)]
            fn to_array(self) -> [$s; $count] {
                <$w>::to_array(self)
            }
            #[inline(always)]
            fn ids(value: u32) -> [u32; $count] {
                [value; $count]
            }
            #[inline(always)]
            fn abs(self) -> Self {
                <$w>::abs(self)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$w>::sqrt(self)
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                self.fast_min(other)
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                self.fast_max(other)
            }
            #[inline(always)]
            fn mul_add(self, a: Self, b: Self) -> Self {
                $mul_add(self, a, b)
            }
            #[inline(always)]
            fn lt(self, other: Self) -> WideMask<$w> {
                WideMask(self.simd_lt(other))
            }
            #[inline(always)]
            fn le(self, other: Self) -> WideMask<$w> {
                WideMask(self.simd_le(other))
            }
            #[inline(always)]
            fn gt(self, other: Self) -> WideMask<$w> {
                WideMask(self.simd_gt(other))
            }
            #[inline(always)]
            fn ge(self, other: Self) -> WideMask<$w> {
                WideMask(self.simd_ge(other))
            }
            #[inline(always)]
            fn eq(self, other: Self) -> WideMask<$w> {
                WideMask(self.simd_eq(other))
            }
            #[inline(always)]
            fn select(mask: WideMask<$w>, yes: Self, no: Self) -> Self {
                mask.0.select(yes, no)
            }
            #[inline(always)]
            fn narrow(wide: $double) -> Self {
                let lanes = Lanes::to_array(wide);
                <$w>::from(std::array::from_fn::<$s, $count, _>(|i| lanes[i] as $s))
            }
            #[inline(always)]
            fn widen(self) -> $double {
                let lanes = Lanes::to_array(self);
                <$double as Lanes>::load(&std::array::from_fn::<f64, $count, _>(|i| {
                    lanes[i] as f64
                }))
            }
            $(by_halves!($half, $half_count);)?
        }
    };
}

// Without hardware FMA `wide` rounds twice of itself, like `mul_add_f32`.
wide_lanes!(f32x4, f32, u32, 4, f64x4, |x: f32x4, a, b| x.mul_add(a, b));
wide_lanes!(
    f32x8,
    f32,
    u32,
    8,
    f64x8,
    |x: f32x8, a, b| x.mul_add(a, b),
    f32x4,
    4
);
wide_lanes!(
    f32x16,
    f32,
    u32,
    16,
    f64x16,
    |x: f32x16, a, b| x.mul_add(a, b),
    f32x8,
    8
);
wide_lanes!(f64x4, f64, u64, 4, f64x4, |x: f64x4, a: f64x4, b: f64x4| x
    * a
    + b);
wide_lanes!(
    f64x8,
    f64,
    u64,
    8,
    f64x8,
    |x: f64x8, a: f64x8, b: f64x8| x * a + b,
    f64x4,
    4
);

/// Sixteen lanes of f64: two registers of eight.
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
    const COUNT: usize = 16;

    pairwise! {
        abs() -> f64x16;
        sqrt() -> f64x16;
        min(other) -> f64x16;
        max(other) -> f64x16;
        mul_add(a, b) -> f64x16;
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
}
