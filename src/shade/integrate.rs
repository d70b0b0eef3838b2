//! //! Whitted's integrator (1980), one batch of queued rays at a time. The rays of a
//! batch are traced together, lit by one batch of shadow rays per light, and queue
//! reflected and refracted rays one depth further, up to a maximum depth.
//!
//! //! Batches are processed depth first, so the number of queued rays is bounded by
//! depth times batch size, however the rays branch. The order of additions to a pixel
//! depends on the pixel's own rays alone, so neither the division into tiles nor the
//! packet width changes the picture.

use super::columns::{STEP, gather};
use super::ledger::{Ledger, note, note_counts};
use super::lit::LitHits;
use super::material::{Looks, leaves_rays, onward};
use super::site::Site;
use super::surface::Surface;
use super::wave::{PIECE, Wave, Waves};
use crate::accel::World;
use crate::plan::Kernels;
use crate::scene::{Light, Material, MaterialId, Rgb};
use crate::trace::{
    Depths, HitId, Hits, Ids, ItemBuffer, Outcome, RayKind, ShadowCache, TILE, closest,
    closest_listed,
};
use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;
use glam::DVec3;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

mod shadows;

use shadows::Shadows;

/// Optional callback for each hit of a camera ray: film row, surface and id.
pub type PrimaryHit<'a> = Option<&'a mut dyn FnMut(u32, &Surface, HitId)>;

/// Buffers of an integration in the thread's arena, allocated once per tile and reused
/// by every batch and sample.
pub struct Columns<'b> {
    waves: Waves<'b>,
    t: ArenaVec<'b, f64>,
    instance: ArenaVec<'b, u64>,
    primitive: ArenaVec<'b, u32>,
    lit: LitHits<'b>,
    shadows: Shadows<'b>,
}

impl<'b> Columns<'b> {
    pub fn new(arena: &'b Bump) -> Columns<'b> {
        Columns {
            waves: Waves::new(arena),
            t: ArenaVec::with_capacity_in(PIECE, arena),
            instance: ArenaVec::with_capacity_in(PIECE, arena),
            primitive: ArenaVec::with_capacity_in(PIECE, arena),
            lit: LitHits::with_capacity(PIECE, arena),
            shadows: Shadows::new(arena),
        }
    }

    /// Returns the queue to fill with camera rays: pixel by pixel, in any order of the
    /// pixels.
    pub fn camera_rays(&mut self) -> &mut Wave<'b> {
        self.waves.at(0)
    }
}

pub struct Integrator<'w> {
    pub world: &'w World,
    pub kernels: Kernels,
    pub lights: &'w [Light],
    /// The frame's item buffer for camera rays, and the index of its first list.
    pub items: Option<(&'w ItemBuffer, usize)>,
    pub background: Rgb,
    pub max_depth: u32,
    /// Material of surfaces without one.
    pub unnamed: Material,
    pub looks: Looks,
    /// Cancellation flag, read before every batch; once set, the remaining rays are
    /// dropped.
    pub cancel: &'w AtomicBool,
}

impl Integrator<'_> {
    /// Adds the radiance of the camera rays in `columns`, and of all rays they spawn,
    /// to `film`, one row per pixel. The queues are empty afterwards. `caches` has one
    /// row per light and is kept for the tile.
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

    /// Traces and shades the last batch of a depth's queue, and replaces it by the rays
    /// it spawns, one depth further.
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
        // An item list finds the closest hit without temporal bounds.
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
                if emission != [0.0; 3] {
                    add(film, wave, lit.row[hit] as usize, emission);
                }
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
            self.light((wave, depth), lit, shadows, cache, film, ledger);
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

    /// Evaluates the surfaces of a batch's hits, up to [`STEP`] hits of one site at a
    /// time.
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
                let site = Site::of(self.world, self.kernels.precision, id);
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
}

/// Number of sites whose hits are collected at the same time.
const OPEN: usize = 4;

/// Hits of one site, collected until they fill a step.
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

    /// Evaluates the collected hits. `t` and `primitive` hold the rays from `first` on.
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

/// Records each ray and passes camera rays' hits to the callback.
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
fn add(film: &mut [Rgb], wave: &Wave, i: usize, radiance: Rgb) {
    let (pixel, weight) = (&mut film[wave.pixel[i] as usize], wave.weight.row(i));
    for k in 0..3 {
        pixel[k] += weight[k] * radiance[k];
    }
}

/// Rays with less weight in their pixel are not traced (adaptive depth control, Hall
/// and Greenberg 1983): glass inside glass would double the rays at each hit.
const LEAST_WEIGHT: f32 = 1.0 / 4096.0;

fn spawn(wave: &Wave, (lit, hit): (&LitHits, usize), material: &Material, next: &mut Wave) {
    let (i, surface) = (lit.row[hit] as usize, &lit.surface(hit));
    let out = onward(material, surface.ns, lit.incoming.get(hit), surface.front);
    let facing = surface.facing();
    let mut push = |dir: DVec3, weight: Rgb, kind| {
        // An interpolated shading normal may send a ray to the wrong side: such a ray
        // is moved to just off the geometric tangent plane.
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
