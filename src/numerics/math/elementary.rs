//! Elementary functions of f32 lanes.
//!
//! Each is a range reduction and a polynomial (minimax in the relative error of the result,
//! by Remez's algorithm) of operations that round correctly, without FMA. So the bits are
//! the same at every width and on every machine, which those of a platform's or a
//! register's own functions are not. Reductions follow Cody & Waite, "Software Manual for
//! the Elementary Functions" (1980), and Muller, "Elementary Functions" (2016), ch. 11.
//!
//! Errors below are in units in the last place of the exact result; the tests hold them on
//! dense samples against `libm` in f64.

use super::lanes::{Lanes, Scalar};

/// Evaluates c₀ + c₁·x + c₂·x² + … by Horner's rule.
#[inline(always)]
fn polynomial<L: Lanes, const N: usize>(x: L, coefficients: [f64; N]) -> L {
    let mut sum = L::from_f64(coefficients[N - 1]);
    for c in coefficients[..N - 1].iter().rev() {
        sum = sum * x + L::from_f64(*c);
    }
    sum
}

/// Rounds to the nearest integer, ties to even. |x| ≤ 2²² (2⁵¹ of f64).
#[inline(always)]
fn nearest_integer<L: Lanes>(x: L) -> L {
    // In the binade of this number the unit in the last place is 1.
    let large = L::from_f64(1.5 / L::Scalar::UNIT_ROUNDOFF.to_f64() * 0.5);
    (x + large) - large
}

/// Returns the sine and cosine of the angle 2π·u, u in turns, |u| ≤ 2²¹. Error below 1.7
/// units; multiples of a quarter turn are exact.
#[inline(always)]
pub fn sin_cos_turns<L: Lanes<Scalar = f32>>(u: L) -> (L, L) {
    // Both differences are exact: of multiples of u's unit, and no larger than u.
    let u = u - nearest_integer(u);
    let quadrant = nearest_integer(u * L::splat(4.0));
    let r = u - quadrant * L::splat(0.25);
    let r2 = r * r;
    // 2π = 6.28125 + what is left: the leading product carries a rounding of its own, and
    // the constant's does not add to it.
    let rest = polynomial(
        r2,
        [
            std::f64::consts::TAU - 6.281_25,
            -41.341_673_161_545_88,
            81.593_936_952_512_62,
            -75.453_396_255_694_77,
        ],
    );
    let sin = r * L::splat(6.281_25) + r * rest;
    let cos = L::splat(1.0)
        + r2 * polynomial(
            r2,
            [
                -19.739_208_693_655_854,
                64.939_326_471_671_73,
                -85.443_741_728_442_12,
                59.245_964_134_340_38,
            ],
        );
    let one = L::splat(1.0);
    let odd = quadrant.abs().eq(one);
    let half = quadrant.abs().eq(L::splat(2.0));
    let (s, c) = (L::select(odd, cos, sin), L::select(odd, sin, cos));
    let minus_sin = quadrant.eq(-one) | half;
    let minus_cos = quadrant.eq(one) | half;
    (L::select(minus_sin, -s, s), L::select(minus_cos, -c, c))
}

/// Returns eˣ. Error below 1.1 units, also of subnormal results; 0 and infinity where the
/// result lies outside the range. NaN gives NaN.
#[inline(always)]
pub fn exp<L: Lanes<Scalar = f32>>(x: L) -> L {
    // In this order a NaN passes.
    let x = L::splat(-104.0).max(L::splat(89.0).min(x));
    let k = nearest_integer(x * L::splat(std::f32::consts::LOG2_E));
    // ln 2 in two parts, of which the first has ten bits: its product with k is exact.
    let r = (x - k * L::splat(LN2_HIGH)) - k * L::splat(LN2_LOW);
    let p = polynomial(
        r,
        [
            0.500_000_009_679_491_8,
            0.166_665_171_835_863_7,
            0.041_666_200_631_713_33,
            0.008_369_088_094_660_507,
            0.001_395_083_566_601_789_9,
        ],
    );
    let value = L::splat(1.0) + (r + r * r * p);
    // Two factors, since k lies in -150..=128 and powers of normal numbers in -126..=127.
    let half = nearest_integer(k * L::splat(0.5));
    value * L::power_of_two(half) * L::power_of_two(k - half)
}

const LN2_HIGH: f32 = 355.0 / 512.0;
const LN2_LOW: f32 = -2.121_944_4e-4;

/// Returns the natural logarithm of x; −∞ if x ≤ 0, so no NaN but of NaN. Error below 1
/// unit.
#[inline(always)]
pub fn ln<L: Lanes<Scalar = f32>>(x: L) -> L {
    let one = L::splat(1.0);
    let subnormal = x.lt(L::splat(f32::MIN_POSITIVE));
    let scaled = L::select(subnormal, x * L::splat(16_777_216.0), x);
    let (m, e) = scaled.split_exponent();
    let e = L::select(subnormal, e - L::splat(24.0), e);
    let upper = m.gt(L::splat(std::f32::consts::SQRT_2));
    let m = L::select(upper, m * L::splat(0.5), m);
    let e = L::select(upper, e + one, e);
    let f = m - one;
    let f2 = f * f;
    let p = polynomial(
        f,
        [
            0.333_333_317_040_396_4,
            -0.250_008_210_200_612_8,
            0.200_012_272_649_423_73,
            -0.166_233_575_152_234_8,
            0.142_017_488_772_315_54,
            -0.131_601_752_045_745,
            0.127_616_389_690_861_92,
            -0.076_345_862_428_091_59,
        ],
    );
    let small = f * f2 * p + e * L::splat(LN2_LOW);
    let value = (f + (small - L::splat(0.5) * f2)) + e * L::splat(LN2_HIGH);
    let value = L::select(x.lt(L::splat(f32::INFINITY)), value, x);
    L::select(x.le(L::zero()), L::splat(f32::NEG_INFINITY), value)
}

/// Returns xʸ of x ≥ 0, correctly rounded in all but about one case of 2¹⁰ (error below
/// 0.502 units). x < 0 counts as 0, 0⁰ and ∞⁰ are 1. NaN gives NaN.
///
/// The logarithm and the power are evaluated in f64, because an error of the logarithm
/// grows with the exponent.
#[inline(always)]
pub fn pow<L: Lanes<Scalar = f32>>(x: L, y: L) -> L {
    let log = log2(x.widen());
    // Finite, since 1 to an infinite power is 1.
    let most = L::splat(f32::MAX);
    let y = (-most).max(most.min(y));
    let power = L::narrow(exp2(y.widen() * log));
    // Where x has no logarithm.
    let (zero, infinity) = (L::zero(), L::splat(f32::INFINITY));
    let no_log = x.le(zero) | x.eq(infinity);
    let rising = L::select(x.le(zero), -y, y);
    let limit = L::select(rising.gt(zero), infinity, L::splat(1.0));
    let limit = L::select(rising.lt(zero), zero, limit);
    L::select(no_log, limit, power)
}

/// Returns the binary logarithm of positive normal numbers, of relative error 2⁻⁴⁵.
#[inline(always)]
fn log2<D: Lanes<Scalar = f64>>(x: D) -> D {
    let one = D::splat(1.0);
    let (m, e) = x.split_exponent();
    let upper = m.gt(D::splat(std::f64::consts::SQRT_2));
    let m = D::select(upper, m * D::splat(0.5), m);
    let e = D::select(upper, e + one, e);
    let s = (m - one) / (m + one);
    let p = polynomial(
        s * s,
        [
            2.885_390_081_777_85,
            0.961_796_694_113_400_5,
            0.577_077_942_346_842_8,
            0.412_209_254_322_466_6,
            0.319_905_612_006_776_03,
            0.282_901_444_932_892,
        ],
    );
    let value = e + s * p;
    // The bits of a NaN are those of some exponent.
    D::select(x.eq(x), value, x)
}

/// Returns 2ˣ, of relative error 2⁻³⁴; the argument is clamped to ±200.
#[inline(always)]
fn exp2<D: Lanes<Scalar = f64>>(x: D) -> D {
    let x = D::splat(-200.0).max(D::splat(200.0).min(x));
    let k = nearest_integer(x);
    let p = polynomial(
        x - k,
        [
            0.999_999_999_961_623_8,
            0.693_147_180_728_733_5,
            0.240_226_511_987_437_8,
            0.055_504_103_527_746_144,
            0.009_618_027_173_128_586,
            0.001_333_392_289_145_533_8,
            0.000_154_693_173_410_620_3,
            0.000_015_201_895_004_924_034,
        ],
    );
    p * D::power_of_two(k)
}

/// Returns (arcsin(x) − x)/x³ as a function of z = x² ≤ 1/4.
#[inline(always)]
fn arcsine_series<L: Lanes<Scalar = f32>>(z: L) -> L {
    polynomial(
        z,
        [
            0.166_667_539_282_334_13,
            0.074_952_417_534_813_76,
            0.045_477_101_239_733_767,
            0.024_147_588_489_040_906,
            0.042_218_588_897_800_086,
        ],
    )
}

/// π less the f32 next to it.
const PI_LOW: f32 = -8.742_278e-8;

/// Returns the angle in [0, π] whose cosine is x; x is clamped to [−1, 1]. Error below 1.6
/// units.
#[inline(always)]
pub fn acos<L: Lanes<Scalar = f32>>(x: L) -> L {
    use std::f32::consts::{FRAC_PI_2, PI};
    let (one, half) = (L::splat(1.0), L::splat(0.5));
    let x = (-one).max(one.min(x));
    // Near 0: π/2 − arcsin x.
    let z = x * x;
    let bend = L::splat(PI_LOW * 0.5) - x * z * arcsine_series(z);
    let near = L::splat(FRAC_PI_2) - (x - bend);
    // Near ±1: 2·arcsin of the half angle's sine. 1 − |x| is exact.
    let z = (one - x.abs()) * half;
    let s = z.sqrt();
    let twice = (s + s * z * arcsine_series(z)) * L::splat(2.0);
    let far = L::select(
        x.lt(L::zero()),
        L::splat(PI) - (twice - L::splat(PI_LOW)),
        twice,
    );
    L::select(x.abs().le(half), near, far)
}

/// Returns the angle in [−π, π] of the direction (x, y), 0 of (0, 0). Error below 1.7
/// units. The sign of a zero does not count: y = −0 gives 0 or π. Infinite coordinates
/// count as the largest finite number.
#[inline(always)]
pub fn atan2<L: Lanes<Scalar = f32>>(y: L, x: L) -> L {
    let (zero, one, most) = (L::zero(), L::splat(1.0), L::splat(f32::MAX));
    let (ax, ay) = (x.abs().min(most), y.abs().min(most));
    // Halved, so that no sum overflows; of the smallest numbers a half would round.
    let scale = L::select(ax.max(ay).gt(one), L::splat(0.5), one);
    let (ax, ay) = (ax * scale, ay * scale);
    let (less, more) = (ax.min(ay), ax.max(ay));
    // The angle of less/more in [0, π/4] is that of t plus an eighth of the turn, or none.
    // Beyond a half the difference is exact.
    let beyond = less.gt(more * L::splat(0.5));
    let above = L::select(beyond, less - more, less);
    let below = L::select(beyond, less + more, more);
    let t = L::select(below.gt(zero), above / below, zero);
    let z = t * t;
    let bend = polynomial(
        z,
        [
            -0.333_333_270_908_639_3,
            0.199_994_992_301_489_15,
            -0.142_722_514_225_384,
            0.109_423_714_260_759_4,
            -0.079_891_308_692_264_99,
            0.038_792_031_958_052_75,
        ],
    );
    let angle = t + t * z * bend;
    // Reflected at the diagonal, then at the y axis: the eighths of a half turn are counted
    // from the other end, and the angle from them back.
    let eighths = L::select(beyond, one, zero);
    let steep = ay.gt(ax);
    let eighths = L::select(steep, L::splat(2.0) - eighths, eighths);
    let angle = L::select(steep, -angle, angle);
    let behind = x.lt(zero);
    let eighths = L::select(behind, L::splat(4.0) - eighths, eighths);
    let angle = L::select(behind, -angle, angle);
    // π/4 in two parts, of which the first has nine bits: its multiples are exact.
    const HIGH: f32 = 0.785_156_25;
    const LOW: f32 = (std::f64::consts::FRAC_PI_4 - HIGH as f64) as f32;
    let angle = eighths * L::splat(HIGH) + (eighths * L::splat(LOW) + angle);
    L::select(y.lt(zero), -angle, angle)
}

#[cfg(test)]
mod tests;
