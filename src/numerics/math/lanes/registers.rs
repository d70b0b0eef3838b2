//! Lanes in registers. Only this file names the crates `wide` and `safe_arch`.

use super::{Lanes, Mask, Words, f64x16};
use std::ops::{BitAnd, BitOr, Not};

pub use wide::{f32x4, f32x8, f32x16, f64x4, f64x8, u32x4, u32x8, u32x16};
use wide::{u64x4, u64x8};

/// One hardware register of f32, at least eight lanes. The children of a wide node are
/// tested in it, whatever the width of packets.
#[cfg(target_feature = "avx512f")]
pub type Register = f32x16;
#[cfg(not(target_feature = "avx512f"))]
pub type Register = f32x8;

/// Adds members to sets. Each lane of `sets` is a set of up to 32 members, one per bit;
/// its value as a number has no meaning. The members of `bits` are added in the lanes of
/// `mask`.
#[inline(always)]
pub fn add_members(mask: <Register as Lanes>::Mask, sets: Register, bits: u32) -> Register {
    sets | (mask.0 & Register::splat(f32::from_bits(bits)))
}

/// Sixteen numbers in as few registers as hold them.
pub type Table = [Register; 16 / <Register as Lanes>::COUNT];

/// Loads a table of sixteen numbers.
#[inline(always)]
pub fn table(from: &[f32; 16]) -> Table {
    std::array::from_fn(|i| Register::load(&from[<Register as Lanes>::COUNT * i..]))
}

/// The index of an entry of a [`Table`] in each lane of a [`Register`].
#[derive(Clone, Copy, Debug)]
#[cfg(target_feature = "avx512f")]
pub struct Entries(safe_arch::m512i);

#[cfg(target_feature = "avx512f")]
impl Entries {
    #[inline(always)]
    pub fn load(at: &[u8; 16]) -> Entries {
        Entries(at.map(i32::from).into())
    }

    #[inline(always)]
    pub fn of(self, [table]: Table) -> Register {
        bytemuck::cast(safe_arch::permute_i32_m512i(self.0, bytemuck::cast(table)))
    }
}

/// The index of an entry of a [`Table`] in each lane of a [`Register`].
#[derive(Clone, Copy, Debug)]
#[cfg(all(target_feature = "avx2", not(target_feature = "avx512f")))]
pub struct Entries(safe_arch::m256i);

#[cfg(all(target_feature = "avx2", not(target_feature = "avx512f")))]
impl Entries {
    // One instruction; the compiler makes two dozen of a conversion lane by lane.
    #[inline(always)]
    pub fn load(at: &[u8; 8]) -> Entries {
        use safe_arch::{convert_to_i16_m256i_from_lower8_u8_m128i, set_i64_m128i_s};
        let bytes = set_i64_m128i_s(i64::from_le_bytes(*at));
        // Converts to i32, although the name says i16.
        Entries(convert_to_i16_m256i_from_lower8_u8_m128i(bytes))
    }

    #[inline(always)]
    pub fn of(self, [low, high]: Table) -> Register {
        use safe_arch::{blend_varying_m256, shl_imm_u32_m256i, shuffle_av_f32_all_m256};
        // Bit 3 of the index selects the table's half; the shift makes it the sign bit,
        // by which the blend selects.
        let is_high = bytemuck::cast(shl_imm_u32_m256i::<28>(self.0));
        let low = shuffle_av_f32_all_m256(bytemuck::cast(low), self.0);
        let high = shuffle_av_f32_all_m256(bytemuck::cast(high), self.0);
        bytemuck::cast(blend_varying_m256(low, high, is_high))
    }
}

/// The index of an entry of a [`Table`] in each lane of a [`Register`].
#[derive(Clone, Copy, Debug)]
#[cfg(not(target_feature = "avx2"))]
pub struct Entries([u8; 8]);

#[cfg(not(target_feature = "avx2"))]
impl Entries {
    #[inline(always)]
    pub fn load(at: &[u8; 8]) -> Entries {
        Entries(*at)
    }

    #[inline(always)]
    pub fn of(self, table: Table) -> Register {
        let table = table.map(|half| half.to_array());
        let entry = |i: u8| table.as_flattened()[usize::from(i) % 16];
        Register::from(self.0.map(entry))
    }
}

/// The mask of a `wide` type: all bits of a lane are set, or none.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct WideMask<W>(W);

/// Defines reductions through registers of half the width; without them the compiler
/// splits registers into single lanes.
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

/// Selects byte by byte with AVX2. If a selection by lanes is stored where its other
/// operand was loaded from, the compiler makes a masked store, which is slow on AMD
/// processors (measured: `guarded` camera rays on meshes a fifth slower, `fast` ones 3 to
/// 19 %). There is no masked store by bytes. See
/// docs/decisions/028-avx2-without-mask-stores.md.
macro_rules! by_bytes {
    ($w:ident, $registers:literal) => {
        |mask: $w, yes: $w, no: $w| -> $w {
            #[cfg(all(target_feature = "avx2", not(target_feature = "avx512f")))]
            {
                use safe_arch::{blend_varying_i8_m256i, m256i};
                let [mask, yes, no]: [[m256i; $registers]; 3] = bytemuck::cast([mask, yes, no]);
                bytemuck::cast(std::array::from_fn::<_, $registers, _>(|i| {
                    blend_varying_i8_m256i(no[i], yes[i], mask[i])
                }))
            }
            #[cfg(not(all(target_feature = "avx2", not(target_feature = "avx512f"))))]
            mask.select(yes, no)
        }
    };
}

macro_rules! wide_lanes {
    ($w:ident, $s:ident, $bits:ident, $ints:ident, $count:literal, $words:ident, $double:ident,
        $select:expr, $mul_add:expr, $narrow:expr, $from_words:expr $(, $half:ident, $half_count:literal)?) => {
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
                let each = $ints::new(std::array::from_fn(|i| 1 << i));
                let set = $ints::splat($bits::from(bits)) & each;
                WideMask(bytemuck::cast(set.simd_eq(each)))
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
            type Words = $words;
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
            // Reads the lane in place if the register lies in memory.
            #[inline(always)]
            fn lane(&self, i: usize) -> $s {
                <$w>::as_array(self)[i]
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
            #[cfg(target_feature = "fma")]
            #[inline(always)]
            fn product_error(self, by: Self, product: Self) -> Self {
                <$w>::mul_add(self, by, -product)
            }
            #[cfg(not(target_feature = "fma"))]
            #[inline(always)]
            fn product_error(self, by: Self, product: Self) -> Self {
                super::error_by_halves(self, by, product)
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
                $select(mask.0, yes, no)
            }
            #[inline(always)]
            fn narrow(wide: $double) -> Self {
                $narrow(wide)
            }
            #[inline(always)]
            fn widen(self) -> $double {
                let lanes = Lanes::to_array(self);
                <$double as Lanes>::load(&std::array::from_fn::<f64, $count, _>(|i| {
                    lanes[i] as f64
                }))
            }
            super::exponents!(
                $w,
                $s,
                $bits,
                bytemuck::cast::<$w, $ints>,
                bytemuck::cast::<$ints, $w>,
                $ints::splat
            );
            #[inline(always)]
            fn from_words(words: $words) -> Self {
                $from_words(words)
            }
            $(by_halves!($half, $half_count);)?
        }
    };
}

/// Converts lane by lane; the compiler finds the vector instructions.
macro_rules! narrowed {
    ($w:ident, $double:ident) => {
        |wide: $double| {
            let lanes = Lanes::to_array(wide);
            $w::from(std::array::from_fn(|i| lanes[i] as f32))
        }
    };
}

/// Converts by instructions of four lanes. In large functions the compiler splits these
/// registers into single lanes (measured: pictures 3 to 5 % slower). Kernels of sixteen
/// lanes are compiled well, and these instructions would make them 2 % slower.
#[cfg(target_feature = "avx")]
#[inline(always)]
fn narrow_eight(wide: f64x8) -> f32x8 {
    let [low, high]: [safe_arch::m256d; 2] = bytemuck::cast(wide);
    let [low, high] = [low, high].map(safe_arch::convert_to_m128_from_m256d);
    bytemuck::cast(safe_arch::set_m128_m256(high, low))
}

#[cfg(not(target_feature = "avx"))]
#[inline(always)]
fn narrow_eight(wide: f64x8) -> f32x8 {
    narrowed!(f32x8, f64x8)(wide)
}

// Without hardware FMA `mul_add` of `wide` rounds twice, as `mul_add_f32` does.
wide_lanes!(
    f32x4,
    f32,
    u32,
    u32x4,
    4,
    u32x4,
    f64x4,
    |mask: f32x4, yes, no| mask.select(yes, no),
    |x: f32x4, a, b| x.mul_add(a, b),
    narrowed!(f32x4, f64x4),
    |words: u32x4| f32x4::from_i32x4(bytemuck::cast(words))
);
wide_lanes!(
    f32x8,
    f32,
    u32,
    u32x8,
    8,
    u32x8,
    f64x8,
    by_bytes!(f32x8, 1),
    |x: f32x8, a, b| x.mul_add(a, b),
    narrow_eight,
    |words: u32x8| f32x8::from_i32x8(bytemuck::cast(words)),
    f32x4,
    4
);
wide_lanes!(
    f32x16,
    f32,
    u32,
    u32x16,
    16,
    u32x16,
    f64x16,
    by_bytes!(f32x16, 2),
    |x: f32x16, a, b| x.mul_add(a, b),
    narrowed!(f32x16, f64x16),
    |words: u32x16| f32x16::from_i32x16(bytemuck::cast(words)),
    f32x8,
    8
);
wide_lanes!(
    f64x4,
    f64,
    u64,
    u64x4,
    4,
    u32x4,
    f64x4,
    by_bytes!(f64x4, 1),
    |x: f64x4, a: f64x4, b: f64x4| x * a + b,
    |same| same,
    |words: u32x4| f64x4::from(words.to_array().map(f64::from))
);
wide_lanes!(
    f64x8,
    f64,
    u64,
    u64x8,
    8,
    u32x8,
    f64x8,
    by_bytes!(f64x8, 2),
    |x: f64x8, a: f64x8, b: f64x8| x * a + b,
    |same| same,
    |words: u32x8| f64x8::from(words.to_array().map(f64::from)),
    f64x4,
    4
);

macro_rules! wide_words {
    ($w:ident, $count:literal, $reverse:expr, $entries:expr) => {
        impl Words for $w {
            type Array = [u32; $count];
            const COUNT: usize = $count;

            #[inline(always)]
            fn splat(x: u32) -> Self {
                <$w>::splat(x)
            }
            #[inline(always)]
            fn load(from: &[u32]) -> Self {
                let words: [u32; $count] = from[..$count].try_into().unwrap();
                <$w>::from(words)
            }
            #[inline(always)]
            fn to_array(self) -> [u32; $count] {
                <$w>::to_array(self)
            }
            #[inline(always)]
            fn any(self) -> bool {
                self != <$w>::splat(0)
            }
            #[inline(always)]
            fn reverse_bits(self) -> Self {
                $reverse(self)
            }
            #[inline(always)]
            fn entries(self, table: &[u32; 8]) -> Self {
                $entries(self, table)
            }
        }
    };
}

/// Reverses the bits of eight words: those of each nibble by a table, the nibbles by
/// shifts, the bytes by a permutation.
#[cfg(target_feature = "avx2")]
#[inline(always)]
fn reversed_eight(x: u32x8) -> u32x8 {
    use safe_arch::{m256i, shuffle_av_i8z_half_m256i};
    const NIBBLE: [u8; 16] = [0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15];
    const BYTES: [u8; 16] = [3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12];
    let twice = |table: [u8; 16]| -> m256i { bytemuck::cast([table; 2]) };
    let permuted = |x: m256i, by| shuffle_av_i8z_half_m256i(x, by);
    let low = u32x8::splat(0x0f0f_0f0f);
    let x: u32x8 = bytemuck::cast(permuted(bytemuck::cast(x), twice(BYTES)));
    let from_low = permuted(twice(NIBBLE.map(|n| n << 4)), bytemuck::cast(x & low));
    let from_high = permuted(twice(NIBBLE), bytemuck::cast((x >> 4) & low));
    bytemuck::cast::<_, u32x8>(from_low) | bytemuck::cast::<_, u32x8>(from_high)
}

#[cfg(not(target_feature = "avx2"))]
#[inline(always)]
fn reversed_eight(x: u32x8) -> u32x8 {
    super::words::reversed_by_swaps(x)
}

/// Looks eight words up; the instruction reads the lowest three bits alone.
#[cfg(target_feature = "avx2")]
#[inline(always)]
fn entries_of_eight(x: u32x8, table: &[u32; 8]) -> u32x8 {
    let table = bytemuck::cast(*table);
    bytemuck::cast(safe_arch::shuffle_av_i32_all_m256i(
        table,
        bytemuck::cast(x),
    ))
}

#[cfg(not(target_feature = "avx2"))]
#[inline(always)]
fn entries_of_eight(x: u32x8, table: &[u32; 8]) -> u32x8 {
    u32x8::from(x.to_array().map(|i| table[(i & 7) as usize]))
}

wide_words!(
    u32x4,
    4,
    super::words::reversed_by_swaps,
    |x: u32x4, table: &[u32; 8]| u32x4::from(x.to_array().map(|i| table[(i & 7) as usize]))
);
wide_words!(u32x8, 8, reversed_eight, entries_of_eight);
wide_words!(
    u32x16,
    16,
    |x| bytemuck::cast(bytemuck::cast::<_, [u32x8; 2]>(x).map(reversed_eight)),
    |x, table| {
        let halves: [u32x8; 2] = bytemuck::cast(x);
        bytemuck::cast(halves.map(|half| entries_of_eight(half, table)))
    }
);
