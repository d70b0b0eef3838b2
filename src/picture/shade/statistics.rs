//! Statistics that the integrator collects beside radiance.

use super::ray_queue::RayQueue;
use crate::accel::World;
use crate::plan::Kernels;
use crate::trace::{
    CacheCounts, HitId, Hits, Outcome, RayKind, Rays, Reuse, TemporalBounds, TemporalCounts,
    TraceScratch, TracedRay,
};
use serde::Serialize;

/// Number of rays traced, by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RayCounts {
    pub primary: u64,
    pub primary_hits: u64,
    pub shadow: u64,
    pub shadow_occluded: u64,
    /// Tries and hits of the shadow cache: the last occluder of each light and tile.
    pub shadow_cache: CacheCounts,
    pub reflection: u64,
    pub refraction: u64,
}

impl RayCounts {
    pub fn total(&self) -> u64 {
        self.primary + self.shadow + self.reflection + self.refraction
    }

    pub fn add(&mut self, other: &RayCounts) {
        self.primary += other.primary;
        self.primary_hits += other.primary_hits;
        self.shadow += other.shadow;
        self.shadow_occluded += other.shadow_occluded;
        self.shadow_cache += other.shadow_cache;
        self.reflection += other.reflection;
        self.refraction += other.refraction;
    }
}

/// Statistics of an integration: counts always, rays if requested.
pub struct Statistics<'a> {
    pub counts: RayCounts,
    /// Every ray with its answer, for `verify`.
    pub record: Option<&'a mut Vec<TracedRay>>,
    /// For the record: the sample index, and the map from a film row to a picture
    /// pixel.
    pub sample: u32,
    pub pixel_of: &'a dyn Fn(u32) -> u32,
    /// Temporal bounds of the camera rays from the frame before.
    pub memory: Option<&'a mut Memory>,
    /// By film row: one less for each camera ray that meets nothing.
    pub covered: Option<&'a mut [f32]>,
}

impl Statistics<'_> {
    /// Returns statistics of rays that are counted, and of which nothing is kept.
    pub fn of_counts() -> Self {
        Statistics {
            counts: RayCounts::default(),
            record: None,
            sample: 0,
            pixel_of: &|row| row,
            memory: None,
            covered: None,
        }
    }
}

/// Hits of a tile's camera rays, as temporal bounds for the next frame: in tracing
/// order, padding included. Empty at first.
#[derive(Debug, Default)]
pub struct Memory {
    temporal_bounds: TemporalBounds,
    /// Number of rays of this frame so far.
    row: usize,
    pub counts: TemporalCounts,
}

impl Memory {
    pub fn new(reuse: Reuse) -> Memory {
        Memory {
            temporal_bounds: TemporalBounds::new(reuse),
            ..Memory::default()
        }
    }

    /// Begins the next frame.
    pub fn restart(&mut self) {
        self.row = 0;
        self.counts = TemporalCounts::default();
    }

    /// Traces the next batch of camera rays and stores their hits.
    pub(super) fn closest(
        &mut self,
        world: &World,
        kernels: &Kernels,
        rays: &Rays,
        hits: &mut Hits,
        scratch: &mut TraceScratch,
    ) {
        let first = self.row;
        self.row += rays.len();
        let counts = self
            .temporal_bounds
            .closest(world, kernels, rays, first, hits, scratch);
        self.counts.add(&counts);
    }
}

/// Counts a batch's rays, and the hits of camera rays.
pub(super) fn count_rays(
    kinds: &[RayKind],
    instance: &[u64],
    depth: u32,
    statistics: &mut Statistics,
) {
    let rays = kinds.len() as u64;
    if depth == 0 {
        statistics.counts.primary += rays;
        let hits = instance.iter().filter(|x| **x != HitId::NONE.instance);
        statistics.counts.primary_hits += hits.count() as u64;
        return;
    }
    let mirrored = kinds.iter().filter(|k| **k == RayKind::Reflection);
    let mirrored = mirrored.count() as u64;
    statistics.counts.reflection += mirrored;
    statistics.counts.refraction += rays - mirrored;
}

/// Records ray `i` of a queue with its answer, if rays are requested.
#[inline(always)]
pub(super) fn record_ray(
    queue: &RayQueue,
    i: usize,
    depth: u32,
    outcome: Outcome,
    statistics: &mut Statistics,
) {
    let Some(record) = &mut statistics.record else {
        return;
    };
    record.push(TracedRay {
        kind: queue.kind[i],
        pixel: (statistics.pixel_of)(queue.pixel[i]),
        sample: statistics.sample,
        depth,
        org: queue.org(i),
        dir: queue.dir(i),
        t_max: queue.t_max[i],
        outcome,
    });
}
