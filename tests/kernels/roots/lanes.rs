//! Least roots in lanes: every width has the bits of one lane, and those of the exact root.

use crate::common::property;
use lanecast::internals::math::lanes::{Lanes, Mask, f64x4, f64x8};
use lanecast::internals::roots::lanes::{
    Segment, Waiting, changes_between, exists, from_powers, least_root, leaves_between, nearest,
};
use lanecast::internals::roots::{Interval, Polynomial, nearest as nearest_of};
use proptest::prelude::*;

/// What a lane says: t, its error, existence; `None`: in doubt.
type Said = (Option<(Option<f64>, f64)>, Option<bool>);

fn ask<L: Lanes<Scalar = f64>, const N: usize>(rows: &[[f64; N]], error: f64) -> Vec<Said> {
    let mut waiting = Waiting::default();
    let mut said = Vec::new();
    for rows in rows.chunks(L::COUNT) {
        let column = |j: usize| {
            let lanes: Vec<f64> = (0..L::COUNT).map(|i| rows[i % rows.len()][j]).collect();
            L::load(&lanes)
        };
        let segment: Segment<L, N> = Segment {
            scaled: std::array::from_fn(column),
            error: L::from_f64(error),
            first: L::from_f64(error),
        };
        let all = L::Mask::splat(true);
        let found = nearest(&segment, all, &mut waiting);
        let exists = exists(&segment, all, &mut waiting);
        for i in 0..rows.len() {
            let on = |mask: L::Mask| mask.bits() >> i & 1 == 1;
            let t = on(found.hit).then(|| found.t.lane(i));
            let error = if on(found.hit) {
                found.error.lane(i)
            } else {
                0.0
            };
            assert!(!(on(found.hit) && on(found.doubt)));
            said.push((
                (!on(found.doubt)).then_some((t, error)),
                (!on(exists.doubt)).then_some(on(exists.some)),
            ));
        }
    }
    said
}

fn product(roots: &[f64], pairs: &[(f64, f64)]) -> Vec<f64> {
    let mut c = vec![1.0];
    let mut times = |factor: &[f64]| {
        let mut next = vec![0.0; c.len() + factor.len() - 1];
        for (i, c) in c.iter().enumerate() {
            for (j, f) in factor.iter().enumerate() {
                next[i + j] += c * f;
            }
        }
        c = next;
    };
    roots.iter().for_each(|r| times(&[-r, 1.0]));
    pairs
        .iter()
        .for_each(|(a, b)| times(&[a * a + b * b, -2.0 * a, 1.0]));
    c
}

/// Of degree N − 1, in powers of t: with real roots in and out of (0, 1), some of
/// them double or at an end, and complex pairs.
fn powers<const N: usize>() -> impl Strategy<Value = [f64; N]> {
    let root = prop_oneof![6 => -0.5..1.5, 1 => Just(0.5), 1 => Just(0.0), 1 => Just(1.0)];
    let roots = prop::collection::vec(root, N - 1);
    let pairs = prop::collection::vec((-0.2..1.2, 0.0..0.5), N / 2);
    (roots, pairs, 0..N, any::<bool>()).prop_map(|(mut roots, pairs, real, double)| {
        let complex = (N - 1 - real.min(N - 1)) / 2;
        roots.truncate(N - 1 - 2 * complex);
        if double && roots.len() > 1 {
            roots[0] = roots[1];
        }
        let c = product(&roots, &pairs[..complex]);
        std::array::from_fn(|i| c[i])
    })
}

fn check<const N: usize>(rows: &[[f64; N]]) {
    let rows: Vec<[f64; N]> = rows.iter().map(|c| from_powers(c, 0.0).scaled).collect();
    let one = ask::<f64, N>(&rows, 0.0);
    assert_eq!(ask::<f64x4, N>(&rows, 0.0), one);
    assert_eq!(ask::<f64x8, N>(&rows, 0.0), one);
    for (row, (found, exists)) in rows.iter().zip(&one) {
        let exact = least_root(row);
        if let Some((t, error)) = found {
            assert_eq!(*t, exact, "{row:?}");
            assert!(t.is_none() || *error < 1e-15);
        }
        if let Some(exists) = exists {
            assert_eq!(*exists, exact.is_some(), "{row:?}");
        }
    }
    // With errors, what is settled is settled for all polynomials within them.
    let error = 1e-6;
    for (row, (found, exists)) in rows.iter().zip(ask::<f64x8, N>(&rows, error)) {
        for sign in [-1.0, 1.0] {
            let mut binomial = 1.0;
            let moved: [f64; N] = std::array::from_fn(|j| {
                let d = row[j] + sign * 0.999 * error * binomial;
                binomial *= (N - 1 - j) as f64 / (j + 1) as f64;
                d
            });
            let exact = least_root(&moved);
            if let Some((t, error)) = found {
                assert_eq!(t.is_some(), exact.is_some(), "{row:?}");
                if let (Some(t), Some(exact)) = (t, exact) {
                    assert!((t - exact).abs() <= error, "{t} {exact} {error}");
                }
            }
            if let Some(exists) = exists {
                assert_eq!(exists, exact.is_some(), "{row:?}");
            }
        }
    }
}

proptest! {
    #![proptest_config(property(150))]

    #[test]
    fn lanes_are_right_at_every_width(
        two in prop::collection::vec(powers::<3>(), 1..12),
        four in prop::collection::vec(powers::<5>(), 1..12),
        six in prop::collection::vec(powers::<7>(), 1..12),
        ten in prop::collection::vec(powers::<11>(), 1..12),
    ) {
        check(&two);
        check(&four);
        check(&six);
        check(&ten);
    }

    /// In powers of t and in q = t / (1 − t) it is one polynomial.
    #[test]
    fn powers_become_the_same_polynomial(c in powers::<7>()) {
        let line = Interval::open(0.0, 1.0);
        let direct = nearest_of(&Polynomial::new(&c).unwrap(), &line);
        let segment = from_powers(&c, 0.0);
        if let (Some((Some(t), _)), _) = ask::<f64, 7>(&[segment.scaled], segment.error)[0] {
            let direct = direct.expect("the one has a root").t;
            prop_assert!((t - direct).abs() < 1e-6, "{} {}", t, direct);
        }
    }
}

#[test]
fn few_lanes_are_in_doubt() {
    // Roots apart, a near miss, and a tangent: only the last needs exact numbers.
    let c: [[f64; 5]; 3] = [
        product(&[0.2, 0.3, 0.7, 0.9], &[]).try_into().unwrap(),
        product(&[], &[(0.5, 1e-4), (0.25, 0.1)])
            .try_into()
            .unwrap(),
        product(&[0.25, 0.25, 2.0, 3.0], &[]).try_into().unwrap(),
    ];
    let rows: Vec<[f64; 5]> = c.iter().map(|c| from_powers(c, 0.0).scaled).collect();
    let said = ask::<f64x8, 5>(&rows, 0.0);
    assert!((said[0].0.unwrap().0.unwrap() - 0.2).abs() < 1e-15);
    assert_eq!(said[1].0.unwrap().0, None);
    assert_eq!(said[2], (None, None));
    assert_eq!(least_root(&rows[2]), Some(0.25));
    assert_eq!(least_root(&[f64::NAN, 1.0]), None);
    assert_eq!(least_root(&[0.0, 0.0]), None);
}

/// Signs at two places tell of a root between them; and of the first one, if the first
/// sign is that at 0.
#[test]
fn the_first_root_is_told_from_the_next() {
    let c: [f64; 3] = product(&[0.25, 0.5], &[]).try_into().unwrap();
    for sign in [1.0, -1.0] {
        let segment: Segment<f64, 3> = from_powers(&c.map(|c| sign * c), 1e-15);
        let of = |low, high| {
            let change = changes_between(&segment, low, high);
            (change.any(), leaves_between(&segment, low, high).any())
        };
        assert_eq!(of(0.125, 0.375), (true, true));
        assert_eq!(of(0.0, 0.375), (true, true));
        assert_eq!(of(0.375, 0.75), (true, false));
        assert_eq!(of(0.125, 0.75), (false, false));
        assert_eq!(of(0.25, 0.375), (false, false));
    }
}

/// A lane that is no number leaves the others alone.
#[test]
fn numbers_that_are_none_are_in_doubt() {
    let one: [f64; 3] = from_powers(&[-0.25, 0.0, 1.0], 0.0).scaled;
    let first = |said: &Said| said.0.and_then(|(t, _)| t);
    for bad in [f64::NAN, f64::INFINITY, f64::MAX, -1e301] {
        for j in 0..3 {
            let mut row = one;
            row[j] = bad;
            let said = ask::<f64x8, 3>(&[one, row, one], 0.0);
            assert_eq!(said[1], (None, None), "{bad} at {j}");
            assert_eq!([first(&said[0]), first(&said[2])], [Some(0.5); 2]);
        }
    }
    for error in [f64::NAN, f64::INFINITY, -1.0] {
        assert_eq!(ask::<f64x8, 3>(&[one], error), [(None, None)]);
    }
    // Of the smallest numbers nothing is known, but it is said.
    let tiny = one.map(|d| d * 1e-300);
    assert_eq!(ask::<f64x8, 3>(&[tiny], 0.0), [(None, None)]);
    assert_eq!(least_root(&tiny), Some(0.5));
}
