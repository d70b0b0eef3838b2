//! Fills an irradiance cache before a picture is rendered from it.
//!
//! In passes over ever finer grids of pixels, paths from the camera look where the cache has no
//! record yet. A pass sees the cache as the pass before, or a batch of this one, has left it, and
//! what it asks for is taken in the order of pixels, so no thread or tile can show. Records are
//! gathered as pixels are rendered: each is a pixel of its own, whose samples are paths over the
//! hemisphere above the point.
//!
//! A record serves a part of the harmonic mean of the distances to what it sees (Ward, Rubinstein
//! and Clear 1988), but never as far as the nearest thing around: so no light leaks through walls,
//! however thin, as what lies behind one is farther away than the wall. Neighbours' radii differ by
//! no more than their distance allows (Křivánek et al. 2006, "Making Radiance and Irradiance
//! Caching Practical", section 4).

use super::RenderConfig;
use super::camera::RayGenerator;
use super::paths::{PathPicture, PathTile};
use super::pixel_order::Spot;
use super::progress::Progress;
use super::sums::Sums;
use super::tile::{View, Worker};
use crate::light::sampling::cosine_hemisphere;
use crate::shade::RayCounts;
use crate::shade::Statistics;
use crate::shade::path::{
    CacheUse, Irradiance, IrradianceRecord, Missed, PathScratch, PathTracer, SampleNumbers, Slot,
    UseMode,
};
use crate::trace::{RayKind, ScratchPool, ShadowCache};
use glam::DVec3;
use rayon::prelude::*;

/// How indirect light is cached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndirectCaching {
    /// Whether some paths go on, so that the mean of pictures is right.
    pub is_unbiased: bool,
    /// How far a record serves, as a part of the distance of what it sees.
    pub error: f64,
}

/// Distances of pixels in the passes.
const STRIDES: [u32; 5] = [16, 8, 4, 2, 1];

/// Records that are gathered before the cache is looked at again, and in one piece of work.
const BATCH: usize = 1024;
const PIECE: usize = 64;

/// Radii in widths of a pixel where the record lies.
const LEAST_WIDTHS: f64 = 1.5;
const MOST_WIDTHS: f64 = 48.0;

/// A record's radius, at most, as a part of the distance of the nearest thing that it sees.
const OF_NEAREST: f64 = 0.8;

/// Rays just above the horizon that look for near things: their number, and the sine of their
/// height.
const AROUND: u32 = 16;
const HEIGHT: f64 = 0.04;

/// Records whose halves differ by more than this part of the cache's error go on, to so many times
/// the samples at the most.
const NOISE: f64 = 0.125;
const MOST_TIMES: u32 = 4;

/// Keys of records differ from those of pixels by this bit of x.
const RECORD: u32 = 1 << 30;

/// What a record's rays have found.
#[derive(Clone, Copy, Default)]
struct Gathered {
    light: [f32; 3],
    /// Sum of 1/distance, and how many distances there are.
    inverse: f64,
    count: u32,
    /// Samples, with those whose directions lead below the surface.
    samples: u32,
    nearest: f64,
    /// Things are nearer than a pixel's width: light there is left to paths.
    is_left: bool,
    /// There are samples enough.
    is_done: bool,
    /// The sum of the first half of the samples.
    half: [f64; 4],
}

impl Gathered {
    /// Says whether half of the samples tells the same as all, within a part of it.
    fn is_quiet(&self, sum: [f64; 4], error: f64) -> bool {
        let off: f64 = (0..3).map(|k| (2.0 * self.half[k] - sum[k]).abs()).sum();
        off <= error * (sum[0] + sum[1] + sum[2])
    }
}

impl PathPicture {
    /// Returns the number of records in the picture's cache, if it has one.
    pub fn records(&self) -> Option<usize> {
        self.cache.as_ref().map(|(cache, _)| cache.records.len())
    }

    /// Fills the cache of a picture, if it is to have one.
    pub fn cached(
        mut self,
        view: &View,
        config: &RenderConfig,
        generator: &RayGenerator,
        progress: &Progress,
    ) -> PathPicture {
        let Some(caching) = config.caching.filter(|_| self.max_depth > 1) else {
            return self;
        };
        self.cache = Some((Irradiance::default(), UseMode::Probe));
        let filler = Filler {
            view,
            config,
            generator,
            progress,
            caching,
            workers: ScratchPool::default(),
        };
        let records = filler.fill(&mut self);
        let mode = match caching.is_unbiased {
            true => UseMode::Control,
            false => UseMode::Final,
        };
        self.cache = Some((Irradiance::new(records), mode));
        self
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
}

/// A point without a record, seen at a pixel.
type Asked = ((u32, u32), Missed);

impl Filler<'_> {
    fn fill(&self, picture: &mut PathPicture) -> Vec<IrradianceRecord> {
        let mut records: Vec<IrradianceRecord> = Vec::new();
        for stride in STRIDES {
            let mut asked = self.probe(picture, stride);
            while !asked.is_empty() && !self.progress.is_cancelled() {
                let rest = asked.split_off(asked.len().min(BATCH));
                let gathered: Vec<Gathered> = asked
                    .par_chunks(PIECE)
                    .flat_map_iter(|piece| self.gather(picture, piece))
                    .collect();
                let old = records.len();
                for ((_, missed), gathered) in asked.iter().zip(&gathered) {
                    let record = self.record(missed, gathered);
                    let served = |other: &IrradianceRecord| {
                        other.weight(record.point, record.normal) >= PathTracer::SERVED
                    };
                    if !gathered.is_left && !records[old..].iter().any(served) {
                        records.push(record);
                    }
                }
                records = self.clamped(records);
                let cache = Irradiance::new(records.clone());
                let is_missed = |(_, m): &Asked| !cache.serves(m.point, m.normal);
                asked = rest.into_iter().filter(is_missed).collect();
                picture.cache = Some((cache, UseMode::Probe));
            }
        }
        records
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
            let tile = PathTile {
                view: self.view,
                config: self.config,
                picture,
                generator: self.generator,
                corner: (0, 0),
                order: &order,
                cancel: &self.progress.cancel,
            };
            let mut missed = self.workers.with(|worker| {
                let Worker { arena, trace } = worker;
                let mut scratch = PathScratch::new(arena, trace, picture.kinds());
                tile.queue_rays(0, &mut scratch);
                let slots = &mut vec![Slot::default(); order.len()];
                let cache = &mut ShadowCache::new(self.config.shadow_cache);
                tile.tracer().run(
                    &mut scratch,
                    SampleNumbers::One(0),
                    slots,
                    cache,
                    &mut statistics(),
                );
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

    /// Gathers indirect light at some points.
    fn gather(&self, picture: &PathPicture, asked: &[Asked]) -> Vec<Gathered> {
        let tile = PathTile {
            view: self.view,
            config: self.config,
            picture,
            generator: self.generator,
            corner: (0, 0),
            order: &[],
            cancel: &self.progress.cancel,
        };
        let tracer = PathTracer {
            // The ray itself is one of the times that a path is scattered.
            max_depth: picture.max_depth - 1,
            backdrop: crate::shade::path::Seen::Nothing,
            ground: None,
            cache: None,
            only_indirect: true,
            ..tile.tracer()
        };
        let horizon = PathTracer {
            max_depth: 0,
            ..tile.tracer()
        };
        let samples = self.samples();
        let mut all = vec![
            Gathered {
                nearest: f64::INFINITY,
                ..Gathered::default()
            };
            asked.len()
        ];
        let keys: Vec<u32> = (asked.iter())
            .map(|((x, y), _)| picture.sampler.key(x | RECORD, *y))
            .collect();
        self.workers.with(|worker| {
            let Worker { arena, trace } = worker;
            let mut scratch = PathScratch::new(arena, trace, picture.kinds());
            scratch.ask_reach();
            let slots = arena.alloc_slice_fill_copy(asked.len(), Slot::default());
            let mut sums = Sums::new(asked.len(), arena);
            let cache = &mut ShadowCache::new(self.config.shadow_cache);
            // Near things are looked for first: a point that has them within a pixel gets no record.
            for number in 0..AROUND + samples * MOST_TIMES {
                let is_gathering = number >= AROUND;
                let sample = number.wrapping_sub(AROUND);
                if number == AROUND {
                    for (gathered, (_, missed)) in all.iter_mut().zip(asked) {
                        let least = self.generator.pixel_width(missed.point) * LEAST_WIDTHS;
                        gathered.is_left = OF_NEAREST * gathered.nearest < least;
                    }
                }
                if is_gathering && sample >= samples / 2 && sample.is_power_of_two() {
                    let error = NOISE * self.caching.error;
                    for (row, gathered) in all.iter_mut().enumerate() {
                        let sum = sums.of(row);
                        gathered.is_done |= sample >= samples && gathered.is_quiet(sum, error);
                        gathered.half = sum;
                    }
                }
                if is_gathering && all.iter().all(|of| of.is_left || of.is_done) {
                    break;
                }
                let toward = |row: usize, missed: &Missed| {
                    let (x, y) = missed.normal.any_orthonormal_pair();
                    let [along, across, up] = match is_gathering {
                        true => {
                            let [u, v, ..] = picture.sampler.pad_one(keys[row], sample, 0);
                            let local = cosine_hemisphere::<f32>([u, v]);
                            [local.x, local.y, local.z].map(f64::from)
                        }
                        false => {
                            let turn = f64::from(number) / f64::from(AROUND);
                            let (sin, cos) = libm::sincos(turn * std::f64::consts::TAU);
                            [cos, sin, HEIGHT]
                        }
                    };
                    x * along + y * across + missed.normal * up
                };
                let left = |row: usize| all[row].is_left || all[row].is_done;
                let rows = queue(&mut scratch, (asked, &keys), left, toward);
                slots.fill(Slot::default());
                let tracer = if is_gathering { &tracer } else { &horizon };
                tracer.run(
                    &mut scratch,
                    SampleNumbers::One(sample & 0xffff),
                    slots,
                    cache,
                    &mut statistics(),
                );
                if self.progress.is_cancelled() {
                    break;
                }
                if is_gathering {
                    sums.add(slots);
                }
                for (row, distance) in rows.iter().zip(scratch.reach()) {
                    let gathered = &mut all[*row as usize];
                    gathered.nearest = gathered.nearest.min(*distance);
                    gathered.inverse += if is_gathering { 1.0 / distance } else { 0.0 };
                    gathered.count += u32::from(is_gathering);
                }
                for gathered in all.iter_mut().filter(|of| !of.is_done) {
                    gathered.samples += u32::from(is_gathering);
                }
            }
            for (row, gathered) in all.iter_mut().enumerate() {
                let share = 1.0 / f64::from(gathered.samples.max(1));
                let [r, g, b, _] = sums.of(row).map(|sum| (sum * share) as f32);
                gathered.light = [r, g, b].map(|c| if c >= 0.0 { c.min(f32::MAX) } else { 0.0 });
            }
            drop(sums);
            drop(scratch);
            arena.reset();
        });
        all
    }

    /// Returns the number of rays that gather a record.
    fn samples(&self) -> u32 {
        let wanted = 8.0 / (self.caching.error * self.caching.error);
        (wanted.clamp(64.0, 4096.0) as u32).next_power_of_two()
    }

    /// Makes the record of what was gathered.
    fn record(&self, missed: &Missed, gathered: &Gathered) -> IrradianceRecord {
        let harmonic = f64::from(gathered.count.max(1)) / gathered.inverse;
        let width = self.generator.pixel_width(missed.point);
        let wanted = self.caching.error * harmonic;
        let radius = wanted.clamp(LEAST_WIDTHS * width, MOST_WIDTHS * width);
        IrradianceRecord {
            point: missed.point,
            normal: missed.normal,
            light: gathered.light,
            radius: radius.min(OF_NEAREST * gathered.nearest),
        }
    }

    /// Lessens radii that differ from their neighbours' by more than their distance allows.
    fn clamped(&self, records: Vec<IrradianceRecord>) -> Vec<IrradianceRecord> {
        let before = Irradiance::new(records);
        let lessened = before.records.par_iter().map(|record| {
            let mut radius = record.radius;
            before.within(record, |other| {
                let apart = (other.point - record.point).length();
                radius = radius.min(other.radius + self.caching.error * apart);
            });
            IrradianceRecord { radius, ..*record }
        });
        lessened.collect()
    }
}

/// Queues a ray for each point whose direction leads away from the surface, and returns the rows.
fn queue(
    scratch: &mut PathScratch,
    (asked, keys): (&[Asked], &[u32]),
    is_left: impl Fn(usize) -> bool,
    toward: impl Fn(usize, &Missed) -> DVec3,
) -> Vec<u32> {
    let (queue, own) = scratch.camera_rays();
    let mut rows = Vec::with_capacity(asked.len());
    for (row, (_, missed)) in asked.iter().enumerate() {
        if is_left(row) {
            continue;
        }
        let dir = toward(row, missed);
        if !(dir.dot(missed.facing) > 0.0) {
            continue;
        }
        queue.push_one((missed.start, dir), row as u32);
        own.push(keys[row]);
        rows.push(row as u32);
    }
    queue.complete(f32::INFINITY, RayKind::Reflection);
    rows
}

fn statistics<'a>() -> Statistics<'a> {
    Statistics {
        counts: RayCounts::default(),
        record: None,
        sample: 0,
        pixel_of: &|row| row,
        memory: None,
        covered: None,
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
