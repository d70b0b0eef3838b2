//! Guarded beams against exact arithmetic.

use super::{Certified, Edges, GuardedLeaf};
use crate::accel::{Block, UnindexedBlock, WIDE};
use crate::geom::Guarded as Certainly;
use crate::geom::triangle::Corners;
use crate::geom::triangle::exact::{Crossing, Pair, meet_exact};
use crate::trace::beam::leaf::{BlockRef, BlockTest, GroupState};
use crate::trace::beam::mesh::Nearest;
use crate::trace::beam::rays::Beam;
use crate::trace::query::{AnyHit, Closest, Query};
use crate::trace::test_cases::{Case, RAYS, count};
use crate::trace::test_random::Random;
use std::cmp::Ordering;

/// A beam with one ray in each group.
pub type TestBeam = Beam<f32, RAYS>;

/// Edge functions with access for tests.
pub trait Probe: Edges {
    const WHAT: &str;

    /// Loads a case's rays, or returns `None` if they form no beam. `placed`: directions are
    /// f64, as in the space of an instance.
    fn traced(case: &Case, placed: bool) -> Option<Traced>;
    fn margin(&self, slot: usize) -> f32;
    fn least(met: &Self::Candidates<f32>) -> f32;
    /// Returns what turns edge functions, from their values and T.
    fn turned_by(values: [f64; 3], volume: f64) -> f64;
}

/// A loaded beam, and origin and direction of each of its rays.
pub struct Traced {
    pub beam: Box<TestBeam>,
    pub rays: Vec<[[f64; 3]; 2]>,
}

impl Traced {
    fn pair(&self, ray: usize, corners: Corners) -> Pair {
        let [org, dir] = self.rays[ray];
        Pair { org, dir, corners }
    }

    /// Sets a ray's limit, a depth.
    pub fn limit(&mut self, ray: usize, limit: f32) {
        let group = &mut self.beam.groups[ray];
        group.limit = limit;
        group.set_deepest();
    }

    /// Evaluates one ray and one triangle: whether the ray may hit it, the certified hit, and
    /// the least edge function.
    pub fn see<E: Probe>(
        &mut self,
        edges: &E,
        (ray, slot): (usize, usize),
        any: bool,
        least: f32,
    ) -> (bool, Certified<f32>, f32) {
        let Beam {
            groups,
            lines,
            starts,
            ..
        } = &mut *self.beam;
        let mut nearest = Nearest::none();
        nearest.least = least;
        let state = GroupState {
            group: &mut groups[ray],
            lines: &lines[ray],
            starts: &starts[ray],
            nearest: &mut nearest,
        };
        let line = edges.line(&state, |x| *x);
        let at = |column: &[f32; WIDE]| column[slot];
        let met = edges.meet(at, &line, any);
        let touched = edges.may_meet(&groups[ray], &lines[ray]) >> slot & 1 != 0;
        let certified = edges.certify(at, &met, any);
        (E::possible(&met) && touched, certified, E::least(&met))
    }
}

/// Computes edge functions in f64 from the original corners, over the direction's part along
/// its axis, and the determinant [a, b, c].
fn edges([a, b, c]: &Corners, org: [f64; 3], dir: [f64; 3], along: f64) -> ([f64; 3], f64) {
    let minus =
        |p: &[f32; 3], q: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| f64::from(p[k]) - q[k]) };
    let cross = |p: [f64; 3], q: [f64; 3]| {
        [
            p[1] * q[2] - p[2] * q[1],
            p[2] * q[0] - p[0] * q[2],
            p[0] * q[1] - p[1] * q[0],
        ]
    };
    let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let edge = |p: &[f32; 3], q: &[f32; 3]| cross(minus(p, org), minus(q, p.map(f64::from)));
    let normals = [edge(b, c), edge(c, a), edge(a, b)];
    let volume = dot(minus(a, org), normals[0]);
    (normals.map(|n| dot(n, dir) / along), volume)
}

/// Returns the least edge function, turned by `sign`.
fn least(values: [f64; 3], sign: f64) -> f64 {
    let turned = values.map(|x| x * 1.0_f64.copysign(sign));
    turned.into_iter().fold(f64::INFINITY, f64::min)
}

/// Statistics of bounds.
#[derive(Default)]
struct Tally {
    pairs: u64,
    sure: u64,
    missed: u64,
    doubts: u64,
    /// Pairs of which no hit is certain, and those of them that are certain misses.
    open: [u64; 2],
    /// Largest quotient of an error and its bound.
    worst: f64,
}

impl Tally {
    fn count(&mut self, may: bool, sure: bool) {
        self.pairs += 1;
        match (may, sure) {
            (true, true) => self.sure += 1,
            (true, false) => self.doubts += 1,
            (false, _) => self.missed += 1,
        }
    }

    fn report(&self, what: &str) {
        let Tally {
            pairs,
            sure,
            missed,
            doubts,
            open: [open, passed],
            worst,
        } = self;
        println!(
            "{what}: of {pairs} pairs {sure} certain hits, {missed} certain misses, {doubts} in doubt; {open} seen edge-on, of which {passed} certain misses; worst error {worst:.3} of its bound"
        );
        assert!(*sure > pairs / 1000 && *missed > pairs / 10, "{what}");
        assert!(*open > pairs / 50 && *passed > open / 2, "{what}");
        assert!(*worst < 1.0, "{what}");
    }
}

/// Compares certified hits and their depths with exact arithmetic, for every ray and triangle
/// of many cases. `more` makes further checks of a hit.
pub fn decisions<E: Probe>(
    seed: u64,
    mut more: impl FnMut(&mut Random, &mut Traced, &UnindexedBlock, (usize, usize), &Crossing),
) {
    let (mut random, mut tally) = (Random(seed), Tally::default());
    for number in 0..count() {
        let case = Case::some(&mut random);
        let block = case.block();
        let Some(mut traced) = E::traced(&case, number % 2 == 1) else {
            continue;
        };
        for ray in 0..RAYS {
            traced.limit(ray, f32::MAX);
        }
        let all = E::new(Block::Unindexed(&block), &traced.beam, false);
        let (k, sign) = (traced.beam.frustum.axes[2], traced.beam.frustum.sign);
        for (ray, slot) in (0..RAYS).flat_map(|ray| (0..WIDE).map(move |slot| (ray, slot))) {
            let pair = traced.pair(ray, case.corners[slot]);
            let Pair { org, dir, corners } = &pair;
            let along = dir[k].abs();
            let truth = meet_exact(&pair).filter(|t| t.order_with(0.0).is_gt());
            let (may, certified, value) = traced.see(&all, (ray, slot), false, f32::MAX);
            let what = || format!("ray {ray} from {org:?} along {dir:?}, triangle {corners:?}");
            tally.count(may, certified.sure);
            let margin = f64::from(all.margin(slot)) / 2.0;
            if margin.is_infinite() {
                tally.open[0] += 1;
                tally.open[1] += u64::from(!may);
            } else {
                let (values, volume) = edges(corners, *org, *dir, along);
                let exact = least(values, E::turned_by(values, volume));
                let off = f64::from(value) - margin - exact;
                tally.worst = tally.worst.max(off.abs() / margin);
            }
            let Some(truth) = truth else {
                assert!(!(may && certified.sure), "no hit: {}", what());
                continue;
            };
            assert!(may, "a hit: {}", what());
            // Depths are measured from the shared origin, or from the tree.
            let start = if traced.beam.parallel {
                org[k] * f64::from(sign) - f64::from(traced.beam.org[2])
            } else {
                0.0
            };
            let depth = start + truth.rounded() * along;
            let (from, to) = (f64::from(certified.from), f64::from(certified.to));
            // Roundings of the comparison in f64.
            let room = 1e-14 * (start.abs() + depth.abs());
            assert!(
                from <= depth + room && depth - room <= to,
                "{from} {depth} {to}: {}",
                what()
            );
            more(&mut random, &mut traced, &block, (ray, slot), &truth);
        }
    }
    tally.report(E::WHAT);
}

/// Tests one ray and a block, with triangles in lanes or one by one. Returns the hit, if any,
/// or `None` for a deferred ray.
fn met<E: Edges, Q: Query<f32>>(
    beam: &mut TestBeam,
    (block, ray): (&UnindexedBlock, usize),
    end: f32,
    at_once: bool,
) -> Option<Option<u32>> {
    let test = GuardedLeaf::<E>::new(Block::Unindexed(block), beam, Q::ANY);
    let mut nearest = Nearest::none();
    let (group, starts) = (&beam.groups[ray], &beam.starts[ray]);
    nearest.least = if beam.parallel {
        starts.depth + end * group.along - starts.slack
    } else {
        end * (group.along * (1.0 - 8.0 * f32::EPSILON))
    };
    let slots = BlockTest::<f32>::may_meet(&test, group, &beam.lines[ray]);
    let mut state = GroupState {
        group: &mut beam.groups[ray],
        lines: &beam.lines[ray],
        starts: &beam.starts[ray],
        nearest: &mut nearest,
    };
    let block_ref = BlockRef {
        number: 0,
        sources: &block.source,
    };
    if at_once {
        test.ray::<Q>(0, &block_ref, &mut state);
    } else {
        for slot in (0..WIDE).filter(|slot| slots >> slot & 1 != 0) {
            test.triangle::<Q>(slot, &block_ref, &mut state);
        }
    }
    let found = nearest.source(0);
    (nearest.deferred == 0).then_some(found)
}

/// Compares closest and any hits with exact arithmetic, for ray ends at or next to the hit of
/// some triangle.
pub fn answers<E: Probe>(seed: u64) {
    let (mut random, mut certain, mut all) = (Random(seed), 0, 0);
    for number in 0..count() / 4 {
        let case = Case::some(&mut random);
        let Some(mut traced) = E::traced(&case, number % 2 == 1) else {
            continue;
        };
        let block = case.block();
        for ray in 0..RAYS {
            certain += ask::<E>(&mut random, &mut traced, (&case, &block), ray);
            all += 4;
        }
    }
    println!("{}: {certain} of {all} answers are certain", E::WHAT);
    assert!(certain > all / 5, "{}: {certain} of {all}", E::WHAT);
}

/// Tests one ray four times. Returns the number of decided answers.
fn ask<E: Edges>(
    random: &mut Random,
    traced: &mut Traced,
    (case, block): (&Case, &UnindexedBlock),
    ray: usize,
) -> usize {
    let pairs = case.corners.map(|corners| traced.pair(ray, corners));
    let all = pairs
        .each_ref()
        .map(|pair| meet_exact(pair).filter(|t| t.order_with(0.0).is_gt()));
    let some = all[random.below(WIDE)].as_ref().map(|t| t.rounded());
    let near = random.size(-8.0, 0.0) * random.unit();
    let end = some.map_or(f32::MAX.sqrt(), |t| (t * (1.0 + near)) as f32);
    let before = |slot: &usize| {
        let crossing = all[*slot].as_ref();
        crossing.is_some_and(|t| t.order_with(f64::from(end)).is_lt())
    };
    let first = (0..WIDE).filter(before).min_by(|a, b| {
        let [a_t, b_t] = [&all[*a], &all[*b]].map(|t| t.as_ref());
        let order = a_t.zip(b_t).map_or(Ordering::Equal, |(a, b)| a.order(b));
        order.then(a.cmp(b))
    });
    let first = first.map(|slot| slot as u32);
    let (beam, mut certain) = (&mut traced.beam, 0);
    for at_once in [true, false] {
        beam.limit_t::<Certainly, AnyHit<f32>>(ray, end);
        let any = met::<E, AnyHit<f32>>(beam, (block, ray), end, at_once);
        beam.limit_t::<Certainly, Closest<f32, Certainly>>(ray, end);
        let closest = met::<E, Closest<f32, Certainly>>(beam, (block, ray), end, at_once);
        let what = || {
            let Pair { org, dir, .. } = pairs[0];
            let corners = &case.corners;
            format!("at once: {at_once}, from {org:?} along {dir:?} to {end}: {corners:?}")
        };
        certain += usize::from(any.is_some()) + usize::from(closest.is_some());
        if let Some(blocked) = any {
            assert_eq!(blocked.is_some(), first.is_some(), "any {}", what());
        }
        if let Some(found) = closest {
            assert_eq!(found, first, "{}", what());
        }
    }
    certain
}
