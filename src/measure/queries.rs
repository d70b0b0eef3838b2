//! From an array of rays to an array of answers, chunk by chunk.
//!
//! The columns of a ray set are those that the kernels read, and they write into
//! the columns of the answers; only the last tile, where it is not full, is
//! copied. No answer depends on the chunks, nor on the number of threads. `bench`
//! times all of this.

use crate::accel::{Counter, Counts, World};
use crate::io::RaySet;
use crate::plan::Kernels;
use crate::render::Progress;
use crate::trace::{
    CacheCounts, Caching, Depths, HitId, Hits, ItemBuffer, Origins, Rays, ShadowCache, TILE, any,
    any_counted, closest, closest_counted, closest_listed,
};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// The question to a ray set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ask {
    Closest,
    Any,
}

/// Rays with one question.
pub struct Job {
    /// As it is reported.
    pub kind: String,
    pub ask: Ask,
    pub rays: RaySet,
}

/// Answers as columns, a row per ray; only those of the question are filled.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answers {
    /// Meaningless without a hit.
    pub t: Vec<f32>,
    pub id: Vec<HitId>,
    pub blocked: Vec<bool>,
}

impl Answers {
    /// Rays that hit, or are blocked.
    pub fn hits(&self) -> usize {
        let hits = self.id.iter().filter(|id| **id != HitId::NONE).count();
        hits + self.blocked.iter().filter(|blocked| **blocked).count()
    }

    pub(super) fn prepare(&mut self, ask: Ask, rays: usize) {
        let (closest, any) = match ask {
            Ask::Closest => (rays, 0),
            Ask::Any => (0, rays),
        };
        self.t.resize(closest, 0.0);
        self.id.resize(closest, HitId::NONE);
        self.blocked.resize(any, false);
    }
}

/// Rays that are traced at a time: whole tiles, and one shadow cache.
const CHUNK: usize = 2048;

/// Rows of a set, of which there must be whole tiles.
pub(super) fn columns(rays: &RaySet, rows: Range<usize>) -> Rays<'_> {
    Rays {
        org: Origins::Single(rays.org.each_ref().map(|x| &x[rows.clone()])),
        dir: rays.dir.each_ref().map(|x| &x[rows.clone()]),
        t_min: &rays.t_min[rows.clone()],
        t_max: &rays.t_max[rows],
    }
}

/// Rows of a set, filled up to whole tiles with rays that meet nothing.
pub(super) fn padded(rays: &RaySet, rows: Range<usize>) -> RaySet {
    let missing = rows.len().next_multiple_of(TILE) - rows.len();
    let mut tiles = rays.select(rows);
    for _ in 0..missing {
        tiles.push([0.0; 3], 0.0, [1.0; 3], -1.0);
    }
    tiles
}

/// Traces all rays on the current rayon pool; `None` where it was cancelled. Each
/// chunk has a shadow cache of its own, as for the one light of a renderer's tile.
pub fn trace(
    world: &World,
    kernels: &Kernels,
    rays: &RaySet,
    (ask, caching): (Ask, Caching),
    answers: &mut Answers,
    progress: &Progress,
) -> Option<CacheCounts> {
    answers.prepare(ask, rays.len());
    let (tries, hits) = (AtomicU64::new(0), AtomicU64::new(0));
    let whole = rays.len() / TILE * TILE;
    let rest = padded(rays, whole..rays.len());
    let rest = (!rest.is_empty()).then(|| columns(&rest, 0..TILE));
    match ask {
        Ask::Closest => {
            // One origin in f32 is one in f64.
            let ray = |i: usize| {
                let meets = rays.t_max[i] > 0.0;
                meets.then(|| (rays.org(i).map(f64::from), rays.dir(i)))
            };
            let items = ItemBuffer::of_rays(world, rays.len(), ray);
            let run = |first: usize, rays: &Rays, t: &mut [f32], id: &mut [HitId]| {
                let hits = &mut Hits {
                    t: Depths::Single(t),
                    id,
                };
                match &items {
                    _ if progress.is_cancelled() => (),
                    None => closest(world, kernels, rays, hits),
                    Some(items) => {
                        closest_listed(world, kernels, rays, (items, first / TILE), hits)
                    }
                }
            };
            let (t, last_t) = answers.t.split_at_mut(whole);
            let (id, last_id) = answers.id.split_at_mut(whole);
            let chunks = t.par_chunks_mut(CHUNK).zip(id.par_chunks_mut(CHUNK));
            chunks.enumerate().for_each(|(number, (t, id))| {
                let first = number * CHUNK;
                run(first, &columns(rays, first..first + t.len()), t, id);
            });
            if let Some(rays) = rest {
                let (mut t, mut id) = ([0.0; TILE], [HitId::NONE; TILE]);
                run(whole, &rays, &mut t, &mut id);
                last_t.copy_from_slice(&t[..last_t.len()]);
                last_id.copy_from_slice(&id[..last_id.len()]);
            }
        }
        Ask::Any => {
            let run = |rays: &Rays, blocked: &mut [bool]| {
                if progress.is_cancelled() {
                    return;
                }
                let cache = &mut ShadowCache::new(caching);
                any(world, kernels, rays, cache, blocked);
                tries.fetch_add(cache.counts.tries, Relaxed);
                hits.fetch_add(cache.counts.hits, Relaxed);
            };
            let (blocked, last) = answers.blocked.split_at_mut(whole);
            let chunks = blocked.par_chunks_mut(CHUNK).enumerate();
            chunks.for_each(|(number, blocked)| {
                let first = number * CHUNK;
                run(&columns(rays, first..first + blocked.len()), blocked);
            });
            if let Some(rays) = rest {
                let mut blocked = [false; TILE];
                run(&rays, &mut blocked);
                last.copy_from_slice(&blocked[..last.len()]);
            }
        }
    }
    (!progress.is_cancelled()).then_some(CacheCounts {
        tries: tries.into_inner(),
        hits: hits.into_inner(),
    })
}

/// What tracing all rays takes, on this thread; `None` where it was cancelled.
pub fn count(
    world: &World,
    kernels: &Kernels,
    rays: &RaySet,
    (ask, caching): (Ask, Caching),
    progress: &Progress,
) -> Option<Counts> {
    let counter = Counter::default();
    let tiles = padded(rays, 0..rays.len());
    for first in (0..tiles.len()).step_by(CHUNK) {
        if progress.is_cancelled() {
            return None;
        }
        let count = CHUNK.min(tiles.len() - first);
        let rays = columns(&tiles, first..first + count);
        match ask {
            Ask::Closest => {
                let mut hits = Hits {
                    t: Depths::Single(&mut vec![0.0; count]),
                    id: &mut vec![HitId::NONE; count],
                };
                closest_counted(world, kernels, &rays, &mut hits, &counter);
            }
            Ask::Any => {
                let mut cache = ShadowCache::new(caching);
                let mut blocked = vec![false; count];
                any_counted(world, kernels, &rays, &mut cache, &mut blocked, &counter);
            }
        }
    }
    Some(counter.counts())
}
