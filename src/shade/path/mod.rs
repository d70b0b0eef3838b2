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
mod media;
mod normal_maps;
mod record;
mod scatter;
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
pub use media::MediaField;
pub use record::{PathLight, PathVertex};
pub use state::Media;

use super::columns::{STEP, Singles};
use super::hit_buffer::HitBuffer;
use super::hit_columns::HitColumns;
use super::hits::fill_hit_buffer;
use super::ray_queue::{BATCH, RayQueue};
use super::statistics::{Statistics, count_rays};
use crate::accel::World;
use crate::light::bsdf::Bsdf;
use crate::light::sampler::Sampler;
use crate::math::lanes::{Lanes, Words};
use crate::plan::Kernels;
use crate::scene::{Material, MaterialId, Rgb, Textures};
use crate::trace::{HitId, RayKind, ShadowCache, Solids, TraceScratch};
use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;
use cache::CacheColumns;
use glam::DVec3;
use layers::Film;
use shadows::LightRays;
use state::Paths;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use textured::{Passing, Varied};

/// What the path tracer needs to know of each material, and of all of them together.
#[derive(Debug)]
pub struct Materials {
    /// By material, and last that of surfaces without one.
    rows: Vec<Look>,
    /// True if light inside some material is bent, absorbed or both.
    has_media: bool,
    /// True if some medium bends the three colours differently.
    has_dispersion: bool,
    /// True if some material shines.
    any_shines: bool,
    /// True if shadow rays may pass some surface.
    has_holes: bool,
    /// True if some material varies from hit to hit; if the alpha of some does, and if some have
    /// normal maps.
    has_textures: bool,
    has_cutouts: bool,
    has_normal_maps: bool,
    /// True if the normals of some coats are not those below.
    bends_coats: bool,
}

/// A material as the path tracer reads it.
#[derive(Debug)]
struct Look {
    material: Material,
    bsdf: Bsdf,
    /// Absorption inside, per world unit.
    absorption: Rgb,
    /// How it varies from hit to hit.
    varied: Option<Varied>,
    /// The factor of an alpha that varies.
    alpha: f32,
    /// Whether the normal of its coat is not that of the base.
    bends_coat: bool,
    /// Whether its highlights are stretched along the tangents of meshes.
    follows_tangents: bool,
}

impl Materials {
    /// Prepares a scene's materials, which textures may vary.
    pub fn new(rows: &[Material], textures: &Textures) -> Materials {
        let all = rows.iter().copied().chain([Material::default()]);
        let mut rows: Vec<Look> = all.map(Look::new).collect();
        for row in textures.iter() {
            let look = &mut rows[row.material.index()];
            *look = Look::varied(look.material, &row);
        }
        let has = |what: fn(&Varied) -> bool| {
            let mut all = rows.iter().filter_map(|look| look.varied.as_ref());
            all.any(what)
        };
        Materials {
            has_textures: has(|_| true),
            has_cutouts: has(Varied::has_alpha),
            has_normal_maps: has(Varied::has_normals),
            bends_coats: rows.iter().any(|look| look.bends_coat),
            any_shines: rows.iter().any(|look| look.shine().is_some()),
            has_media: rows.iter().any(Look::has_medium),
            has_dispersion: rows.iter().any(Look::has_dispersion),
            has_holes: rows.iter().any(Look::lets_shadow_rays_pass),
            rows,
        }
    }

    /// Returns the medium that is there where several overlap: the one of the highest priority,
    /// of the highest number among equals.
    fn innermost(&self, media: &Media) -> Option<u32> {
        let priority = |m: &u32| (self.rows[*m as usize].material.layers.priority, *m);
        media.iter().max_by_key(priority)
    }

    /// Returns the share of light that the innermost of some media leaves over a way in world
    /// units, which may be infinite (Beer and Lambert).
    fn left(&self, media: &Media, way: f32) -> Rgb {
        let Some(medium) = self.innermost(media) else {
            return [1.0; 3];
        };
        let left = |absorption: f32| match absorption {
            0.0 => 1.0,
            _ => libm::expf(-absorption * way),
        };
        self.rows[medium as usize].absorption.map(left)
    }

    /// Says whether paths and shadow rays may pass some surface.
    pub fn has_holes(&self) -> bool {
        self.has_holes
    }

    /// Returns the index of refraction of a medium, 1 without one, for red, green or blue: that
    /// of `KHR_materials_dispersion`, whose red and blue are the Fraunhofer lines C and F.
    fn index(&self, medium: Option<u32>, channel: usize) -> f32 {
        let of = |m: u32| {
            let Material { ior, layers, .. } = &self.rows[m as usize].material;
            let part = [-0.025, 0.0, 0.025][channel];
            ior + (ior - 1.0) * layers.dispersion * part
        };
        medium.map_or(1.0, of)
    }

    /// Says whether a medium bends the three colours differently.
    fn disperses(&self, medium: Option<u32>) -> bool {
        self.has_dispersion
            && medium.is_some_and(|m| self.rows[m as usize].material.layers.dispersion > 0.0)
    }

    /// Says whether some material varies from hit to hit.
    pub fn has_textures(&self) -> bool {
        self.has_textures
    }

    /// Says whether light inside some material is bent or absorbed.
    pub fn has_media(&self) -> bool {
        self.has_media
    }

    /// Says whether a surface of this material bounds a medium.
    pub fn bounds_medium(&self, id: Option<MaterialId>) -> bool {
        self.rows[self.number(id) as usize].has_medium()
    }

    /// Lists the media around a point: those of the solids that contain it.
    pub fn media_at(&self, solids: &Solids, point: DVec3, trace: &mut TraceScratch) -> Media {
        let mut media = Media::default();
        solids.around(point, trace, |material| {
            if self.bounds_medium(material) {
                media.enter(self.number(material));
            }
        });
        media
    }

    #[inline(always)]
    fn number(&self, id: Option<MaterialId>) -> u32 {
        id.map_or(self.rows.len() as u32 - 1, |id| id.index() as u32)
    }
}

impl Look {
    fn new(material: Material) -> Look {
        let layers = &material.layers;
        let absorb = |c: f32| -c.max(1e-6).ln() / layers.attenuation_distance;
        Look {
            bsdf: Bsdf::new(&material),
            absorption: layers.attenuation_color.map(absorb),
            material,
            varied: None,
            alpha: 1.0,
            bends_coat: false,
            follows_tangents: false,
        }
    }

    /// Returns the radiance of the surface itself, if it shines.
    fn shine(&self) -> Option<Rgb> {
        let unlit = self.material.layers.unlit;
        let shown = |k: usize| {
            self.material.emission[k]
                + if unlit {
                    self.material.base_color[k]
                } else {
                    0.0
                }
        };
        let opacity = self.material.layers.opacity;
        let radiance = [shown(0), shown(1), shown(2)].map(|c| c * opacity);
        (radiance != [0.0; 3]).then_some(radiance)
    }

    /// Says whether the material bounds a medium of its own.
    fn has_medium(&self) -> bool {
        self.material.transmission > 0.0 && !self.material.layers.thin_walled
    }

    fn has_dispersion(&self) -> bool {
        self.has_medium() && self.material.layers.dispersion > 0.0
    }

    fn lets_shadow_rays_pass(&self) -> bool {
        let layers = &self.material.layers;
        let is_pane = self.material.transmission > 0.0 && layers.thin_walled;
        let cutout = self.varied.as_ref().is_some_and(Varied::has_alpha);
        cutout || layers.opacity < 1.0 || is_pane && self.bsdf.only_delta
    }
}

/// What camera rays see where they meet nothing but holes and panes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Seen {
    /// The environment or background that lights the scene.
    Sky,
    Color(Rgb),
    /// Nothing, whose share the slots' last number lacks.
    Nothing,
}

/// Buffers of a path tracer: columns in the worker's arena, allocated once per tile and reused
/// by every wave, and the worker's scratch for queries.
pub struct PathScratch<'b> {
    waves: [Paths<'b>; 2],
    hits: HitColumns<'b>,
    buffer: HitBuffer<'b>,
    /// Rows of the hit buffer, sorted by material.
    order: ArenaVec<'b, u32>,
    /// First place in `order` of each material's hits.
    starts: ArenaVec<'b, u32>,
    lights: LightRays<'b>,
    cached: CacheColumns<'b>,
    passing: Passing<'b>,
    layers: Option<LayerSlots<'b>>,
    /// What the tile's pixels meet first.
    first_met: Option<&'b mut [FirstMet]>,
    /// The path that is traced alone, for `verify`.
    record: Option<Vec<PathVertex>>,
    trace: &'b mut TraceScratch,
}

impl<'b> PathScratch<'b> {
    /// `smooth` says whether the scene has meshes with vertex normals, `has_holes` whether paths
    /// may pass surfaces, `is_cached` whether there is an irradiance cache, `has_textures` whether
    /// materials vary from hit to hit.
    pub fn new(
        arena: &'b Bump,
        trace: &'b mut TraceScratch,
        (smooth, has_holes, is_cached, has_textures): (bool, bool, bool, bool),
    ) -> PathScratch<'b> {
        let mut buffer = HitBuffer::with_capacity(BATCH, arena);
        buffer.wants_lift = smooth;
        buffer.wants_places = has_textures;
        PathScratch {
            waves: std::array::from_fn(|_| Paths::new(arena, (has_holes, is_cached, has_textures))),
            hits: HitColumns::new(arena),
            buffer,
            order: ArenaVec::with_capacity_in(BATCH, arena),
            starts: ArenaVec::new_in(arena),
            lights: LightRays::new(arena),
            cached: CacheColumns::new(arena),
            passing: Passing::new(arena),
            layers: None,
            first_met: None,
            record: None,
            trace,
        }
    }

    /// Keeps layers of light of a tile's pixels from now on.
    pub fn keep_layers(&mut self, pixels: usize, plan: &LayerPlan, arena: &'b Bump) {
        let (layers, has_guides) = (plan.count(), plan.guides().is_some());
        let trails = || ArenaVec::with_capacity_in(BATCH, arena);
        self.waves
            .iter_mut()
            .for_each(|wave| wave.trails = Some(trails()));
        self.lights.keys = Some(ArenaVec::with_capacity_in(BATCH, arena));
        if has_guides {
            let guiding = || ArenaVec::with_capacity_in(BATCH, arena);
            self.waves
                .iter_mut()
                .for_each(|wave| wave.guiding = Some(guiding()));
        }
        self.layers = Some(LayerSlots::new(pixels, layers, arena));
    }

    /// Keeps what a tile's pixels meet first from now on.
    pub fn keep_first_met(&mut self, pixels: usize, arena: &'b Bump) {
        let open = || ArenaVec::with_capacity_in(BATCH, arena);
        self.waves
            .iter_mut()
            .for_each(|wave| wave.open = Some(open()));
        self.first_met = Some(arena.alloc_slice_fill_copy(pixels, FirstMet::NOTHING));
    }

    /// Empties what is kept beside the slots, before a sample.
    pub fn clear_outputs(&mut self) {
        if let Some(layers) = &mut self.layers {
            layers.clear();
        }
        if let Some(met) = &mut self.first_met {
            met.fill(FirstMet::NOTHING);
        }
    }

    /// Returns the layers of the last sample, if they are kept.
    pub fn layers(&self) -> Option<&LayerSlots<'b>> {
        self.layers.as_ref()
    }

    /// Returns what each pixel's last sample met first, if it is kept.
    pub fn first_met(&self) -> Option<&[FirstMet]> {
        self.first_met.as_deref()
    }

    /// Returns the emptied queue to fill with at most [`BATCH`] camera rays, one a pixel, and
    /// the column for the keys of their pixels.
    pub fn camera_rays(&mut self) -> (&mut RayQueue<'b>, &mut ArenaVec<'b, u32>) {
        let first = &mut self.waves[0];
        first.clear();
        (&mut first.rays, &mut first.key)
    }

    /// Lists the film's rows of the camera rays that are queued.
    pub fn queued(&self) -> &[u32] {
        &self.waves[0].rays.pixel
    }

    /// Takes the points that the last paths found without a record of the cache.
    pub fn take_missed(&mut self) -> Vec<Missed> {
        let missed = self.cached.missed.to_vec();
        self.cached.missed.clear();
        missed
    }

    /// Asks how far the camera rays of the next batches reach.
    pub fn ask_reach(&mut self) {
        let arena = self.cached.missed.bump();
        self.cached.reach = Some(ArenaVec::with_capacity_in(BATCH, arena));
    }

    /// Lists the t of the last batch's first hits; infinite where a ray met nothing.
    pub fn reach(&self) -> &[f64] {
        self.cached.reach.as_deref().unwrap_or_default()
    }

    /// Begins a record of the next path, which is traced alone.
    pub fn start_record(&mut self) {
        self.record = Some(Vec::new());
    }

    /// Ends a record.
    pub fn take_record(&mut self) -> Vec<PathVertex> {
        self.record.take().unwrap_or_default()
    }
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
        fill_hit_buffer(
            (self.world, self.kernels.precision),
            (&wave.rays, 0..count),
            (t, instance, primitive),
            buffer,
        );
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
        self.sort_by_material(buffer, &mut scratch.order, &mut scratch.starts);
        scratch.lights.clear();
        scratch.cached.clear_found();
        let mut first = 0;
        while first < scratch.order.len() {
            let material = buffer.material[scratch.order[first] as usize];
            let rest = scratch.order[first..].iter().take(STEP);
            let same = rest.take_while(|hit| buffer.material[**hit as usize] == material);
            let same = same.count();
            let hits: [u32; STEP] = std::array::from_fn(|i| scratch.order[first + i.min(same - 1)]);
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

    /// Sorts the hits of a batch by material, and those of a material by row.
    fn sort_by_material(
        &self,
        buffer: &HitBuffer,
        order: &mut ArenaVec<u32>,
        starts: &mut ArenaVec<u32>,
    ) {
        let hits = buffer.len() as u32;
        order.clear();
        let number = |hit: u32| self.materials.number(buffer.material[hit as usize]);
        if (1..hits).all(|hit| buffer.material[hit as usize] == buffer.material[0]) {
            order.extend(0..hits);
            return;
        }
        if self.materials.rows.len() > BATCH {
            order.extend(0..hits);
            order.sort_unstable_by_key(|hit| (number(*hit), *hit));
            return;
        }
        starts.clear();
        starts.resize(self.materials.rows.len() + 1, 0);
        for hit in 0..hits {
            starts[number(hit) as usize + 1] += 1;
        }
        for row in 1..starts.len() {
            starts[row] += starts[row - 1];
        }
        order.resize(hits as usize, 0);
        for hit in 0..hits {
            let start = &mut starts[number(hit) as usize];
            order[*start as usize] = hit;
            *start += 1;
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
