//! Whitted's integrator (1980), a piece of a wave at a time: its rays are traced
//! as one batch, lit by one batch of shadow rays per light, and leave behind
//! mirrored and refracted rays one depth further, to a bounded depth.
//!
//! Pieces go depth first, so that what waits is bounded by depth times piece,
//! however the rays branch. The order of additions to a pixel is that of its own
//! rays, so no tile split or packet width shows.

use super::columns::{Column3, Doubles, STEP, Singles, gather, keep, pad};
use super::light::{Arrival, end_of, shadow_dirs};
use super::lit::LitHits;
use super::material::{Looks, leaves_rays, onward, reflected};
use super::site::Site;
use super::surface::Surface;
use super::wave::{PIECE, Wave, Waves};
use crate::accel::World;
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask};
use crate::plan::Kernels;
use crate::scene::{Light, Material, MaterialId, Rgb};
use crate::trace::{
    CacheCounts, Depths, GuessCounts, Guesses, HitId, Hits, Ids, ItemBuffer, Outcome, RayKind,
    Rays, Reuse, ShadowCache, TILE, TracedRay, any, closest, closest_listed,
};
use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;
use glam::DVec3;
use serde::Serialize;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// Rays traced, by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RayCounts {
    pub primary: u64,
    pub primary_hits: u64,
    pub shadow: u64,
    pub shadow_occluded: u64,
    /// Of the last occluders of each light and tile, which are tried first.
    pub shadow_cache: CacheCounts,
    pub reflection: u64,
    pub refraction: u64,
}

impl RayCounts {
    pub fn total(&self) -> u64 {
        self.primary + self.shadow + self.reflection + self.refraction
    }

    pub fn add(&mut self, other: &RayCounts) {
        self.primary += other.primary;
        self.primary_hits += other.primary_hits;
        self.shadow += other.shadow;
        self.shadow_occluded += other.shadow_occluded;
        self.shadow_cache += other.shadow_cache;
        self.reflection += other.reflection;
        self.refraction += other.refraction;
    }
}

/// What the integrator notes beside radiance: counts always, rays if wanted.
pub struct Ledger<'a> {
    pub counts: RayCounts,
    /// Every ray with its answer, for `verify`.
    pub record: Option<&'a mut Vec<TracedRay>>,
    /// For the record: sample number, and the picture's pixel of a film row.
    pub sample: u32,
    pub pixel_of: &'a dyn Fn(u32) -> u32,
    /// Camera rays' hits of the frame before, for those of this one.
    pub memory: Option<&'a mut Memory>,
}

/// What a film's camera rays met, for those of the next frame: in the order in
/// which they are traced, padding included. Empty at first.
#[derive(Debug, Default)]
pub struct Memory {
    guesses: Guesses,
    /// Rays of this frame so far.
    row: usize,
    pub counts: GuessCounts,
}

impl Memory {
    pub fn new(reuse: Reuse) -> Memory {
        Memory {
            guesses: Guesses::new(reuse),
            ..Memory::default()
        }
    }

    /// The next frame begins.
    pub fn restart(&mut self) {
        self.row = 0;
        self.counts = GuessCounts::default();
    }

    /// Traces the next piece of the camera rays, and remembers what they meet.
    fn closest(&mut self, world: &World, kernels: &Kernels, rays: &Rays, hits: &mut Hits) {
        let first = self.row;
        self.row += rays.len();
        let counts = self.guesses.closest(world, kernels, rays, first, hits);
        self.counts.add(&counts);
    }
}

/// Told of each hit of a camera ray, where somebody asks: the film row, the surface
/// and the id.
pub type PrimaryHit<'a> = Option<&'a mut dyn FnMut(u32, &Surface, HitId)>;

/// The columns of an integration, in the thread's arena: made once a tile and
/// used again by every piece and sample.
pub struct Columns<'b> {
    waves: Waves<'b>,
    t: ArenaVec<'b, f64>,
    instance: ArenaVec<'b, u64>,
    primitive: ArenaVec<'b, u32>,
    lit: LitHits<'b>,
    shadows: Shadows<'b>,
    blocked: ArenaVec<'b, bool>,
}

impl<'b> Columns<'b> {
    pub fn new(arena: &'b Bump) -> Columns<'b> {
        Columns {
            waves: Waves::new(arena),
            t: ArenaVec::with_capacity_in(PIECE, arena),
            instance: ArenaVec::with_capacity_in(PIECE, arena),
            primitive: ArenaVec::with_capacity_in(PIECE, arena),
            lit: LitHits::with_capacity(PIECE, arena),
            shadows: Shadows {
                rays: Wave::with_capacity(PIECE, arena),
                of: ArenaVec::with_capacity_in(PIECE + STEP, arena),
                towards: Column3::with_capacity(PIECE, arena),
            },
            blocked: ArenaVec::with_capacity_in(PIECE, arena),
        }
    }

    /// Where camera rays go: pixel by pixel, in any order of the pixels.
    pub fn camera_rays(&mut self) -> &mut Wave<'b> {
        self.waves.at(0)
    }
}

pub struct Integrator<'w> {
    pub world: &'w World<'w>,
    pub kernels: Kernels,
    pub lights: &'w [Light],
    /// Lists of the frame for the camera rays, and the first of them.
    pub items: Option<(&'w ItemBuffer, usize)>,
    pub background: Rgb,
    pub max_depth: u32,
    /// Of surfaces that have none.
    pub unnamed: Material,
    pub looks: Looks,
    /// Read before every piece: once set, the rest is left out.
    pub cancel: &'w AtomicBool,
}

impl Integrator<'_> {
    /// Adds the radiance of the camera rays in `columns` to `film`, a row per
    /// pixel, with everything that they spawn, and leaves no ray behind.
    /// `caches` has a row per light, kept for the tile.
    pub fn run(
        &self,
        columns: &mut Columns,
        film: &mut [Rgb],
        caches: &mut [ShadowCache],
        ledger: &mut Ledger,
        mut primary: PrimaryHit,
    ) {
        let mut depth = 0;
        loop {
            if self.cancel.load(Relaxed) {
                columns.waves.clear();
                return;
            }
            if columns.waves.at(depth).is_empty() {
                if depth == 0 {
                    return;
                }
                depth -= 1;
                continue;
            }
            self.piece(depth, columns, film, caches, ledger, &mut primary);
            depth += u32::from(depth < self.max_depth);
        }
    }

    /// Traces and lights the last piece of a depth's rays, and puts what they
    /// spawn in their place, one depth further.
    fn piece(
        &self,
        depth: u32,
        columns: &mut Columns,
        film: &mut [Rgb],
        caches: &mut [ShadowCache],
        ledger: &mut Ledger,
        primary: &mut PrimaryHit,
    ) {
        let Columns {
            waves,
            t,
            instance,
            primitive,
            lit,
            shadows,
            blocked,
        } = columns;
        let wave = waves.at(depth);
        let rays = wave.last_piece();
        let (first, count) = (rays.start, rays.len());
        let batch = wave.batch(first);
        t.resize(batch.len(), 0.0);
        instance.resize(batch.len(), HitId::NONE.instance);
        primitive.resize(batch.len(), HitId::NONE.primitive);
        let hits = &mut Hits {
            t: Depths::Double(t),
            id: Ids {
                instance,
                primitive,
            },
        };
        // A list finds what is nearest without a bound.
        match (self.items, &mut ledger.memory) {
            (Some((items, tile)), _) if depth == 0 => {
                let items = (items, tile + first / TILE);
                closest_listed(self.world, &self.kernels, &batch, items, hits);
            }
            (None, Some(memory)) if depth == 0 => {
                memory.closest(self.world, &self.kernels, &batch, hits);
            }
            _ => closest(self.world, &self.kernels, &batch, hits),
        }
        note_counts(&wave.kind[rays.clone()], &instance[..count], depth, ledger);

        self.light_up(wave, rays.clone(), (t, instance, primitive), lit);
        for (row, i) in rays.clone().enumerate() {
            if instance[row] == HitId::NONE.instance {
                add(film, wave, i, self.background);
            }
        }
        if self.looks.glow {
            for hit in 0..lit.len() {
                let emission = self.material(lit.material[hit]).emission;
                add(film, wave, lit.row[hit] as usize, emission);
            }
        }
        if ledger.record.is_some() || depth == 0 && primary.is_some() {
            tell(
                wave,
                (rays, depth),
                (t, instance, primitive),
                lit,
                ledger,
                primary,
            );
        }
        for (number, light) in self.lights.iter().enumerate() {
            shadows.towards(light, number as u32, wave, lit);
            let cache = &mut caches[number];
            self.light(wave, lit, shadows, blocked, depth, cache, film, ledger);
        }
        if depth < self.max_depth && self.looks.leave_rays {
            let (wave, onwards) = waves.pair(depth);
            for i in 0..lit.len() {
                let material = self.material(lit.material[i]);
                if leaves_rays(material) {
                    spawn(wave, (lit, i), material, onwards);
                }
            }
        }
        waves.at(depth).truncate(first);
    }

    /// The surfaces of a piece's hits, of each site some at a time.
    fn light_up(
        &self,
        wave: &Wave,
        rays: Range<usize>,
        (t, instance, primitive): (&[f64], &[u64], &[u32]),
        lit: &mut LitHits,
    ) {
        let met = |row: &usize| instance[*row] != HitId::NONE.instance;
        lit.start((0..rays.len()).filter(met).count());
        let mut open: [Option<Batch>; OPEN] = [const { None }; OPEN];
        let mut oldest = 0;
        for (hit, row) in (0..rays.len()).filter(met).enumerate() {
            let id = HitId {
                instance: instance[row],
                primitive: primitive[row],
            };
            let has = |batch: &Option<Batch>| batch.as_ref().is_some_and(|b| b.site.has(id));
            let at = open.iter().position(has).unwrap_or_else(|| {
                let site = Site::of(self.world, self.kernels.arithmetic, id);
                if let Some(batch) = open[oldest].replace(Batch::of(site)) {
                    batch.close(wave, rays.start, (t, primitive), lit);
                }
                oldest = (oldest + 1) % OPEN;
                (oldest + OPEN - 1) % OPEN
            });
            let Some(batch) = &mut open[at] else {
                continue;
            };
            lit.row[hit] = (rays.start + row) as u32;
            lit.material[hit] = batch.site.material(id.primitive);
            batch.hits[batch.len] = hit as u32;
            batch.len += 1;
            if batch.len == STEP {
                batch.close(wave, rays.start, (t, primitive), lit);
                batch.len = 0;
            }
        }
        for batch in open.iter().flatten() {
            batch.close(wave, rays.start, (t, primitive), lit);
        }
        lit.close();
    }

    #[inline(always)]
    fn material(&self, id: Option<MaterialId>) -> &Material {
        match id {
            Some(id) => &self.world.scene.materials.rows[id.index()],
            None => &self.unnamed,
        }
    }

    /// Traces the shadow rays and adds what arrives.
    #[expect(clippy::too_many_arguments)]
    fn light(
        &self,
        wave: &Wave,
        lit: &LitHits,
        shadows: &mut Shadows,
        blocked: &mut ArenaVec<bool>,
        depth: u32,
        cache: &mut ShadowCache,
        film: &mut [Rgb],
        ledger: &mut Ledger,
    ) {
        let Shadows { rays, of, towards } = shadows;
        let batch = rays.batch(0);
        blocked.resize(batch.len(), false);
        any(self.world, &self.kernels, &batch, cache, blocked);
        let blocked = &blocked[..rays.len()];
        ledger.counts.shadow += blocked.len() as u64;
        ledger.counts.shadow_occluded += blocked.iter().filter(|b| **b).count() as u64;
        if ledger.record.is_some() {
            for (s, blocked) in blocked.iter().enumerate() {
                let outcome = match blocked {
                    true => Outcome::Blocked,
                    false => Outcome::Clear,
                };
                note(rays, s, depth, outcome, ledger);
            }
        }
        for (first, blocked) in (0..).step_by(STEP).zip(blocked.chunks(STEP)) {
            let bit = |(i, blocked): (usize, &bool)| u32::from(!blocked) << i;
            let mut clear: u32 = blocked.iter().enumerate().map(bit).sum();
            if clear == 0 {
                continue;
            }
            let hits: [u32; STEP] = std::array::from_fn(|i| of[first + i]);
            let (ns, out) = (lit.ns.gather(&hits), -lit.incoming.gather(&hits));
            let (light, towards) = (rays.weight.step(first), towards.step(first));
            let light = [light.x, light.y, light.z];
            // Material by material; added in the rays' order.
            let (mut rest, mut sums) = (clear, [Singles::zero(); 3]);
            while rest != 0 {
                let id = lit.material[hits[rest.trailing_zeros() as usize] as usize];
                let same = |i: usize| u32::from(lit.material[hits[i] as usize] == id) << i;
                let same: u32 = (0..STEP).map(same).sum();
                let radiance = reflected(self.material(id), ns, out, towards, light);
                let mask = <Singles as Lanes>::Mask::from_bits(same);
                for (sum, radiance) in sums.iter_mut().zip(radiance) {
                    *sum = Lanes::select(mask, radiance, *sum);
                }
                rest &= !same;
            }
            let rows = hits.map(|hit| lit.row[hit as usize]);
            let weight = wave.weight.gather(&rows);
            let [r, g, b] = sums;
            let [r, g, b] = [weight.x * r, weight.y * g, weight.z * b].map(|c| c.to_array());
            while clear != 0 {
                let i = clear.trailing_zeros() as usize;
                clear &= clear - 1;
                let pixel = &mut film[wave.pixel[rows[i] as usize] as usize];
                for (channel, radiance) in pixel.iter_mut().zip([r[i], g[i], b[i]]) {
                    *channel += radiance;
                }
            }
        }
    }
}

/// Sites of which hits are waited for at a time.
const OPEN: usize = 4;

/// Hits of a site that wait until they are a step.
struct Batch<'w> {
    site: Site<'w>,
    hits: [u32; STEP],
    len: usize,
}

impl<'w> Batch<'w> {
    fn of(site: Site<'w>) -> Batch<'w> {
        Batch {
            site,
            hits: [0; STEP],
            len: 0,
        }
    }

    /// `t` and primitives are of the rays from `first` on.
    fn close(
        &self,
        wave: &Wave,
        first: usize,
        (t, primitive): (&[f64], &[u32]),
        lit: &mut LitHits,
    ) {
        let Some(last) = self.len.checked_sub(1) else {
            return;
        };
        let hits: [u32; STEP] = std::array::from_fn(|i| self.hits[i.min(last)]);
        let rays = hits.map(|hit| lit.row[hit as usize]);
        let (org, dir) = wave.step(&rays);
        let rows = rays.map(|ray| ray - first as u32);
        let primitives = rows.map(|row| primitive[row as usize]);
        let t = gather(t, &rows);
        let surfaces = self.site.surfaces((org, dir), t, &primitives);
        lit.set(&hits, &surfaces, dir);
    }
}

/// Those who ask for each ray, or for what camera rays meet.
fn tell(
    wave: &Wave,
    (rays, depth): (Range<usize>, u32),
    (t, instance, primitive): (&[f64], &[u64], &[u32]),
    lit: &LitHits,
    ledger: &mut Ledger,
    primary: &mut PrimaryHit,
) {
    let mut hit = 0;
    for (row, i) in rays.enumerate() {
        let id = HitId {
            instance: instance[row],
            primitive: primitive[row],
        };
        if id.instance == HitId::NONE.instance {
            note(wave, i, depth, Outcome::Miss, ledger);
            continue;
        }
        let outcome = Outcome::Hit {
            t: t[row],
            instance: id.instance,
            primitive: id.primitive,
            normal: lit.ng.row(hit),
        };
        note(wave, i, depth, outcome, ledger);
        if let (0, Some(primary)) = (depth, &mut *primary) {
            primary(wave.pixel[i], &lit.surface(hit), id);
        }
        hit += 1;
    }
}

#[inline(always)]
fn note(wave: &Wave, i: usize, depth: u32, outcome: Outcome, ledger: &mut Ledger) {
    let Some(record) = &mut ledger.record else {
        return;
    };
    record.push(TracedRay {
        kind: wave.kind[i],
        pixel: (ledger.pixel_of)(wave.pixel[i]),
        sample: ledger.sample,
        depth,
        org: wave.org(i),
        dir: wave.dir(i),
        t_max: wave.t_max[i],
        outcome,
    });
}

struct Shadows<'b> {
    /// Their weight is the light's irradiance.
    rays: Wave<'b>,
    /// Row of the lit hits, and the direction to the light: whole steps.
    of: ArenaVec<'b, u32>,
    towards: Column3<'b, Doubles>,
}

impl Shadows<'_> {
    /// Shadow rays of all hits that the light could reach.
    fn towards(&mut self, light: &Light, number: u32, wave: &Wave, lit: &LitHits) {
        self.rays.truncate(0);
        self.of.clear();
        self.towards.truncate(0);
        let (zero, one) = (Doubles::zero(), Doubles::splat(1.0));
        let (kind, end) = (RayKind::Shadow { light: number }, end_of(light));
        for first in (0..lit.len()).step_by(STEP) {
            let rows = (1 << STEP.min(lit.len() - first)) - 1;
            let (point, ng) = (lit.point.step(first), lit.ng.step(first));
            let arrival = Arrival::at(light, point);
            // On the lit side of both the true and the shading surface.
            let towards = arrival.towards;
            let facing = ng * Doubles::load(&lit.side[first..]);
            let behind = towards.dot(lit.ns.step(first)).le(zero) | towards.dot(facing).le(zero);
            let rows = (arrival.some & !behind).bits() & rows;
            if rows == 0 {
                continue;
            }
            let side: Doubles = Lanes::select(towards.dot(ng).ge(zero), one, -one);
            let org = point + ng * (side * Doubles::load(&lit.offset[first..]));
            let (dir, some) = shadow_dirs(light, org, towards);
            let rows = some.bits() & rows;
            let numbers: [u32; STEP] = std::array::from_fn(|i| (first + i) as u32);
            let pixel = |i: usize| wave.pixel[lit.row[first + i] as usize];
            let pixels = std::array::from_fn(pixel);
            let [r, g, b] = arrival.irradiance;
            self.rays.push_some(rows, (org, dir), &pixels);
            self.rays.weight.push_some(Vec3::new(r, g, b), rows);
            keep(&mut self.of, &numbers, rows);
            self.towards.push_some(towards, rows);
        }
        self.rays.complete(end, kind);
        self.rays.weight.pad();
        pad(&mut self.of);
        self.towards.pad();
    }
}

fn note_counts(kinds: &[RayKind], instance: &[u64], depth: u32, ledger: &mut Ledger) {
    let rays = kinds.len() as u64;
    if depth == 0 {
        ledger.counts.primary += rays;
        let hits = instance.iter().filter(|x| **x != HitId::NONE.instance);
        ledger.counts.primary_hits += hits.count() as u64;
        return;
    }
    let mirrored = kinds.iter().filter(|k| **k == RayKind::Reflection);
    let mirrored = mirrored.count() as u64;
    ledger.counts.reflection += mirrored;
    ledger.counts.refraction += rays - mirrored;
}

#[inline(always)]
fn add(film: &mut [Rgb], wave: &Wave, i: usize, radiance: Rgb) {
    let (pixel, weight) = (&mut film[wave.pixel[i] as usize], wave.weight.row(i));
    for k in 0..3 {
        pixel[k] += weight[k] * radiance[k];
    }
}

/// Rays that count for less in their pixel are not traced (Hall and Greenberg
/// 1983, adaptive depth control): glass in glass would double them at each hit.
const LEAST_WEIGHT: f32 = 1.0 / 4096.0;

fn spawn(wave: &Wave, (lit, hit): (&LitHits, usize), material: &Material, next: &mut Wave) {
    let (i, surface) = (lit.row[hit] as usize, &lit.surface(hit));
    let out = onward(material, surface.ns, lit.incoming.get(hit), surface.front);
    let facing = surface.facing();
    let mut push = |dir: DVec3, weight: Rgb, kind| {
        // A bent shading normal may send a ray to the wrong side: bring it back
        // to the surface's own plane.
        let side = match kind {
            RayKind::Reflection => facing,
            _ => -facing,
        };
        let across = dir.dot(side);
        let dir = if across < 0.0 {
            dir - side * (1.001 * across)
        } else {
            dir
        };
        let before = wave.weight.row(i);
        let weight = std::array::from_fn(|k| before[k] * weight[k]);
        if weight.iter().any(|w| *w >= LEAST_WEIGHT) {
            let dir32 = dir.to_array().map(|x| x as f32);
            let org = surface.leave(side);
            next.push(org, dir32, f32::INFINITY, wave.pixel[i], weight, kind);
        }
    };
    if let Some((dir, weight)) = out.mirror {
        push(dir, weight, RayKind::Reflection);
    }
    if let Some((dir, weight)) = out.refract {
        push(dir, weight, RayKind::Refraction);
    }
}

#[cfg(test)]
mod tests;
