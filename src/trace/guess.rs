//! Closest hits of rays that have been traced before: a frame ago, when most of
//! the world was where it is now.
//!
//! What the ray met then bounds t from the start, so that the walk leaves out
//! what lies behind. It is never an answer by itself. A first pass traces every
//! ray with its bound for a limit. What it finds before a ray's bound is the
//! nearest hit: kernels decide (ray, primitive) pairs whatever the limit, and a
//! limit only leaves out what lies beyond it. A ray that finds nothing had a
//! bound that was wrong; its tile is traced again without bounds, the same way
//! as if nothing had been known. So the bits are those of a cold query whatever
//! is guessed. Checked by tests/frames.rs.
//!
//! The bound comes from the same primitive, met where it is now, or from the
//! depths of the ray's tile a frame ago: docs/COHERENCE.md compares the two.

use super::batch::{Hits, MAX_LANES, Rays, closest};
use super::leaf::resolve_one;
use super::query::HitId;
use crate::accel::World;
use crate::math::round_up;
use crate::plan::Kernels;
use serde::Serialize;
use std::ops::Range;

/// What a ray takes over from the frame before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Reuse {
    /// Nothing.
    None,
    /// The primitive: met anew, its t is the bound.
    Hit,
    /// The largest t of its tile: a little more is the bound.
    #[default]
    Depth,
}

impl Reuse {
    pub const ALL: [Reuse; 3] = [Reuse::None, Reuse::Hit, Reuse::Depth];

    /// As it is written on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Reuse::None => "none",
            Reuse::Hit => "hit",
            Reuse::Depth => "depth",
        }
    }
}

/// What came of the guesses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct GuessCounts {
    /// Rays that had a bound.
    pub bounded: u64,
    /// Of these, rays with nothing before their bound.
    pub lost: u64,
    /// Rays traced a second time: all of the lost rays' tiles.
    pub retraced: u64,
}

impl GuessCounts {
    pub fn add(&mut self, other: &GuessCounts) {
        self.bounded += other.bounded;
        self.lost += other.lost;
        self.retraced += other.retraced;
    }
}

/// By how much a bound lies beyond a t of this very frame: several roundings of t
/// and of the depths that tiles compare (f32), and of no matter otherwise.
const BEYOND: f64 = 1.0 + 1.0 / (1 << 18) as f64;

/// The same of a t that is a frame old: a tile that is traced twice has lost more
/// than close bounds save.
const MARGIN: f64 = 1.0 + 1.0 / 16.0;

/// Frames that a tile goes without bounds once one was wrong: where things pass
/// before each other, bounds are wrong frame after frame.
const PAUSE: u8 = 8;

/// What rays met a frame ago, by tile of [`MAX_LANES`] rays. 13 bytes a tile; with
/// [`Reuse::Hit`] also 16 bytes a ray.
#[derive(Clone, Debug, Default)]
pub struct Guesses {
    reuse: Reuse,
    /// Rays that met anything.
    met: Vec<u64>,
    /// The bound of all of them.
    depth: Vec<f32>,
    pause: Vec<u8>,
    /// By ray.
    id: Vec<HitId>,
    /// Scratch.
    bounds: Vec<f32>,
}

impl Guesses {
    /// Of a sequence that has not begun.
    pub fn new(reuse: Reuse) -> Guesses {
        Guesses {
            reuse,
            ..Guesses::default()
        }
    }

    /// [`closest`], with guesses. `first`: number of the first of these rays among
    /// all of a frame, at a whole multiple of [`MAX_LANES`].
    pub fn closest(
        &mut self,
        world: &World,
        kernels: &Kernels,
        rays: &Rays,
        first: usize,
        hits: &mut Hits,
    ) -> GuessCounts {
        if self.reuse == Reuse::None {
            closest(world, kernels, rays, hits);
            return GuessCounts::default();
        }
        let mut counts = GuessCounts::default();
        let tiles = first / MAX_LANES..(first + rays.len()) / MAX_LANES;
        if self.met.len() < tiles.end {
            self.met.resize(tiles.end, 0);
            self.depth.resize(tiles.end, 0.0);
            self.pause.resize(tiles.end, 0);
            if self.reuse == Reuse::Hit {
                self.id.resize(first + rays.len(), HitId::NONE);
            }
        }
        self.bounds.clear();
        self.bounds.extend_from_slice(rays.t_max);
        for (tile, number) in tiles.clone().enumerate() {
            counts.bounded += self.bound(world, rays, tile * MAX_LANES, number);
        }
        let bounded = Rays {
            t_max: &self.bounds,
            ..*rays
        };
        closest(world, kernels, &bounded, hits);

        // Tiles that follow each other are traced again together.
        let mut again = 0..0;
        for (tile, number) in tiles.clone().enumerate() {
            let rows = tile * MAX_LANES..(tile + 1) * MAX_LANES;
            let lost = self.free(rays, hits, rows.clone());
            if lost == 0 {
                continue;
            }
            counts.lost += lost;
            let t_max = &rays.t_max[rows.clone()];
            counts.retraced += t_max.iter().filter(|t| **t > 0.0).count() as u64;
            self.pause[number] = PAUSE;
            if again.end != rows.start {
                self.retrace(world, kernels, rays, again, hits);
                again = rows.start..rows.start;
            }
            again.end = rows.end;
        }
        self.retrace(world, kernels, rays, again, hits);
        for (tile, number) in tiles.enumerate() {
            self.remember(hits, tile * MAX_LANES, first, number);
        }
        counts
    }

    /// Bounds the rays of a tile; how many.
    #[inline(always)]
    fn bound(&mut self, world: &World, rays: &Rays, row: usize, number: usize) -> u64 {
        if self.pause[number] > 0 {
            self.pause[number] -= 1;
            return 0;
        }
        let (met, depth) = (self.met[number], self.depth[number]);
        let bounds = &mut self.bounds[row..row + MAX_LANES];
        let mut count = 0;
        for (i, bound) in bounds.iter_mut().enumerate() {
            let mut guess = depth;
            if self.reuse == Reuse::Hit && met >> i & 1 != 0 && *bound > 0.0 {
                let id = self.id[number * MAX_LANES + i];
                guess = again(world, rays, row + i, id);
            }
            let on = (met >> i & 1 != 0) & (guess < *bound);
            *bound = if on { guess } else { *bound };
            count += u64::from(on);
        }
        count
    }

    /// Where rays of a tile have met nothing before their bounds: how many, and
    /// the limits for another time. The others' hits are good ones.
    #[inline(always)]
    fn free(&mut self, rays: &Rays, hits: &Hits, rows: Range<usize>) -> u64 {
        let mut lost = 0;
        for i in rows.clone() {
            lost += u64::from((hits.id[i] == HitId::NONE) & (self.bounds[i] < rays.t_max[i]));
        }
        if lost > 0 {
            for i in rows {
                self.bounds[i] = if hits.id[i] == HitId::NONE {
                    rays.t_max[i]
                } else {
                    rays.t_max[i].min(round_up(hits.t[i] * BEYOND))
                };
            }
        }
        lost
    }

    fn retrace(
        &self,
        world: &World,
        kernels: &Kernels,
        rays: &Rays,
        rows: Range<usize>,
        hits: &mut Hits,
    ) {
        if rows.is_empty() {
            return;
        }
        let rays = Rays {
            t_max: &self.bounds[rows.clone()],
            ..rays.rows(rows.clone())
        };
        let mut hits = Hits {
            t: &mut hits.t[rows.clone()],
            id: &mut hits.id[rows],
        };
        closest(world, kernels, &rays, &mut hits);
    }

    #[inline(always)]
    fn remember(&mut self, hits: &Hits, row: usize, first: usize, number: usize) {
        let rows = row..row + MAX_LANES;
        let (t, id) = (&hits.t[rows.clone()], &hits.id[rows.clone()]);
        let (mut met, mut deepest) = (0, 0.0_f64);
        for i in 0..MAX_LANES {
            let on = id[i] != HitId::NONE;
            met |= u64::from(on) << i;
            deepest = if on & (t[i] > deepest) { t[i] } else { deepest };
        }
        self.met[number] = met;
        self.depth[number] = round_up(deepest * MARGIN);
        if self.reuse == Reuse::Hit {
            self.id[first + rows.start..first + rows.end].copy_from_slice(id);
        }
    }
}

/// The bound of a ray that may meet what it met before; nothing of the answer
/// rests on it.
#[inline(never)]
fn again(world: &World, rays: &Rays, i: usize, id: HitId) -> f32 {
    let dir = [rays.dir[0][i], rays.dir[1][i], rays.dir[2][i]].map(f64::from);
    let t_min = f64::from(rays.t_min[i]);
    let t = resolve_one(world, (rays.start(i), dir), t_min, id);
    t.map_or(f32::INFINITY, |t| round_up(t * BEYOND))
}

// A tile's rays are the bits of a word.
const _: () = assert!(MAX_LANES == 64);
