//! Compares exact predicates about a ray and a triangle with integers of any length: rays
//! aimed at edges, corners and planes, triangles without area, and numbers from the ends of
//! the formats.

mod cases;
mod truth;

use crate::common::{Random, campaign};
use crate::number::Exact;
use cases::{PLANE, SORTS, case};
use lanecast::internals::geom::triangle::exact::{Pair, edge_functions, meet_exact};
use lanecast::internals::math::int::Grid;
use truth::Truth;

fn fits<const N: usize>(case: &Pair) -> bool {
    let corners = case.corners.map(|c| c.map(f64::from));
    let grid = Grid::<N>::over(&corners).and(Grid::over(&[case.org]));
    let placed = grid.place(&corners).is_some() && grid.place(&[case.org]).is_some();
    placed && Grid::<N>::over(&[case.dir]).place(&[case.dir]).is_some()
}

/// The least size of integer that holds all of the case: an index into 1, 2, 4
/// and 33 limbs.
fn size_of(case: &Pair) -> usize {
    let fits = [fits::<1>, fits::<2>, fits::<4>, fits::<33>].map(|fits| fits(case));
    fits.iter().position(|f| *f).expect("33 limbs hold all")
}

/// What a run has seen.
#[derive(Default, Debug)]
struct Seen {
    hits: [usize; SORTS],
    /// Cases with an edge function that is exactly zero, and hits among them.
    zeros: usize,
    hit_zeros: usize,
    /// By size of integer.
    sizes: [usize; 4],
    /// Pairs of hits, by their order.
    orders: [usize; 3],
    /// Errors in millionths of their bounds, at worst: edge functions, t.
    tightness: [u64; 2],
    /// Edge functions that f64 leaves open, of all that are not zero.
    open: usize,
    edges: usize,
}

/// Everything that can be asked about a case.
fn check(case: &Pair, seen: &mut Seen, sort: usize) -> Option<Truth> {
    let truth = Truth::of(case);
    let zero = truth.edges.iter().any(|e| e.integer == 0.into());
    seen.zeros += usize::from(zero);
    seen.sizes[size_of(case)] += 1;
    let edges = edge_functions(case);
    for (edge, exact) in edges.iter().zip(&truth.edges) {
        let order = exact.integer.cmp(&0.into());
        let certain = edge.sign().is_none_or(|s| s == order);
        assert!(certain, "{case:?}: {edge:?} has the sign {order:?}");
        seen.edges += usize::from(order.is_ne());
        seen.open += usize::from(order.is_ne() && edge.sign().is_none());
        if edge.value.is_finite() && edge.error.is_finite() {
            let error = (exact - &edge.value.into()).abs();
            let bound = Exact::from(edge.error);
            assert!(error.order(&bound).is_le(), "{case:?}: {edge:?}");
            seen.tightness[0] = seen.tightness[0].max(error.millionths_of(&bound));
        }
    }
    let met = meet_exact(case);
    assert_eq!(met.is_some(), truth.hit, "{case:?}");
    let crossing = met?;
    seen.hits[sort] += 1;
    seen.hit_zeros += usize::from(zero);

    let t = crossing.rounded();
    assert!(truth.rounds_to(t), "{case:?}: {t:e}");
    if crossing.t.value.is_finite() && crossing.t.error.is_finite() {
        let (error, bound) = truth.distance(crossing.t.value, crossing.t.error);
        assert!(error.order(&bound).is_le(), "{case:?}: {:?}", crossing.t);
        seen.tightness[1] = seen.tightness[1].max(error.millionths_of(&bound));
    }
    assert!(crossing.order_with(f64::INFINITY).is_lt(), "{case:?}");
    assert!(crossing.order_with(f64::NAN).is_lt(), "{case:?}");
    assert!(crossing.order_with(f64::NEG_INFINITY).is_gt(), "{case:?}");
    for x in [
        t,
        t.next_up(),
        t.next_down(),
        0.0,
        -0.0,
        1.0,
        f64::MAX,
        5e-324,
    ] {
        if x.is_finite() {
            let order = truth.order_with(&x.into());
            assert_eq!(crossing.order_with(x), order, "{case:?} at {x:e}");
        }
    }
    Some(truth)
}

/// Orders of two hits, both ways.
fn check_order(a: (&Pair, &Truth), b: (&Pair, &Truth), seen: &mut Seen) {
    let order = a.1.order(b.1);
    let met = |case| meet_exact(case).expect("was met before");
    let (s, t) = (met(a.0), met(b.0));
    assert_eq!(s.order(&t), order, "{:?}, {:?}", a.0, b.0);
    assert_eq!(t.order(&s), order.reverse(), "{:?}, {:?}", a.0, b.0);
    let (s, t) = (s.rounded(), t.rounded());
    let rounded = s.partial_cmp(&t).expect("t is a number");
    let fine = rounded == order || rounded.is_eq();
    assert!(fine, "{:?}, {:?}: {s:e}, {t:e}", a.0, b.0);
    seen.orders[(order as i8 + 1) as usize] += 1;
}

/// The same ray in other spaces, and other triangles on the same edge: cases
/// whose t are equal, or nearly so; and a triangle met at a corner elsewhere.
fn relatives(random: &mut Random, case: &Pair) -> [Pair; 5] {
    let [a, b, c] = case.corners;
    let neighbour = Pair {
        corners: [b, a, c.map(|_| (random.unit() * 2.0) as f32)],
        ..*case
    };
    let k = random.below(3) as usize;
    let turned = Pair {
        corners: [
            case.corners[k],
            case.corners[(k + 2) % 3],
            case.corners[(k + 1) % 3],
        ],
        ..*case
    };
    let scale = 2.0_f64.powi(random.below(41) as i32 - 20);
    let scaled = Pair {
        org: case.org.map(|x| x * scale),
        dir: case.dir.map(|x| x * scale),
        corners: case.corners.map(|c| c.map(|x| x * scale as f32)),
    };
    let mut nudged = *case;
    nudged.org[k] = nudged.org[k].next_up();
    let mut corner = || std::array::from_fn(|_| random.unit() as f32);
    let elsewhere = Pair {
        corners: [
            std::array::from_fn(|k| (case.org[k] + 4.0 * case.dir[k]) as f32),
            corner(),
            corner(),
        ],
        ..*case
    };
    [neighbour, turned, scaled, nudged, elsewhere]
}

fn check_cases(count: usize, seed: u64) -> Seen {
    let random = &mut Random(seed);
    let mut seen = Seen::default();
    let mut before: Option<(Pair, Truth)> = None;
    let finite = |c: &Pair| {
        let ray = c.org.iter().chain(&c.dir).all(|x| x.is_finite());
        ray && c.corners.as_flattened().iter().all(|x| x.is_finite())
    };
    for i in 0..count {
        let sort = i % SORTS;
        let case = case(random, sort);
        if !finite(&case) {
            assert!(meet_exact(&case).is_none(), "{case:?}");
            continue;
        }
        let Some(truth) = check(&case, &mut seen, sort) else {
            continue;
        };
        let relatives = relatives(random, &case);
        for relative in relatives.iter().filter(|c| finite(c)) {
            if let Some(other) = check(relative, &mut seen, sort) {
                check_order((&case, &truth), (relative, &other), &mut seen);
            }
        }
        if let Some((before, other)) = &before {
            check_order((&case, &truth), (before, other), &mut seen);
        }
        before = Some((case, truth));
    }
    seen
}

#[test]
fn answers_are_those_of_exact_arithmetic() {
    let count = campaign(100_000);
    let seen = check_cases(count, 1);
    println!("{seen:?}");
    // In a triangle's plane nothing is met.
    let met = |sort: usize| seen.hits[sort] > count / 100;
    assert!(
        (0..SORTS).all(|sort| met(sort) == (sort != PLANE)),
        "{seen:?}"
    );
    assert!(
        seen.zeros > count / 5 && seen.hit_zeros > count / 10,
        "{seen:?}"
    );
    assert!(seen.sizes.iter().all(|n| *n > count / 100), "{seen:?}");
    assert!(seen.orders.iter().all(|n| *n > count / 20), "{seen:?}");
}

#[test]
#[ignore = "ten million cases, in some minutes; prints what they were"]
fn answers_are_those_of_exact_arithmetic_ten_million_times() {
    println!("{:?}", check_cases(campaign(10_000_000), 2));
}
