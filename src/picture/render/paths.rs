//! Path-traced tiles: camera rays by sampler and pixel filter, one wave of paths per sample,
//! and sums that show no order.

use super::RenderConfig;
use super::camera::RayGenerator;
use super::config::{Backdrop, Integrator};
use super::irradiance::use_of;
use super::mattes::MetLists;
use super::picture::View;
use super::pixel_order::Spot;
use super::sums::Sums;
use crate::accel::World;
use crate::light::filter::Filter;
use crate::light::sampler::Sampler;
use crate::math::lanes::{Lanes, Words};
use crate::plan::Kernels;
use crate::scene::{Material, Model, Rgb, Textures, studio};
use crate::shade::path::{
    Irradiance, LayerPlan, LayerSlots, Luminaires, Materials, MediaField, PathKinds, PathScratch,
    PathTracer, SampleNumbers, Seen, Slot, UseMode,
};
use crate::shade::{Doubles, RayCounts, RayQueue, STEP, Singles, Statistics, each_lane};
use crate::trace::{RayKind, ShadowCache, TraceScratch};
use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;
use glam::DVec3;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// What stands behind things in the studio: a light grey.
pub const STUDIO_BACKDROP: Rgb = [0.72; 3];

/// Up to this many samples, textures are filtered; with more, samples take single texels.
const MOST_FILTERED: u32 = 4;

/// The share of a pixel's width that a sample stands for where samples take single texels: the
/// pixel filter is no finer. It does not depend on their number, so that parts of a picture, which
/// do not know it, add up to the whole.
const LEAST_SHARE: f64 = 0.125;

/// What all tiles of a path-traced picture share.
pub struct PathPicture {
    luminaires: Arc<Luminaires>,
    materials: Arc<Materials>,
    pub(super) sampler: Sampler,
    filter: Arc<Filter>,
    pub(super) media: MediaField,
    pub(super) max_depth: u32,
    pub(super) samples: u32,
    /// Whether samples take single texels of textures.
    pub(super) picks_texels: bool,
    pub(super) backdrop: Seen,
    /// Indirect light, and how paths use it.
    pub(super) cache: Option<(Irradiance, UseMode)>,
    /// Whether some mesh has vertex normals.
    pub(super) smooth: bool,
    /// The layers of light, if they are asked for.
    pub(super) layers: Option<Arc<LayerPlan>>,
}

impl PathPicture {
    /// Tells what its paths may meet.
    pub(super) fn kinds(&self) -> PathKinds {
        PathKinds {
            smooth: self.smooth,
            holes: self.materials.has_holes(),
            cache: self.cache.is_some(),
            textures: self.materials.has_textures(),
            media: self.materials.has_media(),
        }
    }

    /// Prepares a picture, unless its integrator traces no paths.
    pub fn new(view: &View, config: &RenderConfig) -> Option<PathPicture> {
        let scene = &view.world.scene;
        let made = (scene.is_dark() && view.lights.is_empty()).then(|| studio(&view.camera));
        let environment = scene.environment.as_ref().or(made.as_ref());
        let (luminaires, materials, max_depth) = match config.integrator {
            Integrator::Path => (
                Luminaires::of((scene, &view.world.instances), view.lights, environment),
                Materials::new(&scene.materials.rows, &scene.textures),
                config.max_depth,
            ),
            // Ambient occlusion is a white world under a white sky, lit once.
            Integrator::Ao => (
                Luminaires::white_sky(),
                Materials::new(&vec![white(); scene.materials.len()], &Textures::default()),
                1,
            ),
            _ => return None,
        };
        let samples = config.samples();
        let has_guides = config.aovs.any_of_guides();
        let has_layers = config.aovs.any_of_light() || has_guides;
        let layers = has_layers.then(|| {
            let bodies = luminaires.materials(scene, &view.world.instances);
            let kept = (config.aovs.light_groups, has_guides);
            let lights = view.lights.len();
            Arc::new(LayerPlan::new(scene, (&luminaires, &bodies), lights, kept))
        });
        let media = MediaField::of(scene, &view.world.instances, &materials, view.camera.eye);
        let backdrop = match config.backdrop {
            Backdrop::Color(color) => Seen::Color(color),
            Backdrop::Transparent => Seen::Nothing,
            // The studio's lamps are no part of the picture.
            Backdrop::Auto if made.is_some() && config.integrator == Integrator::Path => {
                Seen::Color(match scene.background {
                    [0.0, 0.0, 0.0] => STUDIO_BACKDROP,
                    background => background,
                })
            }
            Backdrop::Auto => Seen::Sky,
        };
        Some(PathPicture {
            cache: None,
            luminaires: Arc::new(luminaires),
            layers,
            smooth: !scene.meshes.normals.is_empty(),
            backdrop,
            media,
            materials: Arc::new(materials),
            sampler: Sampler::new(config.sampler, config.seed, config.frame, samples),
            filter: Arc::new(Filter::new(config.filter)),
            max_depth,
            samples,
            picks_texels: samples > MOST_FILTERED,
        })
    }

    /// Prepares the same picture at another time; what does not move is shared.
    pub fn at_time(&self, before: &World, (world, eye): (&World, DVec3)) -> PathPicture {
        let scenes = [before, world].map(|world| (&*world.scene, &world.instances));
        let moved = self.luminaires.at_time(scenes[0], scenes[1]);
        let layers = match (&self.layers, &moved) {
            (Some(plan), Some(moved)) => {
                // Emitters are counted anew.
                let (scene, instances) = scenes[1];
                let bodies = moved.materials(scene, instances);
                let (lights, kept) = (scene.lights.len(), plan.kept());
                let plan = LayerPlan::new(scene, (moved, &bodies), lights, kept);
                Some(Arc::new(plan))
            }
            (plan, _) => plan.clone(),
        };
        PathPicture {
            layers,
            luminaires: moved.map_or_else(|| Arc::clone(&self.luminaires), Arc::new),
            materials: Arc::clone(&self.materials),
            media: MediaField::of(&world.scene, &world.instances, &self.materials, eye),
            filter: Arc::clone(&self.filter),
            cache: None,
            ..*self
        }
    }

    /// Says whether another time's luminaires are these: none of them moves.
    pub fn shares_luminaires(&self, other: &PathPicture) -> bool {
        Arc::ptr_eq(&self.luminaires, &other.luminaires)
    }

    /// Returns the bytes of a time's luminaires if some of them move.
    pub fn bytes_of_a_time(&self) -> usize {
        self.luminaires.emitters.bytes()
    }
}

/// The matter of a clay model.
fn white() -> Material {
    Material {
        model: Model::Phong {
            diffuse: [1.0; 3],
            specular: [0.0; 3],
            exponent: 1.0,
            mirror: [0.0; 3],
        },
        ..Material::default()
    }
}

/// The slot of a path that has found nothing, and hides nothing.
pub const NOTHING_YET: Slot = [0.0, 0.0, 0.0, 1.0];
/// Sums of a tile's samples.
pub struct TileSums<'b> {
    pub all: Sums<'b>,
    /// Those of the first half of the samples, if the variance is kept.
    pub half: Option<Vec<[f64; 4]>>,
    /// By layer of light, if they are kept.
    pub layers: Vec<Sums<'b>>,
    /// What the samples meet first, if mattes are kept.
    pub met: Option<MetLists<'b>>,
}

impl<'b> TileSums<'b> {
    /// Makes the sums of a tile that keeps nothing else.
    pub fn of(all: Sums<'b>) -> TileSums<'b> {
        TileSums {
            all,
            half: None,
            layers: Vec::new(),
            met: None,
        }
    }
}

/// A tile of the picture and what its paths are traced with.
pub struct PathTile<'a> {
    pub view: &'a View<'a>,
    pub config: &'a RenderConfig,
    pub picture: &'a PathPicture,
    pub generator: &'a RayGenerator,
    pub corner: (u32, u32),
    /// The tile's pixels in the order of their packets.
    pub order: &'a [Spot],
    pub cancel: &'a AtomicBool,
}

impl PathTile<'_> {
    /// Renders all samples of the tile into `slots`, one row per pixel.
    pub fn render<'b>(
        &self,
        arena: &'b Bump,
        trace: &'b mut TraceScratch,
        slots: &mut [Slot],
        counts: &mut RayCounts,
    ) -> TileSums<'b> {
        let sums = self.sums(0..self.picture.samples, arena, trace, counts);
        for (pixel, slot) in slots.iter_mut().enumerate() {
            *slot = sums.all.mean(pixel);
        }
        sums
    }

    /// Sums the samples of a range, which is aligned to its length where their number is a power
    /// of two.
    pub fn sums<'b>(
        &self,
        samples: Range<u32>,
        arena: &'b Bump,
        trace: &'b mut TraceScratch,
        counts: &mut RayCounts,
    ) -> TileSums<'b> {
        let tracer = self.tracer();
        let pixels = self.order.len();
        let slots = arena.alloc_slice_fill_copy(pixels, [0.0_f32; 4]);
        let middle = self.middle(&samples);
        let mut sums = self.no_sums(arena);
        let has_mattes = sums.met.is_some();
        let mut cache = ShadowCache::new(self.config.shadow_cache);
        let scratch = &mut PathScratch::new(arena, trace, self.picture.kinds());
        if let Some(plan) = &self.picture.layers {
            scratch.keep_layers(pixels, plan, arena);
        }
        if has_mattes {
            scratch.keep_first_met(pixels, arena);
        }
        for sample in samples {
            let statistics = &mut Statistics {
                sample,
                ..Statistics::of_counts()
            };
            slots.fill(NOTHING_YET);
            scratch.clear_outputs();
            self.queue_rays(sample, scratch);
            if self.generator.has_blind_spots() {
                slots.iter_mut().for_each(|slot| slot[3] = 0.0);
                for row in scratch.queued() {
                    slots[*row as usize][3] = 1.0;
                }
            }
            let number = SampleNumbers::One(sample);
            tracer.run(scratch, number, slots, &mut cache, statistics);
            if self.cancel.load(Relaxed) {
                break;
            }
            if middle == Some(sample) {
                sums.half = Some((0..pixels).map(|pixel| sums.all.of(pixel)).collect());
            }
            sums.all.add(slots);
            let layers = scratch.layers().into_iter().flat_map(LayerSlots::layers);
            for (sum, layer) in sums.layers.iter_mut().zip(layers) {
                sum.add(layer);
            }
            if let (Some(lists), Some(met)) = (&mut sums.met, scratch.first_met()) {
                lists.add(met);
            }
            counts.add(&statistics.counts);
        }
        counts.shadow_cache += cache.counts;
        sums
    }

    /// Makes the sums of no samples yet, of all that the picture keeps.
    pub(super) fn no_sums<'b>(&self, arena: &'b Bump) -> TileSums<'b> {
        let pixels = self.order.len();
        let layers = self.picture.layers.as_ref().map_or(0, |plan| plan.count());
        let has_mattes = self.config.aovs.any_of_mattes();
        TileSums {
            all: Sums::new(pixels, arena),
            half: None,
            layers: (0..layers).map(|_| Sums::new(pixels, arena)).collect(),
            met: has_mattes.then(|| MetLists::new(pixels, arena)),
        }
    }

    /// Returns the sample before which the sums of a half are taken, if the variance is kept.
    pub(super) fn middle(&self, samples: &Range<u32>) -> Option<u32> {
        let keeps = self.config.aovs.variance;
        keeps.then_some(samples.start.midpoint(samples.end))
    }

    pub(super) fn tracer(&self) -> PathTracer<'_> {
        let picture = self.picture;
        PathTracer {
            world: self.view.world,
            kernels: Kernels {
                ..self.view.kernels
            },
            cone: self.cone(),
            picks_texels: picture.picks_texels,
            luminaires: &picture.luminaires,
            materials: &picture.materials,
            sampler: picture.sampler,
            max_depth: picture.max_depth,
            media: picture.media.eye,
            solids: picture.media.solids.as_ref(),
            backdrop: picture.backdrop,
            layers: picture.layers.as_deref(),
            ground: self.config.ground,
            cache: use_of(picture, self.config),
            only_indirect: false,
            cancel: self.cancel,
        }
    }

    /// Returns the width of camera rays and how it grows: a pixel's, or less where its samples
    /// share it.
    fn cone(&self) -> [f32; 2] {
        let share = match self.picture.picks_texels {
            true => LEAST_SHARE,
            false => 1.0 / f64::from(self.picture.samples).sqrt(),
        };
        self.generator.pixel_cone().map(|of| (of * share) as f32)
    }

    /// Queues a camera ray for each pixel, through a point that the filter chooses.
    pub(super) fn queue_rays(&self, sample: u32, scratch: &mut PathScratch) {
        let (queue, keys) = scratch.camera_rays();
        for some in self.order.chunks(STEP) {
            let spots = each_lane(|i| some[i.min(some.len() - 1)]);
            let samples = (&[sample; STEP], &each_lane(|i| spots[i].row));
            self.queue_step((&spots, some.len()), samples, (queue, keys));
        }
        queue.complete(f32::INFINITY, RayKind::Primary);
    }

    /// Queues camera rays of the first `count` of some pixels, each of a sample and for a row of
    /// the slots.
    #[inline(always)]
    pub(super) fn queue_step(
        &self,
        (spots, count): (&[Spot; STEP], usize),
        (samples, rows): (&[u32; STEP], &[u32; STEP]),
        (queue, keys): (&mut RayQueue, &mut ArenaVec<u32>),
    ) {
        let PathPicture {
            sampler, filter, ..
        } = self.picture;
        let at = each_lane(|i| (self.corner.0 + spots[i].x, self.corner.1 + spots[i].y));
        let key = each_lane(|i| sampler.key(at[i].0, at[i].1));
        let [u, v, on_lens @ ..] = sampler.pad(Words::load(&key), Words::load(samples), 0);
        let ([dx, dy], weight): ([Singles; 2], _) = filter.sample([u, v], samples);
        let half = Doubles::splat(0.5);
        let place = |of: fn((u32, u32)) -> u32| Doubles::load(&each_lane(|i| f64::from(of(at[i]))));
        let across = self.generator.across(place(|p| p.0), half + dx.widen());
        let up = self.generator.up(place(|p| p.1), half + dy.widen());
        let mut rays = self.generator.through(across, up);
        if self.generator.has_lens() {
            rays = self.generator.through_lens(rays, on_lens);
        }
        let lanes = self.generator.seeing(&rays.1, count);
        queue.push_some(lanes, rays, rows);
        queue.weigh_some(weight, lanes);
        for i in (0..count).filter(|i| lanes >> i & 1 != 0) {
            keys.push(key[i]);
        }
    }
}
