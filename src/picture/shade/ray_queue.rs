//! Ray queues: rays that wait to be traced, one queue per depth, in the thread's arena.
//! Batches are taken from a queue's end.
//!
//! A ray spawns at most two, and a depth is filled only when its queue is empty. Queues
//! beyond the first therefore hold at most two batches, whatever the scene does.

use super::columns::{Column3, Doubles, STEP, Singles, keep};
use crate::math::Vec3;
use crate::scene::Rgb;
use crate::trace::{MAX_LANES, RayKind, Rays, Vectors};
use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;
use glam::DVec3;
use std::ops::Range;

/// Maximum number of rays traced and shaded as one batch: a tile's rays at one sample
/// per pixel. Fixed, because the order in which a pixel's rays are added depends on it.
pub const BATCH: usize = 1024;

/// Rays of one depth in columns of equal length, apart from padding rays at the end.
pub struct RayQueue<'b> {
    org: Column3<'b, Doubles>,
    dir: Column3<'b, Doubles>,
    t_min: ArenaVec<'b, f32>,
    pub t_max: ArenaVec<'b, f32>,
    /// Row of the tile's film.
    pub pixel: ArenaVec<'b, u32>,
    /// Factor of the ray's radiance in its pixel.
    pub weight: Column3<'b, Singles>,
    pub kind: ArenaVec<'b, RayKind>,
}

impl<'b> RayQueue<'b> {
    pub fn with_capacity(rays: usize, arena: &'b Bump) -> RayQueue<'b> {
        // Padding may start at any row.
        let rays = rays + MAX_LANES;
        let f32s = || ArenaVec::with_capacity_in(rays, arena);
        RayQueue {
            org: Column3::with_capacity(rays, arena),
            dir: Column3::with_capacity(rays, arena),
            t_min: f32s(),
            t_max: f32s(),
            pixel: ArenaVec::with_capacity_in(rays, arena),
            weight: Column3::with_capacity(rays, arena),
            kind: ArenaVec::with_capacity_in(rays, arena),
        }
    }

    /// Appends one world-space ray.
    pub fn push(
        &mut self,
        org: DVec3,
        dir: DVec3,
        t_max: f32,
        pixel: u32,
        weight: Rgb,
        kind: RayKind,
    ) {
        self.org.push(org.to_array());
        self.dir.push(dir.to_array());
        self.t_min.push(0.0);
        self.t_max.push(t_max);
        self.pixel.push(pixel);
        self.weight.push(weight);
        self.kind.push(kind);
    }

    /// Appends the rays of a step whose bits are set; call [`RayQueue::complete`] once all
    /// rays are appended.
    #[inline(always)]
    pub fn push_some(
        &mut self,
        rows: u32,
        (org, dir): (Vec3<Doubles>, Vec3<Doubles>),
        pixels: &[u32; STEP],
    ) {
        self.org.push_some(org, rows);
        self.dir.push_some(dir, rows);
        keep(&mut self.pixel, pixels, rows);
    }

    /// Appends one ray.
    pub fn push_one(&mut self, (org, dir): (DVec3, DVec3), pixel: u32) {
        let lanes = |v: DVec3| Vec3::<Doubles>::splat(v.to_array());
        self.push_some(1, (lanes(org), lanes(dir)), &[pixel; STEP]);
    }

    /// Appends grey weights of rays that were appended by [`RayQueue::push_some`].
    #[inline(always)]
    pub fn weigh_some(&mut self, weight: Singles, rows: u32) {
        self.weight
            .push_some(Vec3::new(weight, weight, weight), rows);
    }

    /// Fills the columns that new rays have in common; rays without a weight get weight
    /// 1.
    pub fn complete(&mut self, t_max: f32, kind: RayKind) {
        let rays = self.len();
        self.t_min.resize(rays, 0.0);
        self.t_max.resize(rays, t_max);
        self.kind.resize(rays, kind);
        self.weight.resize(rays, [1.0; 3]);
    }

    pub fn len(&self) -> usize {
        self.pixel.len()
    }

    pub fn is_empty(&self) -> bool {
        self.pixel.is_empty()
    }

    /// Returns the rows of the last batch: at most [`BATCH`] rays, of whole pixels.
    /// Only a pixel with more rays than that is split, counted from its own last ray,
    /// so the order within a pixel never depends on its neighbours.
    pub fn last_batch(&self) -> Range<usize> {
        let (start, end) = (self.len().saturating_sub(BATCH), self.len());
        let splits = start > 0 && self.pixel[start - 1] == self.pixel[start];
        if !splits {
            return start..end;
        }
        let cut = self.pixel[start];
        let whole = self.pixel[start..].iter().position(|p| *p != cut);
        start + whole.unwrap_or(0)..end
    }

    /// Returns the rays from `first` on, padded to whole packets with rays that hit
    /// nothing. [`RayQueue::truncate`] removes the padding.
    pub fn padded_rays(&mut self, first: usize) -> Rays<'_> {
        let padded = first + (self.len() - first).next_multiple_of(MAX_LANES);
        let (org, dir) = match self.len().checked_sub(1) {
            Some(last) => (self.org.row(last), self.dir.row(last)),
            None => ([0.0; 3], [1.0; 3]),
        };
        self.org.resize(padded, org);
        self.dir.resize(padded, dir);
        self.t_min.resize(padded, 0.0);
        self.t_max.resize(padded, -1.0);
        Rays {
            org: Vectors::Double(self.org.slices(first)),
            dir: Vectors::Double(self.dir.slices(first)),
            t_min: &self.t_min[first..],
            t_max: &self.t_max[first..],
        }
    }

    /// Moves the origin of a ray.
    pub fn set_org(&mut self, ray: usize, org: [f64; 3]) {
        self.org.set(ray, org);
    }

    pub fn truncate(&mut self, rays: usize) {
        self.org.truncate(rays);
        self.dir.truncate(rays);
        self.t_min.truncate(rays);
        self.t_max.truncate(rays);
        self.pixel.truncate(rays);
        self.weight.truncate(rays);
        self.kind.truncate(rays);
    }

    /// Removes the first rays.
    pub fn drop_first(&mut self, rays: usize) {
        self.org.drop_first(rays);
        self.dir.drop_first(rays);
        self.t_min.drain(..rays);
        self.t_max.drain(..rays);
        self.pixel.drain(..rays);
        self.weight.drop_first(rays);
        self.kind.drain(..rays);
    }

    /// Gathers origins and directions of rows, in any order.
    #[inline(always)]
    pub fn gather(&self, rows: &[u32; STEP]) -> (Vec3<Doubles>, Vec3<Doubles>) {
        (self.org.gather(rows), self.dir.gather(rows))
    }

    pub fn org(&self, i: usize) -> [f64; 3] {
        self.org.row(i)
    }

    pub fn dir(&self, i: usize) -> [f64; 3] {
        self.dir.row(i)
    }
}

/// The ray queues of all depths so far.
pub struct RayQueues<'b> {
    depths: ArenaVec<'b, RayQueue<'b>>,
    arena: &'b Bump,
}

impl<'b> RayQueues<'b> {
    pub fn new(arena: &'b Bump) -> RayQueues<'b> {
        RayQueues {
            depths: ArenaVec::new_in(arena),
            arena,
        }
    }

    pub fn at(&mut self, depth: u32) -> &mut RayQueue<'b> {
        while self.depths.len() <= depth as usize {
            // Capacity for all rays that a batch may spawn, so the columns never move.
            let rays = if self.depths.is_empty() {
                BATCH
            } else {
                2 * BATCH
            };
            self.depths.push(RayQueue::with_capacity(rays, self.arena));
        }
        &mut self.depths[depth as usize]
    }

    /// Returns a depth's queue, and the queue of the rays it spawns.
    pub fn pair(&mut self, depth: u32) -> (&RayQueue<'b>, &mut RayQueue<'b>) {
        self.at(depth + 1);
        let (here, next) = self.depths.split_at_mut(depth as usize + 1);
        (&here[depth as usize], &mut next[0])
    }

    pub fn clear(&mut self) {
        for queue in &mut self.depths {
            queue.truncate(0);
        }
    }
}
