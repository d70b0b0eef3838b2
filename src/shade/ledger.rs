//! What an integration notes beside radiance.

use super::wave::Wave;
use crate::accel::World;
use crate::plan::Kernels;
use crate::trace::{
    CacheCounts, GuessCounts, Guesses, HitId, Hits, Outcome, RayKind, Rays, Reuse, TracedRay,
};
use serde::Serialize;

/// Rays traced, by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RayCounts {
    pub primary: u64,
    pub primary_hits: u64,
    pub shadow: u64,
    pub shadow_occluded: u64,
    /// Of the last occluders of each light and tile, which are tried first.
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

/// What the integrator notes beside radiance: counts always, rays if wanted.
pub struct Ledger<'a> {
    pub counts: RayCounts,
    /// Every ray with its answer, for `verify`.
    pub record: Option<&'a mut Vec<TracedRay>>,
    /// For the record: sample number, and the picture's pixel of a film row.
    pub sample: u32,
    pub pixel_of: &'a dyn Fn(u32) -> u32,
    /// Camera rays' hits of the frame before, for those of this one.
    pub memory: Option<&'a mut Memory>,
}

/// What a film's camera rays met, for those of the next frame: in the order in
/// which they are traced, padding included. Empty at first.
#[derive(Debug, Default)]
pub struct Memory {
    guesses: Guesses,
    /// Rays of this frame so far.
    row: usize,
    pub counts: GuessCounts,
}

impl Memory {
    pub fn new(reuse: Reuse) -> Memory {
        Memory {
            guesses: Guesses::new(reuse),
            ..Memory::default()
        }
    }

    /// The next frame begins.
    pub fn restart(&mut self) {
        self.row = 0;
        self.counts = GuessCounts::default();
    }

    /// Traces the next piece of the camera rays, and remembers what they meet.
    pub(super) fn closest(
        &mut self,
        world: &World,
        kernels: &Kernels,
        rays: &Rays,
        hits: &mut Hits,
    ) {
        let first = self.row;
        self.row += rays.len();
        let counts = self.guesses.closest(world, kernels, rays, first, hits);
        self.counts.add(&counts);
    }
}

/// Rays of a depth, and what they met.
pub(super) fn note_counts(kinds: &[RayKind], instance: &[u64], depth: u32, ledger: &mut Ledger) {
    let rays = kinds.len() as u64;
    if depth == 0 {
        ledger.counts.primary += rays;
        let hits = instance.iter().filter(|x| **x != HitId::NONE.instance);
        ledger.counts.primary_hits += hits.count() as u64;
        return;
    }
    let mirrored = kinds.iter().filter(|k| **k == RayKind::Reflection);
    let mirrored = mirrored.count() as u64;
    ledger.counts.reflection += mirrored;
    ledger.counts.refraction += rays - mirrored;
}

/// Ray `i` of a wave, if rays are wanted.
#[inline(always)]
pub(super) fn note(wave: &Wave, i: usize, depth: u32, outcome: Outcome, ledger: &mut Ledger) {
    let Some(record) = &mut ledger.record else {
        return;
    };
    record.push(TracedRay {
        kind: wave.kind[i],
        pixel: (ledger.pixel_of)(wave.pixel[i]),
        sample: ledger.sample,
        depth,
        org: wave.org(i),
        dir: wave.dir(i),
        t_max: wave.t_max[i],
        outcome,
    });
}
