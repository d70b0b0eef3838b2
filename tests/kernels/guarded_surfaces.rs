//! Compares polynomial surfaces in lanes with exact arithmetic: an answer is right, or in
//! doubt. Surfaces with published formulas have their published roots.

use crate::common::{Random, assets, campaign};
use glam::DVec3;
use lanecast::internals::geom::exact::{
    Line, Root, Solid, first_beyond, meetings, meetings_between,
};
use lanecast::internals::geom::guarded::implicit::crossings;
use lanecast::internals::geom::guarded::{ObjectRay, implicit};
use lanecast::internals::geom::implicit::values_at;
use lanecast::internals::geom::implicit_bounds::bounds_of;
use lanecast::internals::geom::tape::Builder;
use lanecast::internals::geom::{Clip, Cuboid, Dense, Implicit, Meet, Ray, Sphere, Tape};
use lanecast::internals::math::bounds::LEAVING;
use lanecast::internals::math::lanes::{Lanes, Mask, Scalar, f32x8, f64x4, f64x8, f64x16};
use lanecast::internals::math::{Aabb, Vec3};
use serde_json::Value;

/// Σ c xⁱ yʲ zᵏ.
fn expanded(terms: &[([u32; 3], f64)]) -> Tape {
    let mut b = Builder::default();
    let axes = [0, 1, 2].map(|axis| b.coordinate(axis));
    let mut sum = b.constant(0.0);
    for (exponents, c) in terms {
        let mut term = b.constant(*c);
        for (axis, exponent) in axes.iter().zip(exponents) {
            let power = b.power(*axis, *exponent);
            term = b.product(term, power);
        }
        sum = b.sum(sum, term);
    }
    b.finish(sum)
}

fn published() -> Option<Vec<Value>> {
    let path = assets()?.join("surfaces/surfaces.json");
    let text = std::fs::read_to_string(path).unwrap();
    let all: Value = serde_json::from_str(&text).unwrap();
    Some(all["surfaces"].as_array().unwrap().clone())
}

fn tape_of(surface: &Value) -> Tape {
    let term = |term: &Value| {
        let exponent = |k: usize| term["m"][k].as_u64().unwrap() as u32;
        let exponents = [exponent(0), exponent(1), exponent(2)];
        (exponents, term["c_f64"].as_f64().unwrap())
    };
    let terms: Vec<_> = surface["terms"]
        .as_array()
        .unwrap()
        .iter()
        .map(term)
        .collect();
    expanded(&terms)
}

/// Products and sums of a few linear forms, which may have double lines and points.
fn random_tape(random: &mut Random) -> Tape {
    let mut b = Builder::default();
    let axes = [0, 1, 2].map(|axis| b.coordinate(axis));
    let mut made = Vec::new();
    for _ in 0..4 {
        let mut form = b.constant(random.unit());
        for axis in axes {
            // Small integers too, for coincidences.
            let c = match random.below(3) {
                0 => random.unit(),
                _ => random.below(5) as f64 - 2.0,
            };
            let c = b.constant(c);
            let term = b.product(c, axis);
            form = b.sum(form, term);
        }
        made.push(form);
    }
    let mut last = made[0];
    for _ in 0..2 + random.below(4) {
        let one = made[random.below(made.len() as u64) as usize];
        let other = made[random.below(made.len() as u64) as usize];
        last = match random.below(4) {
            0 => b.sum(one, other),
            1 => b.difference(one, other),
            2 => b.product(one, one),
            _ => b.product(one, other),
        };
        made.push(last);
    }
    let tape = b.finish(last);
    if tape.degree() == 0 || tape.degree() > 12 {
        return random_tape(random);
    }
    tape
}

/// Object rays, and what `ask` says of them.
fn asked<L: Lanes, T>(
    lines: &[Line],
    t_min: f64,
    ask: impl FnOnce(&ObjectRay<L>, L::Mask) -> T,
) -> T {
    let column = |of: &dyn Fn(&Line) -> f64| {
        let values: Vec<f64> = (0..L::COUNT).map(|i| of(&lines[i])).collect();
        <L::Double as Lanes>::load(&values)
    };
    let vector = |of: fn(&Line, usize) -> f64| {
        Vec3::new(
            column(&|line| of(line, 0)),
            column(&|line| of(line, 1)),
            column(&|line| of(line, 2)),
        )
    };
    let (org, dir) = (vector(|l, k| l.org[k]), vector(|l, k| l.dir[k]));
    let narrow = |v: Vec3<L::Double>| Vec3::new(L::narrow(v.x), L::narrow(v.y), L::narrow(v.z));
    let ray = Ray::<L>::new(narrow(org), narrow(dir), L::from_f64(t_min));
    let object = ObjectRay::new(&org, &dir, &ray);
    ask(&object, L::Mask::splat(true))
}

fn meet<L: Lanes>(row: &Implicit, lines: &[Line], t_min: f64) -> Meet<L> {
    asked::<L, _>(lines, t_min, |object, all| implicit::meet(row, object, all))
}

/// Rays at a region of size `size`, from near and far, through lattice points too.
fn lines(random: &mut Random, count: usize, size: f64, far: f64) -> Vec<Line> {
    let line = |random: &mut Random| {
        let from = random.vector().normalize_or(DVec3::X) * far;
        let mut to = random.vector() * size;
        if random.below(4) == 0 {
            to = (to * 2.0).round() * 0.5;
        }
        // Directions of the world's rays are f32.
        let dir = (to - from).normalize_or(DVec3::Y).as_vec3().as_dvec3();
        let mut org = from;
        if random.below(8) == 0 {
            org = from.round();
        }
        Line {
            org: org.to_array(),
            dir: dir.to_array(),
        }
    };
    (0..count).map(|_| line(random)).collect()
}

/// Where a ray first meets a surface, by integers alone; and as f64 and integers find it.
fn exactly<'a>(row: &Implicit<'a>, line: &Line, t_min: f64) -> Option<Root<'a>> {
    let bounds = None;
    let unbounded = Solid::Implicit(Implicit { bounds, ..*row });
    let root = first_beyond(&unbounded, line, t_min);
    let same = first_beyond(&Solid::Implicit(*row), line, t_min);
    let t = |root: &Option<Root>| root.as_ref().map(Root::rounded);
    assert_eq!(t(&root), t(&same), "{line:?} {row:?}");
    root
}

/// Answers of all kinds: settled, hits among them, in doubt.
#[derive(Debug, Default, Clone, Copy)]
struct Count {
    all: u32,
    hits: u32,
    doubts: u32,
}

#[track_caller]
fn check<L: Lanes>(row: &Implicit, all: &[Line], t_min: f64, count: &mut Count) {
    for lines in all.chunks_exact(L::COUNT) {
        let meet = meet::<L>(row, lines, t_min);
        for (i, line) in lines.iter().enumerate() {
            let on = |mask: L::Mask| mask.bits() >> i & 1 == 1;
            count.all += 1;
            if on(meet.unsure) {
                count.doubts += 1;
                continue;
            }
            let exact = exactly(row, line, t_min);
            assert_eq!(on(meet.hit), exact.is_some(), "{line:?} {exact:?} {row:?}");
            let Some(exact) = exact else {
                continue;
            };
            count.hits += 1;
            let [from, to] = meet.within.map(|x| x.lane(i).to_f64());
            let t = exact.t.value;
            assert!(from <= t && t <= to, "{t} in {from} {to}: {line:?} {row:?}");
        }
        // The same before a limit.
        let limit = lines[0].org.map(f64::abs).into_iter().fold(0.5, f64::max);
        let (blocked, unsure) = asked::<L, _>(lines, t_min, |object, all| {
            implicit::blocked(row, object, L::from_f64(limit), all)
        });
        for (i, line) in lines.iter().enumerate() {
            let on = |mask: L::Mask| mask.bits() >> i & 1 == 1;
            if !on(unsure) {
                let exact = exactly(row, line, t_min);
                let limit = L::from_f64(limit).lane(0).to_f64();
                let before = exact.is_some_and(|root| root.order_with(limit).is_lt());
                assert_eq!(on(blocked), before, "{line:?} {row:?}");
            }
        }
    }
}

fn clips() -> [Option<Clip>; 3] {
    let ball = Sphere {
        center: DVec3::new(0.1, 0.0, -0.2),
        radius: 1.75,
    };
    let cuboid = Cuboid {
        min: DVec3::new(-1.5, -2.0, -1.0),
        max: DVec3::new(1.5, 1.25, 2.0),
    };
    [None, Some(Clip::Sphere(ball)), Some(Clip::Cuboid(cuboid))]
}

/// A tape's zeros within a clip; without one, the solid where it is not above zero.
fn surface<'a>(
    tape: &'a Tape,
    dense: Option<&'a Dense>,
    clip: Option<Clip>,
    bounds: Option<Aabb>,
) -> Implicit<'a> {
    Implicit {
        tape,
        dense,
        open: clip.is_some(),
        clip,
        bounds,
    }
}

#[test]
fn what_lanes_say_of_published_surfaces_is_exact() {
    let Some(surfaces) = published() else {
        return;
    };
    let mut random = Random(1);
    let mut count = Count::default();
    for published in &surfaces {
        let tape = tape_of(published);
        for clip in clips() {
            let bounds = bounds_of(&tape, clip.as_ref());
            let dense = Dense::of(&tape, bounds);
            let row = surface(&tape, dense.as_ref(), clip, bounds);
            if row.bounds.is_none() {
                continue;
            }
            let near = lines(&mut random, 48, 1.5, 6.0);
            check::<f64x8>(&row, &near, 0.0, &mut count);
            let inside = lines(&mut random, 16, 1.5, 0.5);
            check::<f64x4>(&row, &inside, 0.25, &mut count);
            let far = lines(&mut random, 16, 1.5, 1e5);
            check::<f32x8>(&row, &far, 0.0, &mut count);
        }
    }
    println!("{count:?}");
    // An answer is what lanes are for.
    assert!(count.doubts * 20 < count.all && count.hits * 4 > count.all);
}

#[test]
fn what_lanes_say_of_random_surfaces_is_exact() {
    let mut random = Random(2);
    let mut count = Count::default();
    for _ in 0..campaign(400) {
        let tape = random_tape(&mut random);
        let clip = clips()[1 + random.below(2) as usize];
        let bounds = clip.map(|clip| clip.bounds());
        let dense = Dense::of(&tape, bounds);
        let row = surface(&tape, dense.as_ref(), clip, bounds);
        let distance = [0.5, 4.0, 1e3, 1e6][random.below(4) as usize];
        let rays = lines(&mut random, 16, 1.5, distance);
        check::<f64x16>(&row, &rays, 0.0, &mut count);
    }
    println!("{count:?}");
    assert!(count.doubts * 3 < count.all && count.hits * 8 > count.all);
}

#[test]
fn every_width_has_the_same_bits() {
    let mut random = Random(3);
    let (mut by_forms, surfaces) = (0, campaign(80));
    for number in 0..surfaces {
        let tape = random_tape(&mut random);
        let clip = clips()[1];
        let dense = Dense::of(&tape, clip.map(|clip| clip.bounds()));
        by_forms += usize::from(dense.is_some());
        let row = surface(&tape, dense.as_ref(), clip, None);
        let mut rays = lines(&mut random, 16, 1.5, [4.0, 1.0, 40.0][number % 3]);
        if number % 2 == 0 {
            let org = rays[0].org;
            rays.iter_mut().for_each(|ray| ray.org = org);
        }
        let together = meet::<f64x16>(&row, &rays, 0.0);
        for (i, line) in rays.iter().enumerate() {
            let alone = meet::<f64>(&row, std::slice::from_ref(line), 0.0);
            let on = |mask: <f64x16 as Lanes>::Mask| mask.bits() >> i & 1 == 1;
            assert_eq!(alone.hit.bits() == 1, on(together.hit));
            assert_eq!(alone.unsure.bits() == 1, on(together.unsure));
            if on(together.hit) {
                assert_eq!(alone.t.to_bits(), together.t.lane(i).to_bits());
            }
        }
    }
    assert!(by_forms * 8 > surfaces, "{by_forms}");
}

/// Of all roots between two t, as f64 and as integers find them.
#[test]
fn crossings_are_those_of_integers() {
    let mut random = Random(5);
    // Factors of these are often squares, which f64 leaves open.
    let random_tapes: Vec<Tape> = (0..campaign(200))
        .map(|_| random_tape(&mut random))
        .collect();
    known_crossings(&random_tapes, &mut random, 0.5);
    if let Some(surfaces) = published() {
        let tapes: Vec<Tape> = surfaces.iter().map(tape_of).collect();
        known_crossings(&tapes, &mut random, 0.9);
    }
}

/// At least `share` of the lines are settled in f64.
fn known_crossings(tapes: &[Tape], random: &mut Random, share: f64) {
    let (mut all, mut known, mut found) = (0, 0, Vec::new());
    for tape in tapes {
        let far = [0.5, 5.0, 1e4][random.below(3) as usize];
        for line in lines(random, 20, 1.5, far) {
            let between = [far - 3.0, far + 3.0];
            all += 1;
            let rays = (line.org, line.dir);
            let Some(first) = crossings(tape, rays, between, &mut found) else {
                continue;
            };
            known += 1;
            let mut expected = Vec::new();
            let mut sign = meetings(tape, &line, |meeting| {
                expected.push((meeting.root, meeting.after));
            });
            let at = |x: f64| {
                expected
                    .iter()
                    .filter(move |(t, _)| t.order_with(x).is_lt())
            };
            if let Some((_, after)) = at(between[0]).next_back() {
                sign = *after;
            }
            assert_eq!(first, sign);
            let within = expected[at(between[0]).count()..at(between[1]).count()].iter();
            assert_eq!(found.len(), within.len(), "{line:?} {tape:?}");
            for (one, (root, _)) in found.iter().zip(within) {
                assert!(root.order_with(one.from).is_gt() && root.order_with(one.to).is_lt());
            }
            let mut again = Vec::new();
            meetings_between(tape, &line, between, &mut found, |m| again.push(m.root));
            for (i, a) in again.iter().enumerate() {
                for (j, (b, _)) in expected[at(between[0]).count()..].iter().enumerate() {
                    assert_eq!(a.order(b), i.cmp(&j));
                }
                assert_eq!(a.rounded(), expected[at(between[0]).count() + i].0.t.value);
            }
        }
    }
    println!("{known} of {all} lines");
    assert!(f64::from(known) > share * f64::from(all));
}

/// A ray that has just left a surface does not meet it there, and lanes know that.
#[test]
fn rays_that_leave_are_not_in_doubt() {
    let Some(surfaces) = published() else {
        return;
    };
    let mut random = Random(4);
    let (mut all, mut doubts) = (0, 0);
    for published in &surfaces {
        let tape = tape_of(published);
        let clip = clips()[1];
        let dense = Dense::of(&tape, clip.map(|clip| clip.bounds()));
        let row = surface(&tape, dense.as_ref(), clip, None);
        for line in lines(&mut random, 200, 1.5, 6.0) {
            let Some(root) = exactly(&row, &line, 0.0) else {
                continue;
            };
            let [org, dir] = [line.org, line.dir].map(DVec3::from_array);
            let point = org + dir * root.t.value;
            let (_, gradient) = values_at(&tape, Vec3::<f64>::from(point));
            let gradient = DVec3::from(gradient);
            let room = LEAVING * implicit::blur_at((&tape, row.dense), Vec3::<f64>::from(point));
            let room = room / gradient.length();
            if !(room < 1e-6) {
                continue;
            }
            let side = if gradient.dot(dir) > 0.0 { -1.0 } else { 1.0 };
            let up = gradient.normalize() * side;
            let mut dir = up + random.vector() * 0.9;
            dir -= up * (2.0 * dir.dot(up).min(0.0));
            let leaving = Line {
                org: (point + up * room).to_array(),
                dir: dir.to_array(),
            };
            all += 1;
            let meet = meet::<f64>(&row, std::slice::from_ref(&leaving), 0.0);
            doubts += u32::from(meet.unsure.bits() != 0);
            let exact = exactly(&row, &leaving, 0.0);
            if meet.unsure.bits() == 0 {
                assert_eq!(meet.hit.bits() != 0, exact.is_some());
            }
            let again = exact.is_some_and(|root| root.t.value * leaving.dir[0].hypot(1.0) < room);
            assert!(!again, "{leaving:?} meets what it has left");
        }
    }
    println!("{doubts} of {all} in doubt");
    assert!(all > 1000 && doubts * 50 < all);
}

#[test]
fn published_rays_have_their_roots() {
    let Some(surfaces) = published() else {
        return;
    };
    let mut rays = 0;
    for surface in &surfaces {
        let name = surface["name"].as_str().unwrap();
        let tape = tape_of(surface);
        for ray in surface["ray_tests"].as_array().unwrap() {
            let vector = |key: &str| {
                let at = |k: usize| ray[key][k].as_f64().unwrap();
                [at(0), at(1), at(2)]
            };
            let line = Line {
                org: vector("origin"),
                dir: vector("dir"),
            };
            let mut found = Vec::new();
            meetings(&tape, &line, |meeting| found.push(meeting.root.t.value));
            let expected: Vec<f64> = ray["t_real"]
                .as_array()
                .unwrap()
                .iter()
                .map(|t| t.as_str().unwrap().parse().unwrap())
                .collect();
            assert_eq!(found.len(), expected.len(), "{name} {line:?}");
            for (t, expected) in found.iter().zip(&expected) {
                let off = (t - expected).abs();
                assert!(off <= 1e-12 * expected.abs(), "{name}: {t} for {expected}");
            }
            rays += 1;
        }
    }
    assert_eq!(rays, 4 * surfaces.len());
}
