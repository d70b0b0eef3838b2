//! The polynomial of a torus, and the radii of a polynomial that is one.

use crate::geom::tape::{Builder, Step, Tape};

/// Builds (x² + y² + z² + R² − r²)² − 4R²(x² + z²), a torus about y. The squares of the two
/// radii are steps of their own, so the tape holds the radii as they are given.
pub fn tape_of(major: f64, minor: f64) -> Tape {
    let mut b = Builder::default();
    let [xx, yy, zz] = [0, 1, 2].map(|axis| {
        let coordinate = b.coordinate(axis);
        b.power(coordinate, 2)
    });
    let round = b.sum(xx, zz);
    let squares = b.sum(round, yy);
    let [major, minor] = [major, minor].map(|radius| {
        let radius = b.constant(radius);
        b.power(radius, 2)
    });
    let sum = b.sum(squares, major);
    let sum = b.difference(sum, minor);
    let sum = b.power(sum, 2);
    let four = b.constant(4.0);
    let major = b.product(four, major);
    let ring = b.product(major, round);
    let last = b.difference(sum, ring);
    b.finish(last)
}

/// Returns the radii [R, r] if a tape is, step by step, that of [`tape_of`].
pub fn radii_of(tape: &Tape) -> Option<[f64; 2]> {
    // The tape of a torus has three constants at most: the radii and 4.
    let constants: Vec<f64> = tape
        .steps()
        .iter()
        .filter_map(Step::constant)
        .take(4)
        .collect();
    let pairs = constants
        .iter()
        .flat_map(|a| constants.iter().map(move |b| [*a, *b]));
    pairs
        .into_iter()
        .find(|[major, minor]| tape_of(*major, *minor) == *tape)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radii_are_read_back() {
        for radii in [
            [1.0, 0.3],
            [2.0, 2.0],
            [1.0, 2.0],
            [2.0, 1.0],
            [4.0, 0.1],
            [1.0, 4.0],
        ] {
            let tape = tape_of(radii[0], radii[1]);
            assert_eq!(radii_of(&tape), Some(radii), "{:?}", tape.steps());
        }
        let mut b = Builder::default();
        let x = b.coordinate(0);
        let one = b.constant(1.0);
        let last = b.difference(x, one);
        assert_eq!(radii_of(&b.finish(last)), None);
    }
}
