//! Fractions of integers: their order, and the nearest f64.

use super::int::{Int, decoded};
use std::cmp::Ordering;

/// The fraction `top` / `bottom` · 2^`power`; `bottom` is positive.
#[derive(Clone, Copy, Debug)]
pub struct Ratio<const N: usize> {
    pub top: Int<N>,
    pub bottom: Int<N>,
    pub power: i32,
}

impl<const N: usize> Ratio<N> {
    /// Converts a finite f64, exactly.
    pub fn of(x: f64) -> Ratio<N> {
        let (magnitude, power) = decoded(x);
        Ratio {
            top: Int::of(magnitude as i64).negated_if(x < 0.0),
            bottom: Int::of(1),
            power,
        }
    }

    /// Returns the exact order, by cross-multiplication; P = 2N.
    pub fn order<const P: usize>(&self, other: &Ratio<N>) -> Ordering {
        let left: Int<P> = self.top.times(&other.bottom);
        let right: Int<P> = other.top.times(&self.bottom);
        order_scaled((&left, self.power), (&right, other.power))
    }

    /// Returns the nearest f64, ties to even; infinite beyond the range of f64.
    ///
    /// The leading 128 bits of the numerator over the leading 64 of the denominator
    /// enclose the quotient to a few units of 2⁻⁶³. Nearly always that interval rounds to
    /// one number. Otherwise it rounds to two neighbours, and the fraction is compared
    /// with the number halfway between them. Lemma D12, docs/numerics/exact.md.
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

/// Compares x · 2^p with y · 2^q.
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

/// Returns the f64 nearest to m · 2^power, 2^53 < m < 2^127, ties to even.
fn nearest(m: u128, power: i32) -> f64 {
    let length = 128 - m.leading_zeros() as i32;
    // Number of bits to drop; larger if the result is subnormal.
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn ratio(top: i64, bottom: i64, power: i32) -> Ratio<2> {
        let (top, bottom) = (Int::of(top), Int::of(bottom));
        Ratio { top, bottom, power }
    }

    #[test]
    fn ties_go_to_even_and_the_ends_are_kept() {
        let odd = (1_i64 << 53) + 1;
        for (top, bottom, power, rounded) in [
            (odd, 1, 0, odd as f64),
            (odd + 2, 1, 0, (odd + 3) as f64),
            (-odd, 1, 0, -(odd as f64)),
            (3 * odd, 3, -60, odd as f64 * 2.0_f64.powi(-60)),
            (odd, 1, -1074 - 53, f64::from_bits(1)),
            (1, 1, -1075, 0.0),
            (3, 1, -1075, f64::from_bits(2)),
            (1, 1, -1074, f64::from_bits(1)),
            ((1 << 53) - 1, 1, 971, f64::MAX),
            (2 * ((1 << 53) - 1) + 1, 1, 970, f64::INFINITY),
            (1, 1, -4000, 0.0),
            (-1, 1, 4000, f64::NEG_INFINITY),
            (0, 7, 5, 0.0),
            (1, 3, 0, 1.0 / 3.0),
        ] {
            let got = ratio(top, bottom, power).rounded::<4>();
            assert_eq!(got, rounded, "{top} / {bottom} · 2^{power}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            failure_persistence: None,
            ..ProptestConfig::with_cases(20_000)
        })]

        /// Compares with hardware division, which is correctly rounded as well.
        #[test]
        fn quotients_round_as_division_does(
            a in any::<i64>(), b in 1..i64::MAX, cut in 11_u32..62, power in -300..300,
        ) {
            let (a, b) = (a >> 11, (b >> cut).max(1));
            let scale = 2.0_f64.powi(power);
            prop_assert_eq!(ratio(a, b, power).rounded::<4>(), a as f64 / b as f64 * scale);
        }

        #[test]
        fn numbers_keep_their_order(x in any::<f64>(), y in any::<f64>(), near in any::<bool>()) {
            let y = if near { x.next_up() } else { y };
            prop_assume!(x.is_finite() && y.is_finite());
            let (r, s) = (Ratio::<1>::of(x), Ratio::<1>::of(y));
            prop_assert_eq!(Some(r.order::<2>(&s)), x.partial_cmp(&y));
            prop_assert_eq!(r.rounded::<2>(), x);
        }
    }
}
