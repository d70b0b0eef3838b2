//! The shadow cache: a light's last occluder is tested before traversal (Haines and Greenberg,
//! "The light buffer", 1986).
//!
//! The test is the query's own, so it finds only what the traversal would find, and no answer
//! depends on the cache. Rays are tested in rounds, a packet or stream at a time. A test takes
//! a few nanoseconds per ray and often a cache miss, which is too much where triangles block
//! one ray each. So an occluder is only kept if it blocked a good part of the last round.

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

    /// Returns the name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Caching::On => "on",
            Caching::Off => "off",
        }
    }
}

/// Counts of rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct CacheCounts {
    /// Rays tested against the cached occluder.
    pub tries: u64,
    /// Rays that it blocked, which were not traced.
    pub hits: u64,
}

impl AddAssign for CacheCounts {
    fn add_assign(&mut self, other: CacheCounts) {
        self.tries += other.tries;
        self.hits += other.hits;
    }
}

/// The shadow cache of one light, for the consecutive rays of a tile.
#[derive(Clone, Copy, Debug)]
pub struct ShadowCache {
    caching: Caching,
    occluder: HitId,
    pub counts: CacheCounts,
}

/// An occluder is kept if it blocked at least one ray in this many: tests then cost less than
/// the tracing that they save.
const WORTH: u32 = 8;

impl ShadowCache {
    pub fn new(caching: Caching) -> ShadowCache {
        ShadowCache {
            caching,
            occluder: HitId::NONE,
            counts: CacheCounts::default(),
        }
    }

    /// Returns the occluder to test first.
    #[inline(always)]
    pub(super) fn candidate(&self) -> Option<HitId> {
        (self.occluder != HitId::NONE).then_some(self.occluder)
    }

    /// Counts a test of the occluder.
    #[inline(always)]
    pub(super) fn tried(&mut self, rays: u32, certified: u32) {
        self.counts.tries += u64::from(rays);
        self.counts.hits += u64::from(certified);
    }

    /// Ends a round: keeps the occluder if it blocked enough of the rays.
    #[inline(always)]
    pub(super) fn remember(&mut self, occluder: HitId, blocked: u32, rays: u32) {
        let worth = self.caching == Caching::On && blocked > 0 && blocked * WORTH >= rays;
        self.occluder = if worth { occluder } else { HitId::NONE };
    }
}
