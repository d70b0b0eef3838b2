use super::*;
use crate::geom::Sphere;
use crate::geom::tape::Builder;
use crate::geom::{Clip, Cuboid};
use glam::DVec3;

/// (x² + y² + z² + R² − r²)² − 4R²(x² + y²).
fn torus(major: f64, minor: f64) -> Tape {
    let mut b = Builder::default();
    let squares: Vec<u32> = (0..3)
        .map(|axis| {
            let x = b.coordinate(axis);
            b.power(x, 2)
        })
        .collect();
    let round = b.sum(squares[0], squares[1]);
    let all = b.sum(round, squares[2]);
    let rest = b.constant(major * major - minor * minor);
    let sum = b.sum(all, rest);
    let square = b.power(sum, 2);
    let factor = b.constant(4.0 * major * major);
    let ring = b.product(factor, round);
    let last = b.difference(square, ring);
    b.finish(last)
}

const X: [f64; 3] = [1.0, 0.0, 0.0];
const ALL: [f64; 2] = [0.0, f64::INFINITY];

fn row(tape: &Tape, clip: Option<Clip>) -> Implicit<'_> {
    Implicit {
        tape,
        dense: None,
        open: clip.is_some(),
        clip,
        bounds: None,
    }
}

fn is_near(t: Option<f64>, expected: f64) -> bool {
    t.is_some_and(|t| (t - expected).abs() < 1e-12)
}

#[test]
fn every_solver_finds_the_torus() {
    let tape = torus(1.0, 0.25);
    let line = ([-3.0, 0.0, 0.0], X);
    let mut found = Vec::new();
    for solver in Solver::ALL {
        let row = row(&tape, None);
        let name = solver.name();
        assert!(is_near(first(&row, solver, line, ALL), 1.75), "{name}");
        assert!(
            is_near(first(&row, solver, line, [2.0, 9.0]), 2.25),
            "{name}"
        );
        assert!(
            is_near(first(&row, solver, line, [2.5, 9.0]), 3.75),
            "{name}"
        );
        for (between, some) in [
            (ALL, true),
            ([0.0, 1.7], false),
            ([0.0, 1.8], true),
            ([2.3, 3.7], false),
            ([4.3, 9.0], false),
        ] {
            assert_eq!(
                exists(&row, solver, line, between),
                some,
                "{name} {between:?}"
            );
        }
        for (from, inside, count) in [(0.0, false, 4), (2.0, true, 3), (3.0, false, 2)] {
            let is_inside = crossings(&tape, solver, line, [from, 9.0], &mut found);
            assert_eq!((is_inside, found.len()), (inside, count), "{name} {from}");
            let expected = [1.75, 2.25, 3.75, 4.25];
            for (t, expected) in found.iter().zip(&expected[4 - count..]) {
                assert!(is_near(Some(*t), *expected), "{name}: {found:?}");
            }
        }
    }
}

#[test]
fn what_the_clip_takes_away_is_not_met() {
    let tape = torus(1.0, 0.25);
    let clip = Clip::Sphere(Sphere {
        center: DVec3::new(1.0, 0.0, 0.0),
        radius: 1.0,
    });
    let row = row(&tape, Some(clip));
    for solver in Solver::ALL {
        let line = ([-3.0, 0.0, 0.0], X);
        let name = solver.name();
        assert!(is_near(first(&row, solver, line, ALL), 3.75), "{name}");
        assert!(!exists(&row, solver, line, [0.0, 3.5]), "{name}");
        // Past the clip.
        let line = ([-3.0, 1.2, 0.0], X);
        assert_eq!(first(&row, solver, line, ALL), None, "{name}");
    }
}

#[test]
fn a_tangent_is_an_even_number() {
    // x² + y² − 1, seen along y = 1.
    let mut b = Builder::default();
    let [x, y] = [0, 1].map(|axis| b.coordinate(axis));
    let [x, y] = [x, y].map(|v| b.power(v, 2));
    let sum = b.sum(x, y);
    let one = b.constant(1.0);
    let last = b.difference(sum, one);
    let tape = b.finish(last);
    let line = ([-3.0, 1.0, 0.0], X);
    let mut found = Vec::new();
    for solver in Solver::ALL {
        let is_inside = crossings(&tape, solver, line, [0.0, 9.0], &mut found);
        assert_eq!((is_inside, found.len()), (false, 0), "{}", solver.name());
        let touches = first(&row(&tape, None), solver, line, ALL);
        // Those that know multiple roots give it; to others it is a cluster of two.
        assert_eq!(touches.is_some(), solver.is_exact(), "{}", solver.name());
    }
}

#[test]
fn numbers_beyond_the_range_are_no_surface() {
    let tape = torus(1.0, 0.25);
    let line = ([-1e200, 0.0, 0.0], X);
    for solver in Solver::ALL {
        assert_eq!(first(&row(&tape, None), solver, line, ALL), None);
        assert!(!exists(&row(&tape, None), solver, line, ALL));
        assert!(!crossings(&tape, solver, line, ALL, &mut Vec::new()));
    }
}

/// ((z − 1)² + e) (z + 1), from above: a double plane, or nearly one, before a single one.
fn planes(e: f64) -> Tape {
    let mut b = Builder::default();
    let (z, one, e) = (b.coordinate(2), b.constant(1.0), b.constant(e));
    let above = b.difference(z, one);
    let square = b.power(above, 2);
    let double = b.sum(square, e);
    let single = b.sum(z, one);
    let last = b.product(double, single);
    b.finish(last)
}

const DOWN: ([f64; 3], [f64; 3]) = ([0.0, 0.0, 5.0], [0.0, 0.0, -1.0]);

#[test]
fn what_is_none_does_not_hide_what_is_behind() {
    for e in [0.0, 1e-40] {
        let tape = planes(e);
        let row = row(&tape, None);
        for solver in Solver::ALL {
            let name = solver.name();
            let behind = first(&row, solver, DOWN, [4.5, 9.0]);
            assert!(is_near(behind, 6.0), "{name} {e}: {behind:?}");
            // To those that know no multiple roots the double plane is none. Rounded, the
            // coefficients of the other are the same.
            let t = first(&row, solver, DOWN, ALL);
            let sees = solver.is_exact();
            assert!(
                is_near(t, if sees { 4.0 } else { 6.0 }),
                "{name} {e}: {t:?}"
            );
            assert!(exists(&row, solver, DOWN, ALL), "{name} {e}");
            let before = exists(&row, solver, DOWN, [0.0, 5.5]);
            assert_eq!(before, sees, "{name} {e}");
            let mut found = Vec::new();
            let is_inside = crossings(&tape, solver, DOWN, [0.0, 9.0], &mut found);
            assert_eq!(
                (is_inside, found.len()),
                (false, 1),
                "{name} {e}: {found:?}"
            );
        }
    }
}

#[test]
fn a_surface_in_a_face_of_its_clip_is_met() {
    for (min, max, t) in [(-2.0, -1.0, 6.0), (-1.0, 0.0, 6.0)] {
        let clip = Clip::Cuboid(Cuboid {
            min: DVec3::new(-3.0, -3.0, min),
            max: DVec3::new(3.0, 3.0, max),
        });
        let tape = planes(1.0);
        for solver in Solver::ALL.into_iter().filter(|s| *s != Solver::Auto) {
            let met = first(&row(&tape, Some(clip)), solver, DOWN, ALL);
            assert!(is_near(met, t), "{} {min}: {met:?}", solver.name());
            assert!(exists(&row(&tape, Some(clip)), solver, DOWN, ALL));
        }
    }
}
