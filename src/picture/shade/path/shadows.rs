//! Rays towards sampled light, and what arrives by those that are not blocked.

use super::PathTracer;
use super::layers::{EMISSION, Film, LayerKey, SKY};
use super::materials::Look;
use crate::scene::Rgb;
use crate::shade::hit_buffer::HitBuffer;
use crate::shade::hit_columns::HitColumns;
use crate::shade::hits::fill_hit_buffer;
use crate::shade::ray_queue::{BATCH, RayQueue};
use crate::shade::statistics::Statistics;
use crate::shade::textures::Footprint;
use crate::trace::{HitId, RayKind, ShadowCache, TraceScratch, any};
use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;
use glam::DVec3;

/// The end of rays to a sampled point of a body, as a fraction of the way: the point is rounded
/// to f64, and where the ray grazes the body, the body itself lies a little nearer.
pub(super) const BODY_END: f32 = 1.0 - 1.0 / 65_536.0;

/// Rays towards light pass no more surfaces than this.
const MOST_PASSED: usize = 64;

/// Rays towards sampled light; their weight is what the pixel gets if they arrive.
pub(super) struct LightRays<'b> {
    pub rays: RayQueue<'b>,
    pub blocked: ArenaVec<'b, bool>,
    /// Those that may pass what blocks them.
    passing: RayQueue<'b>,
    /// Where the rays take their light, and those that pass, if layers of light are kept.
    pub keys: Option<ArenaVec<'b, LayerKey>>,
    passing_keys: ArenaVec<'b, LayerKey>,
}

impl<'b> LightRays<'b> {
    pub fn new(arena: &'b Bump) -> LightRays<'b> {
        LightRays {
            rays: RayQueue::with_capacity(BATCH, arena),
            blocked: ArenaVec::with_capacity_in(2 * BATCH, arena),
            passing: RayQueue::with_capacity(2 * BATCH, arena),
            keys: None,
            passing_keys: ArenaVec::new_in(arena),
        }
    }

    pub fn clear(&mut self) {
        self.rays.truncate(0);
        if let Some(keys) = &mut self.keys {
            keys.clear();
        }
    }
}

impl PathTracer<'_> {
    /// Traces the rays towards light, and adds to the slots what arrives.
    pub(super) fn add_light(
        &self,
        lights: &mut LightRays,
        (hits, buffer): (&mut HitColumns, &mut HitBuffer),
        film: &mut Film,
        (cache, trace): (&mut ShadowCache, &mut TraceScratch),
        statistics: &mut Statistics,
    ) {
        let LightRays {
            rays,
            blocked,
            passing,
            keys,
            passing_keys,
        } = lights;
        if rays.is_empty() {
            return;
        }
        let count = rays.len();
        rays.complete(f32::INFINITY, RayKind::Shadow { light: 0 });
        let batch = rays.padded_rays(0);
        blocked.resize(batch.len(), false);
        any(self.world, &self.kernels, &batch, cache, blocked, trace);
        rays.truncate(count);
        let blocked = &blocked[..count];
        statistics.counts.shadow += count as u64;
        statistics.counts.shadow_occluded += blocked.iter().filter(|b| **b).count() as u64;
        for (ray, blocked) in blocked.iter().enumerate() {
            if !blocked {
                let key = keys.as_ref().map(|keys| keys[ray]);
                self.arrive(film, rays, ray, key);
            } else if self.materials.has_holes {
                passing_keys.extend(keys.as_ref().map(|keys| keys[ray]));
                passing.push(
                    DVec3::from_array(rays.org(ray)),
                    DVec3::from_array(rays.dir(ray)),
                    rays.t_max[ray],
                    rays.pixel[ray],
                    rays.weight.row(ray),
                    rays.kind[ray],
                );
            }
        }
        let mut left = MOST_PASSED;
        while !passing.is_empty() && left > 0 {
            statistics.counts.shadow += passing.len() as u64;
            self.pass_on((passing, passing_keys), (hits, buffer), film, trace);
            left -= 1;
        }
        passing.truncate(0);
        passing_keys.clear();
    }

    /// Brings rays towards light to what is behind the next surface that lets them pass, and
    /// drops those that none does.
    fn pass_on(
        &self,
        (rays, keys): (&mut RayQueue, &mut ArenaVec<LayerKey>),
        (hits, buffer): (&mut HitColumns, &mut HitBuffer),
        film: &mut Film,
        trace: &mut TraceScratch,
    ) {
        let count = rays.len();
        hits.closest((self.world, &self.kernels), rays, trace);
        fill_hit_buffer(
            (self.world, self.kernels.precision),
            (rays, 0..count),
            (&hits.t, &hits.instance, &hits.primitive),
            buffer,
        );
        for ray in 0..count {
            if hits.instance[ray] == HitId::NONE.instance {
                let key = keys.get(ray).copied();
                self.arrive(film, rays, ray, key);
            }
        }
        for hit in 0..buffer.len() {
            let ray = buffer.row[hit] as usize;
            let look = &self.materials.rows[self.materials.number(buffer.material[hit]) as usize];
            if !look.lets_shadow_rays_pass() {
                continue;
            }
            let surface = buffer.surface(hit);
            let dir = DVec3::from_array(rays.dir(ray));
            let cos = dir.normalize().dot(surface.ns).abs() as f32;
            let mut passed = match &look.varied {
                None => look.bsdf.straight(cos),
                Some(varied) => {
                    let at = buffer.look_up(hit, Footprint::POINT);
                    let there = self.material_there((look, varied), at);
                    Look::new(there).bsdf.straight(cos)
                }
            };
            if let Some(varied) = look.varied.as_ref().filter(|varied| varied.has_alpha()) {
                let there = self.opacity_at(look, varied, &buffer.places[hit]);
                passed = passed.map(|share| (1.0 - there) + there * share);
            }
            let before = rays.weight.row(ray);
            let weight = std::array::from_fn(|k| before[k] * passed[k]);
            let side = if dir.dot(surface.ng) >= 0.0 {
                1.0
            } else {
                -1.0
            };
            let org = surface.point + surface.ng * (side * buffer.shadow_offset[hit]);
            let end = (f64::from(rays.t_max[ray]) - hits.t[ray]) as f32;
            if weight != [0.0; 3] && end > 0.0 {
                keys.extend(keys.get(ray).copied());
                rays.push(org, dir, end, rays.pixel[ray], weight, rays.kind[ray]);
            }
        }
        rays.drop_first(count);
        keys.drain(..count.min(keys.len()));
    }

    /// Gives a pixel, and the layers of a key, the light of a ray that arrives.
    fn arrive(&self, film: &mut Film, rays: &RayQueue, ray: usize, key: Option<LayerKey>) {
        let (pixel, light): (u32, Rgb) = (rays.pixel[ray], rays.weight.row(ray));
        for (channel, light) in film.slots[pixel as usize].iter_mut().zip(light) {
            *channel += light;
        }
        if let (Some(layers), Some(plan), Some(key)) = (&mut film.layers, self.layers, key) {
            let LayerKey { trail, group } = &key;
            if *group == SKY {
                let dir = DVec3::from_array(rays.dir(ray)).normalize().as_vec3();
                let of = (plan, &self.luminaires.emitters);
                layers.add_sky(of, pixel, (trail, dir.to_array()), light);
            } else {
                layers.add(plan, pixel, (trail, EMISSION, *group), light);
            }
        }
    }
}
