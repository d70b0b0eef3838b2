//! The render loop: tiles distributed over threads, one arena and scratch per worker.
//!
//! Packets lie on an absolute grid of 16×16 pixels, in Morton order within each block,
//! and tiles are multiples of that block, so the division into tiles does not change
//! the picture. A tile is traced sample by sample; its transient columns live in the
//! worker's arena, which is reset after the tile.

use super::adaptive::{AdaptiveFilm, Reached, render_adaptively};
use super::blur::{Blur, sum_picture};
use super::camera::RayGenerator;
use super::config::{Backdrop, Inspection, Integrator as How, RenderConfig, TileOrder};
use super::film::blank;
use super::frames::FrameMemory;
use super::inspect::{NOTHING, Reading, depths_of};
use super::irradiance::{CacheCounts, LightCache};
use super::items::{item_buffer, tiles_of};
use super::layers::PathOutputs;
use super::mattes::MatteNames;
use super::paths::PathPicture;
use super::pixel_order::{BLOCK, Spot, morton_order};
use super::progress::Progress;
use super::slices::Slices;
use super::tile::Tile;
use super::{AovSet, Picture};
use crate::accel::World;
use crate::plan::Kernels;
use crate::scene::{Camera, Light, Rgb};
use crate::shade::{MaterialFlags, RayCounts};
use crate::trace::{ScratchPool, TraceScratch, TracedRay};
use bumpalo::Bump;
use rayon::prelude::*;
use std::sync::Mutex;
use thiserror::Error;

/// A world, its lights and the camera that looks at it.
pub struct View<'w> {
    pub world: &'w World,
    pub kernels: Kernels,
    pub camera: Camera,
    pub lights: &'w [Light],
}

/// The picture, the ray counts and the recorded rays.
#[derive(Debug)]
pub struct Rendered {
    pub picture: Picture,
    pub counts: RayCounts,
    /// Every ray and its answer, if requested: sorted by pixel, within a pixel in
    /// tracing order.
    pub record: Vec<TracedRay>,
    /// Number of (ray, primitive) pairs decided by exact arithmetic.
    pub decided: u64,
    /// What sampling came to, if it was adaptive.
    pub reached: Option<Reached>,
    /// The counts of its irradiance cache, if it has one.
    pub cache: Option<CacheCounts>,
    /// What was read at each pixel, row by row, if the picture is an inspection.
    pub readings: Vec<Reading>,
}

/// Memory of one worker, kept from tile to tile.
#[derive(Default)]
pub struct Worker {
    pub arena: Bump,
    pub trace: TraceScratch,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum RenderError {
    #[error("interrupted")]
    Interrupted,
    #[error("there is not enough memory for a picture of {width}x{height}; ask for a smaller one")]
    Memory { width: u32, height: u32 },
    #[error("only pictures of paths have parts")]
    NoPaths,
    #[error(
        "the luminous things that move in the scene would need too much memory in so many slices \
         of the shutter; ask for at most --shutter-slices {most}"
    )]
    MovingLights { most: u32 },
    #[error("a cache of light does not tell groups of lights apart")]
    Outputs,
    #[error(
        "the records of --cache-file are of other light: this view's eye is in another medium, or it \
         stands elsewhere in the studio of a scene without light; name another file, or leave it out"
    )]
    OtherLight,
}

/// Renders on the current rayon pool. Records every ray if `recording` is true.
pub fn render(
    view: &View,
    config: &RenderConfig,
    recording: bool,
    progress: &Progress,
) -> Result<Rendered, RenderError> {
    let kept = Kept::default();
    render_tiles((view, None), config, recording, kept, progress, &|_| ())
}

/// Renders with an open shutter, on the current rayon pool. `view` is of the shutter's middle, of
/// which are outputs beside the colour, and pictures without light.
pub fn render_blurred(
    view: &View,
    slices: &Slices,
    config: &RenderConfig,
    progress: &Progress,
    on_tile: &(dyn Fn(FinishedTile) + Sync),
) -> Result<Rendered, RenderError> {
    let kept = Kept::default();
    render_tiles((view, Some(slices)), config, false, kept, progress, on_tile)
}

/// A rectangle of the picture that is done.
#[derive(Clone, Copy, Debug)]
pub struct FinishedTile<'t> {
    /// Of its left upper pixel.
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
    /// Linear Rec. 709, row by row.
    pub color: &'t [Rgb],
}

/// Renders a picture, and calls `on_tile` with each tile once it is done: from any thread of
/// the pool, in any order.
pub fn render_with(
    view: &View,
    config: &RenderConfig,
    progress: &Progress,
    on_tile: &(dyn Fn(FinishedTile) + Sync),
) -> Result<Picture, RenderError> {
    Ok(render_showing(view, config, progress, on_tile)?.picture)
}

/// Renders a picture as [`render_with`] does, and returns its counts and readings, too.
pub fn render_showing(
    view: &View,
    config: &RenderConfig,
    progress: &Progress,
    on_tile: &(dyn Fn(FinishedTile) + Sync),
) -> Result<Rendered, RenderError> {
    render_keeping(view, config, &mut LightCache::default(), progress, on_tile)
}

/// Renders a picture as [`render_showing`] does. Its cache of indirect light begins with the records
/// of `light`, which are to be of the same scene at rest, and those that it adds are kept there.
pub fn render_keeping(
    view: &View,
    config: &RenderConfig,
    light: &mut LightCache,
    progress: &Progress,
    on_tile: &(dyn Fn(FinishedTile) + Sync),
) -> Result<Rendered, RenderError> {
    let kept = Kept {
        bounds: None,
        light: Some(light),
    };
    render_tiles((view, None), config, false, kept, progress, on_tile)
}

/// Renders a frame of a sequence. `memory` and `light` come from the frame before, rendered with
/// the same configuration. The picture has the same bits as without `memory`; of `light` the same
/// holds as for [`render_keeping`].
pub fn render_after(
    view: &View,
    config: &RenderConfig,
    (memory, light): (&mut FrameMemory, &mut LightCache),
    progress: &Progress,
) -> Result<Rendered, RenderError> {
    memory.restart(tiling(config).1);
    let kept = Kept {
        bounds: Some(memory),
        light: Some(light),
    };
    render_tiles((view, None), config, false, kept, progress, &|_| ())
}

/// What a picture takes over from others, and leaves for them.
#[derive(Default)]
struct Kept<'k> {
    bounds: Option<&'k FrameMemory>,
    light: Option<&'k mut LightCache>,
}

/// Returns the side of the tiles in pixels, and their number.
fn tiling(config: &RenderConfig) -> (u32, u32) {
    let side = match config.tiles {
        TileOrder::Small => BLOCK,
        _ => 2 * BLOCK,
    };
    let window = config.window();
    let tiles = window.width.div_ceil(side) * window.height.div_ceil(side);
    (side, tiles)
}

fn render_tiles(
    (view, slices): (&View, Option<&Slices>),
    config: &RenderConfig,
    recording: bool,
    kept: Kept,
    progress: &Progress,
    on_tile: &(dyn Fn(FinishedTile) + Sync),
) -> Result<Rendered, RenderError> {
    let memory = kept.bounds;
    if config.caching.is_some() && config.aovs.light_groups {
        return Err(RenderError::Outputs);
    }
    let (side, tiles) = tiling(config);
    let window = config.window();
    let columns = window.width.div_ceil(side);
    let has_alpha = config.backdrop == Backdrop::Transparent;
    let picture = blank(window.width, window.height, config.aovs, has_alpha);
    let pixels = match config.integrator {
        How::Inspect(_) => window.pixels(),
        _ => 0,
    };
    let mut readings = Vec::new();
    let out_of_memory = RenderError::Memory {
        width: window.width,
        height: window.height,
    };
    readings
        .try_reserve_exact(pixels)
        .map_err(|_| out_of_memory)?;
    readings.resize(pixels, NOTHING);
    let mut picture = picture.map_err(|_| out_of_memory)?;
    let scene = &view.world.scene;
    let ranks = config.matte_ranks;
    let of_paths = match config.integrator {
        How::Path | How::Ao => config.aovs,
        How::Direct | How::Inspect(_) => AovSet::NONE,
    };
    let mattes = MatteNames::of(&of_paths, ranks, (scene, &view.world.instances));
    let outputs = PathOutputs::new(&of_paths, mattes, scene, &mut picture);
    let outputs = outputs.map_err(|_| out_of_memory)?;
    let done = Mutex::new(Rendered {
        picture,
        counts: RayCounts::default(),
        record: Vec::new(),
        decided: 0,
        reached: None,
        cache: None,
        readings,
    });
    let workers = ScratchPool::<Worker>::default();
    let at = |number: u32| {
        let (x, y) = (number % columns * side, number / columns * side);
        let size = (side.min(window.width - x), side.min(window.height - y));
        ((window.x + x, window.y + y), size)
    };
    let generator = RayGenerator::new(view.camera, config.width, config.height, config.grid);
    let depths = match config.integrator {
        How::Inspect(Inspection::Depth) => depths_of(view, &generator),
        _ => [0.0; 2],
    };
    let whole = morton_order((side, side));
    let mut own = LightCache::default();
    let light = kept.light.unwrap_or(&mut own);
    let mut of_cache = (RayCounts::default(), None);
    let paths = match (PathPicture::new(view, config), slices) {
        (Some(picture), None) => {
            let (picture, rays, counts) =
                picture.cached((view, config), &generator, light, progress)?;
            of_cache = (rays, counts);
            Some(picture)
        }
        (paths, _) => paths,
    };
    progress.start(tiles);
    let film = render_film((view, slices), config, paths.as_ref(), (tiles, progress))?;
    let material_flags = MaterialFlags::new(&view.world.scene.materials.rows);
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
        let number = config.tiles.tile(number, tiles);
        let (corner, size) = at(number);
        workers.with(|worker| {
            let tile = Tile {
                view,
                config,
                progress,
                on_tile,
                corner,
                size,
                window,
                whole: &whole,
                paths: paths.as_ref(),
                outputs: &outputs,
                film: film.as_ref(),
                generator: &generator,
                depths,
                material_flags,
                items: items
                    .as_ref()
                    .map(|items| (items, number as usize * tiles_of(pixels))),
            };
            let mut memory = memory.map(|memory| memory.tile(number));
            let counts = tile.render(recording, memory.as_deref_mut(), worker, &done);
            worker.arena.reset();
            progress.add_tile(counts.total());
        });
    };
    (0..tiles).into_par_iter().with_max_len(1).for_each(one);
    if progress.is_cancelled() {
        return Err(RenderError::Interrupted);
    }
    let mut done = done.into_inner().unwrap_or_else(|e| e.into_inner());
    done.counts.add(&of_cache.0);
    done.cache = of_cache.1;
    if let Some(film) = &film {
        film.put(&outputs, &mut done.picture);
        done.counts.add(&film.counts);
        done.reached = config.adaptive.is_some().then(|| film.reached());
    }
    if let Some(samples) = &mut done.picture.samples {
        match &film {
            Some(film) => samples.copy_from_slice(&film.sample_counts()),
            None => samples.fill(config.samples()),
        }
    }
    outputs.finish(&mut done.picture);
    let workers = workers.into_values();
    done.decided = workers.iter().map(|worker| worker.trace.decided).sum();
    // The sort is stable: all rays of a pixel lie in one tile and keep their order.
    done.record.sort_by_key(|ray| ray.pixel);
    Ok(done)
}

/// Renders the pictures of which tiles are not rendered one by one: adaptive and blurred ones.
fn render_film(
    (view, slices): (&View, Option<&Slices>),
    config: &RenderConfig,
    paths: Option<&PathPicture>,
    (tiles, progress): (u32, &Progress),
) -> Result<Option<AdaptiveFilm>, RenderError> {
    let slices = slices.filter(|_| config.integrator.shows_light());
    let blur = slices.map(|slices| Blur::new(view, slices, config, paths));
    let blur = blur.transpose()?;
    Ok(match (paths, &config.adaptive, &blur) {
        (Some(picture), Some(adaptive), blur) => {
            let settings = (config, adaptive);
            let pictures = (picture, blur.as_ref());
            Some(render_adaptively(view, settings, pictures, progress))
        }
        (paths, _, Some(blur)) => {
            let samples = config.samples();
            let side = blur.side(samples, config.tiles);
            let window = config.window();
            let columns = window.width.div_ceil(side);
            progress.start(tiles + columns * window.height.div_ceil(side));
            let pictures = (paths, Some(blur));
            let of = (view, config);
            let sums = sum_picture(of, pictures, &(0..samples), side, progress)?;
            Some(AdaptiveFilm::of_sums(sums, samples, window.width))
        }
        _ => None,
    })
}
