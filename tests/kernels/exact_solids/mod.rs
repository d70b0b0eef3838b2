//! Compares exact decisions about every primitive but the triangle with integers of any
//! length: the first hit beyond t_min, and the order of hits. Rays are tangent, run along
//! sides and edges, pass through corners and apexes, and begin on surfaces or far away;
//! numbers come from the ends of the formats, too.

mod bounds;
mod cases;
mod touching;
mod truth;

use crate::common::{Random, campaign};
use crate::number::Exact;
use cases::{Case, KINDS, LATTICES, SORTS, Shape, case, power, shape};
use glam::DVec3;
use lanecast::internals::geom::Scratch;
use lanecast::internals::geom::exact::{Crossing, Line, Root, first_beyond};
use lanecast::internals::geom::triangle::exact::{Pair, meet_exact};
use lanecast::internals::geom::{Cone, Ellipsoid, HalfSpace, Quadric, Sphere};
use rayon::prelude::*;
use truth::{Truth, facet};

/// What a run has seen.
#[derive(Default, Debug)]
struct Seen {
    /// By kind and by sort.
    kinds: [usize; KINDS],
    sorts: [usize; SORTS],
    /// Hits with an exact twin: tangents, edges, corners.
    twins: [usize; KINDS],
    misses: usize,
    /// Pairs of crossings, by their order; and with a triangle.
    orders: [usize; 3],
    facets: [usize; 3],
    /// Crossings that f64 knows to 10 units in the last place, and to a part in
    /// 10^6, of those that are met.
    known: [usize; 2],
    met: usize,
    /// The error of what f64 knows of t, over its bound, at worst: by kind.
    tightness: [f64; KINDS],
}

fn first(case: &Case, t_min: f64) -> Option<Root<'_>> {
    first_beyond(
        &case.shape.solid(),
        &case.line,
        t_min,
        &mut Scratch::default(),
    )
}

/// Everything that can be asked about one t_min.
fn check_at<'a>(case: &'a Case, truth: &Truth, t_min: f64) -> Option<(Root<'a>, truth::Root)> {
    let (met, exact) = (first(case, t_min), truth.first(t_min));
    assert_eq!(met.is_some(), exact.is_some(), "{case:?} beyond {t_min:e}");
    let (met, exact) = (met?, exact?);
    let t = met.rounded();
    assert!(exact.rounds_to(t), "{case:?} beyond {t_min:e}: {t:e}");
    let (value, error) = (met.t.value, met.t.error);
    if value.is_finite() && error.is_finite() {
        let (value, error) = (Exact::from(value), Exact::from(error));
        let within = exact.order_with(&(&value + &error)).is_le()
            && exact.order_with(&(&value - &error)).is_ge();
        assert!(within, "{case:?} beyond {t_min:e}: {:?}", met.t);
    }
    assert!(met.order_with(f64::INFINITY).is_lt(), "{case:?}");
    assert!(met.order_with(f64::NAN).is_lt(), "{case:?}");
    assert!(met.order_with(f64::NEG_INFINITY).is_gt(), "{case:?}");
    for x in [t, t.next_up(), t.next_down(), 0.0, 1.0] {
        if x.is_finite() {
            let order = exact.order_with(&Exact::from(x));
            assert_eq!(met.order_with(x), order, "{case:?} at {x:e}");
        }
    }
    Some((met, exact.clone()))
}

/// The error of f64's t over its bound, if that is more than `least`.
fn tightness(root: &Root, exact: &truth::Root, least: f64) -> f64 {
    let (value, error) = (root.t.value, root.t.error);
    if !(value.is_finite() && error.is_finite()) {
        return least;
    }
    let (value, error) = (Exact::from(value), Exact::from(error));
    let within = |share: f64| {
        let error = &error * &Exact::from(share);
        exact.order_with(&(&value + &error)).is_le() && exact.order_with(&(&value - &error)).is_ge()
    };
    if within(least) {
        return least;
    }
    let (mut less, mut more) = (least, 1.0);
    while more - less > 1e-3 {
        let middle = (less + more) * 0.5;
        match within(middle) {
            true => more = middle,
            false => less = middle,
        }
    }
    more
}

/// The first crossing, and those that follow it.
fn check(case: &Case) -> (Truth, Vec<(Root<'_>, truth::Root)>) {
    let truth = Truth::of(case);
    let mut all = Vec::new();
    let mut t_min = f64::NEG_INFINITY;
    while let Some((root, exact)) = check_at(case, &truth, t_min) {
        let t = root.rounded();
        if !t.is_finite() || all.len() == 2 {
            break;
        }
        // Just before it, it is still the first.
        let before = first(case, t.next_down().next_down()).expect("it is met");
        assert!(before.order(&root).is_le(), "{case:?}");
        all.push((root, exact));
        t_min = t.next_up();
    }
    check_at(case, &truth, 0.0);
    (truth, all)
}

/// Other shapes that the same ray meets near by, or at the very place.
fn relatives(random: &mut Random, case: &Case, t: f64) -> Vec<Case> {
    let Line { org, dir } = case.line;
    let with = |shape| Case {
        line: case.line,
        shape,
    };
    let mut relatives = vec![case.clone()];
    let scale = power(random, 20);
    let scaled = case.scaled(scale);
    if scaled.is_finite() {
        relatives.push(scaled);
    }
    // One number moved by a unit in its last place.
    let mut at = random.below(8);
    let nudged = case.shape.map(&mut |x| {
        at = at.wrapping_sub(1);
        if at == u64::MAX { x.next_up() } else { x }
    });
    relatives.push(with(nudged));
    // A plane, a sphere and anything else through what is nearly the same point.
    let point = DVec3::from_array(std::array::from_fn(|k| org[k] + t * dir[k]));
    let normal = DVec3::new(random.unit(), 1.0, 0.25);
    let offset = normal.dot(point);
    relatives.push(with(Shape::HalfSpace(HalfSpace { normal, offset })));
    let radius = 0.5 * DVec3::from_array(dir).length();
    let center = point + DVec3::from_array(dir) * 0.5;
    relatives.push(with(Shape::Sphere(Sphere { center, radius })));
    if let Shape::Sphere(row) = &case.shape {
        let radius = row.radius + random.below(2) as f64 * f64::EPSILON;
        relatives.push(with(Shape::Sphere(Sphere { radius, ..*row })));
    }
    let kind = random.below(KINDS as u64) as usize;
    relatives.push(with(shape(random, kind, 3)));
    relatives.retain(|c| c.is_finite());
    relatives
}

fn check_orders(case: &Case, ours: &[(Root, truth::Root)], other: &Case, seen: &mut Seen) {
    let (_, theirs) = check(other);
    for (a, exact) in ours {
        for (b, other_exact) in &theirs {
            let order = exact.order(other_exact);
            assert_eq!(a.order(b), order, "{case:?}, {other:?}");
            assert_eq!(b.order(a), order.reverse(), "{case:?}, {other:?}");
            let [a, b] = [a, b].map(|root| Crossing::Root(*root));
            assert_eq!(a.order(&b), order);
            seen.orders[(order as i8 + 1) as usize] += 1;
        }
    }
}

/// A triangle that the ray meets near the first crossing, or exactly there.
fn check_facet(
    random: &mut Random,
    case: &Case,
    root: &Root,
    exact: &truth::Root,
    seen: &mut Seen,
) {
    let Line { org, dir } = case.line;
    let t = root.rounded();
    let point: [f64; 3] = std::array::from_fn(|k| org[k] + t * dir[k]);
    let mut corner = || {
        let part = random.below(9) as f64 * 0.25 - 1.0;
        let other: [f64; 3] = std::array::from_fn(|k| point[k] + part + random.unit());
        other.map(|x| x as f32)
    };
    let corners = [point.map(|x| x as f32), corner(), corner()];
    if corners.as_flattened().iter().any(|x| !x.is_finite()) {
        return;
    }
    let pair = Pair { org, dir, corners };
    let Some(crossing) = meet_exact(&pair) else {
        return;
    };
    let order = exact.order(&facet(&case.line, &corners));
    let (ours, theirs) = (Crossing::Root(*root), Crossing::Triangle(crossing));
    assert_eq!(ours.order(&theirs), order, "{case:?}, {pair:?}");
    assert_eq!(theirs.order(&ours), order.reverse(), "{case:?}, {pair:?}");
    seen.facets[(order as i8 + 1) as usize] += 1;
}

fn check_cases(count: usize, seed: u64) -> Seen {
    let random = &mut Random(seed);
    let mut seen = Seen::default();
    let mut before: Option<Case> = None;
    for i in 0..count {
        let (kind, sort) = (i % KINDS, i / KINDS % SORTS);
        let case = case(random, kind, sort);
        if !case.is_finite() {
            assert!(first(&case, f64::NEG_INFINITY).is_none(), "{case:?}");
            continue;
        }
        let (truth, all) = check(&case);
        let Some((root, exact)) = all.first() else {
            seen.misses += 1;
            continue;
        };
        seen.kinds[kind] += 1;
        seen.sorts[sort] += 1;
        seen.twins[kind] += usize::from(truth.twins);
        for (root, exact) in &all {
            seen.tightness[kind] = tightness(root, exact, seen.tightness[kind]);
            let part = root.t.error / root.t.value.abs();
            seen.known[0] += usize::from(part <= 10.0 * f64::EPSILON);
            seen.known[1] += usize::from(part <= 1e-6);
            seen.met += 1;
        }
        let t = root.rounded();
        let relatives = relatives(random, &case, t);
        for other in relatives.iter().chain(&before) {
            check_orders(&case, &all, other, &mut seen);
        }
        // Where squares leave the format f64 knows nothing, and every step is
        // left to exact numbers.
        if LATTICES.contains(&sort) {
            let by = 2.0_f64.powi([520, -520][random.below(2) as usize]);
            let case = case.scaled(by);
            let (_, all) = check(&case);
            for other in &relatives {
                check_orders(&case, &all, &other.scaled(by), &mut seen);
            }
        }
        check_facet(random, &case, root, exact, &mut seen);
        before = Some(case);
    }
    seen
}

#[test]
fn solids_are_met_as_in_exact_arithmetic() {
    let count = campaign(20_000);
    let seen = check_cases(count, 1);
    println!("{seen:?}");
    assert!(seen.kinds.iter().all(|n| *n > count * 3 / 200), "{seen:?}");
    assert!(seen.sorts.iter().all(|n| *n > count * 3 / 200), "{seen:?}");
    // A half-space has no twins.
    assert!(seen.twins[1..].iter().all(|n| *n > count / 800), "{seen:?}");
    assert!(seen.orders.iter().all(|n| *n > count / 4), "{seen:?}");
    assert!(seen.facets.iter().all(|n| *n > count / 400), "{seen:?}");
}

#[test]
#[ignore = "ten million cases, in many minutes; prints what they were"]
fn solids_are_met_as_in_exact_arithmetic_ten_million_times() {
    let count = campaign(10_000_000);
    // Each part of them by its own seed, on all threads.
    const PARTS: u64 = 32;
    (0..PARTS).into_par_iter().for_each(|part| {
        let seen = check_cases(count.div_ceil(PARTS as usize), part + 2);
        println!("part {part}: {seen:?}");
    });
}

#[test]
fn ties_go_to_even() {
    let odd = (1_u64 << 53) as f64;
    for (offset, org, t) in [
        (odd, -1.0, odd),
        (odd, -3.0, odd + 4.0),
        (-odd, 1.0, -odd),
        (-odd, 3.0, -odd - 4.0),
        (f64::from_bits(3), 0.0, f64::from_bits(2)),
        (f64::from_bits(1), 0.0, 0.0),
    ] {
        // Halved once more where it has no other half.
        let speed = if offset.abs() < 1.0 { 2.0 } else { 1.0 };
        let line = Line {
            org: [org, 0.0, 0.0],
            dir: [speed, 0.0, 0.0],
        };
        let normal = DVec3::X;
        let shape = Shape::HalfSpace(HalfSpace { normal, offset });
        let case = Case { line, shape };
        let root = first(&case, f64::NEG_INFINITY).expect("it is met");
        assert_eq!(root.rounded(), t, "{offset:e} from {org}");
    }
}

/// Numbers from both ends of the format in every coordinate, so that all sums and
/// products are as long as they can be.
#[test]
fn numbers_from_both_ends_of_the_format_find_room() {
    let random = &mut Random(3);
    let mut met = 0;
    let mut before: Option<Vec<(Root, truth::Root)>> = None;
    for i in 0..600 {
        // Mantissas without zeros at their ends.
        let mut end = |large: bool| {
            let m = 1.0 + random.unit().abs() + f64::EPSILON;
            if large {
                m * 2.0_f64.powi(1021)
            } else {
                m * 1e-300 * 1e-20
            }
        };
        let vector = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let small = vector(end(false), end(false), end(false));
        let large = vector(end(true), end(true), end(true));
        let shape = match i % 4 {
            3 => Shape::Quadric(Quadric {
                coefficients: std::array::from_fn(
                    |k| if k % 2 == 0 { 1.0 } else { -1.0 } * end(k % 3 == 0),
                ),
            }),
            0 => Shape::Ellipsoid(Ellipsoid {
                center: small,
                radii: vector(end(true), end(false), end(true)),
            }),
            1 => Shape::Cone(Cone {
                base: small,
                top: large,
                base_radius: end(false),
                top_radius: end(true),
                open: i % 2 == 0,
            }),
            _ => Shape::Cone(Cone {
                base: small,
                top: vector(end(true), end(false), end(false)),
                base_radius: end(true),
                top_radius: end(false),
                open: i % 2 == 0,
            }),
        };
        // From the far end towards the near one, or across.
        let across = vector(end(true), end(false), end(false));
        let line = Line {
            org: (if i % 5 == 0 { across } else { large }).to_array(),
            dir: if i % 2 == 0 { -large } else { -across }.to_array(),
        };
        // For as long as the next one is compared with it.
        let case: &'static Case = Box::leak(Box::new(Case { line, shape }));
        let (_, all) = check(case);
        met += usize::from(!all.is_empty());
        if let Some(theirs) = &before {
            for ((a, exact), (b, other)) in all.iter().zip(theirs) {
                assert_eq!(a.order(b), exact.order(other), "{case:?}");
            }
        }
        if !all.is_empty() {
            before = Some(all);
        }
    }
    println!("{met} of 600 are met");
    assert!(met > 200, "{met}");
}
