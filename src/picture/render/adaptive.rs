//! Adaptive sampling in passes over the whole picture. Passes end at powers of two; between them,
//! blocks of 16×16 pixels whose noise is above the threshold, and their neighbours, are chosen
//! from the film as it stands. The choice is a function of pixels alone, so no order of tiles or
//! threads can show.
//!
//! Noise is that of Dammertz et al., "A Hierarchical Automatic Stopping Condition for Monte
//! Carlo Global Illumination" (2010), section 2.1: the difference between all samples and half of
//! them, over the root of the radiance. A block's noise is the largest mean of 3×3 pixels. The
//! half is the first half, not the even samples: an aligned run of a scrambled Sobol' sequence
//! is as well spread as the whole is, whereas every second sample is spread by chance and would
//! show the noise of independent samples, several times the picture's own.

use super::Picture;
use super::blur::{Blur, PictureSums};
use super::camera::RayGenerator;
use super::config::RenderConfig;
use super::layers::{LayerFilm, More, PathOutputs, variance};
use super::paths::{PathPicture, PathTile};
use super::picture::{View, Worker};
use super::pixel_order::{BLOCK, Spot, morton_order};
use super::progress::Progress;
use super::sums::plus;
use crate::shade::RayCounts;
use crate::shade::path::Slot;
use crate::trace::ScratchPool;
use rayon::prelude::*;
use std::iter::repeat;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::Ordering::Relaxed;

/// When samples are enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adaptive {
    /// The noise at which a block is left, about that of a mid-grey in its unit; above 0.
    pub noise: f32,
    /// No pixel gets more samples than this, at least 1, rounded down to a power of two.
    pub most: u32,
}

impl Adaptive {
    /// Returns the most samples that a pixel can get: a power of two, as the halves of all
    /// passes are.
    pub fn most(&self) -> u32 {
        1 << self.most.max(1).ilog2()
    }
}

/// What a pixel has collected.
#[derive(Clone, Copy, Debug, Default)]
struct Pixel {
    sum: [f64; 4],
    /// Of the first half of the samples.
    half: [f64; 4],
    count: u32,
}

/// A picture's pixels, row by row.
pub struct AdaptiveFilm {
    pixels: Vec<Pixel>,
    width: u32,
    height: u32,
    /// Layers of light and mattes, if they are kept.
    layers: LayerFilm,
    /// Whether the pixels have halves.
    has_halves: bool,
    /// Blocks that were too noisy when their pixels had the most samples.
    noisy: usize,
    pub counts: RayCounts,
}

/// What sampling came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reached {
    /// Mean number of samples of a pixel.
    pub mean_samples: f64,
    /// Share of the picture's blocks that are noisier than was asked, at the most samples.
    pub noisy: f64,
}

impl AdaptiveFilm {
    /// Makes the film of pixels that have collected one number of samples, row by row.
    pub fn of_sums(sums: PictureSums, count: u32, width: u32) -> AdaptiveFilm {
        let halves = sums.halves.iter().copied().chain(repeat([0.0; 4]));
        let pixel = |(sum, half): (&[f64; 4], [f64; 4])| Pixel {
            sum: *sum,
            half,
            count,
        };
        AdaptiveFilm {
            pixels: sums.all.iter().zip(halves).map(pixel).collect(),
            width,
            height: sums.all.len() as u32 / width,
            layers: sums.layers,
            has_halves: !sums.halves.is_empty(),
            noisy: 0,
            counts: sums.counts,
        }
    }

    /// Returns the mean of a pixel's samples.
    pub fn mean(&self, (x, y): (u32, u32)) -> Slot {
        let pixel = &self.pixels[(y * self.width + x) as usize];
        let share = 1.0 / f64::from(pixel.count.max(1));
        pixel.sum.map(|sum| (sum * share) as f32)
    }

    /// Returns the number of a pixel's samples.
    pub fn samples(&self, (x, y): (u32, u32)) -> u32 {
        self.pixels[(y * self.width + x) as usize].count
    }

    /// Lists the pixels' numbers of samples.
    pub fn sample_counts(&self) -> Vec<u32> {
        self.pixels.iter().map(|pixel| pixel.count).collect()
    }

    /// Puts what was kept beside the colour into a picture.
    pub fn put(&self, outputs: &PathOutputs, picture: &mut Picture) {
        self.layers.put(outputs, picture, &self.sample_counts());
        if let (Some(column), true) = (&mut picture.variance, self.has_halves) {
            for (row, pixel) in column.iter_mut().zip(&self.pixels) {
                *row = variance((pixel.sum, pixel.count), (pixel.half, pixel.count / 2));
            }
        }
    }

    /// Returns the mean number of samples, and how much of the picture stayed noisy.
    pub fn reached(&self) -> Reached {
        let sum: u64 = self.pixels.iter().map(|p| u64::from(p.count)).sum();
        let blocks = self.width.div_ceil(BLOCK) * self.height.div_ceil(BLOCK);
        Reached {
            mean_samples: sum as f64 / self.pixels.len().max(1) as f64,
            noisy: self.noisy as f64 / f64::from(blocks.max(1)),
        }
    }
}

/// Renders passes until all blocks are quiet, or their pixels have the most samples.
pub fn render_adaptively(
    view: &View,
    (config, adaptive): (&RenderConfig, &Adaptive),
    (picture, blur): (&PathPicture, Option<&Blur>),
    progress: &Progress,
) -> AdaptiveFilm {
    let (width, height) = (config.width, config.height);
    let generator = &RayGenerator::new(view.camera, width, height, config.grid);
    let (columns, rows) = (width.div_ceil(BLOCK), height.div_ceil(BLOCK));
    let mut film = AdaptiveFilm {
        pixels: vec![Pixel::default(); width as usize * height as usize],
        width,
        height,
        layers: LayerFilm::default(),
        has_halves: true,
        noisy: 0,
        counts: RayCounts::default(),
    };
    let keeps_more = picture.layers.is_some() || config.aovs.any_of_mattes();
    let most = adaptive.most();
    let mut blocks: Vec<(u32, u32)> = (0..columns * rows)
        .map(|i| (i % columns, i / columns))
        .collect();
    let first = first_pass(adaptive.noise).min(most);
    let mut range = 0..first.div_ceil(2);
    let mut work = Work::default();
    while !blocks.is_empty() && !range.is_empty() && !progress.is_cancelled() {
        let workers = ScratchPool::<Worker>::default();
        let counts = Mutex::new(RayCounts::default());
        work.begin(blocks.len(), &range, most, progress);
        let done: Vec<Vec<(Pixel, Option<More>, usize)>> = blocks
            .par_iter()
            .with_max_len(1)
            .map(|(column, row)| {
                let corner = (column * BLOCK, row * BLOCK);
                let size = (BLOCK.min(width - corner.0), BLOCK.min(height - corner.1));
                workers.with(|worker| {
                    let order = morton_order(size);
                    let tile = PathTile {
                        view,
                        config,
                        picture,
                        generator,
                        corner,
                        order: &order,
                        cancel: &progress.cancel,
                    };
                    let mut own = RayCounts::default();
                    let place =
                        |spot: &Spot| ((corner.1 + spot.y) * width + corner.0 + spot.x) as usize;
                    let Worker { arena, trace } = &mut *worker;
                    let (range, count) = (range.clone(), range.len() as u32);
                    let sums = match blur {
                        Some(blur) => tile.blurred_sums(blur, range, arena, trace, &mut own),
                        None => tile.sums(range, arena, trace, &mut own),
                    };
                    let pixels = order.iter().map(|spot| {
                        let row = spot.row as usize;
                        let pixel = Pixel {
                            sum: sums.all.of(row),
                            half: [0.0; 4],
                            count,
                        };
                        let more = keeps_more.then(|| More::of(&sums, row));
                        (pixel, more, place(spot))
                    });
                    let pixels: Vec<_> = pixels.collect();
                    drop(sums);
                    worker.arena.reset();
                    progress.rays.fetch_add(own.total(), Relaxed);
                    progress.tiles_done.fetch_add(Work::of(count), Relaxed);
                    counts.lock().unwrap_or_else(|e| e.into_inner()).add(&own);
                    pixels
                })
            })
            .collect();
        let count = film.pixels.len();
        for (more, layers, place) in done.into_iter().flatten() {
            if let Some(layers) = &layers {
                film.layers.add(place, layers, count);
            }
            let pixel = &mut film.pixels[place];
            pixel.half = pixel.sum;
            pixel.sum = plus(pixel.sum, more.sum);
            pixel.count += more.count;
        }
        film.counts
            .add(&counts.into_inner().unwrap_or_else(|e| e.into_inner()));
        if range.end >= first {
            blocks = film.noisy_blocks(adaptive.noise, range.end);
        }
        range = range.end..(2 * range.end).min(most);
    }
    film
}

/// The work of all passes, in units of [`Work::UNIT`] samples of a block, for those who watch.
#[derive(Default)]
struct Work {
    done: u64,
    /// The blocks of the pass before.
    blocks: Option<usize>,
}

impl Work {
    /// So that the work of the largest pictures is a number of 32 bits.
    const UNIT: u32 = 4;

    fn of(samples: u32) -> u32 {
        samples.div_ceil(Work::UNIT)
    }

    /// Tells of the pass that begins, and of all passes after it, of which each is expected to have
    /// as many of the blocks before it as this one has; half, where none were left yet.
    fn begin(&mut self, blocks: usize, range: &Range<u32>, most: u32, progress: &Progress) {
        let share = match self.blocks {
            Some(before) if blocks < before => blocks as f64 / before as f64,
            _ => 0.5,
        };
        let pass = |blocks: f64, samples: u32| blocks * f64::from(Work::of(samples));
        let mut left = pass(blocks as f64, range.len() as u32);
        let (mut blocks_left, mut end) = (blocks as f64, range.end);
        while end < most && blocks_left >= 1.0 {
            blocks_left *= share;
            let next = end.saturating_mul(2).min(most);
            left += pass(blocks_left, next - end);
            end = next;
        }
        progress
            .tiles_done
            .store(self.done.min(u64::from(u32::MAX)) as u32, Relaxed);
        // A cast beyond the range is the nearest number in it.
        progress
            .tiles
            .store((self.done as f64 + left) as u32, Relaxed);
        self.done += pass(blocks as f64, range.len() as u32) as u64;
        self.blocks = Some(blocks);
    }
}

/// Returns the samples of the first pass: 64 at a noise of 0.01, as Cycles has it, so that
/// little that is bright is missed by all of them.
fn first_pass(noise: f32) -> u32 {
    let samples = 16.0 / libm::pow(f64::from(noise).max(1e-4), 0.3);
    (samples.ceil() as u32).next_power_of_two()
}

impl AdaptiveFilm {
    /// Lists the blocks that are too noisy or beside such a block, among those that took part
    /// in the last pass, or are called in again.
    fn noisy_blocks(&mut self, threshold: f32, count: u32) -> Vec<(u32, u32)> {
        let (columns, rows) = (self.width.div_ceil(BLOCK), self.height.div_ceil(BLOCK));
        let noise: Vec<f64> = self.pixels.iter().map(Pixel::noise).collect();
        let is_noisy = |column: u32, row: u32| {
            let (x0, y0) = (column * BLOCK, row * BLOCK);
            let ys = y0..(y0 + BLOCK).min(self.height);
            ys.into_iter().any(|y| {
                (x0..(x0 + BLOCK).min(self.width))
                    .any(|x| self.mean_around(&noise, x, y) > f64::from(threshold))
            })
        };
        let noisy: Vec<bool> = (0..columns * rows)
            .map(|i| is_noisy(i % columns, i / columns))
            .collect();
        self.noisy = noisy.iter().filter(|is| **is).count();
        let at = |column: u32, row: u32| {
            // A block that was left has fewer samples than a pass ends with; it cannot take
            // part again without the passes that it missed.
            let first = self.samples((column * BLOCK, row * BLOCK));
            let near = |r: u32| {
                (column.saturating_sub(1)..=(column + 1).min(columns - 1))
                    .any(|c| noisy[(r * columns + c) as usize])
            };
            first == count && (row.saturating_sub(1)..=(row + 1).min(rows - 1)).any(near)
        };
        (0..columns * rows)
            .map(|i| (i % columns, i / columns))
            .filter(|(column, row)| at(*column, *row))
            .collect()
    }

    /// Returns the mean noise of the pixels around one.
    fn mean_around(&self, noise: &[f64], x: u32, y: u32) -> f64 {
        let mut sum = 0.0;
        let mut count = 0.0;
        for v in y.saturating_sub(1)..=(y + 1).min(self.height - 1) {
            for u in x.saturating_sub(1)..=(x + 1).min(self.width - 1) {
                sum += noise[(v * self.width + u) as usize];
                count += 1.0;
            }
        }
        sum / count
    }
}

/// Radiance below which noise counts no more for being darker.
const DARK: f64 = 1e-3;

impl Pixel {
    fn noise(&self) -> f64 {
        let count = f64::from(self.count);
        // A single sample has no half, and counts as noisy.
        let half = f64::from((self.count / 2).max(1));
        let differ = (0..4).map(|k| (self.sum[k] / count - self.half[k] / half).abs());
        let radiance: f64 = self.sum[..3].iter().map(|sum| sum / count).sum();
        // As in Cycles, above white the noise counts relative to the radiance.
        let scale = match radiance > 1.0 {
            true => radiance,
            false => radiance.max(0.0).sqrt() + DARK,
        };
        differ.sum::<f64>() / scale
    }
}
