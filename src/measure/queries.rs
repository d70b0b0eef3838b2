//! From an array of rays to an array of answers, chunk by chunk.
//!
//! The rays come as `.rays` files have them; the kernels want whole packets of
//! columns. Each chunk is converted into buffers that its thread keeps, traced
//! there, and its answers are copied out. No answer depends on the chunks, nor
//! on the number of threads. `bench` times all of this.

use crate::accel::{Counter, Counts, World};
use crate::io::RaySet;
use crate::plan::Kernels;
use crate::render::Progress;
use crate::trace::{
    Ahead, CacheCounts, Caching, HitId, Hits, ItemBuffer, MAX_LANES, Rays, ShadowCache, TILE, any,
    any_counted, closest, closest_counted, closest_listed,
};
use rayon::prelude::*;
use std::cell::RefCell;
use std::hint::black_box;
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

/// Rays that are converted and traced at a time: the columns stay in the
/// second-level cache.
const CHUNK: usize = 2048;

thread_local! {
    static BUFFERS: RefCell<Buffers> = RefCell::default();
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
    let chunk = |number: usize, count: usize, run: &mut dyn FnMut(&mut Buffers, Ahead)| {
        if !progress.is_cancelled() {
            BUFFERS.with_borrow_mut(|buffers| {
                buffers.rays.fill(rays, number * CHUNK, count);
                run(buffers, next_chunk(rays, (number + 1) * CHUNK));
            });
        }
    };
    // One origin in f32 is one in f64.
    let ray = |i: usize| {
        let meets = rays.t_max[i] > 0.0;
        meets.then(|| (rays.org[i].map(f64::from), rays.dir[i]))
    };
    match ask {
        Ask::Closest => {
            let items = ItemBuffer::of_rays(world, rays.len(), ray);
            let t = answers.t.par_chunks_mut(CHUNK);
            let chunks = t.zip(answers.id.par_chunks_mut(CHUNK)).enumerate();
            chunks.for_each(|(number, (t, id))| {
                chunk(number, t.len(), &mut |buffers, ahead| {
                    let items = items.as_ref().map(|items| (items, number * CHUNK / TILE));
                    buffers.closest(world, kernels, (t, id), items, ahead);
                });
            });
        }
        Ask::Any => {
            let chunks = answers.blocked.par_chunks_mut(CHUNK).enumerate();
            chunks.for_each(|(number, blocked)| {
                chunk(number, blocked.len(), &mut |buffers, ahead| {
                    let cache = &mut ShadowCache::new(caching);
                    buffers.any(world, kernels, cache, blocked, ahead);
                    tries.fetch_add(cache.counts.tries, Relaxed);
                    hits.fetch_add(cache.counts.hits, Relaxed);
                });
            });
        }
    }
    (!progress.is_cancelled()).then_some(CacheCounts {
        tries: tries.into_inner(),
        hits: hits.into_inner(),
    })
}

/// The rays of the chunk that begins with `first`, if there is one.
fn next_chunk(rays: &RaySet, first: usize) -> Ahead<'_> {
    let rows = first.min(rays.len())..rays.len().min(first + CHUNK);
    Ahead {
        columns: [
            rays.org[rows.clone()].as_flattened(),
            rays.dir[rows.clone()].as_flattened(),
            &rays.t_min[rows.clone()],
            &rays.t_max[rows],
        ],
    }
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
    let mut columns = Columns::default();
    for first in (0..rays.len()).step_by(CHUNK) {
        if progress.is_cancelled() {
            return None;
        }
        columns.fill(rays, first, CHUNK.min(rays.len() - first));
        let padded = columns.t_max.len();
        match ask {
            Ask::Closest => {
                let mut hits = Hits {
                    t: &mut vec![0.0; padded],
                    id: &mut vec![HitId::NONE; padded],
                };
                closest_counted(world, kernels, &columns.borrowed(), &mut hits, &counter);
            }
            Ask::Any => {
                let mut cache = ShadowCache::new(caching);
                let (rays, mut blocked) = (columns.borrowed(), vec![false; padded]);
                any_counted(world, kernels, &rays, &mut cache, &mut blocked, &counter);
            }
        }
    }
    Some(counter.counts())
}

/// The conversion alone.
pub(super) fn convert(rays: &RaySet) {
    let chunks = rays.t_max.par_chunks(CHUNK).enumerate();
    chunks.for_each(|(number, chunk)| {
        BUFFERS.with_borrow_mut(|buffers| {
            buffers.rays.fill(rays, number * CHUNK, chunk.len());
            black_box(&buffers);
        });
    });
}

/// Buffers of one thread, kept from chunk to chunk.
#[derive(Default)]
struct Buffers {
    rays: Columns,
    t: Vec<f64>,
    id: Vec<HitId>,
    blocked: Vec<bool>,
}

impl Buffers {
    fn closest(
        &mut self,
        world: &World,
        kernels: &Kernels,
        (t, id): (&mut [f32], &mut [HitId]),
        items: Option<(&ItemBuffer, usize)>,
        ahead: Ahead,
    ) {
        let padded = self.rays.t_max.len();
        self.t.resize(padded, 0.0);
        // Into the answers themselves, unless the last packet would not fit.
        let whole = id.len() == padded;
        self.id.resize(if whole { 0 } else { padded }, HitId::NONE);
        let mut hits = Hits {
            t: &mut self.t,
            id: if whole { id } else { &mut self.id },
        };
        let rays = Rays {
            ahead,
            ..self.rays.borrowed()
        };
        match items {
            None => closest(world, kernels, &rays, &mut hits),
            Some(items) => closest_listed(world, kernels, &rays, items, &mut hits),
        }
        for (to, from) in t.iter_mut().zip(&self.t) {
            *to = *from as f32;
        }
        if !whole {
            id.copy_from_slice(&self.id[..id.len()]);
        }
    }

    fn any(
        &mut self,
        world: &World,
        kernels: &Kernels,
        cache: &mut ShadowCache,
        blocked: &mut [bool],
        ahead: Ahead,
    ) {
        self.blocked.resize(self.rays.t_max.len(), false);
        let rays = Rays {
            ahead,
            ..self.rays.borrowed()
        };
        any(world, kernels, &rays, cache, &mut self.blocked);
        blocked.copy_from_slice(&self.blocked[..blocked.len()]);
    }
}

/// Rows into columns, of which each is at least as long.
fn transpose(rows: &[[f32; 3]], [x, y, z]: [&mut [f32]; 3]) {
    // Of one known length, the loop becomes shuffles of registers.
    let count = rows.len();
    let (x, y, z) = (&mut x[..count], &mut y[..count], &mut z[..count]);
    for i in 0..count {
        [x[i], y[i], z[i]] = rows[i];
    }
}

/// The first row, if all are like it.
fn common(column: &[[f32; 3]]) -> Option<[f32; 3]> {
    let one = *column.first()?;
    let pattern = [one; 16];
    // Without a way out of its middle, a run is compared in registers.
    let like = |run: &[[f32; 3]]| {
        let pairs = run.as_flattened().iter().zip(pattern.as_flattened());
        pairs.fold(true, |same, (a, b)| same & (a == b))
    };
    column.chunks(pattern.len()).all(like).then_some(one)
}

/// Rays as the kernels want them, in whole packets.
#[derive(Default)]
pub(super) struct Columns {
    /// Where all rays start; `org` is empty then.
    origin: Option<[f64; 3]>,
    org: [Vec<f64>; 3],
    dir: [Vec<f32>; 3],
    t_min: Vec<f32>,
    t_max: Vec<f32>,
}

impl Columns {
    /// Takes in a range of the rays and pads it to whole packets.
    pub fn fill(&mut self, rays: &RaySet, first: usize, count: usize) {
        let padded = count.next_multiple_of(MAX_LANES);
        let rows = first..first + count;
        let (org, dir) = (&rays.org[rows.clone()], &rays.dir[rows.clone()]);
        let one = common(org);
        self.origin = one.map(|one| one.map(f64::from));
        for k in 0..3 {
            let rows = if one.is_some() { 0 } else { padded };
            self.org[k].resize(rows, 0.0);
            self.dir[k].resize(padded, 1.0);
        }
        self.t_min.resize(padded, 0.0);
        self.t_max.resize(padded, 0.0);
        if one.is_none() {
            for (k, column) in self.org.iter_mut().enumerate() {
                for (to, from) in column.iter_mut().zip(org) {
                    *to = f64::from(from[k]);
                }
            }
        }
        transpose(dir, self.dir.each_mut().map(Vec::as_mut_slice));
        self.t_min[..count].copy_from_slice(&rays.t_min[rows.clone()]);
        for (to, from) in self.t_max.iter_mut().zip(&rays.t_max[rows]) {
            // −∞ would mean that something has blocked it.
            *to = from.max(f32::MIN);
        }
        for k in 0..3 {
            if one.is_none() {
                self.org[k][count..].fill(0.0);
            }
            self.dir[k][count..].fill(1.0);
        }
        self.t_min[count..].fill(0.0);
        self.t_max[count..].fill(-1.0);
    }

    pub fn borrowed(&self) -> Rays<'_> {
        Rays {
            origin: self.origin,
            org: [&self.org[0], &self.org[1], &self.org[2]],
            dir: [&self.dir[0], &self.dir[1], &self.dir[2]],
            t_min: &self.t_min,
            t_max: &self.t_max,
            ahead: Ahead::default(),
        }
    }
}
