//! The f64 nearest to a root, found among all f64 by exact comparisons
//! (docs/numerics/oracle.md, O6).

use super::dyadic::{Dyadic, scaled};
use super::number::Number;
use super::root::Root;
use std::cmp::Ordering;

/// Returns the f64 nearest to a root. Ties go to even, and roots beyond the largest f64 to
/// infinity, as in IEEE rounding.
pub fn nearest(t: &Root<Dyadic>) -> f64 {
    nearest_from(t, guess(t))
}

/// Returns the root as plain f64 evaluates it, without an error bound.
fn guess(t: &Root<Dyadic>) -> f64 {
    let t = match t {
        Root::Surd(surd) => surd,
        Root::Algebraic(root) => return root.guess(),
    };
    let ((p, p_power), (q, q_power)) = (t.p.leading(), t.q.leading());
    let (r, r_power) = t.r.leading();
    let half = q_power.div_euclid(2);
    let power = if q == 0.0 { p_power } else { p_power.max(half) };
    let root = scaled(q, q_power - 2 * half).sqrt() * t.sign;
    let sum = scaled(p, p_power - power) + scaled(root, half - power);
    scaled(sum / r, power - r_power)
}

/// Returns the nearest f64 by bisection from `guess`. The answer does not depend on the
/// guess.
fn nearest_from(t: &Root<Dyadic>, guess: f64) -> f64 {
    // The rank of an f64 among all f64 is an integer with the same order. An infinity
    // counts as the power of two beyond the largest f64, as it does in IEEE rounding.
    let end = place(f64::INFINITY);
    let not_above = |place: i64| {
        let within = -end < place && place < end;
        if within {
            let Ok(order) = t.order_with(number(place));
            order.is_ge()
        } else {
            place < 0
        }
    };
    // A bracket below ≤ t < beyond about the guess, twice as wide at each step.
    let guess = if guess.is_finite() { place(guess) } else { 0 };
    let (mut below, mut beyond, mut step) = (guess, guess, 1_i64);
    if not_above(guess) {
        while not_above(beyond) {
            below = beyond;
            beyond = beyond.saturating_add(step).min(end);
            step = step.saturating_mul(2);
        }
    } else {
        while !not_above(below) {
            beyond = below;
            below = below.saturating_sub(step).max(-end);
            step = step.saturating_mul(2);
        }
    }
    while beyond - below > 1 {
        let middle = below + (beyond - below) / 2;
        if not_above(middle) {
            below = middle;
        } else {
            beyond = middle;
        }
    }
    let halfway = exact(below).plus(&exact(beyond)).half();
    let (low, high) = (number(below), number(beyond));
    let Ok(side) = t.order_with_number(&halfway);
    match side {
        Ordering::Less => low,
        Ordering::Greater => high,
        Ordering::Equal if low.to_bits().is_multiple_of(2) => low,
        Ordering::Equal => high,
    }
}

/// Returns the rank of a number among all f64; the rank of zero is 0.
fn place(x: f64) -> i64 {
    let bits = (x.to_bits() & !(1 << 63)) as i64;
    if x < 0.0 { -bits } else { bits }
}

/// Returns the f64 of this rank.
fn number(place: i64) -> f64 {
    f64::from_bits(place.unsigned_abs()).copysign(place as f64)
}

/// Returns the f64 of this rank as an exact number; ±2^1024 for the infinities.
fn exact(place: i64) -> Dyadic {
    let x = number(place);
    if x.is_finite() {
        return Dyadic::from_f64(x);
    }
    let half = Dyadic::from_f64(2.0_f64.powi(1023).copysign(x));
    half.plus(&half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surd::Surd;
    use proptest::prelude::*;

    /// Numbers of all sizes, with many bits or few.
    fn number() -> impl Strategy<Value = f64> {
        (-1.0..1.0_f64, -60..60_i32, any::<bool>()).prop_map(|(x, power, short)| {
            let x = if short { f64::from(x as f32) } else { x };
            x * 2.0_f64.powi(power)
        })
    }

    fn fraction(p: f64, r: f64) -> Root<Dyadic> {
        let Ok(sign) = Dyadic::from_f64(r).sign();
        Root::fraction(Dyadic::from_f64(p), Dyadic::from_f64(r), sign)
    }

    #[test]
    fn halves_go_to_even_and_ends_to_infinity() {
        let sum = |a: f64, b: f64| {
            let Ok(one) = Dyadic::from_f64(1.0).sign();
            let sum = Dyadic::from_f64(a).plus(&Dyadic::from_f64(b));
            nearest(&Root::fraction(sum, Dyadic::from_f64(1.0), one))
        };
        let unit = f64::EPSILON / 2.0;
        assert_eq!(sum(1.0, unit), 1.0);
        assert_eq!(sum(1.0 + 2.0 * unit, unit), 1.0 + 4.0 * unit);
        assert_eq!(sum(-1.0, -unit), -1.0);
        assert_eq!(sum(f64::MAX, 1.0), f64::MAX);
        assert_eq!(sum(f64::MAX, 2.0_f64.powi(970)), f64::INFINITY);
        assert_eq!(sum(f64::MAX, f64::MAX), f64::INFINITY);
        assert_eq!(sum(-f64::MAX, -f64::MAX), f64::NEG_INFINITY);
        assert_eq!(sum(f64::MAX, 0.0), f64::MAX);
        assert_eq!(sum(0.0, 0.0), 0.0);
        assert_eq!(
            fraction(f64::from_bits(1), 4.0).order_with(0.0),
            Ok(Ordering::Greater)
        );
        assert_eq!(nearest(&fraction(f64::from_bits(1), 4.0)), 0.0);
        assert_eq!(
            nearest(&fraction(f64::from_bits(3), 2.0)),
            f64::from_bits(2)
        );
        assert_eq!(nearest(&fraction(1e-300, 1e300)), 0.0);
        assert_eq!(nearest(&fraction(-1e300, 1e-300)), f64::NEG_INFINITY);
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            failure_persistence: None,
            ..ProptestConfig::with_cases(5_000)
        })]

        /// The machine rounds quotients and roots correctly, and so does `nearest`,
        /// wherever the search begins.
        #[test]
        fn quotients_and_roots_are_rounded_as_the_machine_does(
            p in number(), r in number(), from in number()
        ) {
            prop_assume!(r != 0.0);
            prop_assert_eq!(nearest(&fraction(p, r)), p / r);
            prop_assert_eq!(nearest_from(&fraction(p, r), from), p / r);
            let root = |sign: f64| {
                Root::Surd(Surd {
                    p: Dyadic::zero(),
                    q: Dyadic::from_f64(p.abs()),
                    r: Dyadic::from_f64(1.0),
                    sign,
                })
            };
            prop_assert_eq!(nearest(&root(1.0)), p.abs().sqrt());
            prop_assert_eq!(nearest_from(&root(-1.0), from), -p.abs().sqrt());
        }
    }
}
