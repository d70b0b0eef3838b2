//! Formulas in f64, in intervals and with slopes; and where they change their sign.

use super::*;
use proptest::prelude::*;
use std::f64::consts::PI;
use std::ops::ControlFlow;

const ALL: [Unary; 13] = [
    Unary::Abs,
    Unary::Sqrt,
    Unary::Exp,
    Unary::Ln,
    Unary::Sin,
    Unary::Cos,
    Unary::Tan,
    Unary::Asin,
    Unary::Acos,
    Unary::Atan,
    Unary::Sinh,
    Unary::Cosh,
    Unary::Tanh,
];

/// Makes a formula of x alone.
fn of_x(make: impl FnOnce(&mut Builder, u32) -> u32) -> Formula {
    let mut b = Builder::default();
    let x = b.coordinate(0);
    let last = make(&mut b, x);
    b.finish(last)
}

/// Along the x axis, in a part of it: where f changes its sign, and whether it falls there.
fn along_x(f: &Formula, part: [f64; 2], is_solid: bool) -> (bool, Vec<(f64, bool)>) {
    let search = Search {
        org: [0.0; 3],
        dir: [1.0, 0.0, 0.0],
        part,
        between: [f64::NEG_INFINITY, f64::INFINITY],
        is_solid,
    };
    let mut found = Vec::new();
    let first = changes(f, &search, &mut SearchScratch::default(), |change| {
        found.push((change.t, change.enters));
        ControlFlow::Continue(())
    });
    (first, found)
}

#[track_caller]
fn check(f: &Formula, part: [f64; 2], first: bool, expected: &[f64]) {
    let (below, found) = along_x(f, part, false);
    assert_eq!(below, first);
    assert_eq!(found.len(), expected.len(), "{found:?}");
    let mut inside = first;
    for ((t, enters), expected) in found.iter().zip(expected) {
        let error = (t - expected).abs();
        assert!(
            error <= 4.0 * f64::EPSILON * expected.abs().max(1e-3),
            "{t} {expected}"
        );
        inside = !inside;
        assert_eq!(*enters, inside);
    }
}

#[test]
fn sines_cross_at_multiples_of_pi() {
    let f = of_x(|b, x| b.unary(Unary::Sin, x));
    let expected: Vec<f64> = (-3..=3).map(|k| f64::from(k) * PI).collect();
    // f falls through 0 at odd ones; before −3π it is above zero.
    check(&f, [-10.0, 10.0], false, &expected);
}

#[test]
fn what_is_touched_is_not_crossed_and_near_pairs_are_two() {
    // sin x − 1 touches 0; sin x − (1 − 10^-9) crosses it twice, 9e-5 apart.
    let less = |c: f64| {
        of_x(|b, x| {
            let sine = b.unary(Unary::Sin, x);
            let c = b.constant(c);
            b.binary(Binary::Difference, sine, c)
        })
    };
    assert_eq!(along_x(&less(1.0), [0.0, 3.0], false), (true, vec![]));
    let (_, found) = along_x(&less(1.0 - 1e-9), [0.0, 3.0], false);
    let off = (2e-9_f64).sqrt();
    assert_eq!(found.len(), 2);
    for ((t, _), expected) in found.iter().zip([PI / 2.0 - off, PI / 2.0 + off]) {
        assert!((t - expected).abs() < 1e-9, "{t} {expected}");
    }
}

#[test]
fn poles_bound_solids_and_are_no_surface() {
    // 1/x is below zero before 0.
    let f = of_x(|b, x| {
        let one = b.constant(1.0);
        b.binary(Binary::Quotient, one, x)
    });
    assert_eq!(along_x(&f, [-1.0, 2.0], false), (true, vec![]));
    let (first, found) = along_x(&f, [-1.0, 2.0], true);
    assert!(first && found.len() == 1, "{found:?}");
    assert!(found[0].0.abs() < 1e-9 && !found[0].1, "{found:?}");
}

#[test]
fn where_there_is_no_value_there_is_nothing() {
    // √x − 2, from 0 on: below zero up to 4.
    let f = of_x(|b, x| {
        let root = b.unary(Unary::Sqrt, x);
        let two = b.constant(2.0);
        b.binary(Binary::Difference, root, two)
    });
    let (first, found) = along_x(&f, [-3.0, 9.0], true);
    assert!(!first && found.len() == 2, "{found:?}");
    assert!(
        found[0].0.abs() < 1e-8 && (found[1].0 - 4.0).abs() < 1e-15,
        "{found:?}"
    );
    let (_, surface) = along_x(&f, [-3.0, 9.0], false);
    assert_eq!(surface, found[1..]);
}

#[test]
fn what_is_made_of_no_value_has_none() {
    let none = Range::NONE;
    for function in ALL {
        assert!(none.unary(function).is_none(), "{function:?}");
    }
    let one = Range::constant(1.0);
    let both = [
        none.plus(one),
        one.times(none),
        none.over(one),
        one.min(none),
        none.power(3),
    ];
    assert!(both.iter().all(Range::is_none), "{both:?}");
    // √√x − 1/2 and ln of what is 0 before it is x.
    let f = of_x(|b, x| {
        let root = b.unary(Unary::Sqrt, x);
        let root = b.unary(Unary::Sqrt, root);
        let half = b.constant(0.5);
        b.binary(Binary::Difference, root, half)
    });
    let (_, found) = along_x(&f, [-1.0, 1.0], false);
    assert!(
        found.len() == 1 && (found[0].0 - 0.0625).abs() < 1e-15,
        "{found:?}"
    );
    let f = of_x(|b, x| {
        let zero = b.constant(0.0);
        let positive = b.binary(Binary::Max, x, zero);
        b.unary(Unary::Ln, positive)
    });
    let (first, found) = along_x(&f, [-1.0, 2.0], true);
    assert!(!first && found.len() == 2, "{found:?}");
    assert!(
        found[0].0.abs() < 1e-9 && (found[1].0 - 1.0).abs() < 1e-15,
        "{found:?}"
    );
}

#[test]
fn corners_are_crossed_like_all_else() {
    // min(|x − 1| − 1/2, |x + 1| − 1/4).
    let f = of_x(|b, x| {
        let one = b.constant(1.0);
        let part = |b: &mut Builder, operator, size| {
            let off = b.binary(operator, x, one);
            let off = b.unary(Unary::Abs, off);
            let size = b.constant(size);
            b.binary(Binary::Difference, off, size)
        };
        let right = part(b, Binary::Difference, 0.5);
        let left = part(b, Binary::Sum, 0.25);
        b.binary(Binary::Min, right, left)
    });
    check(&f, [-3.0, 3.0], false, &[-1.25, -0.75, 0.5, 1.5]);
}

#[test]
fn a_search_that_has_no_end_is_ended() {
    // sin(1/x) has a zero wherever one looks, near 0.
    let f = of_x(|b, x| {
        let one = b.constant(1.0);
        let inverse = b.binary(Binary::Quotient, one, x);
        b.unary(Unary::Sin, inverse)
    });
    let (_, found) = along_x(&f, [0.0, 1.0], false);
    // Zeros without end, of which the line's parts are far fewer.
    assert!(found.len() > 100 && found.len() < 25_000, "{}", found.len());
    assert!((found.last().unwrap().0 - 1.0 / PI).abs() < 1e-15);
    // What is behind is found in larger parts.
    let (_, found) = along_x(&f, [-1.0, 1.0], false);
    for k in 1..10 {
        let zero = 1.0 / (f64::from(k) * PI);
        let is_found = found.iter().any(|(t, _)| (t - zero).abs() < 1e-15);
        assert!(is_found, "{zero}");
    }
}

/// Among roundings, of which the ranges say nothing.
#[test]
fn a_search_begins_with_a_sign() {
    // Two roundings before sin x = ½.
    let f = of_x(|b, x| {
        let (sine, half) = (b.unary(Unary::Sin, x), b.constant(0.5));
        b.binary(Binary::Difference, sine, half)
    });
    let zero = PI / 6.0;
    let (first, found) = along_x(&f, [zero - 3.0 * f64::EPSILON, 1.0], false);
    assert!(first);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!((found[0].0 - zero).abs() < 1e-15 && !found[0].1);
    // From a zero on, which is at the beginning and not behind it.
    let f = of_x(|b, x| {
        let (square, zero) = (b.power(x, 2), b.constant(0.0));
        b.binary(Binary::Difference, zero, square)
    });
    assert_eq!(along_x(&f, [0.0, 1.0], false), (true, vec![]));
}

#[test]
fn a_search_sees_only_what_it_is_asked_about() {
    let f = of_x(|b, x| b.unary(Unary::Sin, x));
    let search = Search {
        org: [0.0; 3],
        dir: [1.0, 0.0, 0.0],
        part: [-10.0, 100.0],
        between: [4.0, 7.0],
        is_solid: false,
    };
    let mut found = Vec::new();
    changes(&f, &search, &mut SearchScratch::default(), |change| {
        found.push(change.t);
        ControlFlow::Continue(())
    });
    assert!(found.contains(&(2.0 * PI)));
    assert!(found.iter().all(|t| *t > 0.0 && *t < 20.0), "{found:?}");
    // The same number as by a look at all.
    let whole = Search {
        between: [f64::NEG_INFINITY, f64::INFINITY],
        ..search
    };
    let mut all = Vec::new();
    changes(&f, &whole, &mut SearchScratch::default(), |change| {
        all.push(change.t);
        ControlFlow::Continue(())
    });
    assert_eq!(all.len(), 35);
    assert!(found.iter().all(|t| all.contains(t)));
}

#[test]
fn bounds_are_found_where_there_are_some() {
    // A ball of radius 2 with a sine on it: x² + y² + z² + sin(7x)/10 − 4.
    let mut b = Builder::default();
    let mut sum = b.constant(-4.0);
    for axis in 0..3 {
        let x = b.coordinate(axis);
        let square = b.power(x, 2);
        sum = b.binary(Binary::Sum, sum, square);
    }
    let (seven, tenth) = (b.constant(7.0), b.constant(0.1));
    let x = b.coordinate(0);
    let wave = b.binary(Binary::Product, seven, x);
    let wave = b.unary(Unary::Sin, wave);
    let wave = b.binary(Binary::Product, tenth, wave);
    let ball = b.binary(Binary::Sum, sum, wave);
    let (bounds, is_outside) = bounds_of(&b.finish(ball)).unwrap();
    assert!(is_outside);
    assert!(bounds.max.min_element() >= 1.97 && bounds.min.max_element() <= -1.97);
    assert!(
        bounds.max.max_element() < 2.2 && bounds.min.min_element() > -2.2,
        "{bounds:?}"
    );
    let sine = of_x(|b, x| b.unary(Unary::Sin, x));
    assert!(bounds_of(&sine).is_none());
}

/// Some steps on three coordinates, each function on what may be anything.
fn formulas() -> impl Strategy<Value = Formula> {
    let step = (0_usize..22, 0_usize..100, 0_usize..100, -3.0..3.0);
    proptest::collection::vec(step, 1..14).prop_map(|steps| {
        let mut b = Builder::default();
        let mut all: Vec<u32> = (0..3).map(|axis| b.coordinate(axis)).collect();
        for (kind, i, j, constant) in steps {
            let (a, c) = (all[all.len() - 1 - i % all.len()], all[j % all.len()]);
            all.push(match kind {
                0..13 => b.unary(ALL[kind], a),
                13 => b.binary(Binary::Sum, a, c),
                14 => b.binary(Binary::Difference, a, c),
                15 => b.binary(Binary::Product, a, c),
                16 => b.binary(Binary::Quotient, a, c),
                17 => b.binary(Binary::Min, a, c),
                18 => b.binary(Binary::Max, a, c),
                19 => b.power(a, 2 + (j % 4) as u32),
                _ => {
                    let constant = b.constant(constant);
                    b.binary(Binary::Sum, a, constant)
                }
            });
        }
        let last = all[all.len() - 1];
        b.finish(last)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// What f64 makes of a point lies in what intervals make of a box around it; and so
    /// does the slope.
    #[test]
    fn intervals_hold_what_is_in_them(
        f in formulas(),
        at in [-4.0..4.0, -4.0..4.0, -4.0..4.0],
        size in -12.0..1.0,
        place in [0.0..1.0, 0.0..1.0, 0.0..1.0],
    ) {
        let at: [f64; 3] = at;
        let place: [f64; 3] = place;
        let width = f64::powf(10.0, size);
        let region = at.map(|x| Interval::new(x, x + width));
        let point = [0, 1, 2].map(|k| (at[k] + place[k] * width).min(region[k].high));
        let (value, slopes) = value_and_gradient(&f, point);
        let mut steps = f.values();
        f.evaluate::<f64>(&point, &mut steps);
        // Beyond f64 there is no telling.
        if steps.iter().any(|x| x.is_infinite()) {
            return Ok(());
        }
        let range = f.evaluate(&region.map(Range::new), &mut f.values());
        if value.is_nan() {
            prop_assert!(range.is_partial, "{range:?}");
            return Ok(());
        }
        prop_assert!(range.values.holds(value), "{range:?} {value}");
        let along = std::array::from_fn(|k| Dual::<Range, 3>::variable(Range::new(region[k]), k));
        let Dual { slopes: bounds, .. } = f.evaluate(&along, &mut f.values());
        for (slope, bound) in slopes.iter().zip(bounds) {
            let room = slope.abs() * 1e-9 + 1e-9;
            let Interval { low, high } = bound.values;
            let holds = low <= slope + room && slope - room <= high;
            prop_assert!(holds || !slope.is_finite() || range.is_partial, "{bound:?} {slope}");
        }
    }

    /// Slopes are what a small step says, where that says anything.
    #[test]
    fn slopes_are_those_of_small_steps(
        f in formulas(),
        at in [-2.0..2.0, -2.0..2.0, -2.0..2.0],
        axis in 0_usize..3,
    ) {
        let at: [f64; 3] = at;
        let (_, slopes) = value_and_gradient(&f, at);
        let mut steps = f.values();
        f.evaluate::<f64>(&at, &mut steps);
        // Roundings of large numbers outweigh small steps.
        if !steps.iter().all(|x| x.abs() < 1e3) {
            return Ok(());
        }
        let off = |step: f64| {
            let mut point = at;
            point[axis] += step;
            value_and_gradient(&f, point).0
        };
        let rate = |step: f64| (off(step) - off(-step)) / (2.0 * step);
        let [near, far] = [1e-6, 2e-6].map(rate);
        let is_smooth = (near - far).abs() <= 1e-5 * near.abs().max(1.0);
        if is_smooth && slopes[axis].is_finite() && near.is_finite() {
            let error = (slopes[axis] - near).abs();
            prop_assert!(error <= 1e-3 * near.abs().max(1.0), "{} {near}", slopes[axis]);
        }
    }
}

/// Of x alone, about a place on the x axis: whether the border there faces along the axis.
#[track_caller]
fn faces_along_x(f: &Formula, x: f64) -> Option<bool> {
    let line = ([x - 3.0, 0.25, 0.5], [1.0, 0.0, 0.0]);
    let there = border(f, line, 3.0, 1e-8)?;
    assert!((there.t - 3.0).abs() < 1e-14, "{}", there.t);
    assert_eq!(there.normal[1..], [0.0, 0.0]);
    Some(there.normal[0] > 0.0)
}

#[test]
fn where_a_function_ends_or_jumps_it_has_a_border() {
    use Binary::{Difference, Max, Quotient};
    let less = |b: &mut Builder, a: u32, c: f64| {
        let c = b.constant(c);
        b.binary(Difference, a, c)
    };
    let one_over = |b: &mut Builder, x: u32| {
        let one = b.constant(1.0);
        b.binary(Quotient, one, x)
    };
    let unary = |function: Unary, c: f64| {
        of_x(|b, x| {
            let value = b.unary(function, x);
            less(b, value, c)
        })
    };
    // What is below them lies on the side that has values.
    for (function, c, x, along) in [
        (Unary::Sqrt, 1.0, 0.0, false),
        (Unary::Ln, 1.0, 0.0, false),
        (Unary::Asin, 1.0, -1.0, false),
        (Unary::Asin, 2.0, 1.0, true),
        (Unary::Acos, 4.0, 1.0, true),
        (Unary::Acos, 4.0, -1.0, false),
    ] {
        let found = faces_along_x(&unary(function, c), x);
        assert_eq!(found, Some(along), "{function:?} {x}");
    }
    // f is below zero before a pole of 1/x, and behind one of −1/x and of the tangent.
    let pole = of_x(|b, x| one_over(b, x));
    assert_eq!(faces_along_x(&pole, 0.0), Some(true));
    let other = of_x(|b, x| {
        let (minus, pole) = (b.constant(-1.0), one_over(b, x));
        b.binary(Binary::Product, minus, pole)
    });
    assert_eq!(faces_along_x(&other, 0.0), Some(false));
    assert_eq!(
        faces_along_x(&unary(Unary::Tan, 0.0), PI / 2.0),
        Some(false)
    );
    // Jumps.
    let cut = of_x(|b, x| {
        let (pole, least) = (one_over(b, x), b.constant(-1.0));
        b.binary(Max, pole, least)
    });
    assert_eq!(faces_along_x(&cut, 0.0), Some(true));
    let steep = of_x(|b, x| {
        let pole = one_over(b, x);
        let power = b.unary(Unary::Exp, pole);
        less(b, power, 2.0)
    });
    assert_eq!(faces_along_x(&steep, 0.0), Some(true));
    // Where f is zero there is none: with a slope, a kink, none, or a pole farther away.
    let kink = of_x(|b, x| {
        let (twice, size) = (b.binary(Binary::Sum, x, x), b.unary(Unary::Abs, x));
        b.binary(Binary::Sum, twice, size)
    });
    let cube = of_x(|b, x| {
        let sine = b.unary(Unary::Sin, x);
        b.power(sine, 3)
    });
    for f in [&unary(Unary::Sin, 0.0), &kink, &cube] {
        assert_eq!(faces_along_x(f, 0.0), None);
    }
    assert_eq!(faces_along_x(&unary(Unary::Tan, 0.0), 0.0), None);
    assert_eq!(faces_along_x(&unary(Unary::Sqrt, 1.0), 1.0), None);
}
