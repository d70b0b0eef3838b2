//! Tiles and triangles at random, of all sizes and from all distances.

use super::{Edges, Guarded};
use crate::accel::{Apart, Block, WIDE};
use crate::geom::Guarded as Certainly;
use crate::geom::triangle::exact::{Pair, meet_exact};
use crate::geom::triangle::{Corners, canonical};
use crate::math::Aabb32;
use crate::trace::query::{AnyHit, Closest, Query};
use crate::trace::tile::bundle::Bundle;
use crate::trace::tile::leaf::{Before, Decides, Place};
use crate::trace::tile::mesh::Nearest;
use std::cmp::Ordering;

/// A tile of rays, one in each group.
pub type Tile = Bundle<f32, RAYS>;

/// Rays of a tile.
pub const RAYS: usize = 64;

/// Vigna's SplitMix64.
pub struct Random(pub u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ x >> 31
    }

    /// In [−1, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    fn vector(&mut self) -> [f64; 3] {
        [self.unit(), self.unit(), self.unit()]
    }

    /// 10 to a power in [low, high).
    fn size(&mut self, low: f64, high: f64) -> f64 {
        10.0_f64.powf(low + (high - low) * (0.5 + 0.5 * self.unit()))
    }
}

/// A block's triangles, and where rays are to pass.
pub struct Case {
    pub corners: [Corners; WIDE],
    pub bounds: Aabb32,
    /// On edges, at corners, inside, and beside.
    pub targets: [[f64; 3]; RAYS],
    /// From which the rays come, and how far away they begin.
    pub dir: [f64; 3],
    pub distance: f64,
}

impl Case {
    pub fn some(random: &mut Random) -> Case {
        let edge = random.size(-6.0, 0.0);
        let off_centre = random.size(-1.0, 1.0);
        let place = random.vector().map(|x| x * off_centre);
        let flat = random.vector().map(|x| if x > 0.6 { 1e-3 } else { 1.0 });
        let around = |random: &mut Random, size: f64| -> [f64; 3] {
            let at = random.vector();
            std::array::from_fn(|k| place[k] + at[k] * size)
        };
        let corners: [Corners; WIDE] = std::array::from_fn(|_| {
            let middle = around(random, 4.0 * edge);
            let corner = |random: &mut Random| -> [f32; 3] {
                let at = random.vector();
                std::array::from_fn(|k| (middle[k] + at[k] * edge * flat[k]) as f32)
            };
            canonical([corner(random), corner(random), corner(random)])
        });
        let spread = edge * random.size(-1.0, 1.5);
        let targets = std::array::from_fn(|i| {
            let [a, b, c] = corners[random.below(WIDE)].map(|p| p.map(f64::from));
            let mix = |p: [f64; 3], q: [f64; 3], x: f64| -> [f64; 3] {
                std::array::from_fn(|k| p[k] + (q[k] - p[k]) * x)
            };
            let share = 0.5 + 0.5 * random.unit();
            match i % 4 {
                0 => mix(a, b, share),
                1 => c,
                2 => mix(a, mix(b, c, share), 0.5 + 0.5 * random.unit()),
                _ => around(random, spread),
            }
        });
        // Of a mesh of some extent, as flat as its triangles or not.
        let mut bounds = Aabb32 {
            min: corners[0][0],
            max: corners[0][0],
        };
        for k in 0..3 {
            let grown = (random.unit() > 0.0).then(|| random.size(-6.0, 1.0) as f32);
            for corner in corners.iter().flatten() {
                bounds.min[k] = bounds.min[k].min(corner[k]);
                bounds.max[k] = bounds.max[k].max(corner[k]);
            }
            if random.unit() > 0.0 {
                bounds.min[k] -= grown.unwrap_or(0.0);
            }
            bounds.max[k] += grown.unwrap_or(0.0);
        }
        Case {
            bounds,
            corners,
            targets,
            dir: random.vector(),
            distance: random.size(-1.0, 4.0) * edge.max(0.01),
        }
    }

    pub fn block(&self) -> Apart {
        let mut block = Apart {
            corner: [[[0.0; WIDE]; 3]; 3],
            source: std::array::from_fn(|slot| slot as u32),
        };
        for (slot, corners) in self.corners.iter().enumerate() {
            for (which, corner) in corners.iter().enumerate() {
                for k in 0..3 {
                    block.corner[which][k][slot] = corner[k];
                }
            }
        }
        block
    }
}

/// How many tiles are asked.
pub fn tiles() -> usize {
    let set = std::env::var("LANECAST_CASES").ok();
    let pairs: usize = set.and_then(|n| n.parse().ok()).unwrap_or(1_000_000);
    pairs.div_ceil(RAYS * WIDE)
}

/// Edge functions by f64 from the corners as they are, over what the direction is along
/// its axis; and [a, b, c].
pub fn edges([a, b, c]: &Corners, org: [f64; 3], dir: [f64; 3], along: f64) -> ([f64; 3], f64) {
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
pub fn least(values: [f64; 3], sign: f64) -> f64 {
    let turned = values.map(|x| x * 1.0_f64.copysign(sign));
    turned.into_iter().fold(f64::INFINITY, f64::min)
}

/// What has been found out about bounds.
#[derive(Default)]
pub struct Tally {
    pub pairs: u64,
    pub sure: u64,
    pub missed: u64,
    pub doubts: u64,
    /// The worst of all errors, over its bound.
    pub worst: f64,
}

impl Tally {
    pub fn report(&self, what: &str) {
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

/// One ray and a block, as a tile meets them: with triangles in lanes, or one after the
/// other. Blocked or not and by what, or None where it is in doubt.
fn met<E: Edges, Q: Query<f32>>(
    tile: &mut Tile,
    (block, ray): (&Apart, usize),
    end: f32,
    at_once: bool,
) -> Option<Option<u32>> {
    let decider = Guarded::<E>::new(Block::Apart(block), tile, Q::ANY);
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
    (nearest.aside == 0).then_some(found)
}

/// Asks a tile for every ray's nearest hit and for any, before an end that is some
/// triangle's or next to it. `pair`: a ray and a triangle. How many answers there were.
pub fn ask<E: Edges>(
    random: &mut Random,
    tile: &mut Tile,
    block: &Apart,
    pair: impl Fn(usize, usize) -> Pair,
) -> [u64; 2] {
    let mut answers = [0; 2];
    for ray in 0..RAYS {
        let pairs: [Pair; WIDE] = std::array::from_fn(|slot| pair(ray, slot));
        let all = pairs.each_ref().map(|pair| {
            let crossing = meet_exact(pair)?;
            crossing.order_with(0.0).is_gt().then_some(crossing)
        });
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
        for at_once in [true, false] {
            tile.limit_t::<Certainly, AnyHit<f32>>(ray, end);
            let any = met::<E, AnyHit<f32>>(tile, (block, ray), end, at_once);
            tile.limit_t::<Certainly, Closest<f32, Certainly>>(ray, end);
            let closest = met::<E, Closest<f32, Certainly>>(tile, (block, ray), end, at_once);
            let what = || {
                let Pair { org, dir, .. } = pairs[0];
                let corners = pairs.each_ref().map(|pair| pair.corners);
                format!("at once: {at_once}, from {org:?} along {dir:?} to {end}: {corners:?}")
            };
            answers[0] += u64::from(any.is_some()) + u64::from(closest.is_some());
            answers[1] += 2;
            if let Some(blocked) = any {
                assert_eq!(blocked.is_some(), first.is_some(), "any {}", what());
            }
            if let Some(found) = closest {
                assert_eq!(found, first, "{}", what());
            }
        }
    }
    answers
}
