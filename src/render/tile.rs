//! The render loop: tiles over threads, an arena per thread.
//!
//! Packets sit on an absolute grid of 16×16 pixels, in Morton order within it,
//! and tiles are multiples of that, so the split never shows. A tile is traced
//! sample by sample; its transient columns come from the thread's arena, which
//! is reset afterwards.

use super::camera::RayGenerator;
use super::config::{Grid, RenderConfig, TileOrder};
use super::film::{AovSample, blank, put};
use super::frames::FrameMemory;
use super::items::{item_buffer, tiles_of};
use super::progress::Progress;
use super::sampler::sample_position;
use super::{AovSet, Picture};
use crate::accel::World;
use crate::math::lanes::Lanes;
use crate::plan::Kernels;
use crate::scene::{Camera, Light, Rgb};
use crate::shade::{Columns, Doubles, Integrator, Ledger, Looks, Memory, RayCounts, STEP, Surface};
use crate::trace::{HitId, ItemBuffer, RayKind, ShadowCache, TracedRay};
use bumpalo::Bump;
use rayon::prelude::*;
use std::cell::RefCell;
use std::sync::Mutex;
use thiserror::Error;

/// Side of the grid that packets sit on, in pixels.
pub const BLOCK: u32 = 16;

/// Side of the largest tile.
const SIDE: usize = 2 * BLOCK as usize;

/// What is rendered, and from where.
pub struct View<'w> {
    pub world: &'w World,
    pub kernels: Kernels,
    pub camera: Camera,
    pub lights: &'w [Light],
}

/// The picture and what it took.
#[derive(Debug)]
pub struct Rendered {
    pub picture: Picture,
    pub counts: RayCounts,
    /// Every ray and its answer, if asked for: pixel by pixel, and there in the
    /// order in which they were traced.
    pub record: Vec<TracedRay>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum RenderError {
    #[error("interrupted")]
    Interrupted,
    #[error("there is not enough memory for a picture of {width}x{height}; ask for a smaller one")]
    Memory { width: u32, height: u32 },
}

/// Renders on the current rayon pool. Records every ray where `recording`.
pub fn render(
    view: &View,
    config: &RenderConfig,
    recording: bool,
    progress: &Progress,
) -> Result<Rendered, RenderError> {
    render_tiles(view, config, recording, None, progress)
}

/// Renders a frame of a sequence. `memory` is of the frame before, which was
/// rendered with the same configuration; the picture has the same bits as
/// without.
pub fn render_after(
    view: &View,
    config: &RenderConfig,
    memory: &mut FrameMemory,
    progress: &Progress,
) -> Result<Rendered, RenderError> {
    memory.restart(tiling(config).1);
    render_tiles(view, config, false, Some(memory), progress)
}

/// Side of the tiles, and their number.
fn tiling(config: &RenderConfig) -> (u32, u32) {
    let side = match config.tiles {
        TileOrder::Small => BLOCK,
        _ => 2 * BLOCK,
    };
    let tiles = config.width.div_ceil(side) * config.height.div_ceil(side);
    (side, tiles)
}

fn render_tiles(
    view: &View,
    config: &RenderConfig,
    recording: bool,
    memory: Option<&FrameMemory>,
    progress: &Progress,
) -> Result<Rendered, RenderError> {
    let (side, tiles) = tiling(config);
    let columns = config.width.div_ceil(side);
    progress.start(tiles);
    let picture = blank(config.width, config.height, config.aovs);
    let done = Mutex::new(Rendered {
        picture: picture.map_err(|_| RenderError::Memory {
            width: config.width,
            height: config.height,
        })?,
        counts: RayCounts::default(),
        record: Vec::new(),
    });
    let at = |number: u32| {
        let corner = (number % columns * side, number / columns * side);
        let size = (
            side.min(config.width - corner.0),
            side.min(config.height - corner.1),
        );
        (corner, size)
    };
    let generator = RayGenerator::new(view.camera, config.width, config.height, config.grid);
    let whole = morton_order((side, side));
    let looks = Looks::of(&view.world.scene.materials.rows);
    let order = |number: u32| {
        let (corner, size) = at(number);
        let place = |spot: &Spot| (corner.0 + spot.x, corner.1 + spot.y);
        morton_order(size).iter().map(place).collect()
    };
    let pixels = side * side;
    let items = item_buffer(view.world, &view.camera, &generator, tiles, pixels, order);
    let one = |number: u32| {
        if progress.is_cancelled() {
            return;
        }
        let number = match config.tiles {
            TileOrder::Reverse => tiles - 1 - number,
            _ => number,
        };
        let (corner, size) = at(number);
        thread_local! {
            static ARENA: RefCell<Bump> = RefCell::new(Bump::new());
        }
        ARENA.with_borrow_mut(|arena| {
            let tile = Tile {
                view,
                config,
                progress,
                corner,
                size,
                whole: &whole,
                looks,
                items: items
                    .as_ref()
                    .map(|items| (items, number as usize * tiles_of(pixels))),
            };
            let mut memory = memory.map(|memory| memory.tile(number));
            let counts = tile.render(recording, memory.as_deref_mut(), arena, &done);
            arena.reset();
            progress.add_tile(counts.total());
        });
    };
    (0..tiles).into_par_iter().with_max_len(1).for_each(one);
    if progress.is_cancelled() {
        return Err(RenderError::Interrupted);
    }
    let mut done = done.into_inner().unwrap_or_else(|e| e.into_inner());
    // Stable: a pixel's rays lie in one tile and keep their order.
    done.record.sort_by_key(|ray| ray.pixel);
    Ok(done)
}

struct Tile<'a> {
    view: &'a View<'a>,
    config: &'a RenderConfig,
    progress: &'a Progress,
    corner: (u32, u32),
    size: (u32, u32),
    /// The order of a tile that no edge of the picture cuts.
    whole: &'a [Spot],
    looks: Looks,
    /// Of the frame, and the tile's first list.
    items: Option<(&'a ItemBuffer, usize)>,
}

impl Tile<'_> {
    fn render(
        &self,
        recording: bool,
        mut memory: Option<&mut Memory>,
        arena: &Bump,
        done: &Mutex<Rendered>,
    ) -> RayCounts {
        let pixels = (self.size.0 * self.size.1) as usize;
        let color = arena.alloc_slice_fill_copy(pixels, [0.0_f32; 3]);
        let kept = if self.config.aovs.any() { pixels } else { 0 };
        let aovs = arena.alloc_slice_fill_copy(kept, AovSample::NOTHING);
        let cache = ShadowCache::new(self.config.shadow_cache);
        let caches = arena.alloc_slice_fill_copy(self.view.lights.len(), cache);
        let cut = (pixels < self.whole.len()).then(|| morton_order(self.size));
        let order = cut.as_deref().unwrap_or(self.whole);
        let columns = &mut Columns::new(arena);
        let mut record = Vec::new();
        let mut counts = RayCounts::default();
        for sample in 0..self.samples() {
            let ledger = &mut Ledger {
                counts: RayCounts::default(),
                record: recording.then_some(&mut record),
                sample,
                pixel_of: &|row| self.pixel(row),
                memory: memory.as_deref_mut(),
            };
            self.sample(sample, order, columns, color, aovs, caches, ledger);
            counts.add(&ledger.counts);
            // What is not finished is not kept.
            if self.progress.is_cancelled() {
                return counts;
            }
        }
        for cache in caches {
            counts.shadow_cache += cache.counts;
        }
        let share = 1.0 / self.samples() as f32;
        for pixel in color.iter_mut() {
            *pixel = pixel.map(|c| c * share);
        }
        let mut done = done.lock().unwrap_or_else(|e| e.into_inner());
        put(&mut done.picture, self.corner, self.size, color, aovs);
        done.counts.add(&counts);
        done.record.append(&mut record);
        counts
    }

    fn samples(&self) -> u32 {
        match self.config.grid {
            Grid::Centers => self.config.spp,
            Grid::Corners => 1,
        }
    }

    #[expect(clippy::too_many_arguments)]
    fn sample(
        &self,
        sample: u32,
        order: &[Spot],
        columns: &mut Columns,
        color: &mut [Rgb],
        aovs: &mut [AovSample],
        caches: &mut [ShadowCache],
        ledger: &mut Ledger,
    ) {
        let config = self.config;
        let generator =
            RayGenerator::new(self.view.camera, config.width, config.height, config.grid);
        let wave = columns.camera_rays();
        // A lone sample is the centre: its rays share columns and rows.
        let lone = (self.samples() == 1).then(|| self.centres(&generator));
        for some in order.chunks(STEP) {
            let spots: [Spot; STEP] = std::array::from_fn(|i| some[i.min(some.len() - 1)]);
            let [across, up] = match &lone {
                Some([columns, rows]) => [
                    Doubles::load(&spots.map(|spot| columns[spot.x as usize % SIDE])),
                    Doubles::load(&spots.map(|spot| rows[spot.y as usize % SIDE])),
                ],
                None => self.sampled(&generator, &spots, sample),
            };
            wave.push_some(
                (1 << some.len()) - 1,
                generator.through(across, up),
                &spots.map(|spot| spot.row),
            );
        }
        wave.complete(f32::INFINITY, RayKind::Primary);
        let integrator = Integrator {
            world: self.view.world,
            kernels: self.view.kernels,
            lights: self.view.lights,
            items: self.items,
            background: self.view.world.scene.background,
            max_depth: config.max_depth,
            unnamed: Default::default(),
            looks: self.looks,
            cancel: &self.progress.cancel,
        };
        let keep = sample == 0 && config.aovs != AovSet::default();
        let mut first_hit = |row: u32, surface: &Surface, id: HitId| {
            aovs[row as usize] = self.aov(&generator, surface, id);
        };
        let first_hit = keep.then_some(&mut first_hit as _);
        integrator.run(columns, color, caches, ledger, first_hit);
    }

    /// Where rays through the middles of columns and rows go.
    fn centres(&self, generator: &RayGenerator) -> [[f64; SIDE]; 2] {
        let half = Doubles::splat(0.5);
        let mut centres = [[0.0; SIDE]; 2];
        for first in (0..SIDE).step_by(STEP) {
            let from = |corner: u32| {
                let at = |i| f64::from(corner) + (first + i) as f64;
                Doubles::load(&std::array::from_fn::<_, STEP, _>(at))
            };
            let across = generator.across(from(self.corner.0), half);
            let up = generator.up(from(self.corner.1), half);
            across.store(&mut centres[0][first..]);
            up.store(&mut centres[1][first..]);
        }
        centres
    }

    /// Where rays through a sample of pixels go.
    fn sampled(&self, generator: &RayGenerator, spots: &[Spot; STEP], sample: u32) -> [Doubles; 2] {
        let config = self.config;
        let (mut at, mut offset) = ([[0.0; STEP]; 2], [[0.0; STEP]; 2]);
        for (i, spot) in spots.iter().enumerate() {
            let (x, y) = (self.corner.0 + spot.x, self.corner.1 + spot.y);
            let [dx, dy] = sample_position(config.seed, 0, (x, y), sample, config.spp);
            (at[0][i], at[1][i]) = (f64::from(x), f64::from(y));
            (offset[0][i], offset[1][i]) = (dx, dy);
        }
        let [[x, y], [dx, dy]] = [at, offset].map(|axes| axes.map(|axis| Doubles::load(&axis)));
        [generator.across(x, dx), generator.up(y, dy)]
    }

    fn aov(&self, generator: &RayGenerator, surface: &Surface, id: HitId) -> AovSample {
        let materials = &self.view.world.scene.materials;
        let material = match surface.material {
            Some(id) => materials.rows[id.index()],
            None => Default::default(),
        };
        AovSample {
            depth: generator.depth(surface.point) as f32,
            position: surface.point.to_array().map(|x| x as f32),
            normal: surface.ns.to_array().map(|x| x as f32),
            albedo: material.base_color,
            instance: id.instance,
            primitive: id.primitive,
        }
    }

    /// Position in the picture of a row of the tile's film.
    fn place(&self, row: u32) -> (u32, u32) {
        (
            self.corner.0 + row % self.size.0,
            self.corner.1 + row / self.size.0,
        )
    }

    fn pixel(&self, row: u32) -> u32 {
        let (x, y) = self.place(row);
        y * self.config.width + x
    }
}

/// A pixel of a tile, from its corner, and its row of the film.
#[derive(Clone, Copy)]
struct Spot {
    x: u32,
    y: u32,
    row: u32,
}

/// A tile's pixels, block by block, each block's in Morton order.
fn morton_order((width, height): (u32, u32)) -> Vec<Spot> {
    let mut order = Vec::with_capacity((width * height) as usize);
    for block_y in (0..height).step_by(BLOCK as usize) {
        for block_x in (0..width).step_by(BLOCK as usize) {
            for code in 0..BLOCK * BLOCK {
                let x = block_x + every_second_bit(code);
                let y = block_y + every_second_bit(code >> 1);
                if x < width && y < height {
                    let row = y * width + x;
                    order.push(Spot { x, y, row });
                }
            }
        }
    }
    order
}

/// Bits 0, 2, 4, 6 packed together.
pub fn every_second_bit(code: u32) -> u32 {
    code & 1 | code >> 1 & 2 | code >> 2 & 4 | code >> 3 & 8
}
