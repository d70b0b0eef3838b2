//! Compares the bounds of a tape's values with fractions.

use super::*;
use crate::geom::tape::{Arithmetic, Builder};
use num_rational::BigRational;
use proptest::prelude::*;

struct Fractions([BigRational; 3]);

impl Arithmetic for Fractions {
    type Value = BigRational;

    fn coordinate(&self, axis: usize) -> BigRational {
        self.0[axis].clone()
    }

    fn constant(&self, value: f64) -> BigRational {
        fraction(value)
    }

    fn sum(&self, a: &BigRational, b: &BigRational) -> BigRational {
        a + b
    }

    fn difference(&self, a: &BigRational, b: &BigRational) -> BigRational {
        a - b
    }

    fn product(&self, a: &BigRational, b: &BigRational) -> BigRational {
        a * b
    }
}

fn fraction(x: f64) -> BigRational {
    BigRational::from_float(x).expect("a finite number")
}

/// Makes a tape of random steps, whose last ones are summed.
fn tape(choices: &[(u8, usize, usize, f64)]) -> Tape {
    let mut b = Builder::default();
    let mut all: Vec<(u32, u32)> = (0..3).map(|axis| (b.coordinate(axis), 1)).collect();
    for (what, i, j, c) in choices {
        let ((x, n), (y, m)) = (all[i % all.len()], all[j % all.len()]);
        let next = match what % 6 {
            0 => (b.constant(*c), 0),
            1 => (b.sum(x, y), n.max(m)),
            2 => (b.difference(x, y), n.max(m)),
            3 => {
                let factor = b.constant(*c);
                (b.product(x, factor), n)
            }
            _ if n + m > 12 => continue,
            _ => (b.product(x, y), n + m),
        };
        all.push(next);
    }
    let last = all
        .iter()
        .rev()
        .take(4)
        .map(|(i, _)| *i)
        .reduce(|a, x| b.sum(a, x));
    b.finish(last.expect("three at least"))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Moves coordinates at one node, the start of a segment, by as much as their error bound.
    #[test]
    fn values_are_off_by_no_more_than_magnitudes_say(
        choices in prop::collection::vec((any::<u8>(), 0..40_usize, 0..40_usize, -3.0..3.0), 1..30),
        p in prop::array::uniform3(-2.0..2.0_f64),
        scale in -60..60_i32,
        off in prop::array::uniform3(-1.0..1.0_f64),
        bits in -54..-8_i32,
    ) {
        let tape = tape(&choices);
        prop_assume!(tape.degree() <= 24);
        let scale = f64::powi(2.0, scale);
        let computed = p.map(|x| x * scale);
        let off = off.map(|x| x * scale * f64::powi(2.0, bits));
        // The true point lies beside the computed one.
        let exact = Fractions([0, 1, 2].map(|k| fraction(computed[k]) + fraction(off[k])));
        let exact = tape.evaluate(&exact);
        let [reach, off] = [computed, off].map(|v| Vec3::<f64>::splat(v).abs());
        let stretch = Stretch::choose_for_tape(&tape, reach, off);
        let sizes = [stretch.magnitudes(tape.floor(), reach, off); 2];
        let still = Vec3::splat([0.0; 3]);
        let nodes = [0.0; 3];
        let line = (Vec3::splat(computed), still);
        let (values, sizes) = values::<f64, 3>(&tape, line, sizes, &nodes, &mut Vec::new());
        let bound = sizes[0] * stretch.lost;
        prop_assert!(!bound.is_nan());
        if bound.is_finite() {
            let (error, bound) = (fraction(values[0]) - exact, fraction(bound));
            prop_assert!(error <= bound && -error <= bound, "{} {bound}", values[0]);
        }
    }

    /// Fused steps give the same bits as all steps.
    #[test]
    fn fused_steps_have_the_same_bits(
        choices in prop::collection::vec((any::<u8>(), 0..40_usize, 0..40_usize, -3.0..3.0), 1..60),
        p in prop::array::uniform3(-2.0..2.0_f64),
        step in prop::array::uniform3(-2.0..2.0_f64),
    ) {
        let tape = tape(&choices);
        let zero = Vec3::splat([0.0; 3]);
        let nodes = [0.0, 0.25, 1.0];
        let line = (Vec3::splat(p), Vec3::splat(step));
        let (values, _) = values::<f64, 3>(&tape, line, [zero; 2], &nodes, &mut Vec::new());
        for (value, s) in values.iter().zip(nodes) {
            let at = [0, 1, 2].map(|k| p[k] + step[k] * s);
            let expected = crate::geom::implicit::values_at(&tape, Vec3::<f64>::splat(at)).0;
            prop_assert_eq!(value.to_bits(), expected.to_bits());
        }
    }
}
