//! Temporal bounds: closest hits with upper bounds of t from the frame before.
//!
//! A bound limits the ray from the start, so that the walk culls what lies behind it; it is
//! never an answer by itself. A first pass traces every ray up to its bound. A hit found there
//! is the closest one, since kernels decide a (ray, primitive) pair independently of the
//! limit. A ray without a hit had a wrong bound: its tile is traced again, that ray without a
//! bound. So hits have the bits of a query without bounds (tests/structures/frames.rs).
//!
//! The bound comes from the primitive of the last hit, tested where it is now, or from the
//! depths of the ray's tile in the last frame.

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

/// Source of temporal bounds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Reuse {
    /// Nothing.
    #[default]
    None,
    /// The primitive of the last hit: its t now is the bound.
    Hit,
    /// The largest t of the ray's tile in the last frame, if all its rays had hits.
    Depth,
}

impl Reuse {
    pub const ALL: [Reuse; 3] = [Reuse::None, Reuse::Hit, Reuse::Depth];

    /// Chooses for a scene that [places meshes](crate::plan::places_meshes), or not: these
    /// cost enough for bounds to pay (docs/results/frames.md).
    pub fn that_pays(places_meshes: bool) -> Reuse {
        if places_meshes {
            Reuse::Depth
        } else {
            Reuse::None
        }
    }

    /// Returns the name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Reuse::None => "none",
            Reuse::Hit => "hit",
            Reuse::Depth => "depth",
        }
    }
}

/// Counts of rays with temporal bounds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct TemporalCounts {
    /// Rays that had a bound.
    pub bounded: u64,
    /// Of these, rays without a hit before their bound.
    pub lost: u64,
    /// Rays traced a second time: all rays of the lost rays' tiles.
    pub retraced: u64,
}

impl TemporalCounts {
    pub fn add(&mut self, other: &TemporalCounts) {
        self.bounded += other.bounded;
        self.lost += other.lost;
        self.retraced += other.retraced;
    }
}

/// Factor of a bound over the t that it comes from. Beams compare depths in f32, whose error
/// on triangles seen edge-on is many roundings of t, and no bound may come that near.
/// Besides, a tile that is traced twice loses more than close bounds save.
const MARGIN: f64 = 1.0 + 1.0 / 16.0;

/// Number of frames that a tile goes without bounds after a wrong one: where objects pass in
/// front of each other, bounds are wrong in consecutive frames.
const PAUSE: u8 = 8;

/// Hits of the last frame by tile of [`MAX_LANES`] rays: 5 bytes per tile, and 12 bytes per
/// ray with [`Reuse::Hit`].
#[derive(Clone, Debug, Default)]
pub struct TemporalBounds {
    reuse: Reuse,
    /// Bound of a tile's rays; infinite if one of them had no hit. Such a tile is traversed
    /// to the end anyway, and it lies at a silhouette, where bounds become wrong as soon as
    /// something moves.
    depth: Vec<f32>,
    /// Frames that a tile still goes without bounds.
    pause: Vec<u8>,
    /// Last hits by ray.
    id: HitIds,
    /// Buffer: limits by ray.
    bounds: Vec<f32>,
    /// Buffer: by tile, the rays with a bound.
    bounded: Vec<u64>,
}

impl TemporalBounds {
    /// Bounds of a sequence that has not begun.
    pub fn new(reuse: Reuse) -> TemporalBounds {
        TemporalBounds {
            reuse,
            ..TemporalBounds::default()
        }
    }

    /// [`closest`] with temporal bounds. `first`: number of the first ray in the frame, a
    /// multiple of [`MAX_LANES`].
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

        // Consecutive tiles are traced again together.
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
            // The other rays find the same hits before the same bounds.
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

    /// Sets the bounds of a tile's rays. Returns the rays that got one.
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

    /// Traces some rows again.
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

    /// Stores a tile's hits for the next frame.
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

/// Returns the largest t of the live rays.
#[inline(always)]
fn deepest<X: Copy + Into<f64>>(t: &[X], t_max: &[f32]) -> f64 {
    // Lanes of one register.
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

/// Returns the rays of a tile with a hit.
#[inline(always)]
fn met(hits: &Hits, row: usize) -> u64 {
    // The instance id suffices.
    let instance = &hits.id.instance[row..row + MAX_LANES];
    let bit = |i: usize| u64::from(instance[i] != HitId::NONE.instance) << i;
    (0..MAX_LANES).fold(0, |met, i| met | bit(i))
}

/// Tests a ray against the primitive of its last hit, and returns the bound. It may be wrong.
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
