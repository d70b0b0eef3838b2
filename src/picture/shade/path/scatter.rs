//! What a path does at a surface: it aims at a light, and goes on.

use super::cache::{CacheColumns, UseMode};
use super::emission::narrow;
use super::layers::{LayerKey, SKY, shares};
use super::materials::Look;
use super::shadows::{BODY_END, LightRays};
use super::spot::{Spot, widen};
use super::state::Paths;
use super::textured::widening;
use super::{PathTracer, ROULETTE_DEPTH, SampleNumbers, share};
use crate::light::bsdf::Sampled;
use crate::math::lanes::{Lanes, Mask, Words};
use crate::math::{Vec3, units};
use crate::shade::columns::{Doubles, STEP, Singles, each_lane, gather, keep};
use crate::shade::hit_buffer::HitBuffer;
use crate::trace::{RayKind, TraceScratch};

type SingleMask = <Singles as Lanes>::Mask;
type DoubleMask = <Doubles as Lanes>::Mask;

impl PathTracer<'_> {
    /// Scatters up to [`STEP`] hits of the material of a number: queues a ray towards a light
    /// for each, and the ray that the path goes on with.
    pub(super) fn scatter(
        &self,
        (numbers, depth): (SampleNumbers, u32),
        (wave, buffer): (&Paths, &HitBuffer),
        (hits, count, (number, look)): (&[u32; STEP], usize, (u32, &Look)),
        (next, lights, cached): (&mut Paths, &mut LightRays, &mut CacheColumns),
        trace: &mut TraceScratch,
    ) {
        let opacity = look.material.layers.opacity;
        let ends = look.material.layers.unlit || look.bsdf.is_black;
        if ends && opacity >= 1.0 {
            return;
        }
        let mut spot = Spot::new((wave, buffer), look, hits, count);
        if look.follows_tangents {
            spot.follow_tangents(buffer);
        }
        if let Some(varied) = &look.varied {
            spot.looks = self.looks_at((look, varied), (numbers, depth), wave, (buffer, hits));
        }
        if look.bends_coat {
            spot.looks.coat_normal = Some(spot.coat_normals(buffer));
        }
        if buffer.wants_lift && !look.bsdf.transmits {
            let lift = spot.lifted - spot.point;
            spot.curved = lift.max_abs().gt(Doubles::zero()).bits() & spot.lanes;
        }
        let keys = Words::load(&each_lane(|i| wave.key[spot.rays[i] as usize]));
        let samples = numbers.of_step(|i| wave.rays.pixel[spot.rays[i] as usize]);
        let mut displaced = 0;
        if look.has_medium() {
            displaced = self.enter_media(&mut spot, (wave, numbers), (buffer, number), trace);
        }
        let [u, v, mut lobe, roulette]: [Singles; 4] =
            self.sampler.pad(keys, samples, 2 + 2 * depth);
        let mut passing = displaced;
        if opacity < 1.0 {
            let opacity = Singles::splat(opacity);
            passing |= lobe.ge(opacity).bits() & spot.lanes;
            // The rest of the number is as good as new.
            lobe = (lobe / opacity).min(Singles::splat(1.0 - f32::EPSILON));
        }
        if let Some(ground) = self.ground.filter(|g| g.material.index() as u32 == number) {
            for i in 0..STEP {
                let (ray, hit) = (spot.rays[i] as usize, spot.hits[i] as usize);
                if !wave.straight[ray] {
                    continue;
                }
                let opacity = match buffer.side[hit] > 0.0 {
                    true => ground.opacity_at(buffer.point.get(hit)),
                    false => 0.0,
                };
                passing |= u32::from(lobe.to_array()[i] >= opacity) << i & spot.lanes;
            }
            // Matte ground has one lobe, and needs the number no more.
        }
        if passing != 0 {
            self.pass((wave, buffer), &spot, (passing, displaced), next);
            spot.lanes &= !passing;
            if spot.lanes == 0 {
                return;
            }
        }
        if ends || spot.is_spent(wave, look) {
            return;
        }
        let is_probe = matches!(&self.cache, Some(cache) if cache.mode == UseMode::Probe);
        if !look.bsdf.only_delta && !self.luminaires.emitters.is_empty() && !is_probe {
            let random = self.sampler.pad(keys, samples, 3 + 2 * depth);
            let at = (numbers, depth);
            self.aim((wave, at), look, &spot, random, (buffer, lights));
        }
        let sampled = look
            .bsdf
            .sample(&spot.looks, spot.eta, spot.out_local, [u, v], lobe);
        let mut onward = None;
        if let Some(cache) = &self.cache {
            let taken =
                self.take_cached(cache, (wave, buffer), (look, &spot, depth), cached, || {
                    let [.., survives] = self.sampler.pad(keys, samples, 3 + 2 * depth);
                    survives
                });
            if is_probe {
                // What is scattered once more is looked at, too, where paths will ask there.
                spot.lanes &= match depth < cache.probe_depth {
                    true => u32::MAX,
                    false => sampled.delta.bits(),
                };
            }
            onward = Some(taken.onward(&sampled));
        }
        self.go_on(
            (wave, buffer),
            (look, depth),
            &spot,
            (&sampled, roulette, onward),
            next,
        );
    }

    /// Queues the rays towards a light.
    fn aim(
        &self,
        (wave, at): (&Paths, (SampleNumbers, u32)),
        look: &Look,
        spot: &Spot,
        [u, v, pick, _]: [Singles; 4],
        (buffer, lights): (&HitBuffer, &mut LightRays),
    ) {
        let transmits = look.bsdf.transmits;
        let normal = light_normal(look, spot.ns);
        let active = SingleMask::from_bits(spot.lanes);
        // Where a reflected ray would start: the density of what it meets is asked for there.
        let offset: Doubles = gather(&buffer.offset, &spot.hits);
        let start = spot.leave(spot.lanes, spot.curved, offset);
        let light = self
            .luminaires
            .emitters
            .sample(start, normal, active, pick, [u, v]);
        let into = spot.frame.local_from_world(narrow(units(light.dir)));
        let zero = Doubles::zero();
        let above = light.dir.dot(spot.facing).gt(zero).bits() | spot.curved;
        let shown = into.z.gt(Singles::zero()).bits();
        // Light from one side of the surface and the other side of its shading normal would
        // leak through.
        let right = match transmits {
            true => !(above ^ shown),
            false => above & shown,
        };
        let mut rows = light.some.bits() & right & spot.lanes;
        if rows == 0 {
            return;
        }
        let found = look.bsdf.eval(&spot.looks, spot.eta, spot.out_local, into);
        let one = Singles::splat(1.0);
        let part = Lanes::select(light.delta, one, share(light.pdf, found.pdf));
        let part = part / light.pdf;
        let from = |lane: usize| [start.x, start.y, start.z].map(|x| x.lane(lane)).into();
        let radiance =
            self.sampled_radiance((&light, found.pdf), (wave, buffer), (spot, rows), at, from);
        let [r, g, b]: [Singles; 3] = std::array::from_fn(|k| found.value[k] * radiance[k] * part);
        let weight = Vec3::new(
            spot.throughput.x * r,
            spot.throughput.y * g,
            spot.throughput.z * b,
        );
        let some = weight.x.max(weight.y).max(weight.z).gt(Singles::zero());
        rows &= some.bits();
        if rows == 0 {
            return;
        }
        let offset: Doubles = gather(&buffer.shadow_offset, &spot.hits);
        let org = spot.leave(above, spot.curved, offset);
        let far = DoubleMask::from_bits(light.far.bits());
        let to = start + light.dir - org;
        let dir = Vec3::select(far, light.dir, to);
        let far = light.far.bits();
        let ends: [f32; STEP] = each_lane(|i| match far >> i & 1 {
            0 => BODY_END,
            _ => f32::INFINITY,
        });
        let mut weight = weight;
        if self.materials.has_media {
            let way = to.length().to_array();
            let left: [[f32; 3]; STEP] = std::array::from_fn(|i| {
                let media = match above >> i & 1 {
                    0 => spot.behind[i],
                    _ => wave.media(spot.rays[i]),
                };
                let way = match far >> i & 1 {
                    0 => way[i] as f32,
                    _ => f32::INFINITY,
                };
                self.materials.left(&media, way)
            });
            let [r, g, b] = [0, 1, 2].map(|k| Singles::load(&left.map(|left| left[k])));
            weight = Vec3::new(weight.x * r, weight.y * g, weight.z * b);
            rows &= weight
                .x
                .max(weight.y)
                .max(weight.z)
                .gt(Singles::zero())
                .bits();
            if rows == 0 {
                return;
            }
        }
        if let (Some(keys), Some(plan)) = (&mut lights.keys, self.layers) {
            let share = look
                .bsdf
                .diffuse_share(&spot.looks, spot.eta, spot.out_local, into);
            let (share, delta) = (shares(share), light.delta.bits());
            let emitters = light.emitter.as_ref();
            let all: [LayerKey; STEP] = std::array::from_fn(|i| LayerKey {
                trail: wave.trail_on(spot.rays[i]).after(share[i]),
                group: match (far & !delta) >> i & 1 {
                    0 => plan.of_emitter(emitters[i]),
                    _ => SKY,
                },
            });
            keep(keys, &all, rows);
        }
        let pixels = each_lane(|i| wave.rays.pixel[spot.rays[i] as usize]);
        lights.rays.push_some(rows, (org, dir), &pixels);
        lights.rays.weight.push_some(weight, rows);
        keep(&mut lights.rays.t_max, &ends, rows);
    }

    /// Queues the rays that the paths go on with.
    fn go_on(
        &self,
        (wave, buffer): (&Paths, &HitBuffer),
        (look, depth): (&Look, u32),
        spot: &Spot,
        (sampled, roulette, onward): (&Sampled<Singles>, Singles, Option<Vec3<Singles>>),
        next: &mut Paths,
    ) {
        let through = sampled.through.bits();
        let delta = sampled.delta.bits() & spot.lanes;
        let thin = look.material.layers.thin_walled;
        // Light sampling at the hit before sees through a smooth pane, so what the path meets
        // behind is weighed by the densities there.
        let straight = if thin { delta & through } else { 0 };
        let mut dir: Vec3<Doubles> = widen(spot.frame.world_from_local(sampled.into));
        // Where coat and base have normals of their own, each mirrors about its own.
        if delta != 0 && spot.looks.coat_normal.is_none() {
            let exact = spot.mirrored_or_bent(through, thin);
            dir = Vec3::select(DoubleMask::from_bits(delta), exact, dir);
        }
        let zero = Doubles::zero();
        let above = dir.dot(spot.facing).gt(zero).bits() | spot.curved & !delta & !through;
        // A shading normal may send a ray to the wrong side of the surface.
        let mut rows = sampled.some.bits() & (above ^ through) & spot.lanes;
        let [r, g, b] = sampled.weight;
        let mut throughput = spot.throughput;
        let mut onward = onward;
        if let Some(before) = wave.onward(&spot.rays) {
            let passes = SingleMask::from_bits(straight);
            throughput = Vec3::select(passes, spot.passing, throughput);
            let scattered = onward.unwrap_or(Vec3::splat([1.0; 3]));
            onward = Some(Vec3::select(passes, before, scattered));
        }
        let mut weight = Vec3::new(throughput.x * r, throughput.y * g, throughput.z * b);
        let mut compression = wave.compression(&spot.rays);
        if through != 0 && !thin {
            let more = compression * spot.eta * spot.eta;
            compression = Lanes::select(sampled.through, more, compression);
        }
        if depth >= ROULETTE_DEPTH {
            let most = weight.x.max(weight.y).max(weight.z) * compression;
            let survival = most.sqrt().min(Singles::splat(1.0));
            rows &= roulette.lt(survival).bits();
            let more = Singles::splat(1.0) / survival;
            weight = Vec3::new(weight.x * more, weight.y * more, weight.z * more);
        }
        let some = weight.x.max(weight.y).max(weight.z);
        rows &= (some.gt(Singles::zero()) & some.lt(Singles::splat(f32::INFINITY))).bits();
        if rows == 0 {
            return;
        }
        let offset: Doubles = gather(&buffer.offset, &spot.hits);
        let org = spot.leave(above, spot.curved & !delta, offset);
        let before = wave.normal.gather(&spot.rays);
        let normal = light_normal(look, spot.ns);
        let normal = Vec3::select(SingleMask::from_bits(straight), before, normal);
        let pdf = sampled.pdf.to_array();
        let pdfs: [f32; STEP] = each_lane(|i| match (straight >> i & 1, delta >> i & 1) {
            (1, _) => wave.pdf[spot.rays[i] as usize],
            (_, 1) => f32::INFINITY,
            _ => pdf[i],
        });
        let clear: [bool; STEP] =
            each_lane(|i| straight >> i & 1 != 0 && wave.straight[spot.rays[i] as usize]);
        let kinds: [RayKind; STEP] = each_lane(|i| match through >> i & 1 {
            0 => RayKind::Reflection,
            _ => RayKind::Refraction,
        });
        if let Some(cones) = &mut next.cones {
            let wider: [f32; STEP] = std::array::from_fn(|i| {
                if delta >> i & 1 != 0 {
                    0.0
                } else {
                    widening(pdf[i])
                }
            });
            let all = self.cones_after((wave, buffer), (&spot.hits, &spot.rays), wider);
            keep(cones, &all, rows);
        }
        let paths = &mut *next;
        if let Some(trails) = &mut paths.trails {
            let into = sampled.into;
            let share = look
                .bsdf
                .diffuse_share(&spot.looks, spot.eta, spot.out_local, into);
            let share = shares(share);
            let all: [_; STEP] = std::array::from_fn(|i| {
                let before = wave.trail_on(spot.rays[i]);
                match (straight >> i & 1, delta >> i & 1) {
                    (1, _) => wave.trail(spot.rays[i]),
                    (_, 1) => before.after([0.0; 3]),
                    _ => before.after(share[i]),
                }
            });
            keep(trails, &all, rows);
        }
        if let Some(open) = &mut paths.open {
            keep(open, &[false; STEP], rows);
        }
        if let (Some(guiding), Some(before)) = (&mut paths.guiding, &wave.guiding) {
            let goes_on = look.bsdf.only_delta;
            let weights = spot.rays.map(|ray| match goes_on {
                true => before[ray as usize],
                false => 0.0,
            });
            keep(guiding, &weights, rows);
        }
        paths.rays.weight.push_some(weight, rows);
        paths.normal.push_some(normal, rows);
        keep(&mut paths.pdf, &pdfs, rows);
        let media = || {
            let mut media = wave.media_of(&spot.rays);
            for (i, media) in media.iter_mut().enumerate() {
                if through >> i & 1 != 0 {
                    *media = spot.behind[i];
                }
            }
            media
        };
        paths.push_interior(media, compression, rows);
        keep(&mut paths.straight, &clear, rows);
        let origins = wave.origins(&spot.rays, org);
        let behind = DoubleMask::from_bits(straight);
        paths.push_origins(Vec3::select(behind, origins, org), rows);
        paths.push_onward(onward, rows);
        spot.push((org, dir), (&kinds, rows), wave, next);
    }

    /// Lets paths go straight on through holes, and through the `displaced` surfaces of media.
    /// These block rays towards light, so nothing competes with what a path meets behind them.
    fn pass(
        &self,
        (wave, buffer): (&Paths, &HitBuffer),
        spot: &Spot,
        (rows, displaced): (u32, u32),
        next: &mut Paths,
    ) {
        let dir = -spot.out;
        let one = Doubles::splat(1.0);
        let side = Lanes::select(dir.dot(spot.ng).ge(Doubles::zero()), one, -one);
        let offset: Doubles = gather(&buffer.offset, &spot.hits);
        let org = spot.point + spot.ng * (side * offset);
        let of = spot.rays.map(|ray| ray as usize);
        let kinds = [RayKind::Refraction; STEP];
        if let Some(cones) = &mut next.cones {
            let all = self.cones_after((wave, buffer), (&spot.hits, &spot.rays), [0.0; STEP]);
            keep(cones, &all, rows);
        }
        if let Some(trails) = &mut next.trails {
            keep(trails, &spot.rays.map(|ray| wave.trail(ray)), rows);
        }
        if let (Some(open), Some(before)) = (&mut next.open, &wave.open) {
            keep(open, &of.map(|ray| before[ray]), rows);
        }
        if let (Some(guiding), Some(before)) = (&mut next.guiding, &wave.guiding) {
            keep(guiding, &of.map(|ray| before[ray]), rows);
        }
        next.rays.weight.push_some(spot.passing, rows);
        next.push_onward(wave.onward(&spot.rays), rows);
        next.normal.push_some(wave.normal.gather(&spot.rays), rows);
        let pdfs: [f32; STEP] = each_lane(|i| match displaced >> i & 1 {
            0 => wave.pdf[of[i]],
            _ => f32::INFINITY,
        });
        keep(&mut next.pdf, &pdfs, rows);
        next.push_origins(wave.origins(&spot.rays, org), rows);
        next.push_interior(|| spot.behind, wave.compression(&spot.rays), rows);
        keep(
            &mut next.straight,
            &each_lane(|i| wave.straight[of[i]]),
            rows,
        );
        spot.push((org, dir), (&kinds, rows), wave, next);
    }

    /// Computes the ratio of the indices of refraction on both sides of the surfaces of a
    /// medium, and returns the lanes whose surface is none: a medium of higher priority is on
    /// both sides (Schmidt and Budge 2002).
    fn enter_media(
        &self,
        spot: &mut Spot,
        (wave, numbers): (&Paths, SampleNumbers),
        (buffer, number): (&HitBuffer, u32),
        trace: &mut TraceScratch,
    ) -> u32 {
        let mut passing = 0;
        let mut eta = [1.0_f32; STEP];
        let mut share = [[1.0_f32; STEP]; 3];
        let mut is_dispersed = false;
        for i in 0..STEP {
            let (ray, hit) = (spot.rays[i] as usize, spot.hits[i] as usize);
            let (mut before, mut behind) = (spot.behind[i], spot.behind[i]);
            let front = buffer.side[hit] > 0.0;
            if let Some(solids) = self.solids {
                let far = buffer.point.get(hit)
                    - buffer.ng.get(hit) * (buffer.side[hit] * buffer.offset[hit]);
                behind = self.materials.media_at(solids, far, trace);
            } else if front {
                behind.enter(number);
            } else {
                behind.leave(number);
                // A ray that starts inside has not entered.
                if !before.has(number) {
                    before.enter(number);
                }
            }
            let [near, far] = [before, behind].map(|media| self.materials.innermost(&media));
            let mut channel = 1;
            if near != far && (self.materials.disperses(near) || self.materials.disperses(far)) {
                let weight = wave.rays.weight.row(ray);
                let sample = numbers.of(wave.rays.pixel[ray]);
                channel = self.channel_of(weight, (wave.key[ray], sample));
                let alone = weight.iter().filter(|part| **part > 0.0).count() < 2;
                for (k, share) in share.iter_mut().enumerate() {
                    share[i] = match k == channel {
                        true if alone => 1.0,
                        true => 3.0,
                        false => 0.0,
                    };
                }
                is_dispersed = true;
            }
            let [near_index, far_index] =
                [near, far].map(|medium| self.materials.index(medium, channel));
            eta[i] = far_index / near_index;
            passing |= u32::from(near == far) << i;
            spot.behind[i] = behind;
        }
        if is_dispersed {
            let [r, g, b] = share.each_ref().map(|share| Singles::load(share));
            let Vec3 { x, y, z } = spot.throughput;
            spot.throughput = Vec3::new(x * r, y * g, z * b);
        }
        spot.eta = Singles::load(&eta);
        passing & spot.lanes
    }
}

impl PathTracer<'_> {
    /// Chooses the colour that a path goes on with where colours part: the one that it still has,
    /// else one of three by the path's own number, which is the same at all its surfaces.
    fn channel_of(&self, weight: [f32; 3], (key, sample): (u32, u32)) -> usize {
        let left = |k: &usize| weight[*k] > 0.0;
        if let (Some(only), 1) = ((0..3).find(left), (0..3).filter(left).count()) {
            return only;
        }
        let [_, wavelength, ..] = self.sampler.pad_one(key, sample, 1);
        ((wavelength * 3.0) as usize).min(2)
    }
}

/// Returns the normals that light sampling aims by: none where light from both sides counts.
fn light_normal(look: &Look, ns: Vec3<Doubles>) -> Vec3<Singles> {
    match look.bsdf.transmits {
        true => Vec3::splat([0.0; 3]),
        false => narrow(ns),
    }
}
