//! The canonical refinement: from any point near a simple root to the f64 nearest to the
//! root.
//!
//! Correct rounding makes the bits of a root depend on the polynomial alone, and not on
//! the bracket, the neighbour or the solver that led to it. One Newton step from x, with
//! p(x) in twice the precision ([`local`]), gives a correction and its error bound. If
//! both ends of the remaining interval round to one number (Ziv's test), that is the
//! root's. Otherwise integers decide (`exact/`).
//!
//! The bound (lemma Z3, docs/numerics/roots.md). Let A = Σ |cᵢ| |x|ⁱ, d = fl(p'(x)),
//! r = fl(p(x)), off by θ, δ = −r/d, σ = |δ| + 2 θ/|d| and ρ = 4 σ. Within ρ ≤ |x| / 4n of x,
//! |p''| ≤ 2 n² A / x², and d is off by 5 n² u A / |x|. So p' = d (1 ± η) there, with
//! η = (5 n² u A / |x| + ρ · 2 n² A / x²) / |d|. If η ≤ ¼, p is monotone there and
//! |p(x)| ≤ |d| σ < ¾ |d| ρ. Hence there is exactly one root, it is simple, and by the mean value
//! theorem it is no farther from x + δ than |δ| (1.5 η + 8 u) + 1.5 θ/|d|.

use super::eval::{derivative, local};
use super::polynomial::{Polynomial, exponent, times_power};
use crate::math::lanes::{Lanes, Mask, Scalar};

/// The only root within `reach` of the start of the last step.
#[derive(Clone, Copy, Debug)]
pub struct Nearest<L: Lanes> {
    /// The root, correctly rounded in lanes of `certain`.
    pub root: L,
    /// Lanes in which the root passed Ziv's test and the bound holds.
    pub certain: L::Mask,
    /// |p'| at the start, rounded.
    pub slope: L,
    /// Radius about the start within which the root is the only one.
    pub reach: L,
}

/// Limit of Newton steps; the first suffices unless the root is badly conditioned.
const CORRECTIONS: usize = 4;

/// Refines the root near x, for the `wanted` lanes. x must not be 0; the end of a Newton
/// iteration is best. If x is too far from the root for the bound, the corrected x is the
/// next start.
#[inline(always)]
pub fn nearest<L: Lanes<Scalar = f64>>(c: &[L], x: L, wanted: L::Mask) -> Nearest<L> {
    let mut found = step(c, x);
    for _ in 1..CORRECTIONS {
        if (wanted & !found.certain).none() {
            break;
        }
        let next = step(c, found.root);
        let pick = |a, b| L::select(found.certain, a, b);
        found = Nearest {
            root: pick(found.root, next.root),
            certain: found.certain | next.certain,
            slope: pick(found.slope, next.slope),
            reach: pick(found.reach, next.reach),
        };
    }
    found
}

/// Takes one Newton step and bounds its error. Lemma Z3, docs/numerics/roots.md.
#[inline(always)]
fn step<L: Lanes<Scalar = f64>>(c: &[L], x: L) -> Nearest<L> {
    let of = |x: f64| L::from_f64(x);
    // Lemma Z3, docs/numerics/roots.md.
    let (n, u) = ((c.len() - 1) as f64, f64::UNIT_ROUNDOFF);
    let here = local(c, x);
    let size = x.abs();
    let slope = here.slope.abs();
    let delta = -((here.high + here.low) / here.slope);
    let noise = here.error / slope;
    let reach = of(4.0) * (delta.abs() + of(2.0) * noise);
    // Relative condition of the root, n² A / (|x| |d|).
    let condition = of(n * n * 1.000_001) * here.size / (size * slope);
    let eta = condition * (of(5.0 * u) + of(2.0) * (reach / size));
    let off = delta.abs() * (of(1.5) * eta + of(8.0 * u)) + of(1.5) * noise;
    let (below, above) = (x + (delta - off), x + (delta + off));
    let certain = below.eq(above) & eta.le(of(0.25)) & (of(4.0 * n) * reach).le(size);
    Nearest {
        root: below,
        certain,
        slope,
        reach,
    }
}

/// Relative length of a Newton step after which the next one is about its square. The
/// refinement takes that one.
pub const SETTLED: f64 = 1.0 / (1 << 30) as f64;

/// Finds a zero of a polynomial between two numbers s with opposite signs of p, with a
/// relative error of about the square of [`SETTLED`]. `sign_low` is the sign at `low`.
/// Newton's method, with bisection (geometric for wide positive brackets) if a step
/// leaves the bracket or is not half as long as the last. `guess` may be NaN.
pub fn approach(c: &[f64], mut low: f64, mut high: f64, sign_low: f64, guess: f64) -> f64 {
    let middle = |low: f64, high: f64| {
        if high > 4.0 * low && low > 0.0 {
            (low * high).sqrt()
        } else {
            low + 0.5 * (high - low)
        }
    };
    let mut x = match guess > low && guess < high {
        true => guess,
        false => middle(low, high),
    };
    let mut last_step = high - low;
    for _ in 0..200 {
        let (mut y, mut d) = (0.0, 0.0);
        for c in c.iter().rev() {
            d = x * d + y;
            y = x * y + c;
        }
        if y == 0.0 {
            return x;
        }
        if (y > 0.0) == (sign_low > 0.0) {
            low = x;
        } else {
            high = x;
        }
        let step = -y / d;
        let newton = x + step;
        let halves = step.abs() <= 0.5 * last_step;
        let next = if newton >= low && newton <= high && halves {
            last_step = step.abs();
            newton
        } else {
            last_step = 0.5 * (high - low);
            middle(low, high)
        };
        let moved = (next - x).abs();
        x = next;
        if moved <= SETTLED * x.abs() {
            break;
        }
    }
    x
}

/// Refines the root that Newton's method finds from 2^k s: the f64 nearest to a simple
/// root, and the radius within which it is the only one, both as multiples of a power of
/// two. `None` if the root is not certain.
pub(super) fn certified(
    p: &Polynomial,
    s: f64,
    k: i32,
    scratch: &mut Vec<f64>,
) -> Option<Certified> {
    let down = exponent(s)? + 1;
    let (mut x, k) = (times_power(s, -down), k + down);
    p.scaled_into(k, scratch);
    let c = &scratch[..];
    for _ in 0..8 {
        let mut y = 0.0;
        for c in c.iter().rev() {
            y = x * y + c;
        }
        let step = y / derivative(c, x);
        x -= step;
        if !(0.2..2.0).contains(&x.abs()) {
            return None;
        }
        if step.abs() <= SETTLED * x.abs() {
            break;
        }
    }
    let found = nearest(c, x, true);
    // A subnormal t has fewer bits, so rounding s would round twice.
    let is_normal = exponent(found.root)? + k >= -1022;
    (found.certain && is_normal).then_some(Certified {
        s: found.root,
        k,
        reach: found.reach,
    })
}

/// A simple root; the f64 nearest to it is s · 2^k.
#[derive(Clone, Copy, Debug)]
pub(super) struct Certified {
    pub s: f64,
    pub k: i32,
    /// No other root is within reach · 2^k of the start of the last step, which is close
    /// to s.
    pub reach: f64,
}

impl Certified {
    /// Returns the root as f64; ± `f64::MAX` beyond the range.
    pub fn t(&self) -> f64 {
        let t = times_power(self.s, self.k);
        t.clamp(-f64::MAX, f64::MAX)
    }
}
