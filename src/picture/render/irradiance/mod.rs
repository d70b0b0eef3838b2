//! Fills an irradiance cache before a picture is rendered from it.
//!
//! In passes over ever finer grids of pixels, paths from the camera look where the cache has no
//! record yet. A pass sees the cache as the pass before, or a batch of this one, has left it, and
//! what it asks for is taken in the order of pixels, so no thread or tile can show. Records are
//! gathered as pixels are rendered: each is a pixel of its own, whose samples are paths over the
//! hemisphere above the point.
//!
//! How far a record serves follows from how the light of what its rays have met changes around it
//! (`light::hemisphere`), and it ends before what stands around, in each direction by itself: so no
//! light leaks through walls, however thin, as what lies behind one is farther away than the wall.

mod gather;
mod kept;

pub use kept::LightCache;

use super::RenderConfig;
use super::camera::RayGenerator;
use super::paths::{PathPicture, PathTile};
use super::picture::{RenderError, View, Worker};
use super::pixel_order::Spot;
use super::progress::Progress;
use crate::shade::RayCounts;
use crate::shade::Statistics;
use crate::shade::path::{
    CacheUse, Irradiance, IrradianceRecord, Missed, PathScratch, PathTracer, SampleNumbers, Slot,
    UseMode,
};
use crate::trace::{ScratchPool, ShadowCache};
use rayon::prelude::*;
use serde::Serialize;
use std::sync::Mutex;
use std::sync::atomic::Ordering::Relaxed;
use std::time::Instant;

/// How indirect light is cached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndirectCaching {
    /// Whether some paths go on, so that the mean of pictures is right.
    pub is_unbiased: bool,
    /// How far records serve, and how many rays gather them: about the part of the light that they
    /// may be wrong by, from 0.02 to 1.
    pub error: f64,
}

/// Distances of pixels in the passes.
const STRIDES: [u32; 5] = [16, 8, 4, 2, 1];

/// Records that are gathered before the cache is looked at again, at first and at most; and in one
/// piece of work.
const FIRST_BATCH: usize = 64;
const BATCH: usize = 1024;
const PIECE: usize = 16;

/// Where the records of a picture come from, and what they took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct CacheCounts {
    /// Records of a file that serve the picture.
    pub from_file: usize,
    /// Records of earlier pictures that serve it.
    pub kept: usize,
    /// Records that were made for it.
    pub added: usize,
    /// Wall-clock time of looking for what is missing and making it.
    pub seconds: f64,
}

impl CacheCounts {
    /// Returns the number of records that serve the picture.
    pub fn records(&self) -> usize {
        self.from_file + self.kept + self.added
    }
}

impl PathPicture {
    /// Fills the cache of a picture, if it is to have one, from the records that are kept, and keeps
    /// what it adds. Returns the rays that this took, and the counts of a picture that has a cache.
    ///
    /// Fails if the records of a file are of other light.
    pub fn cached(
        mut self,
        (view, config): (&View, &RenderConfig),
        generator: &RayGenerator,
        light: &mut LightCache,
        progress: &Progress,
    ) -> Result<(PathPicture, RayCounts, Option<CacheCounts>), RenderError> {
        let Some(caching) = config.caching.filter(|_| self.max_depth > 1) else {
            return Ok((self, RayCounts::default(), None));
        };
        let start = Instant::now();
        let (kept, mut counts) = light.serving(&self, view, generator)?;
        let old = kept.len();
        self.cache = Some((Irradiance::new(kept), UseMode::Probe));
        let filler = Filler {
            view,
            config,
            generator,
            progress,
            caching,
            workers: ScratchPool::default(),
            counts: Mutex::default(),
        };
        let records = filler.fill(&mut self);
        light.keep(&records[old..]);
        let mode = match caching.is_unbiased {
            true => UseMode::Control,
            false => UseMode::Final,
        };
        counts.added = records.len() - old;
        self.cache = Some((Irradiance::new(records), mode));
        counts.seconds = start.elapsed().as_secs_f64();
        let rays = filler.counts.into_inner();
        Ok((self, rays.unwrap_or_else(|e| e.into_inner()), Some(counts)))
    }
}

/// What filling needs.
struct Filler<'a> {
    view: &'a View<'a>,
    config: &'a RenderConfig,
    generator: &'a RayGenerator,
    progress: &'a Progress,
    caching: IndirectCaching,
    workers: ScratchPool<Worker>,
    /// All rays so far.
    counts: Mutex<RayCounts>,
}

/// A point without a record, seen at a pixel.
type Asked = ((u32, u32), Missed);

impl Filler<'_> {
    fn fill(&self, picture: &mut PathPicture) -> Vec<IrradianceRecord> {
        self.progress.start(STRIDES.len() as u32);
        for stride in STRIDES {
            let asked = self.probe(picture, stride);
            self.add(picture, asked);
            self.progress.add_tile(0);
        }
        let cache = picture.cache.take().map(|(cache, _)| cache);
        cache.unwrap_or_default().records
    }

    /// Counts rays.
    fn count(&self, counts: &RayCounts) {
        self.progress.rays.fetch_add(counts.total(), Relaxed);
        let mut all = self.counts.lock().unwrap_or_else(|e| e.into_inner());
        all.add(counts);
    }

    /// Adds to a picture's cache the records of some points, as far as those before them leave
    /// need of them.
    fn add(&self, picture: &mut PathPicture, mut asked: Vec<Asked>) {
        let cache = picture.cache.take().map(|(cache, _)| cache);
        let mut records = cache.unwrap_or_default().records;
        let mut batch = FIRST_BATCH;
        while !asked.is_empty() && !self.progress.is_cancelled() {
            let rest = asked.split_off(asked.len().min(batch));
            batch = BATCH.min(2 * batch);
            let gathered: Vec<Option<IrradianceRecord>> = asked
                .par_chunks(PIECE)
                .flat_map_iter(|piece| self.gather(picture, piece))
                .collect();
            let old = records.len();
            for record in gathered.into_iter().flatten() {
                let served = |other: &IrradianceRecord| {
                    other.weight(record.point, record.normal) >= PathTracer::SERVED
                };
                if !records[old..].iter().any(served) {
                    records.push(record);
                }
            }
            let cache = Irradiance::new(records.clone());
            let is_missed = |(_, m): &Asked| !cache.serves(m.point, m.normal);
            asked = rest.into_iter().filter(is_missed).collect();
        }
        picture.cache = Some((Irradiance::new(records), UseMode::Probe));
    }

    fn tile<'t>(&'t self, picture: &'t PathPicture, order: &'t [Spot]) -> PathTile<'t> {
        PathTile {
            view: self.view,
            config: self.config,
            picture,
            generator: self.generator,
            corner: (0, 0),
            order,
            cancel: &self.progress.cancel,
        }
    }

    /// Lists the points, seen at the pixels of a grid that no coarser one has, that have no
    /// record.
    fn probe(&self, picture: &PathPicture, stride: u32) -> Vec<Asked> {
        let coarser = match stride == STRIDES[0] {
            true => u32::MAX,
            false => 2 * stride,
        };
        let (width, height) = (self.config.width, self.config.height);
        let is_new =
            |(x, y): &(u32, u32)| coarser == u32::MAX || x % coarser != 0 || y % coarser != 0;
        let rows: Vec<u32> = (0..height).step_by(stride as usize).collect();
        let pixels = rows.iter().flat_map(|y| {
            let row = (0..width).step_by(stride as usize).map(|x| (x, *y));
            row.filter(is_new)
        });
        let pixels: Vec<(u32, u32)> = pixels.collect();
        let pieces = pixels.par_chunks(BATCH);
        let some = pieces.flat_map_iter(|pixels| {
            let spot = |(row, (x, y)): (usize, &(u32, u32))| Spot {
                x: *x,
                y: *y,
                row: row as u32,
            };
            let order: Vec<Spot> = pixels.iter().enumerate().map(spot).collect();
            let tile = self.tile(picture, &order);
            let mut missed = self.workers.with(|worker| {
                let Worker { arena, trace } = worker;
                let mut scratch = PathScratch::new(arena, trace, picture.kinds());
                tile.queue_rays(0, &mut scratch);
                let slots = &mut vec![Slot::default(); order.len()];
                let cache = &mut ShadowCache::new(self.config.shadow_cache);
                let statistics = &mut Statistics::of_counts();
                tile.tracer().run(
                    &mut scratch,
                    SampleNumbers::One(0),
                    slots,
                    cache,
                    statistics,
                );
                self.count(&statistics.counts);
                let missed = scratch.take_missed();
                drop(scratch);
                arena.reset();
                missed
            });
            missed.sort_by_key(|m| m.pixel);
            missed
                .into_iter()
                .map(|m| (pixels[m.pixel as usize], m))
                .collect::<Vec<_>>()
        });
        some.collect()
    }
}

/// A cache and its use, for a tracer.
pub(super) fn use_of<'p>(picture: &'p PathPicture, config: &RenderConfig) -> Option<CacheUse<'p>> {
    let unbiased = config.caching.is_some_and(|caching| caching.is_unbiased);
    picture.cache.as_ref().map(|(records, mode)| CacheUse {
        records,
        mode: *mode,
        probe_depth: u32::from(unbiased),
    })
}
