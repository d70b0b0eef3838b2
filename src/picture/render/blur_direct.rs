//! Direct light with an open shutter: the samples of a tile by slice, as `blur.rs` groups them.

use super::blur::{Blur, BlurSlice, Groups, PixelSample};
use super::config::{Backdrop, RenderConfig};
use super::pixel_order::Spot;
use super::sampler::{frame_key, position_in};
use super::sums::Sums;
use crate::math::lanes::Lanes;
use crate::scene::Rgb;
use crate::shade::path::Slot;
use crate::shade::{
    BATCH, Doubles, Integrator, MaterialFlags, RayCounts, STEP, Scratch, Statistics,
};
use crate::trace::{RayKind, ShadowCache, TraceScratch};
use bumpalo::Bump;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// A tile of the picture.
pub struct DirectTile<'a> {
    pub config: &'a RenderConfig,
    pub blur: &'a Blur<'a>,
    pub corner: (u32, u32),
    /// The tile's pixels in the order of their packets.
    pub order: &'a [Spot],
    pub cancel: &'a AtomicBool,
}

impl DirectTile<'_> {
    /// Sums the samples of a range, each in its slice.
    pub fn sums<'b>(
        &self,
        samples: Range<u32>,
        arena: &'b Bump,
        trace: &'b mut TraceScratch,
        counts: &mut RayCounts,
    ) -> Sums<'b> {
        let pixels = self.order.len();
        let mut sums = Sums::new(pixels, arena);
        let room = self.blur.room(&samples, pixels);
        let slots: &mut [Slot] = arena.alloc_slice_fill_copy(room, [0.0; 4]);
        // A batch's film lies together, however far apart its pixels are.
        let film = arena.alloc_slice_fill_copy(BATCH, [0.0_f32; 3]);
        let covered = arena.alloc_slice_fill_copy(BATCH, 1.0_f32);
        let mut groups = Groups::new(room, self.blur.slices.len(), arena);
        let lights = self.blur.slices.iter().map(|slice| slice.view.lights.len());
        let cache = ShadowCache::new(self.config.shadow_cache);
        let caches = arena.alloc_slice_fill_copy(lights.max().unwrap_or(0), cache);
        let scratch = &mut Scratch::new(arena, trace);
        for samples in self.blur.portions(samples, pixels) {
            groups.sort(self.blur, (self.corner, self.order), &samples);
            for (number, slice) in self.blur.slices.iter().enumerate() {
                let integrator = self.integrator(slice);
                for batch in groups.of(number).chunks(BATCH) {
                    film.fill([0.0; 3]);
                    covered.fill(1.0);
                    let statistics = &mut Statistics {
                        sample: samples.start,
                        covered: Some(covered),
                        ..Statistics::of_counts()
                    };
                    self.queue_batch(slice, batch, samples.start, scratch);
                    if slice.generator.has_blind_spots() {
                        covered_by(scratch, statistics);
                    }
                    integrator.run(scratch, film, caches, statistics, None);
                    counts.add(&statistics.counts);
                    for (of, ([r, g, b], there)) in batch.iter().zip(film.iter().zip(&*covered)) {
                        let row = self.order[of.spot()].row as usize;
                        slots[of.sample() as usize * pixels + row] = [*r, *g, *b, *there];
                    }
                }
                if self.cancel.load(Relaxed) {
                    return sums;
                }
            }
            for slots in slots.chunks(pixels).take(samples.len()) {
                sums.add(slots);
            }
        }
        for cache in caches {
            counts.shadow_cache += cache.counts;
        }
        sums
    }

    fn integrator<'s>(&'s self, slice: &'s BlurSlice) -> Integrator<'s> {
        let scene = &slice.view.world.scene;
        let backdrop: Rgb = match self.config.backdrop {
            Backdrop::Auto => scene.background,
            Backdrop::Color(color) => color,
            Backdrop::Transparent => [0.0; 3],
        };
        Integrator {
            world: slice.view.world,
            kernels: slice.view.kernels,
            lights: slice.view.lights,
            items: None,
            background: scene.background,
            backdrop,
            max_depth: self.config.max_depth,
            unnamed: Default::default(),
            material_flags: MaterialFlags::new(&scene.materials.rows),
            cancel: self.cancel,
        }
    }

    /// Queues the camera rays of a batch of samples from the number `first` on, for a film in the
    /// batch's order, at the places that samples have in a picture that is still.
    fn queue_batch(
        &self,
        slice: &BlurSlice,
        batch: &[PixelSample],
        first: u32,
        scratch: &mut Scratch,
    ) {
        let config = self.config;
        let frame = frame_key(config.frame);
        let queue = scratch.camera_rays();
        for (step, some) in batch.chunks(STEP).enumerate() {
            let (mut at, mut offset) = ([[0.0; STEP]; 2], [[0.0; STEP]; 2]);
            let mut rows = [0; STEP];
            for i in 0..STEP {
                let row = i.min(some.len() - 1);
                let of = some[row];
                let spot = self.order[of.spot()];
                let (x, y) = (self.corner.0 + spot.x, self.corner.1 + spot.y);
                let sample = first + of.sample();
                let [dx, dy] = position_in(config.seed, frame, (x, y), sample, config.spp);
                (at[0][i], at[1][i]) = (f64::from(x), f64::from(y));
                (offset[0][i], offset[1][i]) = (dx, dy);
                rows[i] = (step * STEP + row) as u32;
            }
            let [[x, y], [dx, dy]] = [at, offset].map(|axes| axes.map(|axis| Doubles::load(&axis)));
            let (across, up) = (slice.generator.across(x, dx), slice.generator.up(y, dy));
            let rays = slice.generator.through(across, up);
            queue.push_some(slice.generator.seeing(&rays.1, some.len()), rays, &rows);
        }
        queue.complete(f32::INFINITY, RayKind::Primary);
    }
}

/// Notes that samples without a ray cover nothing.
fn covered_by(scratch: &mut Scratch, statistics: &mut Statistics) {
    if let Some(covered) = &mut statistics.covered {
        covered.fill(0.0);
        for row in &scratch.camera_rays().pixel {
            covered[*row as usize] = 1.0;
        }
    }
}
