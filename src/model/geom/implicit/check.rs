//! Checks that polynomial surfaces and level sets have finite numbers, allowed sizes and a
//! surface.

use crate::geom::primitive::{Flaw, finite, finite3, require};
use crate::geom::tape::{Arithmetic, MAX_DEGREE, MAX_SLOTS, MAX_STEPS, Step, Tape};
use crate::geom::{Clip, Implicit, LevelSet, formula};
use crate::math::int::decoded;
use crate::roots::Solver;

/// The most bits of exact values; numbers of ordinary size to the 24th power have a tenth of
/// these.
const MAX_BITS: u64 = 1 << 15;

/// 2⁷⁶⁸: what f may sum up to where no coordinate is above 1, so that it is in f64's range
/// with its gradient far from there, too.
const MAX_SUM: f64 = 1.552_518_092_300_709e231;

pub(in crate::geom) fn implicit(row: &Implicit, solver: Solver) -> Result<(), Flaw> {
    let tape = row.tape;
    let degenerate = |why: &str| Flaw::Degenerate(why.into());
    let limit = |field, value: usize, must| Flaw::OutOfRange {
        field,
        value: value.to_string(),
        must,
    };
    let constants: Vec<f64> = tape.steps().iter().filter_map(Step::constant).collect();
    finite("constants", &constants)?;
    if tape.degree() > MAX_DEGREE {
        return Err(limit("degree", tape.degree() as usize, "24 at most"));
    }
    if let Some(most) = solver.most()
        && tape.degree() as usize > most
    {
        return Err(Flaw::NoFormula {
            degree: tape.degree(),
            solver,
            most,
        });
    }
    if tape.steps().len() > MAX_STEPS {
        return Err(limit("steps", tape.steps().len(), "4096 at most"));
    }
    if tape.slot_count() > MAX_SLOTS {
        return Err(limit("values at once", tape.slot_count(), "64 at most"));
    }
    let beyond = "its constants, multiplied out, are too large or too small";
    if bits(tape) > MAX_BITS {
        return Err(degenerate(beyond));
    }
    if is_constant(tape) {
        return Err(degenerate(
            "its polynomial is the same number everywhere, and it has no surface",
        ));
    }
    if !(1.0 / MAX_SUM..=MAX_SUM).contains(&tape.evaluate(&Magnitudes)) {
        return Err(degenerate(beyond));
    }
    if row.clip.is_some() && !row.open {
        return Err(degenerate(
            "it is clipped but not open; make an intersection of the two",
        ));
    }
    clip(row.clip)
}

/// Checks a level set's numbers and steps, and that the place of its zeros is known.
pub(in crate::geom) fn level_set(row: &LevelSet) -> Result<(), Flaw> {
    let steps = row.formula.steps();
    let constant = |step: &formula::Step| match step {
        formula::Step::Constant(value) => Some(*value),
        _ => None,
    };
    let constants: Vec<f64> = steps.iter().filter_map(constant).collect();
    finite("constants", &constants)?;
    if steps.len() > formula::MAX_STEPS {
        return Err(Flaw::OutOfRange {
            field: "steps",
            value: steps.len().to_string(),
            must: "4096 at most",
        });
    }
    clip(row.clip)?;
    if let Some(region) = row.region
        && !(region.min.is_finite() && region.max.is_finite())
    {
        return Err(Flaw::Degenerate(
            "its clip is too large for its numbers; scale the shape by a transform".into(),
        ));
    }
    if row.region.is_none() {
        return Err(Flaw::Degenerate(
            "it is no polynomial, and no box is found that holds all of its surface; \
                  give it a clip"
                .into(),
        ));
    }
    Ok(())
}

fn clip(clip: Option<Clip>) -> Result<(), Flaw> {
    match clip {
        None => Ok(()),
        Some(Clip::Sphere(sphere)) => {
            finite3("the clip's center", sphere.center)?;
            finite("the clip's radius", &[sphere.radius])?;
            let (field, must) = ("the clip's radius", "greater than 0");
            require(sphere.radius > 0.0, field, sphere.radius, must)
        }
        Some(Clip::Cuboid(cuboid)) => {
            finite3("the clip's min", cuboid.min)?;
            finite3("the clip's max", cuboid.max)?;
            match cuboid.min.cmplt(cuboid.max).all() {
                true => Ok(()),
                false => Err(Flaw::Degenerate(
                    "its clip's min must be below max on every axis".into(),
                )),
            }
        }
    }
}

/// Bounds the bits of the largest exact coefficient: from its highest bit to its lowest, or
/// from either to the binary point.
fn bits(tape: &Tape) -> u64 {
    let of_constant = |value: f64| {
        if value == 0.0 {
            return [1, 0];
        }
        let (magnitude, power) = decoded(value);
        let low = power + magnitude.trailing_zeros() as i32;
        let high = power + 64 - magnitude.leading_zeros() as i32;
        [high.max(0) as u64, (-low).max(0) as u64]
    };
    // Per step, coefficients are below 2^high and multiples of 2^−low.
    let mut all: Vec<[u64; 2]> = Vec::with_capacity(tape.steps().len());
    for step in tape.steps() {
        let of = |i: u32| all[i as usize];
        all.push(match *step {
            Step::Coordinate(_) => [1, 0],
            Step::Constant(value) => of_constant(value),
            Step::Scaled(a, by) => {
                let ([h, l], [i, m]) = (of(a), of_constant(by));
                [h.saturating_add(i), l.saturating_add(m)]
            }
            Step::Sum(a, b) | Step::Difference(a, b) => {
                let ([h, l], [i, m]) = (of(a), of(b));
                [h.max(i).saturating_add(1), l.max(m)]
            }
            Step::Product(a, b) => {
                let ([h, l], [i, m]) = (of(a), of(b));
                // At most as many products are summed as there are terms of degree 24,
                // fewer than 2¹².
                let sums = 12;
                [
                    h.saturating_add(i).saturating_add(sums),
                    l.saturating_add(m),
                ]
            }
        });
    }
    let most = all.iter().map(|[high, low]| high.saturating_add(*low));
    most.max().unwrap_or(0)
}

/// Sums the magnitudes of a polynomial's terms where each coordinate is 1.
struct Magnitudes;

impl Arithmetic for Magnitudes {
    type Value = f64;

    fn coordinate(&self, _: usize) -> f64 {
        1.0
    }

    fn constant(&self, value: f64) -> f64 {
        value.abs()
    }

    fn sum(&self, a: &f64, b: &f64) -> f64 {
        a + b
    }

    fn difference(&self, a: &f64, b: &f64) -> f64 {
        a + b
    }

    fn product(&self, a: &f64, b: &f64) -> f64 {
        a * b
    }
}

/// Evaluates tapes modulo the prime 2⁶¹ − 1, at a point.
struct Residues([u64; 3]);

const PRIME: u64 = (1 << 61) - 1;

impl Arithmetic for Residues {
    type Value = u64;

    fn coordinate(&self, axis: usize) -> u64 {
        self.0[axis]
    }

    fn constant(&self, value: f64) -> u64 {
        let (magnitude, power) = decoded(value);
        // 2⁶¹ ≡ 1 modulo the prime.
        let shift = power.rem_euclid(61) as u32;
        let residue = (u128::from(magnitude) << shift) % u128::from(PRIME);
        match value < 0.0 {
            true => self.difference(&0, &(residue as u64)),
            false => residue as u64,
        }
    }

    fn sum(&self, a: &u64, b: &u64) -> u64 {
        (a + b) % PRIME
    }

    fn difference(&self, a: &u64, b: &u64) -> u64 {
        (a + PRIME - b) % PRIME
    }

    fn product(&self, a: &u64, b: &u64) -> u64 {
        (u128::from(*a) * u128::from(*b) % u128::from(PRIME)) as u64
    }
}

/// Says whether a tape has the same value at arbitrary points modulo a prime. A polynomial
/// of degree d that is not constant does so with a probability of d / 2⁶¹ per point
/// (Schwartz 1980).
fn is_constant(tape: &Tape) -> bool {
    const POINTS: [[u64; 3]; 3] = [
        [
            0x0b4c_59d1_3c1a_6e47,
            0x1d37_8c2e_90f5_ab13,
            0x0691_e2b7_4fd8_350c,
        ],
        [
            0x13f6_07a8_d25b_94e1,
            0x08ce_6b15_f73a_4d90,
            0x1a52_cf9d_3086_b7e4,
        ],
        [
            0x0f2d_84e6_b97c_1035,
            0x1671_3afb_0cd9_e268,
            0x04a8_5d90_e613_7fcb,
        ],
    ];
    let [a, b, c] = POINTS.map(|point| tape.evaluate(&Residues(point)));
    a == b && b == c
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::tape::Builder;

    #[test]
    fn residues_are_those_of_the_numbers() {
        let r = Residues([0; 3]);
        for (value, times, whole) in [
            (0.5, 2, 1),
            (0.375, 8, 3),
            (-1.5, 2, PRIME - 3),
            (6.0, 1, 6),
        ] {
            assert_eq!(r.product(&r.constant(value), &times), whole, "{value}");
        }
        let tiny = r.constant(5e-324);
        let back = (0..1074).fold(tiny, |value, _| r.sum(&value, &value));
        assert_eq!(back, 1);
    }

    #[test]
    fn what_cancels_everywhere_is_constant() {
        let mut b = Builder::default();
        let [x, y] = [0, 1].map(|axis| b.coordinate(axis));
        // The tape (x + y)² − x² − y² − 2xy + ½.
        let sum = b.sum(x, y);
        let square = b.power(sum, 2);
        let [xx, yy, xy] = [(x, x), (y, y), (x, y)].map(|(p, q)| b.product(p, q));
        let rest = b.difference(square, xx);
        let rest = b.difference(rest, yy);
        let once = b.difference(rest, xy);
        let twice = b.difference(once, xy);
        let half = b.constant(0.5);
        let last = b.sum(twice, half);
        assert!(is_constant(&b.clone().finish(last)));
        assert!(!is_constant(&b.finish(once)));
    }

    #[test]
    fn bits_are_counted_through_products() {
        let of = |value: f64, squares: u32| {
            let mut b = Builder::default();
            let mut last = b.constant(value);
            for _ in 0..squares {
                last = b.product(last, last);
            }
            let x = b.coordinate(0);
            let last = b.product(last, x);
            bits(&b.finish(last))
        };
        assert!(of(0.1, 1) < 200);
        assert!(of(1e-300, 4) < MAX_BITS);
        assert!(of(1e-300, 6) > MAX_BITS);
        assert!(of(3.0, 60) > MAX_BITS);
        assert_eq!(of(3.0, 80), u64::MAX, "no overflow");
    }
}
