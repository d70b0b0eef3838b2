//! Closest hits of rays that have been traced before: a frame ago, when most of
//! the world was where it is now.
//!
//! What the ray met then bounds t from the start, so that the walk leaves out
//! what lies behind. It is never an answer by itself. A first pass traces every
//! ray with its bound for a limit. What it finds before a ray's bound is the
//! nearest hit: kernels decide (ray, primitive) pairs whatever the limit, and a
//! limit only leaves out what lies beyond it. A ray that finds nothing had a
//! bound that was wrong; its tile is traced again, that ray without a bound. So
//! the bits are those of a cold query whatever is guessed. Checked by
//! tests/structures/frames.rs.
//!
//! The bound comes from the same primitive, met where it is now, or from the
//! depths of the ray's tile a frame ago: docs/COHERENCE.md compares the two.

use super::batch::closest;
use super::hits::{Depths, HitIds, Hits};
use super::leaf::Tester;
use super::packet::Packet;
use super::query::{Closest, HitId};
use super::rays::{MAX_LANES, Rays};
use super::scratch::TraceScratch;
use crate::accel::World;
use crate::geom::Fast;
use crate::math::round_up;
use crate::plan::Kernels;
use serde::Serialize;
use std::ops::Range;

/// What a ray takes over from the frame before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Reuse {
    /// Nothing.
    #[default]
    None,
    /// The primitive: met anew, its t is the bound.
    Hit,
    /// The largest t of its tile, where all rays met something: a little more is the
    /// bound.
    Depth,
}

impl Reuse {
    pub const ALL: [Reuse; 3] = [Reuse::None, Reuse::Hit, Reuse::Depth];

    /// Chooses for a scene that [places meshes](crate::plan::places_meshes), or not: these
    /// cost enough for bounds to pay (docs/COHERENCE.md).
    pub fn that_pays(places_meshes: bool) -> Reuse {
        if places_meshes {
            Reuse::Depth
        } else {
            Reuse::None
        }
    }

    /// As it is written on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Reuse::None => "none",
            Reuse::Hit => "hit",
            Reuse::Depth => "depth",
        }
    }
}

/// What came of the temporal_bounds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct TemporalCounts {
    /// Rays that had a bound.
    pub bounded: u64,
    /// Of these, rays with nothing before their bound.
    pub lost: u64,
    /// Rays traced a second time: all of the lost rays' tiles.
    pub retraced: u64,
}

impl TemporalCounts {
    pub fn add(&mut self, other: &TemporalCounts) {
        self.bounded += other.bounded;
        self.lost += other.lost;
        self.retraced += other.retraced;
    }
}

/// By how much a bound lies beyond the t that it comes from. In f32 a tile compares
/// depths, which are t's only up to their rounding: of triangles seen edge-on that
/// is many times the rounding of t, and no bound may come near it. Besides, a tile
/// that is traced twice has lost more than close bounds save.
const MARGIN: f64 = 1.0 + 1.0 / 16.0;

/// Frames that a tile goes without bounds once one was wrong: where things pass
/// before each other, bounds are wrong frame after frame.
const PAUSE: u8 = 8;

/// What rays met a frame ago, by tile of [`MAX_LANES`] rays. 5 bytes a tile; with
/// [`Reuse::Hit`] also 16 bytes a ray.
#[derive(Clone, Debug, Default)]
pub struct TemporalBounds {
    reuse: Reuse,
    /// The bound of all rays; infinite where one of them met nothing. A tile with
    /// such a ray is walked to the end anyway, and it lies at an outline, where
    /// bounds are wrong as soon as something moves.
    depth: Vec<f32>,
    pause: Vec<u8>,
    /// By ray.
    id: HitIds,
    /// Scratch: limits by ray, and by tile the rays that have a bound.
    bounds: Vec<f32>,
    bounded: Vec<u64>,
}

impl TemporalBounds {
    /// Of a sequence that has not begun.
    pub fn new(reuse: Reuse) -> TemporalBounds {
        TemporalBounds {
            reuse,
            ..TemporalBounds::default()
        }
    }

    /// [`closest`], with temporal_bounds. `first`: number of the first of these rays among
    /// all of a frame, at a whole multiple of [`MAX_LANES`].
    pub fn closest(
        &mut self,
        world: &World,
        kernels: &Kernels,
        rays: &Rays,
        first: usize,
        hits: &mut Hits,
        scratch: &mut TraceScratch,
    ) -> TemporalCounts {
        if self.reuse == Reuse::None {
            closest(world, kernels, rays, hits, scratch);
            return TemporalCounts::default();
        }
        let mut counts = TemporalCounts::default();
        let tiles = first / MAX_LANES..(first + rays.len()) / MAX_LANES;
        if self.depth.len() < tiles.end {
            self.depth.resize(tiles.end, f32::INFINITY);
            self.pause.resize(tiles.end, 0);
            if self.reuse == Reuse::Hit {
                self.id.resize(first + rays.len());
            }
        }
        self.bounds.clear();
        self.bounds.extend_from_slice(rays.t_max);
        self.bounded.clear();
        for (tile, number) in tiles.clone().enumerate() {
            let bounded = self.bound(world, rays, tile * MAX_LANES, number, scratch);
            counts.bounded += u64::from(bounded.count_ones());
            self.bounded.push(bounded);
        }
        let bounded = Rays {
            t_max: &self.bounds,
            ..*rays
        };
        closest(world, kernels, &bounded, hits, scratch);

        // Tiles that follow each other are traced again together.
        let mut again = 0..0;
        for (tile, number) in tiles.clone().enumerate() {
            let rows = tile * MAX_LANES..(tile + 1) * MAX_LANES;
            let bounded = self.bounded[tile];
            if bounded == 0 {
                continue;
            }
            let lost = bounded & !met(hits, rows.start);
            if lost == 0 {
                continue;
            }
            counts.lost += u64::from(lost.count_ones());
            let t_max = &rays.t_max[rows.clone()];
            counts.retraced += t_max.iter().filter(|t| **t > 0.0).count() as u64;
            self.pause[number] = PAUSE;
            // The others find again what they found, before the same bounds.
            for i in rows.clone() {
                let is_lost = hits.id.get(i) == HitId::NONE;
                self.bounds[i] = if is_lost {
                    rays.t_max[i]
                } else {
                    self.bounds[i]
                };
            }
            if again.end != rows.start {
                self.retrace((world, kernels), rays, again, hits, scratch);
                again = rows.start..rows.start;
            }
            again.end = rows.end;
        }
        self.retrace((world, kernels), rays, again, hits, scratch);
        for (tile, number) in tiles.enumerate() {
            self.remember(rays, hits, tile * MAX_LANES, number);
        }
        counts
    }

    /// Bounds the rays of a tile; which.
    #[inline(always)]
    fn bound(
        &mut self,
        world: &World,
        rays: &Rays,
        row: usize,
        number: usize,
        scratch: &mut TraceScratch,
    ) -> u64 {
        if self.pause[number] > 0 {
            self.pause[number] -= 1;
            return 0;
        }
        let mut bound = [self.depth[number]; MAX_LANES];
        if self.reuse == Reuse::Hit {
            for (i, bound) in bound.iter_mut().enumerate() {
                let id = self.id.get(number * MAX_LANES + i);
                *bound = again(world, rays, row + i, id, scratch);
            }
        } else if bound[0] == f32::INFINITY {
            return 0;
        }
        let bounds = &mut self.bounds[row..row + MAX_LANES];
        let mut bounded = 0;
        for i in 0..MAX_LANES {
            let on = bound[i] < bounds[i];
            bounds[i] = if on { bound[i] } else { bounds[i] };
            bounded |= u64::from(on) << i;
        }
        bounded
    }

    fn retrace(
        &self,
        (world, kernels): (&World, &Kernels),
        rays: &Rays,
        rows: Range<usize>,
        hits: &mut Hits,
        scratch: &mut TraceScratch,
    ) {
        if rows.is_empty() {
            return;
        }
        let rays = Rays {
            t_max: &self.bounds[rows.clone()],
            ..rays.rows(rows.clone())
        };
        closest(world, kernels, &rays, &mut hits.rows(rows), scratch);
    }

    #[inline(always)]
    fn remember(&mut self, rays: &Rays, hits: &Hits, row: usize, number: usize) {
        let rows = row..row + MAX_LANES;
        if self.reuse == Reuse::Hit {
            let to = number * MAX_LANES..(number + 1) * MAX_LANES;
            self.id.instance[to.clone()].copy_from_slice(&hits.id.instance[rows.clone()]);
            self.id.primitive[to].copy_from_slice(&hits.id.primitive[rows]);
            return;
        }
        let t_max = &rays.t_max[rows.clone()];
        let mut alive = 0_u64;
        for i in 0..MAX_LANES {
            alive |= u64::from(t_max[i] > 0.0) << i;
        }
        if alive & !met(hits, row) != 0 {
            self.depth[number] = f32::INFINITY;
            return;
        }
        let deepest = match &hits.t {
            Depths::Single(t) => deepest(&t[rows], t_max),
            Depths::Double(t) => deepest(&t[rows], t_max),
        };
        self.depth[number] = round_up(deepest * MARGIN);
    }
}

/// The largest t of the rays that are alive.
#[inline(always)]
fn deepest<X: Copy + Into<f64>>(t: &[X], t_max: &[f32]) -> f64 {
    // As many at a time as registers hold.
    const RUN: usize = 8;
    let mut deepest = [0.0_f64; RUN];
    for (t, t_max) in t.chunks_exact(RUN).zip(t_max.chunks_exact(RUN)) {
        for i in 0..RUN {
            let t = t[i].into();
            let on = (t_max[i] > 0.0) & (t > deepest[i]);
            deepest[i] = if on { t } else { deepest[i] };
        }
    }
    deepest.into_iter().fold(0.0, f64::max)
}

/// The rays of a tile that have met anything.
#[inline(always)]
fn met(hits: &Hits, row: usize) -> u64 {
    // One half of an id tells.
    let instance = &hits.id.instance[row..row + MAX_LANES];
    let bit = |i: usize| u64::from(instance[i] != HitId::NONE.instance) << i;
    (0..MAX_LANES).fold(0, |met, i| met | bit(i))
}

/// The bound of a ray that may meet what it met before; nothing of the answer
/// rests on it.
#[inline(never)]
fn again(world: &World, rays: &Rays, i: usize, id: HitId, scratch: &mut TraceScratch) -> f32 {
    if id == HitId::NONE || rays.t_max[i] <= 0.0 {
        return f32::INFINITY;
    }
    let packet: Packet<f32> = rays.packet(i, world);
    let mut nearest = Closest::<f32, Fast>::new(f32::INFINITY);
    Tester::<f32, Fast>::new(world, &packet, scratch).single(id, &mut nearest);
    match nearest.id(0) {
        HitId::NONE => f32::INFINITY,
        _ => round_up(nearest.t(0) * MARGIN),
    }
}

// A tile's rays are the bits of a word.
const _: () = assert!(MAX_LANES == 64);
