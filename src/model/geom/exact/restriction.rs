//! Restriction of surfaces to a line: polynomials in t with integer coefficients (D17,
//! docs/numerics/exact.md).

use super::Line;
use super::surface::Surface;
use crate::geom::tape::{Arithmetic, Tape};
use crate::math::Number;
use crate::math::dyadic::{Dyadic, exactly};
use crate::math::int::decoded;
use num_bigint::{BigInt, Sign};

/// The polynomial 2^power · Σ c[i] tⁱ.
#[derive(Clone, Debug)]
struct Scaled {
    c: Vec<BigInt>,
    power: i64,
}

impl Scaled {
    fn constant(x: f64) -> Scaled {
        let (m, power) = decoded(x);
        let zeros = if m == 0 { 0 } else { m.trailing_zeros() };
        let m = BigInt::from(m >> zeros);
        Scaled {
            c: vec![if x < 0.0 { -m } else { m }],
            power: i64::from(power) + i64::from(zeros),
        }
    }

    fn is_zero(&self) -> bool {
        self.c.iter().all(|c| c.sign() == Sign::NoSign)
    }

    fn plus(&self, other: &Scaled, negate: bool) -> Scaled {
        // The power of zero is meaningless.
        if other.is_zero() {
            return self.clone();
        }
        let power = if self.is_zero() {
            other.power
        } else {
            self.power.min(other.power)
        };
        let at = |of: &Scaled, i: usize| match of.c.get(i) {
            Some(c) if c.sign() != Sign::NoSign => c << (of.power - power) as u64,
            _ => BigInt::ZERO,
        };
        let len = self.c.len().max(other.c.len());
        let sum = |i: usize| {
            let (a, b) = (at(self, i), at(other, i));
            if negate { a - b } else { a + b }
        };
        Scaled {
            c: (0..len).map(sum).collect(),
            power,
        }
    }

    fn times(&self, other: &Scaled) -> Scaled {
        let mut c = vec![BigInt::ZERO; self.c.len() + other.c.len() - 1];
        for (i, a) in self.c.iter().enumerate() {
            for (j, b) in other.c.iter().enumerate() {
                c[i + j] += a * b;
            }
        }
        Scaled {
            c,
            power: self.power + other.power,
        }
    }
}

/// Arithmetic of polynomials in t at the points of a line.
struct PointsOf<'a>(&'a Line);

impl Arithmetic for PointsOf<'_> {
    type Value = Scaled;

    fn coordinate(&self, axis: usize) -> Scaled {
        let t = Scaled {
            c: vec![BigInt::ZERO, BigInt::from(1)],
            power: 0,
        };
        let dir = Scaled::constant(self.0.dir[axis]).times(&t);
        dir.plus(&Scaled::constant(self.0.org[axis]), false)
    }

    fn constant(&self, value: f64) -> Scaled {
        Scaled::constant(value)
    }

    fn sum(&self, a: &Scaled, b: &Scaled) -> Scaled {
        a.plus(b, false)
    }

    fn difference(&self, a: &Scaled, b: &Scaled) -> Scaled {
        a.plus(b, true)
    }

    fn product(&self, a: &Scaled, b: &Scaled) -> Scaled {
        a.times(b)
    }
}

/// Returns the exact coefficients of a tape's polynomial along a line of finite numbers, up to a
/// power of two; the constant one first.
pub(in crate::geom) fn restrict_tape(tape: &Tape, line: &Line) -> Vec<BigInt> {
    tape.evaluate(&PointsOf(line)).c
}

/// Returns the exact coefficients of any surface's polynomial along a line, up to a power of two.
pub(in crate::geom) fn restrict(surface: &Surface, line: &Line) -> Vec<BigInt> {
    if let Surface::Implicit(tape) = surface {
        return restrict_tape(tape, line);
    }
    let parts = exactly(&|space| {
        let [a, b, c] = surface.on_line_exactly::<Dyadic>(space, line);
        let parts = [c, b.doubled(), a].map(|x: Dyadic| x.parts());
        let [c, b, a] = parts;
        Some([c?, b?, a?])
    });
    let least = parts.iter().filter(|(_, limbs, _)| !limbs.is_empty());
    let least = least.map(|(_, _, power)| *power).min().unwrap_or(0);
    let number = |(negative, limbs, power): &(bool, Vec<u64>, i32)| {
        let halves = limbs.iter().flat_map(|x| [*x as u32, (x >> 32) as u32]);
        let sign = if *negative { Sign::Minus } else { Sign::Plus };
        let m = BigInt::from_slice(sign, &halves.collect::<Vec<u32>>());
        if limbs.is_empty() {
            return BigInt::ZERO;
        }
        m << (64 * (power - least)) as u32
    };
    parts.iter().map(number).collect()
}
