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
//! The bound comes from the same primitive, met where it is now, or is simply
//! last frame's t: docs/COHERENCE.md compares the two.

use super::batch::{Hits, MAX_LANES, Rays, closest};
use super::leaf::resolve_one;
use super::query::HitId;
use crate::accel::World;
use crate::math::round_up;
use crate::plan::Kernels;
use serde::Serialize;

/// What a ray takes over from the frame before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Reuse {
    /// Nothing.
    None,
    /// The primitive: met anew, its t is the bound.
    Hit,
    /// The t.
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

/// The answers of the frame before, a row per ray; rows beyond count as misses.
#[derive(Clone, Copy)]
pub struct Last<'a> {
    pub reuse: Reuse,
    pub t: &'a [f64],
    pub id: &'a [HitId],
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

/// By how much a bound lies beyond the t that it comes from: several roundings
/// of t and of the depths that tiles compare (f32), and of no matter otherwise.
const BEYOND: f64 = 1.0 + 1.0 / (1 << 18) as f64;

/// [`closest`], with guesses. `bounds` is scratch, a row per ray afterwards.
pub fn closest_after(
    world: &World,
    kernels: &Kernels,
    rays: &Rays,
    last: &Last,
    bounds: &mut [f32],
    hits: &mut Hits,
) -> GuessCounts {
    let mut counts = GuessCounts::default();
    bounds.copy_from_slice(rays.t_max);
    for (i, bound) in bounds.iter_mut().enumerate() {
        if let Some(t) = guess(world, rays, last, i) {
            let t = round_up(t * BEYOND);
            if t > 0.0 && t < *bound {
                *bound = t;
                counts.bounded += 1;
            }
        }
    }
    let bounded = Rays {
        t_max: bounds,
        ..*rays
    };
    closest(world, kernels, &bounded, hits);
    for first in (0..rays.len()).step_by(MAX_LANES) {
        let tile = first..first + MAX_LANES;
        let is_lost = |i: &usize| hits.id[*i] == HitId::NONE && bounds[*i] < rays.t_max[*i];
        let lost = tile.clone().filter(is_lost).count() as u64;
        if lost > 0 {
            counts.lost += lost;
            counts.retraced += rays.t_max[tile.clone()]
                .iter()
                .filter(|t| **t > 0.0)
                .count() as u64;
            let mut hits = Hits {
                t: &mut hits.t[tile.clone()],
                id: &mut hits.id[tile.clone()],
            };
            closest(world, kernels, &rays.rows(tile), &mut hits);
        }
    }
    counts
}

/// Where a ray may be blocked; nothing of the answer rests on it.
#[inline(always)]
fn guess(world: &World, rays: &Rays, last: &Last, i: usize) -> Option<f64> {
    let id = *last.id.get(i)?;
    if id == HitId::NONE || rays.t_max[i] <= 0.0 {
        return None;
    }
    match last.reuse {
        Reuse::None => None,
        Reuse::Depth => Some(last.t[i]),
        Reuse::Hit => {
            let dir = [rays.dir[0][i], rays.dir[1][i], rays.dir[2][i]].map(f64::from);
            resolve_one(world, (rays.start(i), dir), f64::from(rays.t_min[i]), id)
        }
    }
}
