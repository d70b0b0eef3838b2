//! Shadow rays from a batch's hits to one light, and the light that arrives.

use super::Integrator;
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask};
use crate::scene::{Light, Rgb};
use crate::shade::bsdf::reflected;
use crate::shade::columns::{Column3, Doubles, STEP, Singles, keep, pad};
use crate::shade::cutouts::{Passing, has_cutouts, unblock};
use crate::shade::hit_buffer::HitBuffer;
use crate::shade::light::{LightSample, shadow_dirs, shadow_t_max};
use crate::shade::ray_queue::{BATCH, RayQueue};
use crate::shade::statistics::{Statistics, record_ray};
use crate::trace::{Outcome, RayKind, ShadowCache, TraceScratch, any};
use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;

pub(super) struct ShadowRays<'b> {
    /// Shadow rays; their weight is the light's irradiance.
    rays: RayQueue<'b>,
    blocked: ArenaVec<'b, bool>,
    /// Row of the hit buffer, and direction to the light, of each ray: whole steps.
    hit_rows: ArenaVec<'b, u32>,
    towards: Column3<'b, Doubles>,
}

impl<'b> ShadowRays<'b> {
    pub(super) fn new(arena: &'b Bump) -> ShadowRays<'b> {
        ShadowRays {
            rays: RayQueue::with_capacity(BATCH, arena),
            blocked: ArenaVec::with_capacity_in(BATCH, arena),
            hit_rows: ArenaVec::with_capacity_in(BATCH + STEP, arena),
            towards: Column3::with_capacity(BATCH, arena),
        }
    }

    /// Generates the shadow rays of all hits that the light could reach.
    pub(super) fn generate(
        &mut self,
        light: &Light,
        number: u32,
        queue: &RayQueue,
        buffer: &HitBuffer,
    ) {
        self.rays.truncate(0);
        self.hit_rows.clear();
        self.towards.truncate(0);
        let (zero, one) = (Doubles::zero(), Doubles::splat(1.0));
        let (kind, end) = (RayKind::Shadow { light: number }, shadow_t_max(light));
        for first in (0..buffer.len()).step_by(STEP) {
            let rows = (1 << STEP.min(buffer.len() - first)) - 1;
            let (point, ng) = (buffer.point.step(first), buffer.ng.step(first));
            let arrival = LightSample::at(light, point);
            // The light lies on the ray's side of both the geometric and the shading
            // surface.
            let towards = arrival.towards;
            let facing = ng * Doubles::load(&buffer.side[first..]);
            let behind = towards.dot(buffer.ns.step(first)).le(zero) | towards.dot(facing).le(zero);
            let rows = (arrival.some & !behind).bits() & rows;
            if rows == 0 {
                continue;
            }
            let side: Doubles = Lanes::select(towards.dot(ng).ge(zero), one, -one);
            let org = point + ng * (side * Doubles::load(&buffer.shadow_offset[first..]));
            let (dir, some) = shadow_dirs(light, org, towards);
            let rows = some.bits() & rows;
            let numbers: [u32; STEP] = std::array::from_fn(|i| (first + i) as u32);
            let pixel = |i: usize| queue.pixel[buffer.row[first + i] as usize];
            let pixels = std::array::from_fn(pixel);
            let [r, g, b] = arrival.irradiance;
            self.rays.push_some(rows, (org, dir), &pixels);
            self.rays.weight.push_some(Vec3::new(r, g, b), rows);
            keep(&mut self.hit_rows, &numbers, rows);
            self.towards.push_some(towards, rows);
        }
        self.rays.complete(end, kind);
        self.rays.weight.pad();
        pad(&mut self.hit_rows);
        self.towards.pad();
    }
}

impl Integrator<'_> {
    /// Traces the shadow rays and adds the light that arrives to `film`.
    pub(super) fn add_direct_light(
        &self,
        (queue, depth): (&RayQueue, u32),
        buffer: &HitBuffer,
        (shadows, passing, trace): (&mut ShadowRays, &mut Passing, &mut TraceScratch),
        cache: &mut ShadowCache,
        film: &mut [Rgb],
        statistics: &mut Statistics,
    ) {
        let ShadowRays {
            rays,
            blocked,
            hit_rows,
            towards,
        } = shadows;
        let batch = rays.padded_rays(0);
        blocked.resize(batch.len(), false);
        any(self.world, &self.kernels, &batch, cache, blocked, trace);
        if buffer.wants_places && has_cutouts(&self.world.scene) {
            let rest = (&*rays, &mut blocked[..rays.len()]);
            unblock((self.world, &self.lanes()), rest, passing, trace);
        }
        let blocked = &blocked[..rays.len()];
        statistics.counts.shadow += blocked.len() as u64;
        statistics.counts.shadow_occluded += blocked.iter().filter(|b| **b).count() as u64;
        if statistics.record.is_some() {
            for (s, blocked) in blocked.iter().enumerate() {
                let outcome = match blocked {
                    true => Outcome::Blocked,
                    false => Outcome::Clear,
                };
                record_ray(rays, s, depth, outcome, statistics);
            }
        }
        for (first, blocked) in (0..).step_by(STEP).zip(blocked.chunks(STEP)) {
            let bit = |(i, blocked): (usize, &bool)| u32::from(!blocked) << i;
            let mut clear: u32 = blocked.iter().enumerate().map(bit).sum();
            if clear == 0 {
                continue;
            }
            let hits: [u32; STEP] = std::array::from_fn(|i| hit_rows[first + i]);
            let (ns, out) = (buffer.ns.gather(&hits), -buffer.incoming.gather(&hits));
            let (light, towards) = (rays.weight.step(first), towards.step(first));
            let light = [light.x, light.y, light.z];
            // Radiance is computed material by material and added in the rays' order.
            let (mut rest, mut sums) = (clear, [Singles::zero(); 3]);
            while rest != 0 {
                let id = buffer.material[hits[rest.trailing_zeros() as usize] as usize];
                let same = |i: usize| u32::from(buffer.material[hits[i] as usize] == id) << i;
                let mut same: u32 = (0..STEP).map(same).sum();
                let radiance = match self.varies(id) {
                    false => reflected(self.material(id), ns, out, towards, light),
                    // Each hit has a material of its own.
                    true => {
                        let hit = hits[rest.trailing_zeros() as usize];
                        same = rest & rest.wrapping_neg();
                        let own = self.material_of((buffer, hit as usize));
                        reflected(&own, ns, out, towards, light)
                    }
                };
                let mask = <Singles as Lanes>::Mask::from_bits(same);
                for (sum, radiance) in sums.iter_mut().zip(radiance) {
                    *sum = Lanes::select(mask, radiance, *sum);
                }
                rest &= !same;
            }
            let rows = hits.map(|hit| buffer.row[hit as usize]);
            let weight = queue.weight.gather(&rows);
            let [r, g, b] = sums;
            let [r, g, b] = [weight.x * r, weight.y * g, weight.z * b].map(|c| c.to_array());
            while clear != 0 {
                let i = clear.trailing_zeros() as usize;
                clear &= clear - 1;
                let pixel = &mut film[queue.pixel[rows[i] as usize] as usize];
                for (channel, radiance) in pixel.iter_mut().zip([r[i], g[i], b[i]]) {
                    *channel += radiance;
                }
            }
        }
    }
}
