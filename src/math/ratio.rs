//! Fractions of integers: their order, and the f64 nearest to one.

use super::int::{Int, decoded};
use std::cmp::Ordering;

/// `top` / `bottom` · 2^`power`, `bottom` positive.
#[derive(Clone, Copy, Debug)]
pub struct Ratio<const N: usize> {
    pub top: Int<N>,
    pub bottom: Int<N>,
    pub power: i32,
}

impl<const N: usize> Ratio<N> {
    /// A finite number.
    pub fn of(x: f64) -> Ratio<N> {
        let (magnitude, power) = decoded(x);
        Ratio {
            top: Int::of(magnitude as i64).negated_if(x < 0.0),
            bottom: Int::of(1),
            power,
        }
    }

    /// Exactly, by cross-multiplication; P = 2N.
    pub fn order<const P: usize>(&self, other: &Ratio<N>) -> Ordering {
        let left: Int<P> = self.top.times(&other.bottom);
        let right: Int<P> = other.top.times(&self.bottom);
        order_scaled((&left, self.power), (&right, other.power))
    }

    /// To nearest, ties to even; beyond the range of f64 infinite.
    ///
    /// The leading 128 bits over the leading 64 leave an interval of a few units
    /// of 2^−63. It rounds to one number, nearly always; or to two neighbours,
    /// and the fraction is compared with the number halfway between them.
    pub fn rounded<const P: usize>(&self) -> f64 {
        let (top, length) = self.top.normalised();
        let (bottom, bottom_length) = self.bottom.normalised();
        if length == 0 {
            return 0.0;
        }
        let x = u128::from(top[N - 1]) << 64 | u128::from(if N > 1 { top[N - 2] } else { 0 });
        let y = u128::from(bottom[N - 1]);
        let power = self.power + (length - 128) - (bottom_length - 64);
        let below = nearest(x / (y + 1), power);
        let above = nearest(x / y + 2, power);
        let magnitude = if below == above {
            below
        } else {
            let (m, power) = decoded(below);
            let halfway = Ratio {
                top: Int::of(2 * m as i64 + 1),
                bottom: Int::of(1),
                power: power - 1,
            };
            let magnitude = Ratio {
                top: self.top.negated_if(self.top.is_negative()),
                ..*self
            };
            match magnitude.order::<P>(&halfway) {
                Ordering::Less => below,
                Ordering::Equal if m % 2 == 0 => below,
                _ => above,
            }
        };
        if self.top.is_negative() {
            -magnitude
        } else {
            magnitude
        }
    }
}

/// x · 2^p against y · 2^q.
fn order_scaled<const N: usize>((x, p): (&Int<N>, i32), (y, q): (&Int<N>, i32)) -> Ordering {
    let (sign, other) = (x.sign(), y.sign());
    if p == q || sign != other {
        return if p == q { x.cmp(y) } else { sign.cmp(&other) };
    }
    let ((x, length), (y, other_length)) = (x.normalised(), y.normalised());
    let magnitudes = (length + p)
        .cmp(&(other_length + q))
        .then_with(|| x.iter().rev().cmp(y.iter().rev()));
    match sign {
        Ordering::Less => magnitudes.reverse(),
        Ordering::Equal => Ordering::Equal,
        Ordering::Greater => magnitudes,
    }
}

/// The f64 nearest to m · 2^power, 2^53 < m < 2^127, ties to even.
fn nearest(m: u128, power: i32) -> f64 {
    let length = 128 - m.leading_zeros() as i32;
    // Bits to drop; more of them where the result is subnormal.
    let drop = (length - 53).max(-1074 - power);
    if drop > 127 {
        return 0.0;
    }
    let (kept, rest, half) = (m >> drop, m & ((1 << drop) - 1), 1 << (drop - 1));
    let up = rest > half || rest == half && kept % 2 == 1;
    let exponent = power + drop + 1074;
    if exponent > 2045 {
        return f64::INFINITY;
    }
    // The hidden bit, or a carry out of the fraction, raises the exponent.
    f64::from_bits(((exponent as u64) << 52) + kept as u64 + u64::from(up))
}
