//! The path tracer: a path a ray and bounce, with light sampling at every hit and multiple
//! importance sampling between the two (Veach 1997).
//!
//! Paths go on in waves: the rays of one sample of a tile are traced together, shaded by
//! material in lanes, and those that are scattered make up the next wave. Every random number
//! is a function of (seed, frame, pixel, sample, dimension), and what a path finds goes to its
//! own slot, so no order of rays, tiles, threads or lanes can show.

mod cache;
mod emission;
mod first_met;
mod ground;
mod guides;
mod layers;
mod luminaires;
mod materials;
mod media;
mod normal_maps;
mod record;
mod scatter;
mod scratch;
mod shadows;
mod spot;
mod state;
mod textured;
mod textured_emitters;

pub use cache::{
    CacheUse, Irradiance, IrradianceRecord, Missed, SECTORS, UseMode, sector_direction,
};
pub use first_met::FirstMet;
pub use ground::Ground;
pub use guides::GUIDES;
pub use layers::{LIGHT_LAYERS, LayerPlan, LayerSlots};
pub use luminaires::Luminaires;
pub use materials::Materials;
pub use media::MediaField;
pub use record::{PathLight, PathVertex};
pub use scratch::PathScratch;
pub use state::{Media, PathKinds};

use super::columns::{STEP, Singles, each_lane};
use super::statistics::{Statistics, count_rays};
use crate::accel::World;
use crate::light::sampler::Sampler;
use crate::math::lanes::{Lanes, Words};
use crate::plan::Kernels;
use crate::scene::Rgb;
use crate::trace::{HitId, RayKind, ShadowCache, Solids};
use layers::Film;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// What camera rays see where they meet nothing but holes and panes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Seen {
    /// The environment or background that lights the scene.
    Sky,
    Color(Rgb),
    /// Nothing, whose share the slots' last number lacks.
    Nothing,
}

/// Which sample of its pixel each path is.
#[derive(Clone, Copy, Debug)]
pub enum SampleNumbers<'a> {
    /// All paths are this one.
    One(u32),
    /// By the row of a path's slot.
    Each(&'a [u32]),
}

impl SampleNumbers<'_> {
    /// Returns the number of the sample with a row of the slots.
    #[inline(always)]
    fn of(self, row: u32) -> u32 {
        match self {
            SampleNumbers::One(sample) => sample,
            SampleNumbers::Each(numbers) => numbers[row as usize],
        }
    }

    /// Returns the numbers of a step of paths; `row` returns the row of a lane's slot.
    #[inline(always)]
    fn of_step(self, row: impl Fn(usize) -> u32) -> <Singles as Lanes>::Words {
        match self {
            SampleNumbers::One(sample) => Words::splat(sample),
            SampleNumbers::Each(numbers) => Words::load(&std::array::from_fn::<_, STEP, _>(|i| {
                numbers[row(i) as usize]
            })),
        }
    }
}

/// A path tracer of one picture.
pub struct PathTracer<'w> {
    pub world: &'w World,
    pub kernels: Kernels,
    /// The width of camera rays at the eye, and how much wider they get per unit of way: for the
    /// levels of textures.
    pub cone: [f32; 2],
    /// Whether a texture's look-up takes one texel by random numbers.
    pub picks_texels: bool,
    pub luminaires: &'w Luminaires,
    pub materials: &'w Materials,
    pub sampler: Sampler,
    /// The maximum number of times that a path is scattered.
    pub max_depth: u32,
    /// The media around the eye.
    pub media: Media,
    /// Where media touch or overlap: the scene's solids, which tell exactly which are where.
    pub solids: Option<&'w Solids>,
    /// What camera rays see where they meet nothing.
    pub backdrop: Seen,
    /// The layers of light, if they are kept.
    pub layers: Option<&'w LayerPlan>,
    /// The ground that the scene stands on, if it fades.
    pub ground: Option<Ground>,
    /// An irradiance cache, and how it is used.
    pub cache: Option<CacheUse<'w>>,
    /// Whether what shines is left out where paths meet it straight from their start: rays that
    /// gather indirect light.
    pub only_indirect: bool,
    /// Cancellation flag, read before every wave.
    pub cancel: &'w AtomicBool,
}

/// What a pixel gets of one path: radiance, and the share of what is behind all that it hides.
pub type Slot = [f32; 4];

/// Paths that are scattered this often take part in Russian roulette. They survive with the
/// square root of their weight: as a path's cost does not shrink with its weight, that is worth
/// more than the weight itself (Rath et al. 2022, "EARS", section 3).
const ROULETTE_DEPTH: u32 = 3;

impl PathTracer<'_> {
    /// Adds the radiance of the camera rays in `scratch` to `slots`, one row per pixel of the
    /// tile and sample.
    pub fn run(
        &self,
        scratch: &mut PathScratch,
        samples: SampleNumbers,
        slots: &mut [Slot],
        cache: &mut ShadowCache,
        statistics: &mut Statistics,
    ) {
        let has_patterns = !self.world.scene.textures.patterns.is_empty();
        scratch.buffer.wants_spots = self.materials.has_textures && has_patterns;
        scratch.waves[0].begin(self.media, self.cone);
        for depth in 0..=self.max_depth {
            if scratch.waves[0].rays.is_empty() || self.cancel.load(Relaxed) {
                return;
            }
            scratch.waves[1].clear();
            self.wave((samples, depth), scratch, slots, cache, statistics);
            scratch.waves.swap(0, 1);
        }
    }

    /// Traces and shades the rays of a depth, and queues those of the next.
    fn wave(
        &self,
        (samples, depth): (SampleNumbers, u32),
        scratch: &mut PathScratch,
        slots: &mut [Slot],
        cache: &mut ShadowCache,
        statistics: &mut Statistics,
    ) {
        let [wave, next] = &mut scratch.waves;
        let count = wave.rays.len();
        let hits = &mut scratch.hits;
        hits.closest((self.world, &self.kernels), &mut wave.rays, scratch.trace);
        if self.materials.has_cutouts {
            let scratch = (
                &mut scratch.passing,
                &mut scratch.buffer,
                &mut *scratch.trace,
            );
            self.pass_cutouts((samples, depth), (wave, hits), scratch);
        }
        let (t, instance, primitive) = (&hits.t, &hits.instance, &hits.primitive);
        count_rays(&wave.rays.kind, &instance[..count], depth, statistics);
        if let Some(record) = &mut scratch.record {
            record::record_ray(wave, (instance, primitive), record);
        }
        if let (0, Some(reach)) = (depth, &mut scratch.cached.reach) {
            reach.clear();
            reach.extend(t[..count].iter().zip(&instance[..count]).map(|(t, id)| {
                match *id == HitId::NONE.instance {
                    true => f64::INFINITY,
                    false => *t,
                }
            }));
        }
        let film = &mut Film {
            slots,
            layers: scratch.layers.as_mut(),
        };
        let buffer = &mut scratch.buffer;
        let world = (self.world, self.kernels.precision);
        let groups = &mut scratch.groups;
        groups.fill(world, &wave.rays, (t, instance, primitive), buffer);
        if self.materials.has_normal_maps {
            self.bend_normals((samples, depth), wave, buffer);
        }
        if let (Some(met), Some(open)) = (&mut scratch.first_met, &wave.open) {
            self.meet(met, (wave, open), (depth, instance), buffer);
        }
        let kept = (film.layers.as_deref_mut(), self.layers, &wave.guiding);
        if let (Some(layers), Some(plan), Some(guiding)) = kept {
            self.guide((layers, plan), (wave, guiding), instance, buffer);
        }
        if depth > 0 {
            self.add_panels(wave, (&instance[..count], t), film);
        }
        if self.materials.has_media {
            self.absorb(wave, buffer);
        }
        self.add_sky(wave, (depth, &instance[..count]), film);
        self.add_emission(wave, (samples, depth), (instance, primitive), buffer, film);
        if depth == self.max_depth {
            return;
        }
        scratch.lights.clear();
        scratch.cached.clear_found();
        let mut first = 0;
        while first < buffer.len() {
            let material = buffer.material[first];
            let rest = buffer.material[first..buffer.len()].iter().take(STEP);
            let same = rest.take_while(|other| **other == material).count();
            let hits = each_lane(|i| (first + i.min(same - 1)) as u32);
            let number = self.materials.number(material);
            let look = &self.materials.rows[number as usize];
            let deep = look.varied.as_ref().filter(|varied| varied.is_deep);
            // Where more varies than shading varies in lanes, each hit has a material of its own.
            let groups = if deep.is_some() { same } else { 1 };
            for i in 0..groups {
                let (hits, count, own) = match deep {
                    None => (hits, same, None),
                    Some(varied) => {
                        let hit = hits[i];
                        let at =
                            self.look_at((look, varied), (samples, depth), wave, (buffer, hit));
                        ([hit; STEP], 1, Some(at))
                    }
                };
                self.scatter(
                    (samples, depth),
                    (wave, buffer),
                    (&hits, count, (number, own.as_ref().unwrap_or(look))),
                    (next, &mut scratch.lights, &mut scratch.cached),
                    scratch.trace,
                );
            }
            first += same;
        }
        scratch.cached.add_to(film, self.layers);
        next.rays.complete(f32::INFINITY, RayKind::Reflection);
        self.add_light(
            &mut scratch.lights,
            (&mut scratch.hits, &mut scratch.buffer),
            film,
            (cache, scratch.trace),
            statistics,
        );
        if let Some(record) = &mut scratch.record {
            record::record_light(&scratch.lights, record);
        }
    }
}

/// Returns the share of a way of sampling under the power heuristic (Veach 1997, section
/// 9.2.4): its squared density over the sum of its own and the other's. Under a large lamp the
/// balance heuristic has nearly twice the variance. An infinite density is that of a mirror,
/// which no other competes with.
#[inline(always)]
fn share<L: Lanes<Scalar = f32>>(own: L, other: L) -> L {
    let one = L::splat(1.0);
    let ratio = other / own;
    let share = one / (one + ratio * ratio);
    L::select(own.lt(L::splat(f32::MAX)), share, one)
}
