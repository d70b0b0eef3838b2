//! Correct rounding of an isolated root to f64.

use super::{Point, against, sign_at};
use num_bigint::BigInt;
use std::cmp::Ordering;

/// Returns the f64 nearest to the only root between two points ≥ 0 that are not roots; p
/// changes its sign at the root. Ties to even; `f64::MAX` beyond the range. The sign of p
/// is evaluated at f64 numbers, first near `guess`, and then halfway between two
/// neighbours.
pub fn nearest(p: &[BigInt], low: &Point, high: &Point, guess: f64) -> f64 {
    let sign_low = sign_at(p, low);
    // Order of the root and a point.
    let against = |at: &Point| against(p, (low, high), sign_low, at);
    // The bits of positive f64 are ordered as their values.
    let number = |bits: u64| f64::from_bits(bits);
    let at = |bits: u64| against(&Point::of(number(bits), 0));
    let last = f64::MAX.to_bits();
    let guess = if guess.is_finite() {
        guess.max(0.0)
    } else {
        0.0
    };
    let guess = improved(p, low, high, guess);
    let start = guess.to_bits();
    // Search a bracket from the guess outward with growing steps, in bits.
    let (mut below, mut above) = (0, start);
    let mut step = 1_u64;
    match at(start) {
        Ordering::Equal => return guess,
        Ordering::Greater => {
            below = start;
            loop {
                let next = below.saturating_add(step).min(last);
                match at(next) {
                    Ordering::Equal => return number(next),
                    Ordering::Less => {
                        above = next;
                        break;
                    }
                    Ordering::Greater if next == last => return f64::MAX,
                    Ordering::Greater => below = next,
                }
                step = step.saturating_mul(4);
            }
        }
        Ordering::Less => {
            while above > 0 {
                let next = above.saturating_sub(step);
                match at(next) {
                    Ordering::Equal => return number(next),
                    Ordering::Greater => {
                        below = next;
                        break;
                    }
                    Ordering::Less => above = next,
                }
                step = step.saturating_mul(4);
            }
        }
    }
    while above - below > 1 {
        let middle = below + (above - below) / 2;
        match at(middle) {
            Ordering::Equal => return number(middle),
            Ordering::Greater => below = middle,
            Ordering::Less => above = middle,
        }
    }
    let [a, b] = [below, above].map(|bits| Point::of(number(bits), 0));
    match against(&a.middle(&b)) {
        Ordering::Less => number(below),
        Ordering::Greater => number(above),
        // Ties to even.
        Ordering::Equal if below & 1 == 0 => number(below),
        Ordering::Equal => number(above),
    }
}

/// Improves a guess by a few exact steps of Newton's method, as long as they stay between
/// the two points.
fn improved(p: &[BigInt], low: &Point, high: &Point, guess: f64) -> f64 {
    let mut x = guess;
    for _ in 0..STEPS {
        let at = Point::of(x, 0);
        if at <= *low || at >= *high {
            break;
        }
        let next = x - quotient(p, &at);
        if !(next > 0.0 && next.is_finite()) || next == x {
            break;
        }
        x = next;
    }
    x
}

/// Steps of Newton's method.
const STEPS: usize = 6;

/// Returns p / p' at a point, to a few roundings; NaN or infinite if p' is 0.
fn quotient(p: &[BigInt], at: &Point) -> f64 {
    // Powers of 2^down as in `sign_at`, with one power fewer in the derivative.
    let (m, down) = match at.e {
        0.. => (&at.m << at.e as u64, 0),
        e => (at.m.clone(), e.unsigned_abs()),
    };
    let (mut y, mut slope) = (BigInt::ZERO, BigInt::ZERO);
    for (i, c) in p.iter().rev().enumerate() {
        slope = slope * &m + &y;
        y = y * &m + (c << (down * i as u64));
    }
    let ((a, i), (b, j)) = (leading(&y), leading(&slope));
    let power = i - j - down as i64;
    let power = power.clamp(-4000, 4000) as i32;
    crate::roots::polynomial::times_power(a / b, power)
}

/// Returns the leading bits of an integer as f64, rounded, and the power of two that
/// scales them.
fn leading(x: &BigInt) -> (f64, i64) {
    let down = x.bits().saturating_sub(63);
    let bits: BigInt = x >> down;
    let bits = i64::try_from(bits).unwrap_or(i64::MAX);
    (bits as f64, down as i64)
}

/// Returns the f64 nearest to a dyadic number ≥ 0, ties to even; `f64::MAX` beyond the
/// range.
pub fn rounded(at: &Point) -> f64 {
    // The number is the root of t − at, between 0 and 2 at.
    let line = if at.e >= 0 {
        vec![-(at.m.clone() << at.e as u64), BigInt::from(1)]
    } else {
        vec![-at.m.clone(), BigInt::from(1) << at.e.unsigned_abs()]
    };
    let zero = Point::of(0.0, 0);
    let above = Point {
        m: at.m.clone() * 2,
        e: at.e,
    };
    let power = at.m.bits() as i64 + at.e;
    let guess = match power {
        ..-1080 => 0.0,
        -1080..=1023 => super::super::polynomial::times_power(1.0, power as i32),
        _ => f64::MAX,
    };
    nearest(&line, &zero, &above, guess)
}
