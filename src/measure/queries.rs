//! Traces an array of rays to an array of answers, chunk by chunk.
//!
//! Kernels read the columns of the ray set and write the columns of the answers
//! directly; only an incomplete last tile is copied. No answer depends on the chunks or
//! on the number of threads. `bench` times all of this.

use lanecast_engine::accel::{Counter, Counts, World};
use lanecast_engine::trace::{
    BEAM, CacheCounts, Caching, Depths, HitIds, Hits, Ids, ItemBuffer, Rays, ScratchPool,
    ShadowCache, TraceScratch, Vectors, any, any_counted, closest, closest_counted, closest_listed,
};
use lanecast_io::RaySet;
use lanecast_model::plan::Kernels;
use lanecast_picture::render::Progress;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// The query for a ray set: closest hit or any hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ask {
    Closest,
    Any,
}

/// A ray set with its query.
pub struct Job {
    /// The name in reports.
    pub kind: String,
    pub ask: Ask,
    pub rays: RaySet,
}

/// Answers in columns, one row per ray; only the columns of the query are filled.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answers {
    /// Undefined without a hit.
    pub t: Vec<f32>,
    pub id: HitIds,
    pub blocked: Vec<bool>,
}

impl Answers {
    /// Returns the number of rays that hit or are blocked.
    pub fn hits(&self) -> usize {
        self.id.hits() + self.blocked.iter().filter(|blocked| **blocked).count()
    }

    pub(super) fn prepare(&mut self, ask: Ask, rays: usize) {
        let (closest, any) = match ask {
            Ask::Closest => (rays, 0),
            Ask::Any => (0, rays),
        };
        self.t.resize(closest, 0.0);
        self.id.resize(closest);
        self.blocked.resize(any, false);
    }

    /// Splits the closest-hit rows into chunks of `size`.
    pub(super) fn hit_chunks(
        &mut self,
        size: usize,
    ) -> impl IndexedParallelIterator<Item = Hits<'_>> {
        let instances = self.id.instance.par_chunks_mut(size);
        let ids = instances.zip(self.id.primitive.par_chunks_mut(size));
        let rows = self.t.par_chunks_mut(size).zip(ids);
        rows.map(|(t, (instance, primitive))| Hits {
            t: Depths::Single(t),
            id: Ids {
                instance,
                primitive,
            },
        })
    }
}

/// Rays per chunk: whole tiles, with one shadow cache.
const CHUNK: usize = 2048;

/// Returns the columns of some rows, which must be whole tiles.
pub(super) fn columns(rays: &RaySet, rows: Range<usize>) -> Rays<'_> {
    Rays {
        org: Vectors::Single(rays.org.each_ref().map(|x| &x[rows.clone()])),
        dir: Vectors::Single(rays.dir.each_ref().map(|x| &x[rows.clone()])),
        t_min: &rays.t_min[rows.clone()],
        t_max: &rays.t_max[rows],
    }
}

/// Copies some rows, padded to whole tiles with rays that hit nothing.
pub(super) fn padded(rays: &RaySet, rows: Range<usize>) -> RaySet {
    let missing = rows.len().next_multiple_of(BEAM) - rows.len();
    let mut tiles = rays.select(rows);
    for _ in 0..missing {
        tiles.push([0.0; 3], 0.0, [1.0; 3], -1.0);
    }
    tiles
}

/// Traces all rays on the current rayon pool. Returns `None` if cancelled. Each chunk
/// has its own shadow cache, as for the one light of a renderer's tile.
pub fn trace(
    world: &World,
    kernels: &Kernels,
    rays: &RaySet,
    (ask, caching): (Ask, Caching),
    answers: &mut Answers,
    progress: &Progress,
) -> Option<CacheCounts> {
    let (tries, hits) = (AtomicU64::new(0), AtomicU64::new(0));
    let whole = rays.len() / BEAM * BEAM;
    let last = padded(rays, whole..rays.len());
    // The rows of a chunk that lie in the set itself, and the rows that lie in the
    // padded last tile.
    let parts = |number: usize, count: usize| {
        let first = number * CHUNK;
        let full = count.min(whole - first);
        let most = (full > 0).then(|| (first, 0..full, columns(rays, first..first + full)));
        let rest = (full < count).then(|| (whole, full..count, columns(&last, 0..BEAM)));
        most.into_iter().chain(rest)
    };
    answers.prepare(ask, whole + last.len());
    let scratch = ScratchPool::<TraceScratch>::default();
    match ask {
        Ask::Closest => {
            // Origins that are equal in f32 are equal in f64.
            let ray = |i: usize| {
                let meets = rays.t_max[i] > 0.0;
                meets.then(|| (rays.org(i).map(f64::from), rays.dir(i).map(f64::from)))
            };
            let items = ItemBuffer::of_rays(world, rays.len(), ray);
            let chunks = answers.hit_chunks(CHUNK).enumerate();
            chunks.for_each(|(number, mut hits)| {
                for (first, rows, rays) in parts(number, hits.len()) {
                    let hits = &mut hits.rows(rows);
                    match &items {
                        _ if progress.is_cancelled() => (),
                        None => {
                            scratch.with(|scratch| closest(world, kernels, &rays, hits, scratch))
                        }
                        Some(items) => {
                            let items = (items, first / BEAM);
                            scratch.with(|scratch| {
                                closest_listed(world, kernels, &rays, items, hits, scratch);
                            });
                        }
                    }
                }
            });
        }
        Ask::Any => {
            let chunks = answers.blocked.par_chunks_mut(CHUNK).enumerate();
            chunks.for_each(|(number, blocked)| {
                let cache = &mut ShadowCache::new(caching);
                for (_, rows, rays) in parts(number, blocked.len()) {
                    if !progress.is_cancelled() {
                        let blocked = &mut blocked[rows];
                        scratch.with(|scratch| {
                            any(world, kernels, &rays, cache, blocked, scratch);
                        });
                    }
                }
                tries.fetch_add(cache.counts.tries, Relaxed);
                hits.fetch_add(cache.counts.hits, Relaxed);
            });
        }
    }
    answers.prepare(ask, rays.len());
    (!progress.is_cancelled()).then_some(CacheCounts {
        tries: tries.into_inner(),
        hits: hits.into_inner(),
    })
}

/// Counts the traversal steps of all rays, on this thread. Returns `None` if cancelled.
pub fn count(
    world: &World,
    kernels: &Kernels,
    rays: &RaySet,
    (ask, caching): (Ask, Caching),
    progress: &Progress,
) -> Option<Counts> {
    let (counter, mut scratch) = (Counter::default(), TraceScratch::default());
    let tiles = padded(rays, 0..rays.len());
    for first in (0..tiles.len()).step_by(CHUNK) {
        if progress.is_cancelled() {
            return None;
        }
        let count = CHUNK.min(tiles.len() - first);
        let rays = columns(&tiles, first..first + count);
        match ask {
            Ask::Closest => {
                let (mut t, mut id) = (vec![0.0; count], HitIds::none(count));
                let mut hits = Hits {
                    t: Depths::Single(&mut t),
                    id: id.columns(),
                };
                closest_counted(world, kernels, &rays, &mut hits, &counter, &mut scratch);
            }
            Ask::Any => {
                let mut cache = ShadowCache::new(caching);
                let mut blocked = vec![false; count];
                let (cache, blocked) = (&mut cache, &mut blocked);
                any_counted(
                    world,
                    kernels,
                    &rays,
                    cache,
                    blocked,
                    &counter,
                    &mut scratch,
                );
            }
        }
    }
    Some(counter.counts())
}
