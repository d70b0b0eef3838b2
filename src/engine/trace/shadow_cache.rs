//! The last occluder of a light, tried before any traversal (Haines and
//! Greenberg, "The light buffer", 1986).
//!
//! A try is the query's own test of one primitive, so it can only find what the
//! traversal would find: no answer depends on the cache. Rays go in rounds (a
//! packet, or a stream) and are tried a packet at a time. That takes a few
//! nanoseconds a ray, and a wait for memory where the primitive is not at hand:
//! too much among triangles that block a ray each. So only what has blocked a
//! good part of the last round is tried in the next.

use super::query::HitId;
use serde::Serialize;
use std::ops::AddAssign;

/// Whether last occluders are tried.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Caching {
    #[default]
    On,
    Off,
}

impl Caching {
    pub const ALL: [Caching; 2] = [Caching::On, Caching::Off];

    /// As it is written on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Caching::On => "on",
            Caching::Off => "off",
        }
    }
}

/// What a cache did, in rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct CacheCounts {
    /// Rays that met the cached occluder's test.
    pub tries: u64,
    /// Those that it blocked: they were not traced.
    pub hits: u64,
}

impl AddAssign for CacheCounts {
    fn add_assign(&mut self, other: CacheCounts) {
        self.tries += other.tries;
        self.hits += other.hits;
    }
}

/// One light's, for rays that follow each other: those of a tile.
#[derive(Clone, Copy, Debug)]
pub struct ShadowCache {
    caching: Caching,
    occluder: HitId,
    pub counts: CacheCounts,
}

/// An occluder is tried again where it has blocked one ray in so many: then a
/// try costs less than what it spares.
const WORTH: u32 = 8;

impl ShadowCache {
    pub fn new(caching: Caching) -> ShadowCache {
        ShadowCache {
            caching,
            occluder: HitId::NONE,
            counts: CacheCounts::default(),
        }
    }

    /// What a round of rays should try first.
    #[inline(always)]
    pub(super) fn candidate(&self) -> Option<HitId> {
        (self.occluder != HitId::NONE).then_some(self.occluder)
    }

    /// After a candidate was tried.
    #[inline(always)]
    pub(super) fn tried(&mut self, rays: u32, certified: u32) {
        self.counts.tries += u64::from(rays);
        self.counts.hits += u64::from(certified);
    }

    /// At the end of a round: what has blocked so many of its rays.
    #[inline(always)]
    pub(super) fn remember(&mut self, occluder: HitId, blocked: u32, rays: u32) {
        let worth = self.caching == Caching::On && blocked > 0 && blocked * WORTH >= rays;
        self.occluder = if worth { occluder } else { HitId::NONE };
    }
}
