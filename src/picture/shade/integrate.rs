//! Whitted's integrator (1980), one batch of queued rays at a time. The rays of a batch
//! are traced together, lit by one batch of shadow rays per light, and queue reflected
//! and refracted rays one depth further, up to a maximum depth.
//!
//! Batches are processed depth first, so the number of queued rays is bounded by depth
//! times batch size, however the rays branch. The order of additions to a pixel depends
//! on the pixel's own rays alone, so neither the division into tiles nor the packet
//! width changes the picture.

use super::bsdf::{MaterialFlags, sample_bsdf, spawns_rays};
use super::cutouts::{HitSlices, Passing, has_cutouts, pass_cutouts};
use super::hit_buffer::HitBuffer;
use super::hits::fill_hit_buffer;
use super::ray_queue::{BATCH, RayQueue, RayQueues};
use super::statistics::{Statistics, count_rays, record_ray};
use super::surface::Surface;
use super::textures::{Footprint, material_at};
use crate::accel::World;
use crate::plan::{Kernels, Precision};
use crate::scene::{Light, Material, MaterialId, Rgb};
use crate::trace::{
    BEAM, Depths, HitId, Hits, Ids, ItemBuffer, Outcome, RayKind, ShadowCache, TraceScratch,
    closest, closest_listed, refine,
};
use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;
use glam::DVec3;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

mod shadows;

use shadows::ShadowRays;

/// Optional callback for each hit of a camera ray: film row, surface and id.
pub type PrimaryHit<'a> = Option<&'a mut dyn FnMut(u32, &Surface, HitId)>;

/// Buffers of an integration: columns in the worker's arena, allocated once per tile and
/// reused by every batch and sample, and the worker's scratch for queries.
pub struct Scratch<'b> {
    queues: RayQueues<'b>,
    t: ArenaVec<'b, f64>,
    instance: ArenaVec<'b, u64>,
    primitive: ArenaVec<'b, u32>,
    buffer: HitBuffer<'b>,
    shadows: ShadowRays<'b>,
    passing: Passing<'b>,
    trace: &'b mut TraceScratch,
}

impl<'b> Scratch<'b> {
    pub fn new(arena: &'b Bump, trace: &'b mut TraceScratch) -> Scratch<'b> {
        Scratch {
            trace,
            queues: RayQueues::new(arena),
            t: ArenaVec::with_capacity_in(BATCH, arena),
            instance: ArenaVec::with_capacity_in(BATCH, arena),
            primitive: ArenaVec::with_capacity_in(BATCH, arena),
            buffer: HitBuffer::with_capacity(BATCH, arena),
            shadows: ShadowRays::new(arena),
            passing: Passing::new(arena),
        }
    }

    /// Returns the queue to fill with camera rays: pixel by pixel, in any order of the
    /// pixels.
    pub fn camera_rays(&mut self) -> &mut RayQueue<'b> {
        self.queues.at(0)
    }
}

pub struct Integrator<'w> {
    pub world: &'w World,
    pub kernels: Kernels,
    pub lights: &'w [Light],
    /// The frame's item buffer for camera rays, and the index of its first list.
    pub items: Option<(&'w ItemBuffer, usize)>,
    pub background: Rgb,
    /// What camera rays see where they meet nothing.
    pub backdrop: Rgb,
    pub max_depth: u32,
    /// Material of surfaces without one.
    pub unnamed: Material,
    pub material_flags: MaterialFlags,
    /// Cancellation flag, read before every batch; once set, the remaining rays are
    /// dropped.
    pub cancel: &'w AtomicBool,
}

impl Integrator<'_> {
    /// Adds the radiance of the camera rays in `scratch`, and of all rays they spawn,
    /// to `film`, one row per pixel. The queues are empty afterwards. `caches` has one
    /// row per light and is kept for the tile.
    pub fn run(
        &self,
        scratch: &mut Scratch,
        film: &mut [Rgb],
        caches: &mut [ShadowCache],
        statistics: &mut Statistics,
        mut primary: PrimaryHit,
    ) {
        scratch.buffer.want_look_ups(&self.world.scene.textures);
        let mut depth = 0;
        loop {
            if self.cancel.load(Relaxed) {
                scratch.queues.clear();
                return;
            }
            if scratch.queues.at(depth).is_empty() {
                if depth == 0 {
                    return;
                }
                depth -= 1;
                continue;
            }
            self.trace_batch(depth, scratch, film, caches, statistics, &mut primary);
            depth += u32::from(depth < self.max_depth);
        }
    }

    /// Traces and shades the last batch of a depth's queue, and replaces it by the rays
    /// it spawns, one depth further.
    fn trace_batch(
        &self,
        depth: u32,
        scratch: &mut Scratch,
        film: &mut [Rgb],
        caches: &mut [ShadowCache],
        statistics: &mut Statistics,
        primary: &mut PrimaryHit,
    ) {
        let Scratch {
            queues,
            t,
            instance,
            primitive,
            buffer,
            shadows,
            passing,
            trace,
        } = scratch;
        let queue = queues.at(depth);
        let rays = queue.last_batch();
        let (first, count) = (rays.start, rays.len());
        let batch = queue.padded_rays(first);
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
        let lanes = &self.lanes();
        // An item list finds the closest hit without temporal bounds.
        match (self.items, &mut statistics.memory) {
            (Some((items, tile)), _) if depth == 0 => {
                let items = (items, tile + first / BEAM);
                closest_listed(self.world, lanes, &batch, items, hits, trace);
            }
            (None, Some(memory)) if depth == 0 => {
                memory.closest(self.world, lanes, &batch, hits, trace);
            }
            _ => closest(self.world, lanes, &batch, hits, trace),
        }
        if buffer.wants_places && has_cutouts(&self.world.scene) {
            let hits = &mut HitSlices {
                t: &mut t[..],
                instance: &mut instance[..],
                primitive: &mut primitive[..],
            };
            let scratch = (&mut *passing, &mut *buffer, &mut **trace);
            pass_cutouts(
                (self.world, lanes),
                (&mut *queue, rays.clone()),
                hits,
                scratch,
            );
        }
        count_rays(
            &queue.kind[rays.clone()],
            &instance[..count],
            depth,
            statistics,
        );

        fill_hit_buffer(
            (self.world, self.kernels.precision),
            (queue, rays.clone()),
            (t, instance, primitive),
            buffer,
        );
        for (row, i) in rays.clone().enumerate() {
            if instance[row] == HitId::NONE.instance {
                let seen = if depth == 0 {
                    if let Some(covered) = &mut statistics.covered {
                        covered[queue.pixel[i] as usize] -= 1.0;
                    }
                    self.backdrop
                } else {
                    self.background
                };
                add(film, queue, i, seen);
            }
        }
        if self.material_flags.emits {
            for hit in 0..buffer.len() {
                let id = buffer.material[hit];
                let mut emission = self.material(id).emission;
                if emission != [0.0; 3] && self.varies(id) {
                    emission = self.material_of((buffer, hit)).emission;
                }
                if emission != [0.0; 3] {
                    add(film, queue, buffer.row[hit] as usize, emission);
                }
            }
        }
        if statistics.record.is_some() && self.kernels.precision == Precision::Exact {
            let batch = queue.padded_rays(first);
            let hits = &mut Hits {
                t: Depths::Double(t),
                id: Ids {
                    instance,
                    primitive,
                },
            };
            refine(self.world, &batch, hits, trace);
        }
        if statistics.record.is_some() || depth == 0 && primary.is_some() {
            report_hits(
                queue,
                (rays, depth),
                (t, instance, primitive),
                buffer,
                statistics,
                primary,
            );
        }
        for (number, light) in self.lights.iter().enumerate() {
            shadows.generate(light, number as u32, queue, buffer);
            let cache = &mut caches[number];
            self.add_direct_light(
                (queue, depth),
                buffer,
                (shadows, passing, trace),
                cache,
                film,
                statistics,
            );
        }
        if depth < self.max_depth && self.material_flags.spawns_rays {
            let (queue, next) = queues.pair(depth);
            for i in 0..buffer.len() {
                let material = self.material(buffer.material[i]);
                if !spawns_rays(material) {
                    continue;
                }
                match self.varies(buffer.material[i]) {
                    false => spawn(queue, (buffer, i), material, next),
                    true => spawn(queue, (buffer, i), &self.material_of((buffer, i)), next),
                }
            }
        }
        queues.at(depth).truncate(first);
    }

    /// Returns the kernels of hits that are shaded: they start from the t of lanes in every exact
    /// precision, so that pictures do not depend on which it is.
    fn lanes(&self) -> Kernels {
        Kernels {
            precision: match self.kernels.precision {
                Precision::Exact => Precision::Guarded,
                other => other,
            },
            ..self.kernels
        }
    }

    /// Says whether a material varies from hit to hit.
    fn varies(&self, id: Option<MaterialId>) -> bool {
        let textures = &self.world.scene.textures;
        !textures.is_empty() && id.is_some_and(|id| textures.of(id).is_some())
    }

    /// Returns the material of a hit that varies.
    fn material_of(&self, (buffer, hit): (&HitBuffer, usize)) -> Material {
        let id = buffer.material[hit];
        let own = (id, self.material(id));
        let at = buffer.look_up(hit, Footprint::POINT);
        material_at(&self.world.scene, own, (at.place, at.spot))
    }

    #[inline(always)]
    fn material(&self, id: Option<MaterialId>) -> &Material {
        match id {
            Some(id) => &self.world.scene.materials.rows[id.index()],
            None => &self.unnamed,
        }
    }
}

/// Records each ray and passes camera rays' hits to the callback.
fn report_hits(
    queue: &RayQueue,
    (rays, depth): (Range<usize>, u32),
    (t, instance, primitive): (&[f64], &[u64], &[u32]),
    buffer: &HitBuffer,
    statistics: &mut Statistics,
    primary: &mut PrimaryHit,
) {
    let mut hit = 0;
    for (row, i) in rays.enumerate() {
        let id = HitId {
            instance: instance[row],
            primitive: primitive[row],
        };
        if id.instance == HitId::NONE.instance {
            record_ray(queue, i, depth, Outcome::Miss, statistics);
            continue;
        }
        let outcome = Outcome::Hit {
            t: t[row],
            instance: id.instance,
            primitive: id.primitive,
            normal: buffer.ng.row(hit),
        };
        record_ray(queue, i, depth, outcome, statistics);
        if let (0, Some(primary)) = (depth, &mut *primary) {
            primary(queue.pixel[i], &buffer.surface(hit), id);
        }
        hit += 1;
    }
}

#[inline(always)]
fn add(film: &mut [Rgb], queue: &RayQueue, i: usize, radiance: Rgb) {
    let (pixel, weight) = (&mut film[queue.pixel[i] as usize], queue.weight.row(i));
    for k in 0..3 {
        pixel[k] += weight[k] * radiance[k];
    }
}

/// Rays with less weight in their pixel are not traced (adaptive depth control, Hall
/// and Greenberg 1983): glass inside glass would double the rays at each hit.
const LEAST_WEIGHT: f32 = 1.0 / 4096.0;

fn spawn(
    queue: &RayQueue,
    (buffer, hit): (&HitBuffer, usize),
    material: &Material,
    next: &mut RayQueue,
) {
    let (i, surface) = (buffer.row[hit] as usize, &buffer.surface(hit));
    let out = sample_bsdf(
        material,
        surface.ns,
        buffer.incoming.get(hit),
        surface.front,
    );
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
        let before = queue.weight.row(i);
        let weight = std::array::from_fn(|k| before[k] * weight[k]);
        if weight.iter().any(|w| *w >= LEAST_WEIGHT) {
            let org = surface.leave(side);
            next.push(org, dir, f32::INFINITY, queue.pixel[i], weight, kind);
        }
    };
    if let Some((dir, weight)) = out.mirror {
        push(dir, weight, RayKind::Reflection);
    }
    if let Some((dir, weight)) = out.refract {
        push(dir, weight, RayKind::Refraction);
    }
}
