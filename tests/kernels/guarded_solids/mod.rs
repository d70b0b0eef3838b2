//! Compares guarded kernels with polynomials in integers of any length: no lane is certain of
//! something false, and t of a certain hit lies between its stated bounds.

mod cases;
mod truth;

use crate::common::{Random, campaign};
use cases::{Case, KINDS, Kind, NAMES, subject};
use glam::DVec3;
use lanecast::internals::geom::guarded::{
    ObjectRay, cone, cuboid, half_space, polygon, quadric, sphere,
};
use lanecast::internals::geom::{Cone, Meet, Polygon, Ray, triangle};
use lanecast::internals::math::Vec3;
use lanecast::internals::math::lanes::{Lanes, Mask, Register, Scalar, f64x8};
use truth::Truth;

fn meet<L: Lanes>(kind: &Kind, object: &ObjectRay<L>) -> Meet<L> {
    let all = L::Mask::splat(true);
    match kind {
        Kind::Sphere(row) => sphere::meet_sphere(row, object, all),
        Kind::Ellipsoid(row) => sphere::meet_ellipsoid(row, object, all),
        Kind::Cone(row) if row.base_radius == row.top_radius => {
            let row = row.upright();
            let meet = cone::meet_cylinder(&row, object, all);
            let general = cone::meet(&row, object, all);
            let bits = |x: L| (0..L::COUNT).map(|i| x.lane(i).bits()).collect::<Vec<_>>();
            let hits = |x: L| bits(L::select(meet.hit, x, L::zero()));
            assert_eq!(meet.hit.bits(), general.hit.bits(), "{row:?}");
            assert_eq!(meet.unsure.bits(), general.unsure.bits(), "{row:?}");
            assert_eq!(hits(meet.t), hits(general.t), "{row:?}");
            if !row.open {
                let ends = cone::cylinder_ends(&row, object);
                let general = cone::ends(&row, object);
                assert_eq!(ends.some.bits(), general.some.bits(), "{row:?}");
                assert_eq!(ends.none.bits(), general.none.bits(), "{row:?}");
                let some = |x: L| bits(L::select(ends.some, x, L::zero()));
                let both = ends.enter.into_iter().chain(ends.exit);
                for (x, y) in both.zip(general.enter.into_iter().chain(general.exit)) {
                    assert_eq!(some(x), some(y), "{row:?}");
                }
            }
            meet
        }
        Kind::Cone(row) => cone::meet(&row.upright(), object, all),
        Kind::Cuboid(row) => cuboid::meet(row, object, all),
        Kind::HalfSpace(row) => half_space::meet(row, object, all),
        Kind::Polyhedron(planes, corner) => {
            half_space::meet_polyhedron(planes, *corner, object, all)
        }
        Kind::Polygon(points, normal) => {
            let normal = *normal;
            let from = |p: &glam::DVec3| (*p - points[0]).abs().max_element() as f32;
            let extent = points.iter().map(from).fold(0.0, f32::max) * 2.0;
            let row = &Polygon { points, normal };
            let first = polygon::meet(row, extent, object, all);
            let open = first.unsure;
            let again = polygon::meet_again(row, extent, object, open);
            let of = |again: L, first: L| L::select(open, again, first);
            Meet {
                hit: first.hit | again.hit,
                t: of(again.t, first.t),
                within: [0, 1].map(|side| of(again.within[side], first.within[side])),
                unsure: again.unsure,
            }
        }
        Kind::Quadric(row) => quadric::meet(row, object, all),
        Kind::Triangle(corners) => {
            // Its t is that of the plane, whatever the interval.
            let meet = triangle::meet_guarded(corners, object.ray, all);
            let t = (meet.within[0] + meet.within[1]) * L::from_f32(0.5);
            Meet { t, ..meet }
        }
    }
}

/// What one lane says.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Answer {
    /// t, from, to.
    Hit([f64; 3]),
    Miss,
    Unsure,
}

/// Every lane's answer.
fn answers<L: Lanes>(cases: &[Case]) -> Vec<Answer> {
    let double = |f: &dyn Fn(&Case) -> f64| {
        let mut lanes = <L::Double as Lanes>::zero().to_array();
        for (lane, case) in lanes.as_mut().iter_mut().zip(cases) {
            *lane = f(case);
        }
        <L::Double as Lanes>::load(lanes.as_ref())
    };
    let vector = |f: fn(&Case) -> &[f64; 3]| {
        Vec3::new(
            double(&|case| f(case)[0]),
            double(&|case| f(case)[1]),
            double(&|case| f(case)[2]),
        )
    };
    let (org, dir) = (vector(|case| &case.org), vector(|case| &case.dir));
    let narrow = |v: Vec3<L::Double>| Vec3::new(L::narrow(v.x), L::narrow(v.y), L::narrow(v.z));
    let t_min = L::narrow(double(&|case| f64::from(case.t_min)));
    let ray = &Ray::new(narrow(org), narrow(dir), t_min);
    let object = ObjectRay::new(&org, &dir, ray);
    let met = meet(&cases[0].kind, &object);
    let lane = |i: usize| {
        let number = |x: L| x.lane(i).to_f64();
        let [hit, unsure] = [met.hit, met.unsure].map(|mask| mask.bits() >> i & 1 != 0);
        match (hit, unsure) {
            (true, false) => Answer::Hit([met.t, met.within[0], met.within[1]].map(number)),
            (false, true) => Answer::Unsure,
            (false, false) => Answer::Miss,
            (true, true) => panic!("sure and unsure"),
        }
    };
    (0..cases.len()).map(lane).collect()
}

/// What a run has seen of one kind in one type.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    hits: usize,
    misses: usize,
    unsure: usize,
    /// The error of t over what `within` allows on its wider side, at worst.
    tightness: f64,
}

fn check(case: &Case, truth: &Truth, answer: Answer, seen: &mut Seen) {
    match answer {
        Answer::Unsure => seen.unsure += 1,
        Answer::Miss => {
            seen.misses += 1;
            let first = truth.first(f64::from(case.t_min));
            assert!(first.is_none(), "certain miss: {case:?}, {first:?}");
        }
        Answer::Hit([t, from, to]) => {
            seen.hits += 1;
            assert!(from <= t && t <= to, "{case:?}, {answer:?}");
            let first = truth.first(f64::from(case.t_min));
            let Some(first) = first else {
                panic!("certain hit: {case:?}, {answer:?}");
            };
            let lies = |low: f64, high: f64| {
                truth.order(&first, &low.into()).is_ge()
                    && truth.order(&first, &high.into()).is_le()
            };
            assert!(lies(from, to), "{case:?}: {first:?} is not in {answer:?}");
            let most = (t - from).max(to - t);
            let within = |share: f64| lies(t - most * share, t + most * share);
            if !within(seen.tightness) {
                let (mut less, mut more) = (seen.tightness, 1.0);
                while more - less > 1e-3 {
                    let middle = (less + more) * 0.5;
                    match within(middle) {
                        true => more = middle,
                        false => less = middle,
                    }
                }
                seen.tightness = more;
            }
        }
    }
}

fn is_finite(case: &Case) -> bool {
    case.org.iter().chain(&case.dir).all(|x| x.is_finite())
}

/// Some rays before one primitive, in one type, alone and in lanes `W`.
fn check_in<W: Lanes, One: Lanes>(cases: &[Case], truths: &[Option<Truth>], seen: &mut Seen) {
    let groups = cases.chunks(W::COUNT).zip(truths.chunks(W::COUNT));
    for (group, truths) in groups {
        let together = answers::<W>(group);
        for ((case, truth), together) in group.iter().zip(truths).zip(together) {
            let answer = answers::<One>(std::slice::from_ref(case))[0];
            assert_eq!(answer, together, "in lanes: {case:?}");
            match truth {
                Some(truth) => check(case, truth, answer, seen),
                None => assert!(!matches!(answer, Answer::Hit(_)), "{case:?}"),
            }
        }
    }
}

/// In both types.
fn check_all(cases: &[Case], [single, double]: &mut [Seen; 2]) {
    let truth = |case: &Case| is_finite(case).then(|| Truth::of(case));
    let truths: Vec<Option<Truth>> = cases.iter().map(truth).collect();
    check_in::<Register, f32>(cases, &truths, single);
    check_in::<f64x8, f64>(cases, &truths, double);
}

fn check_cases(count: usize, seed: u64) -> [[Seen; 2]; KINDS] {
    let mut seen = [[Seen::default(); 2]; KINDS];
    for (kind, seen) in seen.iter_mut().enumerate() {
        let random = &mut Random(seed + ((kind as u64) << 32));
        for _ in 0..count / 16 {
            let subject = subject(random, kind, false);
            let cases: Vec<Case> = (0..16).map(|_| subject.hard_ray(random)).collect();
            check_all(&cases, seen);
        }
        for (ty, seen) in ["f32", "f64"].iter().zip(seen) {
            println!("{:14} {ty} {seen:?}", NAMES[kind]);
        }
    }
    seen
}

#[test]
fn certain_answers_are_those_of_exact_arithmetic() {
    let count = campaign(8_000);
    let seen = check_cases(count, 1);
    for (kind, seen) in seen.iter().enumerate() {
        for seen in seen {
            let some = [seen.hits, seen.misses, seen.unsure]
                .iter()
                .all(|n| *n > count / 200);
            assert!(some, "{}: {seen:?}", NAMES[kind]);
        }
    }
}

#[test]
#[ignore = "a million hard rays of each kind; prints how tight the bounds are"]
fn certain_answers_are_those_of_exact_arithmetic_ten_million_times() {
    check_cases(campaign(1_000_000), 2);
}

/// A ray by a cone's apex: the bounds of a root once left out how fast the error of
/// the side's polynomial may grow beside it.
#[test]
fn a_ray_that_passes_the_apex_of_a_cone() {
    let case = Case {
        kind: Kind::Cone(Cone {
            base: DVec3::new(59.11357004898588, 818.5844518114908, -472.4367860121525),
            top: DVec3::new(58.871485600005656, 818.7200804867608, -472.41554035293615),
            base_radius: 0.4782310957634629,
            top_radius: 0.0,
            open: false,
        }),
        org: [59.0567450815872, 818.7464886886545, -472.69632241690425],
        dir: [
            -1.8471949128799817e-7,
            -2.633122784316368e-8,
            2.799636465362356e-7,
        ],
        t_min: 0.0,
    };
    check_all(&[case], &mut Default::default());
}

/// Shares of unsure lanes, of ordinary rays at primitives that seem small. Of
/// triangles they grow with the distance, for these are seen from where rays begin.
#[test]
fn ordinary_rays_are_hardly_ever_in_doubt() {
    let random = &mut Random(3);
    for kind in (0..KINDS).filter(|kind| NAMES[*kind] != "triangle") {
        for (double, most) in [(false, 0.01), (true, 0.001)] {
            let mut shares = Vec::new();
            for power in 1..=6 {
                let (mut unsure, mut all) = (0, 0);
                for _ in 0..campaign(2_000) {
                    let subject = subject(random, kind, true);
                    for _ in 0..10 {
                        let case = subject.plain_ray(random, 10.0_f64.powi(power), true);
                        let one = std::slice::from_ref(&case);
                        let answer = if double {
                            answers::<f64>(one)
                        } else {
                            answers::<f32>(one)
                        };
                        unsure += usize::from(answer[0] == Answer::Unsure);
                        all += 1;
                    }
                }
                shares.push(f64::from(unsure as u32) / f64::from(all));
            }
            println!(
                "{:14} {} {shares:?}",
                NAMES[kind],
                if double { "f64" } else { "f32" }
            );
            assert!(shares.iter().all(|s| *s <= most), "{}", NAMES[kind]);
        }
    }
}
