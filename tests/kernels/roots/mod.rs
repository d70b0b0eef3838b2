//! Compares every root finder with roots that others certified and with Sturm's theorem in
//! fractions, also on the worst coefficients that f64 can hold.

mod fractions;
mod lanes;

use crate::common::{assets, property};
use fractions::Fractions;
use lanecast::internals::roots::{
    Answer, Cluster, Interval, Polynomial, Proof, Solver, Want, nearest, roots, solve,
};
use proptest::prelude::*;
use serde_json::Value;
use std::ops::Bound;

fn polynomial(coefficients: &[f64]) -> Polynomial {
    Polynomial::new(coefficients).unwrap()
}

/// By a solver that takes the degree.
fn by(solver: Solver, p: &Polynomial, interval: &Interval) -> Answer {
    solve(p, interval, solver, Want::All, &[]).unwrap()
}

const INFINITE: f64 = f64::INFINITY;

/// (low, high].
fn half_open(low: f64, high: f64) -> Interval {
    let end = |x: f64, bound: fn(f64) -> Bound<f64>| match x.is_finite() {
        true => bound(x),
        false => Bound::Unbounded,
    };
    Interval {
        low: end(low, Bound::Excluded),
        high: end(high, Bound::Included),
    }
}

#[test]
fn the_lectures_cubic() {
    let p = polynomial(&[-1.0, 0.0, 3.0, 1.0]);
    for solver in Solver::ALL {
        let name = solver.name();
        for (low, high, count) in [
            (0.0, 1.0, 1),
            (0.0, INFINITE, 1),
            (-INFINITE, INFINITE, 3),
            (-1.0, 0.0, 1),
            (-3.0, -2.0, 1),
        ] {
            let answer = by(solver, &p, &half_open(low, high));
            assert_eq!(answer.roots.len(), count, "{name}, ({low}, {high}]");
            assert!(answer.clusters.is_empty(), "{name}");
        }
        let answer = by(solver, &p, &Interval::LINE);
        let found: Vec<f64> = answer.roots.iter().map(|root| root.t).collect();
        let exact = [
            "-2.87938524157181676811",
            "-0.65270364466613930229",
            "0.53208888623795607040",
        ];
        let exact = exact.map(|digits| digits.parse::<f64>().unwrap());
        assert_eq!(found, exact, "{name}");
        assert!(answer.roots.iter().all(|root| root.multiplicity == 1));
        assert!(answer.roots.iter().all(|root| root.error < 4.5e-16));
    }
}

/// What became of the roots that the file knows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Fate {
    right: usize,
    wrong_multiplicity: usize,
    in_clusters: usize,
    lost: usize,
    false_roots: usize,
}

#[test]
fn all_certified_polynomials_have_their_roots() {
    let Some(assets) = assets() else { return };
    let text = std::fs::read_to_string(assets.join("poly/polynomials.json")).unwrap();
    let file: Value = serde_json::from_str(&text).unwrap();
    let number = |x: &Value| x.as_str().unwrap().parse::<f64>().unwrap();
    let mut fates = Solver::ALL.map(|solver| (solver, Fate::default()));
    let mut known_roots = 0;
    for row in file["polynomials"].as_array().unwrap() {
        let c: Vec<f64> = row["coeffs_f64"]
            .as_array()
            .unwrap()
            .iter()
            .map(number)
            .collect();
        let p = polynomial(&c);
        let known = row["real_roots_f64"].as_array().unwrap();
        known_roots += known.len();
        for (solver, fate) in &mut fates {
            let Ok(answer) = solve(&p, &Interval::LINE, *solver, Want::All, &[]) else {
                assert_eq!(*solver, Solver::Closed);
                continue;
            };
            let mut left = answer.roots.clone();
            for root in known {
                let (x, bound) = (number(&root["x"]), number(&root["forward_bound"]));
                let reach = 10.0 * c.len() as f64 * bound;
                let near = left
                    .iter()
                    .position(|r| r.t == x || (r.t - x).abs() <= reach.min(1e-300));
                match near.map(|at| left.remove(at)) {
                    // All that is given is rounded correctly.
                    Some(found) if u64::from(found.multiplicity) == root["mult"] => fate.right += 1,
                    Some(_) => fate.wrong_multiplicity += 1,
                    None if answer.clusters.iter().any(|c| c.low <= x && x <= c.high) => {
                        fate.in_clusters += 1;
                    }
                    None => fate.lost += 1,
                }
            }
            fate.false_roots += left.len();
            if solver.is_exact() {
                assert_eq!(
                    answer.roots.len(),
                    known.len(),
                    "{} {}",
                    row["name"],
                    solver.name()
                );
                assert!(answer.clusters.is_empty() && answer.proof == Proof::Complete);
            }
        }
    }
    for (solver, fate) in fates {
        let name = solver.name();
        println!("{name}: {fate:?}");
        assert_eq!(fate.false_roots, 0, "{name}");
        assert_eq!(fate.wrong_multiplicity, 0, "{name}");
        if solver.is_exact() {
            assert_eq!(fate.right, known_roots, "{name}");
        }
        if matches!(solver, Solver::Bernstein | Solver::Halving) {
            assert_eq!(fate.lost, 0, "{name}");
        }
    }
}

/// Coefficients of Π (t − root), exact for small whole numbers.
fn product(roots: &[f64]) -> Vec<f64> {
    let mut c = vec![1.0];
    for root in roots {
        c.insert(0, 0.0);
        for i in 0..c.len() - 1 {
            c[i] -= root * c[i + 1];
        }
    }
    c
}

/// Numbers of any size, and of the sizes that meet.
fn coefficient() -> impl Strategy<Value = f64> {
    let any = any::<f64>().prop_filter("finite", |x| x.is_finite());
    let small = (-6_i32..7).prop_map(f64::from);
    prop_oneof![1 => any, 4 => -1.0..1.0, 4 => small, 1 => Just(0.0)]
}

/// Every claim of an answer, by fractions.
fn check(p: &Polynomial, answer: &Answer, solver: Solver) {
    let exact = Fractions::of(p.coefficients());
    let name = solver.name();
    for root in &answer.roots {
        if !root.error.is_finite() {
            continue;
        }
        let around = exact.distinct_between(root.t, root.error);
        assert!(around >= 1, "{name}: no root at {root:?} of {p:?}");
    }
    for pair in answer.roots.windows(2) {
        assert!(pair[0].t <= pair[1].t);
    }
    if answer.proof == Proof::Complete && answer.clusters.is_empty() {
        assert_eq!(answer.roots.len(), exact.distinct(), "{name}: {p:?}");
    }
    if solver.is_exact() {
        assert!(answer.clusters.is_empty());
        let mut found: Vec<u32> = answer.roots.iter().map(|root| root.multiplicity).collect();
        found.sort_unstable();
        assert_eq!(found, exact.multiplicities(), "{name}: {p:?}");
    }
}

/// Roots next to each other, none of them a number: those that a solver which claims to
/// be complete does not list lie in its clusters.
fn nothing_is_left_out(near: &[(i32, i32)], (whole, part): (i32, i32)) {
    let center = f64::from(whole) / f64::from(part);
    let offset = |(steps, power): &(i32, i32)| f64::from(*steps) * 10.0_f64.powi(-power);
    let roots: Vec<f64> = near.iter().map(|one| center + offset(one)).collect();
    let p = polynomial(&product(&roots));
    let exact = Fractions::of(p.coefficients());
    for solver in [Solver::Halving, Solver::Bernstein] {
        let answer = by(solver, &p, &Interval::LINE);
        assert_eq!(answer.proof, Proof::Complete);
        let within = |cluster: &Cluster| {
            let middle = cluster.low + 0.5 * (cluster.high - cluster.low);
            let reach = f64::max(middle - cluster.low, cluster.high - middle);
            exact.distinct_between(middle, reach)
        };
        let clustered: usize = answer.clusters.iter().map(within).sum();
        let found = answer.roots.len() + clustered;
        assert_eq!(found, exact.distinct(), "{}: {answer:?}", solver.name());
    }
}

#[test]
fn a_proven_root_hides_no_other_in_its_interval() {
    let near = [(-9, 4), (5, 4), (3, 2), (0, 2), (1, 5)];
    nothing_is_left_out(&near, (4, 7));
}

proptest! {
    #![proptest_config(property(120))]

    #[test]
    fn complete_answers_leave_no_root_out(
        near in prop::collection::vec((-9_i32..10, 2_i32..10), 2..7),
        center in (1_i32..6, 1_i32..9),
    ) {
        nothing_is_left_out(&near, center);
    }

    /// Multiple roots, clusters, far and near ones: the right number, each to the bit.
    #[test]
    fn known_roots_are_found(
        whole in prop::collection::vec((-9_i32..10, 1_usize..4), 1..5),
        power in -30_i32..30,
    ) {
        let mut whole = whole;
        whole.sort_unstable();
        whole.dedup_by_key(|(root, _)| *root);
        let scale = 2.0_f64.powi(power);
        let all: Vec<f64> = whole.iter()
            .flat_map(|(root, m)| std::iter::repeat_n(f64::from(*root) * scale, *m))
            .collect();
        let p = polynomial(&product(&all));
        for solver in [Solver::Auto, Solver::Sturm] {
            let answer = by(solver, &p, &Interval::LINE);
            let found: Vec<(f64, usize)> = answer.roots.iter()
                .map(|root| (root.t, root.multiplicity as usize))
                .collect();
            let known: Vec<(f64, usize)> = whole.iter()
                .map(|(root, m)| (f64::from(*root) * scale, *m))
                .collect();
            prop_assert_eq!(&found, &known, "{}", solver.name());
            // Ends belong to intervals as they say.
            let (low, high) = (known[0].0, known[known.len() - 1].0);
            if low < high {
                let inside = by(solver, &p, &half_open(low, high));
                prop_assert_eq!(inside.roots.len(), known.len() - 1);
                let open = Interval::open(low, high);
                let inside = by(solver, &p, &open);
                prop_assert_eq!(inside.roots.len(), known.len() - 2);
                let first = nearest(&p, &open).map(|root| root.t);
                prop_assert_eq!(first, inside.roots.first().map(|root| root.t));
            }
        }
    }

    /// No claim of any solver is wrong, whatever the coefficients.
    #[test]
    fn claims_hold_by_sturms_theorem_in_fractions(
        c in prop::collection::vec(coefficient(), 1..8),
        twice in any::<bool>(),
    ) {
        let Ok(p) = Polynomial::new(&c) else { return Ok(()) };
        let small = c.iter().all(|c| c.abs() < 10.0 && c.fract() == 0.0);
        let p = if twice && small && p.degree() < 5 {
            // A square: all roots double.
            let mut square = vec![0.0; 2 * c.len() - 1];
            for (i, a) in c.iter().enumerate() {
                for (j, b) in c.iter().enumerate() {
                    square[i + j] += a * b;
                }
            }
            polynomial(&square)
        } else {
            p
        };
        for solver in Solver::ALL {
            if let Ok(answer) = solve(&p, &Interval::LINE, solver, Want::All, &[]) {
                check(&p, &answer, solver);
            }
        }
    }

    /// Bits of a root depend on nothing but the polynomial and the root.
    #[test]
    fn no_start_solver_or_interval_changes_a_bit(
        c in prop::collection::vec(-1.0_f64..1.0, 2..12),
        starts in prop::collection::vec(-3.0_f64..3.0, 0..4),
        low in -2.0_f64..2.0,
        width in 0.0_f64..2.0,
    ) {
        let p = polynomial(&c);
        let line = roots(&p, &Interval::LINE);
        let bits: Vec<u64> = line.roots.iter().map(|root| root.t.to_bits()).collect();
        let interval = Interval::open(low, low + width);
        for solver in Solver::ALL {
            for starts in [&[][..], &starts] {
                let Ok(answer) = solve(&p, &interval, solver, Want::All, starts) else { continue };
                for root in &answer.roots {
                    prop_assert!(bits.contains(&root.t.to_bits()), "{} {root:?}", solver.name());
                    prop_assert!(low < root.t && root.t < low + width);
                }
                if solver.is_exact() {
                    let inside = line.roots.iter().filter(|r| low < r.t && r.t < low + width);
                    prop_assert_eq!(answer.roots.len(), inside.count());
                    let first = solve(&p, &interval, solver, Want::Nearest, starts).unwrap();
                    prop_assert_eq!(first.roots.first(), answer.roots.first());
                }
            }
        }
    }
}

/// From the least to the largest that f64 can be, and beyond.
#[test]
fn no_size_of_coefficients_is_too_much() {
    let tiny = f64::from_bits(1);
    let cases: &[(&[f64], &[f64])] = &[
        (&[1.0, -1e300, 1.0], &[1e-300, 1e300]),
        (&[tiny, 0.0, -tiny], &[-1.0, 1.0]),
        (&[f64::MAX, -f64::MAX, f64::MAX, -f64::MAX], &[1.0]),
        (&[-1e300, 1e-300], &[f64::MAX]),
        (&[1e300, 1e-300], &[-f64::MAX]),
        (&[-tiny, 1e300], &[0.0]),
        (&[tiny, -3.0 * tiny, 2.0 * tiny], &[0.5, 1.0]),
        (&[0.0, 0.0, 1.0], &[0.0]),
        (&[5.0], &[]),
    ];
    for (c, known) in cases {
        let p = polynomial(c);
        for solver in [Solver::Auto, Solver::Sturm] {
            let found: Vec<f64> = by(solver, &p, &Interval::LINE)
                .roots
                .iter()
                .map(|r| r.t)
                .collect();
            assert_eq!(found, *known, "{c:?}, {}", solver.name());
        }
        for solver in Solver::ALL {
            check(&p, &by(solver, &p, &Interval::LINE), solver);
        }
    }
}

/// A root that rounds to an interval's end lies on one side of it.
#[test]
fn ends_are_compared_exactly() {
    for (square, is_below) in [(2.0, true), (3.0, false)] {
        // √2 is a little below its f64, √3 a little above.
        let p = polynomial(&[-square, 0.0, 1.0]);
        let t = f64::sqrt(square);
        for solver in Solver::ALL {
            let count = |low, high| by(solver, &p, &half_open(low, high)).roots.len();
            let name = solver.name();
            assert_eq!(count(0.0, t), usize::from(is_below), "√{square}, {name}");
            assert_eq!(count(t, 9.0), usize::from(!is_below), "√{square}, {name}");
            assert_eq!(count(0.0, t.next_down()), 0, "√{square}, {name}");
            assert_eq!(count(t.next_up(), 9.0), 0, "√{square}, {name}");
            assert_eq!(
                count(-9.0, -t),
                usize::from(is_below) ^ 1,
                "√{square}, {name}"
            );
        }
    }
}
