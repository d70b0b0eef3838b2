//! What tiles make of rays and triangles, against exact arithmetic.

use super::{Certified, Edges, GuardedLeaf};
use crate::accel::{Block, UnindexedBlock, WIDE};
use crate::geom::Guarded as Certainly;
use crate::geom::triangle::Corners;
use crate::geom::triangle::exact::{Crossing, Pair, meet_exact};
use crate::trace::beam::leaf::{Before, Decides, Place};
use crate::trace::beam::mesh::Nearest;
use crate::trace::beam::rays::Beam;
use crate::trace::query::{AnyHit, Closest, Query};
use crate::trace::test_cases::{Case, RAYS, count};
use crate::trace::test_random::Random;
use std::cmp::Ordering;

/// A tile of rays, one in each group.
pub type Tile = Beam<f32, RAYS>;

/// What tests ask of edges besides.
pub trait Probe: Edges {
    const WHAT: &str;

    /// A case's rays, or none where a tile takes in no such. `placed`: directions are
    /// f64, as in the space of an instance.
    fn traced(case: &Case, placed: bool) -> Option<Traced>;
    fn margin(&self, slot: usize) -> f32;
    fn least(met: &Self::Met<f32>) -> f32;
    /// What turns edge functions, of their values and T.
    fn turned_by(values: [f64; 3], volume: f64) -> f64;
}

/// A tile that has taken in rays, and where each of these begins and goes.
pub struct Traced {
    pub tile: Box<Tile>,
    pub rays: Vec<[[f64; 3]; 2]>,
}

impl Traced {
    fn pair(&self, ray: usize, corners: Corners) -> Pair {
        let [org, dir] = self.rays[ray];
        Pair { org, dir, corners }
    }

    /// `limit`: a depth.
    pub fn limit(&mut self, ray: usize, limit: f32) {
        let group = &mut self.tile.groups[ray];
        group.limit = limit;
        group.set_deepest();
    }

    /// One ray and one triangle as the tile sees them: whether they may meet, what comes
    /// of it, and the least edge function.
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
        } = &mut *self.tile;
        let mut nearest = Nearest::none();
        nearest.least = least;
        let before = Before {
            group: &mut groups[ray],
            lines: &lines[ray],
            starts: &starts[ray],
            nearest: &mut nearest,
        };
        let line = edges.line(&before, |x| *x);
        let at = |column: &[f32; WIDE]| column[slot];
        let met = edges.meet(at, &line, any);
        let touched = edges.may_meet(&groups[ray], &lines[ray]) >> slot & 1 != 0;
        let certified = edges.certify(at, &met, any);
        (E::possible(&met) && touched, certified, E::least(&met))
    }
}

/// Edge functions by f64 from the corners as they are, over what the direction is along
/// its axis; and [a, b, c].
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

/// The least of them, turned as `sign` says.
fn least(values: [f64; 3], sign: f64) -> f64 {
    let turned = values.map(|x| x * 1.0_f64.copysign(sign));
    turned.into_iter().fold(f64::INFINITY, f64::min)
}

/// What has been found out about bounds.
#[derive(Default)]
struct Tally {
    pairs: u64,
    sure: u64,
    missed: u64,
    doubts: u64,
    /// The worst of all errors, over its bound.
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
            worst,
        } = self;
        println!(
            "{what}: of {pairs} pairs {sure} certain hits, {missed} certain misses, {doubts} in doubt; worst error {worst:.3} of its bound"
        );
        assert!(*sure > pairs / 1000 && *missed > pairs / 10, "{what}");
        assert!(*worst < 1.0, "{what}");
    }
}

/// Every ray and triangle of many cases: what the tile makes of them, and where the hit
/// lies, must be what exact arithmetic says. `more`: what else to ask where there is a hit.
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
        let all = E::of(Block::Unindexed(&block), &traced.tile, false);
        let (k, sign) = (traced.tile.frustum.axes[2], traced.tile.frustum.sign);
        for (ray, slot) in (0..RAYS).flat_map(|ray| (0..WIDE).map(move |slot| (ray, slot))) {
            let pair = traced.pair(ray, case.corners[slot]);
            let Pair { org, dir, corners } = &pair;
            let along = dir[k].abs();
            let truth = meet_exact(&pair).filter(|t| t.order_with(0.0).is_gt());
            let (may, certified, value) = traced.see(&all, (ray, slot), false, f32::MAX);
            let what = || format!("ray {ray} from {org:?} along {dir:?}, triangle {corners:?}");
            tally.count(may, certified.sure);
            let margin = f64::from(all.margin(slot)) / 2.0;
            if margin.is_finite() {
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
            // Depths count from the origin that all rays share, or from the tree.
            let start = if traced.tile.parallel {
                org[k] * f64::from(sign) - f64::from(traced.tile.org[2])
            } else {
                0.0
            };
            let depth = start + truth.rounded() * along;
            let (from, to) = (f64::from(certified.from), f64::from(certified.to));
            // f64's own roundings.
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

/// One ray and a block, as a tile meets them: with triangles in lanes, or one after the
/// other. Blocked or not and by what, or None where it is in doubt.
fn met<E: Edges, Q: Query<f32>>(
    tile: &mut Tile,
    (block, ray): (&UnindexedBlock, usize),
    end: f32,
    at_once: bool,
) -> Option<Option<u32>> {
    let decider = GuardedLeaf::<E>::new(Block::Unindexed(block), tile, Q::ANY);
    let mut nearest = Nearest::none();
    let (group, starts) = (&tile.groups[ray], &tile.starts[ray]);
    nearest.least = if tile.parallel {
        starts.depth + end * group.along - starts.slack
    } else {
        end * (group.along * (1.0 - 8.0 * f32::EPSILON))
    };
    let slots = Decides::<f32>::may_meet(&decider, group, &tile.lines[ray]);
    let mut before = Before {
        group: &mut tile.groups[ray],
        lines: &tile.lines[ray],
        starts: &tile.starts[ray],
        nearest: &mut nearest,
    };
    let place = Place {
        number: 0,
        sources: &block.source,
    };
    if at_once {
        decider.ray::<Q>(0, &place, &mut before);
    } else {
        for slot in (0..WIDE).filter(|slot| slots >> slot & 1 != 0) {
            decider.triangle::<Q>(slot, &place, &mut before);
        }
    }
    let found = nearest.source(0);
    (nearest.deferred == 0).then_some(found)
}

/// Asks tiles for every ray's nearest hit and for any, before an end that is some
/// triangle's or next to it.
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

/// One ray, four times. How many of the answers were certain.
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
    let (tile, mut certain) = (&mut traced.tile, 0);
    for at_once in [true, false] {
        tile.limit_t::<Certainly, AnyHit<f32>>(ray, end);
        let any = met::<E, AnyHit<f32>>(tile, (block, ray), end, at_once);
        tile.limit_t::<Certainly, Closest<f32, Certainly>>(ray, end);
        let closest = met::<E, Closest<f32, Certainly>>(tile, (block, ray), end, at_once);
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
