//! Rounding of a root, given its order with any number, to the nearest f64 (D12,
//! docs/numerics/exact.md).

use crate::math::bounds::ErrorBounded;
use crate::math::int::decoded;
use std::cmp::Ordering;

/// Returns the f64 nearest to the root, ties to even. `order` compares ± m · 2^power with the
/// root; `guess` is nearly always the answer; `t` encloses the root. `None` if `order` returns
/// `None`.
pub(in crate::geom) fn rounded(
    order: &dyn Fn(u64, i32, bool) -> Option<Ordering>,
    t: &ErrorBounded,
    guess: f64,
) -> Option<f64> {
    if guess.is_finite() && guess != 0.0 && is_nearest(order, guess)? {
        return Some(guess);
    }
    by_bisection(order, t)
}

/// Says whether `guess` certainly is nearer to the root than any other f64.
fn is_nearest(order: &dyn Fn(u64, i32, bool) -> Option<Ordering>, guess: f64) -> Option<bool> {
    /// The significand of powers of two, below which f64 are half as far apart.
    const LEAST: u64 = 1 << 52;
    let (m, power) = decoded(guess);
    let below = if m == LEAST {
        (4 * m - 1, power - 2)
    } else {
        (2 * m - 1, power - 1)
    };
    let negative = guess < 0.0;
    let (inward, outward) = if negative {
        (Ordering::Greater, Ordering::Less)
    } else {
        (Ordering::Less, Ordering::Greater)
    };
    let is_beyond = order(2 * m + 1, power - 1, negative)? == outward;
    Some(is_beyond && order(below.0, below.1, negative)? == inward)
}

/// Bisects over the bits of the f64 in `t`, and then compares with the number halfway to the next.
fn by_bisection(
    order: &dyn Fn(u64, i32, bool) -> Option<Ordering>,
    t: &ErrorBounded,
) -> Option<f64> {
    let sign = order(0, 0, false)?.reverse();
    if sign.is_eq() {
        return Some(0.0);
    }
    let negative = sign.is_lt();
    // |t| against m · 2^power.
    let against = |(m, power): (u64, i32)| {
        let order = order(m, power, negative)?;
        Some(if negative { order } else { order.reverse() })
    };
    // |t| is at least `low` and less than `high`, which become neighbours.
    let around = |x: f64| if negative { -x } else { x };
    let least = around(t.value) - t.error;
    let most = around(t.value) + t.error;
    let least = if least > 0.0 { least.next_down() } else { 0.0 };
    let most = if most < f64::MAX {
        most.next_up()
    } else {
        f64::MAX
    };
    let (mut low, mut high) = (least.to_bits(), most.to_bits() + 1);
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if against(decoded(f64::from_bits(middle)))?.is_lt() {
            high = middle;
        } else {
            low = middle;
        }
    }
    let (m, power) = decoded(f64::from_bits(low));
    let up = match against((2 * m + 1, power - 1))? {
        Ordering::Less => 0,
        Ordering::Equal => low & 1,
        Ordering::Greater => 1,
    };
    // The number after the largest f64 is infinity.
    Some(around(f64::from_bits(low + up)))
}
