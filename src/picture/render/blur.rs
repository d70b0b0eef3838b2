//! Pictures with an open shutter: the samples of a tile are grouped by their slice of the
//! shutter, each group is traced in the world of its slice, and every result goes to the slot of
//! its own sample.
//!
//! A sample's time is a number of its pad 1. Results are added by sample number as they always
//! are, so neither tiles nor groups show. Tiles are as large as it takes to fill the groups.

use super::blur_direct::DirectTile;
use super::camera::RayGenerator;
use super::config::{Exposure, RenderConfig, TileOrder};
use super::layers::{LayerFilm, More};
use super::paths::{NOTHING_YET, PathPicture, PathTile, TileSums};
use super::picture::{RenderError, View, Worker};
use super::pixel_order::{BLOCK, Spot, morton_order};
use super::progress::Progress;
use super::slices::Slices;
use super::sums::Sums;
use crate::light::sampler::{Kind, Sampler};
use crate::math::lanes::Words;
use crate::shade::path::{FirstMet, LayerSlots, PathScratch, SampleNumbers, Slot};
use crate::shade::{BATCH, RayCounts, STEP, Singles, Statistics};
use crate::trace::{RayKind, ScratchPool, ShadowCache, TraceScratch};
use bumpalo::Bump;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::Ordering::Relaxed;

/// The most slots of a tile at a time, of paths: 4 megabytes. Waves are fuller the more there
/// are, and that is worth more to paths than slots that stay in the second-level cache.
const MOST_SLOTS: usize = 1 << 18;

/// The same of direct light, whose rays cost little beside a slot that is far away.
const MOST_DIRECT_SLOTS: usize = 1 << 16;

/// The largest side of a tile, in pixels.
const MOST_SIDE: u32 = 128;

/// The most bytes of luminaires that move, over all slices.
const MOST_LUMINAIRES: usize = 1 << 30;

/// What all tiles of a blurred picture share.
pub struct Blur<'a> {
    pub exposure: &'a Exposure,
    pub slices: Vec<BlurSlice<'a>>,
    sampler: Sampler,
    /// The most slots of a tile at a time.
    most_slots: usize,
}

/// A slice as a picture of its own.
pub struct BlurSlice<'a> {
    pub view: View<'a>,
    pub generator: RayGenerator,
    /// Nothing if the integrator traces no paths.
    pub picture: Option<PathPicture>,
}

impl<'a> Blur<'a> {
    /// Prepares the slices of a picture. `picture` is that of `view`, if it is one of paths.
    pub fn new(
        view: &'a View,
        slices: &'a Slices,
        config: &RenderConfig,
        picture: Option<&PathPicture>,
    ) -> Result<Blur<'a>, RenderError> {
        let of_slice = |slice: &'a super::slices::Slice| {
            let of_slice = picture
                .map(|picture| picture.at_time(view.world, (&slice.world, slice.camera.eye)));
            BlurSlice {
                view: View {
                    world: &slice.world,
                    kernels: view.kernels,
                    camera: slice.camera,
                    lights: Slices::lights(slice, view.lights),
                },
                generator: RayGenerator::new(
                    slice.camera,
                    config.width,
                    config.height,
                    config.grid,
                ),
                picture: of_slice,
            }
        };
        let count = slices.rows.len();
        let first = slices.rows.first().map(of_slice);
        // One time tells whether lights move, and the others are not begun if they are too many.
        if let (
            Some(before),
            Some(BlurSlice {
                picture: Some(now), ..
            }),
        ) = (picture, &first)
            && !before.shares_luminaires(now)
            && now.bytes_of_a_time() > MOST_LUMINAIRES / count
        {
            return Err(RenderError::MovingLights {
                most: (MOST_LUMINAIRES / now.bytes_of_a_time()) as u32,
            });
        }
        let rest = slices.rows[first.iter().len()..].par_iter().map(of_slice);
        let mut rest: Vec<BlurSlice> = rest.collect();
        let mut all: Vec<BlurSlice> = first.into_iter().collect();
        all.append(&mut rest);
        let samples = config.samples();
        // Direct light has no sampler of its own.
        let own = Sampler::new(Kind::Sobol, config.seed, config.frame, samples);
        Ok(Blur {
            exposure: &slices.exposure,
            slices: all,
            sampler: picture.map_or(own, |picture| picture.sampler),
            most_slots: match picture {
                // Each layer has slots of its own.
                Some(picture) => MOST_SLOTS / picture.layers.as_ref().map_or(1, |p| p.count()),
                None => MOST_DIRECT_SLOTS,
            },
        })
    }

    /// Returns the side of the tiles whose groups fill batches, in pixels.
    pub fn side(&self, samples: u32, order: TileOrder) -> u32 {
        if order == TileOrder::Small {
            return BLOCK;
        }
        let wanted = (self.slices.len() * BATCH).min(self.most_slots) as u64;
        let pixels = wanted.div_ceil(u64::from(samples.max(1)));
        let mut side = 2 * BLOCK;
        while side < MOST_SIDE && u64::from(side * side) < pixels {
            side *= 2;
        }
        side
    }
}

/// A pixel's sample.
#[derive(Clone, Copy, Default)]
pub struct PixelSample {
    /// The pixel's place in the tile's order, which is shorter than 2^16.
    spot: u16,
    /// Counted from the first of the range; no pixel has more than 2^16 samples.
    sample: u16,
}

impl PixelSample {
    /// Returns the pixel's place in the tile's order.
    pub fn spot(self) -> usize {
        self.spot.into()
    }

    /// Returns the sample's number, counted from the first of the range.
    pub fn sample(self) -> u32 {
        self.sample.into()
    }
}

/// Samples of a tile, sorted by slice, within a slice by pixel and sample.
pub struct Groups<'b> {
    sorted: &'b mut [PixelSample],
    slice_of: &'b mut [u16],
    starts: &'b mut [u32],
}

impl<'b> Groups<'b> {
    /// Makes room for groups of at most that many samples.
    pub fn new(samples: usize, slices: usize, arena: &'b Bump) -> Groups<'b> {
        Groups {
            sorted: arena.alloc_slice_fill_default(samples),
            slice_of: arena.alloc_slice_fill_copy(samples, 0),
            starts: arena.alloc_slice_fill_copy(slices + 1, 0),
        }
    }

    /// Sorts a range of the samples of a tile's pixels.
    pub fn sort(
        &mut self,
        blur: &Blur,
        (corner, order): ((u32, u32), &[Spot]),
        samples: &Range<u32>,
    ) {
        let each = samples.len();
        for (chunk, some) in order.chunks(STEP).enumerate() {
            let key: [u32; STEP] = std::array::from_fn(|i| {
                let spot = some[i.min(some.len() - 1)];
                blur.sampler.key(corner.0 + spot.x, corner.1 + spot.y)
            });
            let keys = Words::load(&key);
            for (offset, sample) in samples.clone().enumerate() {
                let [time, ..]: [Singles; 4] = blur.sampler.pad(keys, Words::splat(sample), 1);
                for (i, u) in time.to_array().into_iter().take(some.len()).enumerate() {
                    self.slice_of[(chunk * STEP + i) * each + offset] =
                        blur.exposure.slice(u) as u16;
                }
            }
        }
        let slice_of = &self.slice_of[..order.len() * each];
        self.starts.fill(0);
        for slice in slice_of {
            self.starts[*slice as usize + 1] += 1;
        }
        for row in 1..self.starts.len() {
            self.starts[row] += self.starts[row - 1];
        }
        // Each start moves to its group's end, which is the start of the next.
        for (spot, slices) in (0..).zip(slice_of.chunks(each)) {
            for (sample, slice) in (0..).zip(slices) {
                let next = &mut self.starts[*slice as usize];
                self.sorted[*next as usize] = PixelSample { spot, sample };
                *next += 1;
            }
        }
    }

    /// Lists the samples of a slice.
    pub fn of(&self, slice: usize) -> &[PixelSample] {
        let start = match slice {
            0 => 0,
            _ => self.starts[slice - 1],
        };
        &self.sorted[start as usize..self.starts[slice] as usize]
    }
}

impl Blur<'_> {
    /// Divides a range of samples so that the slots of a tile's pixels fit the room.
    pub fn portions(
        &self,
        samples: Range<u32>,
        pixels: usize,
    ) -> impl Iterator<Item = Range<u32>> + use<> {
        let each = (self.most_slots / pixels).max(1);
        let end = samples.end;
        samples
            .step_by(each)
            .map(move |start| start..end.min(start.saturating_add(each as u32)))
    }

    /// Returns the most slots of a portion of some samples.
    pub fn room(&self, samples: &Range<u32>, pixels: usize) -> usize {
        let lengths = self
            .portions(samples.clone(), pixels)
            .map(|samples| samples.len());
        lengths.max().unwrap_or(0) * pixels
    }
}

impl PathTile<'_> {
    /// Sums the samples of a range as [`PathTile::sums`] does, each in its slice.
    pub fn blurred_sums<'b>(
        &self,
        blur: &Blur,
        samples: Range<u32>,
        arena: &'b Bump,
        trace: &'b mut TraceScratch,
        counts: &mut RayCounts,
    ) -> TileSums<'b> {
        let pixels = self.order.len();
        let room = blur.room(&samples, pixels);
        let slots: &mut [Slot] = arena.alloc_slice_fill_copy(room, NOTHING_YET);
        let mut groups = Groups::new(room, blur.slices.len(), arena);
        let middle = self.middle(&samples);
        let mut sums = self.no_sums(arena);
        let (layers, has_mattes) = (sums.layers.len(), sums.met.is_some());
        // Layer by layer, and in a layer as `slots`.
        let layer_slots: &mut [Slot] = arena.alloc_slice_fill_copy(room * layers, [0.0; 4]);
        let met_room = if has_mattes { room } else { 0 };
        let met = arena.alloc_slice_fill_copy(met_room, FirstMet::NOTHING);
        let mut cache = ShadowCache::new(self.config.shadow_cache);
        let scratch = &mut PathScratch::new(arena, trace, self.picture.kinds());
        if let Some(plan) = &self.picture.layers {
            scratch.keep_layers(BATCH, plan, arena);
        }
        if has_mattes {
            scratch.keep_first_met(BATCH, arena);
        }
        // A batch's slots lie together, however far apart its pixels are.
        let batch_slots: &mut [Slot] = arena.alloc_slice_fill_copy(BATCH, NOTHING_YET);
        let numbers = arena.alloc_slice_fill_copy(BATCH, 0);
        for samples in blur.portions(samples, pixels) {
            groups.sort(blur, (self.corner, self.order), &samples);
            for (number, slice) in blur.slices.iter().enumerate() {
                let tile = PathTile {
                    view: &slice.view,
                    picture: slice.picture.as_ref().unwrap_or(self.picture),
                    generator: &slice.generator,
                    ..*self
                };
                let tracer = tile.tracer();
                for batch in groups.of(number).chunks(BATCH) {
                    let statistics = &mut Statistics {
                        sample: samples.start,
                        ..Statistics::of_counts()
                    };
                    for (number, of) in numbers.iter_mut().zip(batch) {
                        *number = samples.start + of.sample();
                    }
                    tile.queue_batch(batch, numbers, scratch);
                    let found = &mut batch_slots[..batch.len()];
                    found.fill(NOTHING_YET);
                    scratch.clear_outputs();
                    if tile.generator.has_blind_spots() {
                        found.iter_mut().for_each(|slot| slot[3] = 0.0);
                        for row in scratch.queued() {
                            found[*row as usize][3] = 1.0;
                        }
                    }
                    let numbers = SampleNumbers::Each(numbers);
                    tracer.run(scratch, numbers, found, &mut cache, statistics);
                    let place = |of: &PixelSample| {
                        of.sample() as usize * pixels + self.order[of.spot()].row as usize
                    };
                    for (slot, of) in found.iter().zip(batch) {
                        slots[place(of)] = *slot;
                    }
                    let found = scratch.layers().into_iter().flat_map(LayerSlots::layers);
                    for (slots, found) in layer_slots.chunks_mut(room).zip(found) {
                        for (slot, of) in found.iter().zip(batch) {
                            slots[place(of)] = *slot;
                        }
                    }
                    for (first, of) in scratch.first_met().into_iter().flatten().zip(batch) {
                        met[place(of)] = *first;
                    }
                    counts.add(&statistics.counts);
                }
                if self.cancel.load(Relaxed) {
                    return sums;
                }
            }
            for (number, sample) in samples.enumerate() {
                if middle == Some(sample) {
                    sums.half = Some((0..pixels).map(|pixel| sums.all.of(pixel)).collect());
                }
                let rows = number * pixels..(number + 1) * pixels;
                sums.all.add(&slots[rows.clone()]);
                let layers = layer_slots.chunks(room);
                for (sum, layer) in sums.layers.iter_mut().zip(layers) {
                    sum.add(&layer[rows.clone()]);
                }
                if let Some(lists) = &mut sums.met {
                    lists.add(&met[rows]);
                }
            }
        }
        counts.shadow_cache += cache.counts;
        sums
    }

    /// Queues the camera rays of a batch of samples, for slots in the batch's order.
    fn queue_batch(&self, batch: &[PixelSample], numbers: &[u32], scratch: &mut PathScratch) {
        let (queue, keys) = scratch.camera_rays();
        for (step, some) in batch.chunks(STEP).enumerate() {
            let at = |i: usize| i.min(some.len() - 1);
            let spots = std::array::from_fn(|i| self.order[some[at(i)].spot()]);
            let rows = std::array::from_fn(|i| (step * STEP + at(i)) as u32);
            let samples = rows.map(|row| numbers[row as usize]);
            self.queue_step((&spots, some.len()), (&samples, &rows), (queue, keys));
        }
        queue.complete(f32::INFINITY, RayKind::Primary);
    }
}

/// What the samples of a picture add up to, row by row.
pub struct PictureSums {
    pub all: Vec<[f64; 4]>,
    /// Those of the first half of the samples, if the variance is kept.
    pub halves: Vec<[f64; 4]>,
    pub layers: LayerFilm,
    pub counts: RayCounts,
}

/// Sums a range of the samples of all pixels, row by row, in tiles of a side. `picture` is that of
/// `view`, if it is one of paths.
pub fn sum_picture(
    (view, config): (&View, &RenderConfig),
    (picture, blur): (Option<&PathPicture>, Option<&Blur>),
    samples: &Range<u32>,
    side: u32,
    progress: &Progress,
) -> Result<PictureSums, RenderError> {
    let window = config.window();
    let (width, height) = (window.width, window.height);
    let memory = RenderError::Memory { width, height };
    let pixels = window.pixels();
    let column = |is_kept: bool| {
        let mut sums = Vec::new();
        let rows = if is_kept { pixels } else { 0 };
        sums.try_reserve_exact(rows).map_err(|_| memory)?;
        sums.resize(rows, [0.0; 4]);
        Ok(sums)
    };
    let keeps_more =
        config.aovs.any_of_mattes() || picture.is_some_and(|picture| picture.layers.is_some());
    let generator = RayGenerator::new(view.camera, config.width, config.height, config.grid);
    let (columns, rows) = (width.div_ceil(side), height.div_ceil(side));
    let workers = ScratchPool::<Worker>::default();
    let done = Mutex::new(PictureSums {
        all: column(true)?,
        halves: column(config.aovs.variance && picture.is_some())?,
        layers: LayerFilm::default(),
        counts: RayCounts::default(),
    });
    let one = |number: u32| {
        if progress.is_cancelled() {
            return;
        }
        let number = config.tiles.tile(number, columns * rows);
        let (x, y) = (number % columns * side, number / columns * side);
        let size = (side.min(width - x), side.min(height - y));
        let corner = (window.x + x, window.y + y);
        let order = &morton_order(size)[..];
        let place = |spot: &Spot| ((y + spot.y) * width + x + spot.x) as usize;
        let samples = samples.clone();
        workers.with(|worker| {
            let Worker { arena, trace } = &mut *worker;
            let mut counts = RayCounts::default();
            let cancel = &progress.cancel;
            let all = match (picture, blur) {
                (Some(picture), _) => {
                    let tile = PathTile {
                        view,
                        config,
                        picture,
                        generator: &generator,
                        corner,
                        order,
                        cancel,
                    };
                    let counts = &mut counts;
                    match blur {
                        Some(blur) => tile.blurred_sums(blur, samples, arena, trace, counts),
                        None => tile.sums(samples, arena, trace, counts),
                    }
                }
                (None, Some(blur)) => {
                    let tile = DirectTile {
                        config,
                        blur,
                        corner,
                        order,
                        cancel,
                    };
                    TileSums::of(tile.sums(samples, arena, trace, &mut counts))
                }
                (None, None) => TileSums::of(Sums::new(order.len(), arena)),
            };
            let mut done = done.lock().unwrap_or_else(|e| e.into_inner());
            for spot in order {
                let (row, place) = (spot.row as usize, place(spot));
                done.all[place] = all.all.of(row);
                if let (Some(half), true) = (&all.half, !done.halves.is_empty()) {
                    done.halves[place] = half[row];
                }
                if keeps_more {
                    done.layers.add(place, &More::of(&all, row), pixels);
                }
            }
            done.counts.add(&counts);
            drop(done);
            drop(all);
            worker.arena.reset();
            progress.add_tile(counts.total());
        });
    };
    let tiles = (0..columns * rows).into_par_iter();
    tiles.with_max_len(1).for_each(one);
    match progress.is_cancelled() {
        true => Err(RenderError::Interrupted),
        false => Ok(done.into_inner().unwrap_or_else(|e| e.into_inner())),
    }
}
