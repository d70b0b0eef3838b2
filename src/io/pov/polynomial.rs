//! Export of polynomial surfaces, expanded into monomials, of which POV-Ray needs all
//! coefficients.

use super::{number, vector};
use crate::geom::tape::{Arithmetic, Tape};
use crate::geom::{Clip, Implicit};
use crate::shared::rational::Rational;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The coefficients of x^i y^j z^k by [i, j, k], none of them 0; `None` if a coefficient is
/// beyond the limits of [`Rational`].
type Expansion = Option<BTreeMap<[u32; 3], Rational>>;

/// The exponents of x, y and z, and the coefficient.
type Term = ([u32; 3], f64);

/// The arithmetic that expands a tape exactly.
struct Expanding;

impl Arithmetic for Expanding {
    type Value = Expansion;

    fn coordinate(&self, axis: usize) -> Expansion {
        let mut powers = [0; 3];
        powers[axis] = 1;
        Some(BTreeMap::from([(powers, Rational::whole(1))]))
    }

    fn constant(&self, value: f64) -> Expansion {
        let constant = ([0; 3], Rational::from_f64(value));
        Some(
            [constant]
                .into_iter()
                .filter(|(_, c)| !c.is_zero())
                .collect(),
        )
    }

    fn sum(&self, a: &Expansion, b: &Expansion) -> Expansion {
        let (mut sum, b) = (a.clone()?, b.as_ref()?);
        for (powers, coefficient) in b {
            add(&mut sum, *powers, coefficient)?;
        }
        Some(sum)
    }

    fn difference(&self, a: &Expansion, b: &Expansion) -> Expansion {
        let (mut sum, b) = (a.clone()?, b.as_ref()?);
        for (powers, coefficient) in b {
            add(&mut sum, *powers, &coefficient.clone().negated())?;
        }
        Some(sum)
    }

    fn product(&self, a: &Expansion, b: &Expansion) -> Expansion {
        let mut sum = BTreeMap::new();
        for (p, c) in a.as_ref()? {
            for (q, d) in b.as_ref()? {
                let powers = [0, 1, 2].map(|k| p[k] + q[k]);
                add(&mut sum, powers, &c.times(d).ok()?)?;
            }
        }
        Some(sum)
    }
}

/// Adds a term to a sum; `None` if the coefficient is beyond the limits of [`Rational`].
fn add(sum: &mut BTreeMap<[u32; 3], Rational>, powers: [u32; 3], term: &Rational) -> Option<()> {
    let new = match sum.get(&powers) {
        Some(old) => old.plus(term).ok()?,
        None => term.clone(),
    };
    match new.is_zero() {
        true => sum.remove(&powers),
        false => sum.insert(powers, new),
    };
    Some(())
}

/// Expands a tape into its degree and its terms, the highest powers of x first, each with the
/// f64 nearest to its coefficient; `None` if a coefficient is beyond f64.
fn terms(tape: &Tape) -> Option<(u32, Vec<Term>)> {
    let expansion = tape.evaluate(&Expanding)?;
    let degree = expansion.keys().map(|powers| powers.iter().sum()).max();
    let terms = expansion.iter().rev().map(|(powers, coefficient)| {
        let coefficient = coefficient.rounded().ok()?;
        Some((*powers, coefficient))
    });
    Some((degree.unwrap_or(0), terms.collect::<Option<_>>()?))
}

/// Writes POV-Ray's `polynomial`, which allows degree 35; here the limit is 24. `None` if a
/// coefficient is beyond f64.
pub(super) fn polynomial(row: &Implicit) -> Option<String> {
    let (degree, terms) = terms(row.tape)?;
    // POV-Ray requires degree 2 or more, so a plane becomes a quadric without squares.
    let mut text = format!("polynomial {{ {}", degree.max(2));
    for ([i, j, k], coefficient) in terms {
        let _ = write!(text, ",\n  xyz({i}, {j}, {k}): {}", number(coefficient));
    }
    text.push_str("\n  sturm\n");
    match (row.clip, row.bounds) {
        (Some(clip), _) => {
            let clip = match clip {
                Clip::Sphere(s) => {
                    format!("sphere {{ {}, {} }}", vector(s.center), number(s.radius))
                }
                Clip::Cuboid(s) => format!("box {{ {}, {} }}", vector(s.min), vector(s.max)),
            };
            let _ = writeln!(
                text,
                "  clipped_by {{ {clip} }}\n  bounded_by {{ clipped_by }}"
            );
        }
        (None, Some(bounds)) => {
            let room = bounds.diagonal() * 1e-6;
            let [low, high] = [bounds.min - room, bounds.max + room].map(vector);
            let _ = writeln!(text, "  bounded_by {{ box {{ {low}, {high} }} }}");
        }
        (None, None) => {}
    }
    Some(text + "}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::tape::Builder;

    #[test]
    fn tapes_are_multiplied_out() {
        // (0.1 x − y)³ z + 7, where 0.1 is the nearest f64.
        let mut b = Builder::default();
        let [x, y, z] = [0, 1, 2].map(|axis| b.coordinate(axis));
        let [tenth, seven] = [0.1, 7.0].map(|value| b.constant(value));
        let scaled = b.product(tenth, x);
        let difference = b.difference(scaled, y);
        let cube = b.power(difference, 3);
        let product = b.product(cube, z);
        let last = b.sum(product, seven);
        let (degree, terms) = terms(&b.finish(last)).unwrap();
        assert_eq!(degree, 4);
        let expected = [
            ([3, 0, 1], 0.001_000_000_000_000_000_2),
            ([2, 1, 1], -0.030_000_000_000_000_002),
            ([1, 2, 1], 0.300_000_000_000_000_04),
            ([0, 3, 1], -1.0),
            ([0, 0, 0], 7.0),
        ];
        assert_eq!(terms, expected);
    }

    #[test]
    fn what_cancels_is_not_written() {
        let mut b = Builder::default();
        let [x, y] = [0, 1].map(|axis| b.coordinate(axis));
        let [sum, difference] = [b.sum(x, y), b.difference(x, y)];
        let product = b.product(sum, difference);
        let tape = b.finish(product);
        let row = Implicit {
            tape: &tape,
            dense: None,
            open: false,
            clip: None,
            bounds: None,
        };
        let text = "polynomial { 2,\n  xyz(2, 0, 0): 1,\n  xyz(0, 2, 0): -1\n  sturm\n}";
        assert_eq!(polynomial(&row).as_deref(), Some(text));
    }
}
