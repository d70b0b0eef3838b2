//! One tile of a picture, by every integrator.
//!
//! A tile is traced sample by sample; its transient columns live in the worker's arena.

use super::adaptive::AdaptiveFilm;
use super::camera::RayGenerator;
use super::config::{Backdrop, Inspection, Integrator as How, RenderConfig};
use super::edges::Lines;
use super::film::{AovSample, put};
use super::inspect::{Inspector, NOTHING, coordinates};
use super::layers::PathOutputs;
use super::paths::{PathPicture, PathTile};
use super::picture::{FinishedTile, Rendered, View, Worker};
use super::pixel_order::{BLOCK, Spot, morton_order};
use super::progress::Progress;
use super::sampler::{frame_key, position_in};
use super::window::Window;
use crate::math::lanes::Lanes;
use crate::scene::Rgb;
use crate::shade::path::Slot;
use crate::shade::{
    Doubles, Integrator, InteractionPart, MaterialFlags, Memory, RayCounts, STEP, Scratch,
    Statistics, Surface, material_at, place_of,
};
use crate::trace::{HitId, ItemBuffer, RayKind, ShadowCache, TURNED, TraceScratch, TracedRay};
use bumpalo::Bump;
use std::sync::Mutex;

/// Side of the largest tile, in pixels.
const SIDE: usize = 2 * BLOCK as usize;

/// A tile, and what is needed to render it.
pub(super) struct Tile<'a> {
    pub view: &'a View<'a>,
    pub config: &'a RenderConfig,
    pub progress: &'a Progress,
    pub on_tile: &'a (dyn Fn(FinishedTile) + Sync),
    pub corner: (u32, u32),
    pub size: (u32, u32),
    /// The part of the picture that is rendered, in which the tile lies.
    pub window: Window,
    /// Pixel order of a tile that the picture's border does not cut.
    pub whole: &'a [Spot],
    /// What path-traced tiles share.
    pub paths: Option<&'a PathPicture>,
    /// What the picture keeps of paths beside their colour.
    pub outputs: &'a PathOutputs<'a>,
    /// The picture, where it was sampled as a whole.
    pub film: Option<&'a AdaptiveFilm>,
    pub generator: &'a RayGenerator,
    /// The depths of the scene, if they are what is shown.
    pub depths: [f64; 2],
    pub material_flags: MaterialFlags,
    /// The frame's item buffer, and the index of the tile's first list.
    pub items: Option<(&'a ItemBuffer, usize)>,
}

impl Tile<'_> {
    pub fn render(
        &self,
        recording: bool,
        mut memory: Option<&mut Memory>,
        Worker { arena, trace }: &mut Worker,
        done: &Mutex<Rendered>,
    ) -> RayCounts {
        let pixels = (self.size.0 * self.size.1) as usize;
        let color = arena.alloc_slice_fill_copy(pixels, [0.0_f32; 3]);
        let alpha = arena.alloc_slice_fill_copy(pixels, 1.0_f32);
        let kept = match self.config.aovs.any_of_hits() {
            true => pixels,
            false => 0,
        };
        let aovs = arena.alloc_slice_fill_copy(kept, AovSample::NOTHING);
        let cache = ShadowCache::new(self.config.shadow_cache);
        let caches = arena.alloc_slice_fill_copy(self.view.lights.len(), cache);
        let cut = (pixels < self.whole.len()).then(|| morton_order(self.size));
        let order = cut.as_deref().unwrap_or(self.whole);
        if let How::Inspect(what) = self.config.integrator {
            return self.inspect(what, order, (arena, trace), (color, alpha, aovs), done);
        }
        let mut record = Vec::new();
        let mut counts = RayCounts::default();
        if kept > 0 && (self.paths.is_some() || self.film.is_some()) {
            let scratch = &mut Scratch::new(arena, trace);
            self.keep_first_hits(order, scratch, aovs);
        }
        if let Some(film) = self.film {
            for row in 0..pixels {
                (color[row], alpha[row]) = color_of(&film.mean(self.spot(row as u32)));
            }
            self.finish(color, alpha, aovs, done, (&counts, record));
            return counts;
        }
        if let Some(picture) = self.paths {
            let tile = PathTile {
                view: self.view,
                config: self.config,
                picture,
                generator: self.generator,
                corner: self.corner,
                order,
                cancel: &self.progress.cancel,
            };
            let slots = arena.alloc_slice_fill_copy(pixels, [0.0; 4]);
            let mut sums = None;
            match self.film {
                Some(film) => {
                    for (row, slot) in slots.iter_mut().enumerate() {
                        *slot = film.mean(self.spot(row as u32));
                    }
                }
                None => sums = Some(tile.render(arena, trace, slots, &mut counts)),
            }
            for (row, slot) in slots.iter().enumerate() {
                (color[row], alpha[row]) = color_of(slot);
            }
            if self.progress.is_cancelled() {
                return counts;
            }
            self.finish(color, alpha, aovs, done, (&counts, record));
            if let Some(sums) = &sums {
                let mut done = done.lock().unwrap_or_else(|e| e.into_inner());
                let place = |row| self.pixel(row) as usize;
                self.outputs.put(&mut done.picture, sums, place);
            }
            return counts;
        }
        let scratch = &mut Scratch::new(arena, trace);
        if kept > 0 && self.config.samples() > 1 {
            self.keep_first_hits(order, scratch, aovs);
        }
        for sample in 0..self.config.samples() {
            let statistics = &mut Statistics {
                counts: RayCounts::default(),
                record: recording.then_some(&mut record),
                sample,
                pixel_of: &|row| self.pixel(row),
                memory: memory.as_deref_mut(),
                covered: Some(alpha),
            };
            self.sample(sample, order, scratch, color, aovs, caches, statistics);
            counts.add(&statistics.counts);
            // Results of a cancelled tile are discarded.
            if self.progress.is_cancelled() {
                return counts;
            }
        }
        for cache in caches {
            counts.shadow_cache += cache.counts;
        }
        let share = 1.0 / self.config.samples() as f32;
        for pixel in color.iter_mut() {
            *pixel = pixel.map(|c| radiance(c * share));
        }
        for alpha in alpha.iter_mut() {
            *alpha = 1.0 - (1.0 - *alpha) * share;
        }
        self.finish(color, alpha, aovs, done, (&counts, record));
        counts
    }

    /// Shows what the pixels' rays meet or cost.
    fn inspect(
        &self,
        what: Inspection,
        order: &[Spot],
        (arena, trace): (&Bump, &mut TraceScratch),
        (color, alpha, aovs): (&mut [Rgb], &mut [f32], &mut [AovSample]),
        done: &Mutex<Rendered>,
    ) -> RayCounts {
        let inspector = &Inspector {
            view: self.view,
            config: self.config,
            what,
            generator: self.generator,
            corner: self.corner,
            depths: self.depths,
        };
        color.fill(inspector.nothing());
        let readings = arena.alloc_slice_fill_copy(color.len(), NOTHING);
        let mut statistics = Statistics {
            covered: Some(alpha),
            ..Statistics::of_counts()
        };
        let mut first_hit = |row: u32, surface: &Surface, id: HitId| {
            let (place, row) = (self.place(row), row as usize);
            let albedo = || self.aov(row as u32, surface, id).albedo;
            (color[row], readings[row]) = inspector.of_hit(place, (surface, id), albedo);
            if let Some(aov) = aovs.get_mut(row) {
                *aov = self.aov(row as u32, surface, id);
            }
        };
        let mut scratch = Scratch::new(arena, trace);
        self.first_hits(order, &mut scratch, &mut statistics, &mut first_hit);
        let mut counts = statistics.counts;
        if what == Inspection::Edges {
            let lines = Lines {
                generator: self.generator,
                integrator: Integrator {
                    lights: &[],
                    max_depth: 0,
                    items: None,
                    ..self.integrator()
                },
                backdrop: self.config.backdrop,
                corner: self.corner,
                size: self.size,
            };
            counts.add(&lines.draw(arena, &mut scratch, |row, drawn| {
                let row = row as usize;
                (color[row], alpha[row]) = (drawn.color, drawn.alpha);
                readings[row] = [f64::from(drawn.ink), f64::NAN, f64::NAN];
            }));
        }
        drop(scratch);
        if let Inspection::Heat(cost) = what {
            inspector.costs(cost, order, trace, |row, hot, reading| {
                (color[row as usize], readings[row as usize]) = (hot, reading);
            });
        }
        if self.progress.is_cancelled() {
            return counts;
        }
        self.finish(color, alpha, aovs, done, (&counts, Vec::new()));
        let mut done = done.lock().unwrap_or_else(|e| e.into_inner());
        for (row, reading) in readings.iter().enumerate() {
            let pixel = self.pixel(row as u32) as usize;
            done.readings[pixel] = *reading;
        }
        counts
    }

    /// Hands the tile's pixels on, and puts them into the picture.
    fn finish(
        &self,
        color: &[Rgb],
        alpha: &[f32],
        aovs: &[AovSample],
        done: &Mutex<Rendered>,
        (counts, mut record): (&RayCounts, Vec<TracedRay>),
    ) {
        (self.on_tile)(FinishedTile {
            x: self.corner.0,
            y: self.corner.1,
            width: self.size.0,
            height: self.size.1,
            color,
        });
        let mut done = done.lock().unwrap_or_else(|e| e.into_inner());
        put(
            &mut done.picture,
            self.window.local(self.corner),
            self.size,
            color,
            alpha,
            aovs,
        );
        done.counts.add(counts);
        done.record.append(&mut record);
    }

    #[expect(clippy::too_many_arguments)]
    fn sample(
        &self,
        sample: u32,
        order: &[Spot],
        scratch: &mut Scratch,
        color: &mut [Rgb],
        aovs: &mut [AovSample],
        caches: &mut [ShadowCache],
        statistics: &mut Statistics,
    ) {
        let config = self.config;
        let generator =
            RayGenerator::new(self.view.camera, config.width, config.height, config.grid);
        // A single sample lies at the centre.
        let number = (config.samples() > 1).then_some(sample);
        self.queue_rays(&generator, order, number, scratch);
        self.uncover_blind(order, scratch, statistics);
        let integrator = self.integrator();
        // The outputs beside the colour are those of the pixel's centre.
        let keep = number.is_none() && config.aovs.any_of_hits();
        let mut first_hit = |row: u32, surface: &Surface, id: HitId| {
            aovs[row as usize] = self.aov(row, surface, id);
        };
        let first_hit = keep.then_some(&mut first_hit as _);
        integrator.run(scratch, color, caches, statistics, first_hit);
    }

    /// Queues one camera ray for each pixel: its sample of this number, or through its centre.
    fn queue_rays(
        &self,
        generator: &RayGenerator,
        order: &[Spot],
        sample: Option<u32>,
        scratch: &mut Scratch,
    ) {
        let queue = scratch.camera_rays();
        // Rays through the centres of a column or row share one position.
        let centres = sample.is_none().then(|| self.centres(generator));
        for some in order.chunks(STEP) {
            let spots: [Spot; STEP] = std::array::from_fn(|i| some[i.min(some.len() - 1)]);
            let [across, up] = match &centres {
                Some([columns, rows]) => [
                    Doubles::load(&spots.map(|spot| columns[spot.x as usize % SIDE])),
                    Doubles::load(&spots.map(|spot| rows[spot.y as usize % SIDE])),
                ],
                None => self.sampled(generator, &spots, sample.unwrap_or(0)),
            };
            let rays = generator.through(across, up);
            let rows = generator.seeing(&rays.1, some.len());
            queue.push_some(rows, rays, &spots.map(|spot| spot.row));
        }
        queue.complete(f32::INFINITY, RayKind::Primary);
    }

    /// Notes that pixels without a ray cover nothing.
    fn uncover_blind(&self, order: &[Spot], scratch: &mut Scratch, statistics: &mut Statistics) {
        let Some(covered) = &mut statistics.covered else {
            return;
        };
        if !self.generator.has_blind_spots() {
            return;
        }
        let mut sees = [false; SIDE * SIDE];
        for row in &scratch.camera_rays().pixel {
            sees[*row as usize] = true;
        }
        for spot in order.iter().filter(|spot| !sees[spot.row as usize]) {
            covered[spot.row as usize] -= 1.0;
        }
    }

    /// Keeps what the rays through the pixels' centres hit, for the outputs beside the colour
    /// of a picture whose samples lie elsewhere.
    fn keep_first_hits(&self, order: &[Spot], scratch: &mut Scratch, aovs: &mut [AovSample]) {
        let statistics = &mut Statistics::of_counts();
        let mut first_hit = |row: u32, surface: &Surface, id: HitId| {
            aovs[row as usize] = self.aov(row, surface, id);
        };
        self.first_hits(order, scratch, statistics, &mut first_hit);
    }

    /// Finds what the rays through the pixels' centres hit.
    fn first_hits(
        &self,
        order: &[Spot],
        scratch: &mut Scratch,
        statistics: &mut Statistics,
        first_hit: &mut dyn FnMut(u32, &Surface, HitId),
    ) {
        self.queue_rays(self.generator, order, None, scratch);
        self.uncover_blind(order, scratch, statistics);
        let integrator = Integrator {
            lights: &[],
            max_depth: 0,
            ..self.integrator()
        };
        // Nobody looks at the emission and the backdrop that are added here.
        let film = &mut [[0.0; 3]; SIDE * SIDE];
        integrator.run(scratch, film, &mut [], statistics, Some(first_hit));
    }

    fn integrator(&self) -> Integrator<'_> {
        Integrator {
            world: self.view.world,
            kernels: self.view.kernels,
            lights: self.view.lights,
            items: self.items,
            background: self.view.world.scene.background,
            backdrop: match self.config.backdrop {
                Backdrop::Auto => self.view.world.scene.background,
                Backdrop::Color(color) => color,
                Backdrop::Transparent => [0.0; 3],
            },
            max_depth: self.config.max_depth,
            unnamed: Default::default(),
            material_flags: self.material_flags,
            cancel: &self.progress.cancel,
        }
    }

    /// Returns the image-plane positions of rays through the centres of the tile's
    /// columns and rows.
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

    /// Returns the image-plane positions of rays through one sample of each pixel.
    fn sampled(&self, generator: &RayGenerator, spots: &[Spot; STEP], sample: u32) -> [Doubles; 2] {
        let config = self.config;
        let (mut at, mut offset) = ([[0.0; STEP]; 2], [[0.0; STEP]; 2]);
        let frame = frame_key(config.frame);
        for (i, spot) in spots.iter().enumerate() {
            let (x, y) = (self.corner.0 + spot.x, self.corner.1 + spot.y);
            let [dx, dy] = position_in(config.seed, frame, (x, y), sample, config.spp);
            (at[0][i], at[1][i]) = (f64::from(x), f64::from(y));
            (offset[0][i], offset[1][i]) = (dx, dy);
        }
        let [[x, y], [dx, dy]] = [at, offset].map(|axes| axes.map(|axis| Doubles::load(&axis)));
        [generator.across(x, dx), generator.up(y, dy)]
    }

    fn aov(&self, row: u32, surface: &Surface, id: HitId) -> AovSample {
        let generator = self.generator;
        let materials = &self.view.world.scene.materials;
        let material = match surface.material {
            Some(id) => materials.rows[id.index()],
            None => Default::default(),
        };
        let (x, y) = self.place(row);
        let (org, dir) = generator.ray(x, y, [0.5; 2]);
        let mut albedo = material.base_color;
        let scene = &self.view.world.scene;
        let textured = surface.material.and_then(|id| scene.textures.of(id));
        if textured.is_some() {
            let part = InteractionPart::of(self.view.world, self.view.kernels.precision, id);
            let hit = (surface, id);
            let (place, spot) = place_of((&part, self.view.world), (org, dir), hit);
            let own = (surface.material, &material);
            albedo = material_at(scene, own, (&place, &spot)).base_color;
        }
        let camera = &self.view.camera;
        let camera_normal = [camera.right, camera.up, -camera.forward].map(|v| v.dot(surface.ns));
        let uv = match self.config.aovs.uv {
            true => coordinates(self.view, (org, dir), surface, id),
            false => [0.0; 2],
        };
        AovSample {
            depth: generator.depth(surface.point) as f32,
            position: surface.point.to_array().map(|x| x as f32),
            normal: surface.ns.to_array().map(|x| x as f32),
            albedo,
            instance: id.instance,
            primitive: id.primitive & !TURNED,
            distance: (surface.point - org).length() as f32,
            geometric_normal: surface.facing().to_array().map(|x| x as f32),
            camera_normal: camera_normal.map(|x| x as f32),
            uv: uv.map(|x| x as f32),
        }
    }

    /// Returns the picture position of a row of the tile's film.
    fn place(&self, row: u32) -> (u32, u32) {
        (
            self.corner.0 + row % self.size.0,
            self.corner.1 + row / self.size.0,
        )
    }

    /// Returns the position in the window of a row of the tile's film.
    fn spot(&self, row: u32) -> (u32, u32) {
        self.window.local(self.place(row))
    }

    /// Returns the number in the window of a row's pixel.
    fn pixel(&self, row: u32) -> u32 {
        let (x, y) = self.spot(row);
        y * self.window.width + x
    }
}

/// Returns the colour and alpha that a picture has for the mean of a pixel's slots.
pub fn color_of([r, g, b, there]: &Slot) -> (Rgb, f32) {
    ([*r, *g, *b].map(radiance), there.clamp(0.0, 1.0))
}

/// Returns a radiance that is neither negative, infinite nor NaN: what overflows f32 becomes
/// its largest number, and what such an overflow leaves undefined is black.
fn radiance(c: f32) -> f32 {
    if c >= 0.0 { c.min(f32::MAX) } else { 0.0 }
}
