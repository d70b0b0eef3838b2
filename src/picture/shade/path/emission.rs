//! Light that paths run into: the sky, and bodies that shine, weighed against the light
//! sampling that could have found them.

use super::layers::{EMISSION, Film};
use super::state::Paths;
use super::{PathTracer, SampleNumbers, Seen, share};
use crate::math::lanes::Lanes;
use crate::math::{Vec3, units};
use crate::scene::Rgb;
use crate::shade::columns::{STEP, Singles, gather};
use crate::shade::hit_buffer::HitBuffer;
use crate::trace::HitId;
use glam::DVec3;

impl PathTracer<'_> {
    /// Adds the sky to the slots of paths whose rays meet nothing.
    pub(super) fn add_sky(&self, wave: &Paths, (depth, instance): (u32, &[u64]), film: &mut Film) {
        let mut rows = [0; STEP];
        let mut count = 0;
        for (ray, id) in instance.iter().enumerate() {
            if *id == HitId::NONE.instance {
                rows[count] = ray as u32;
                count += 1;
            }
            if count == STEP {
                self.add_sky_to(wave, depth, &rows, count, film);
                count = 0;
            }
        }
        if count > 0 {
            let last = rows[count - 1];
            rows[count..].fill(last);
            self.add_sky_to(wave, depth, &rows, count, film);
        }
    }

    fn add_sky_to(
        &self,
        wave: &Paths,
        depth: u32,
        rows: &[u32; STEP],
        count: usize,
        film: &mut Film,
    ) {
        let straight = |i: usize| wave.straight[rows[i] as usize];
        let seen = |i: usize| self.backdrop != Seen::Sky && straight(i);
        let sky = match (0..count).all(seen) {
            true => [[0.0; STEP]; 3],
            false => self.sky_of(wave, rows),
        };
        for (i, ray) in rows.iter().enumerate().take(count) {
            let ray = *ray as usize;
            let slot = &mut film.slots[wave.rays.pixel[ray] as usize];
            match self.backdrop {
                Seen::Color(color) if seen(i) => {
                    let weight = wave.rays.weight.row(ray);
                    for k in 0..3 {
                        slot[k] += weight[k] * color[k];
                    }
                }
                Seen::Nothing if seen(i) => {
                    let [r, g, b] = wave.rays.weight.row(ray);
                    slot[3] = match depth {
                        0 => 0.0,
                        // What is behind panes is weakened by their tint.
                        _ => 1.0 - (r + g + b) / 3.0,
                    };
                }
                _ => {
                    for k in 0..3 {
                        slot[k] += sky[k][i];
                    }
                }
            }
            if let (Some(layers), Some(plan)) = (&mut film.layers, self.layers) {
                let light = match self.backdrop {
                    Seen::Color(color) if seen(i) => {
                        let weight = wave.rays.weight.row(ray);
                        std::array::from_fn(|k| weight[k] * color[k])
                    }
                    Seen::Nothing if seen(i) => continue,
                    _ => [0, 1, 2].map(|k| sky[k][i]),
                };
                let dir = DVec3::from_array(wave.rays.dir(ray)).normalize().as_vec3();
                let trail = &wave.trail(ray as u32);
                let of = (plan, &self.luminaires.emitters);
                layers.add_sky(of, wave.rays.pixel[ray], (trail, dir.to_array()), light);
            }
        }
    }

    /// Returns what paths find of the sky.
    fn sky_of(&self, wave: &Paths, rows: &[u32; STEP]) -> [[f32; STEP]; 3] {
        let weight = wave.rays.weight.gather(rows);
        let (org, dir) = wave.rays.gather(rows);
        let dir: Vec3<Singles> = narrow(units(dir));
        let normal = wave.normal.gather(rows);
        let ([r, g, b], other) = self
            .luminaires
            .emitters
            .sky(dir, wave.origins(rows, org), normal);
        let own: Singles = gather(&wave.pdf, rows);
        let part = share(own, other);
        [weight.x * r, weight.y * g, weight.z * b].map(|c| (c * part).to_array())
    }

    /// Adds the rectangles and discs of the table that scattered rays come through before they
    /// meet anything.
    pub(super) fn add_panels(
        &self,
        wave: &Paths,
        (instance, t): (&[u64], &[f64]),
        film: &mut Film,
    ) {
        let emitters = &self.luminaires.emitters;
        if !emitters.has_panels() {
            return;
        }
        for (ray, id) in instance.iter().enumerate() {
            if wave.straight[ray] {
                continue;
            }
            let [org, dir] = [wave.rays.org(ray), wave.rays.dir(ray)].map(DVec3::from_array);
            let end = match *id == HitId::NONE.instance {
                true => f64::INFINITY,
                false => t[ray],
            };
            let from = wave.origin(ray);
            for (emitter, t, radiance) in emitters.panels_on(org, dir, end) {
                let [nx, ny, nz] = wave.normal.row(ray);
                let other = emitters.pdf::<f32>(
                    [emitter],
                    Vec3::from(from),
                    Vec3::new(nx, ny, nz),
                    Vec3::from(org + dir * t - from),
                );
                let part = share(wave.pdf[ray], other);
                let way = t * dir.length();
                let left = self.materials.left(&wave.media(ray as u32), way as f32);
                let weight = wave.rays.weight.row(ray);
                let pixel = wave.rays.pixel[ray];
                let light: Rgb = std::array::from_fn(|k| weight[k] * radiance[k] * part * left[k]);
                let slot = &mut film.slots[pixel as usize];
                for k in 0..3 {
                    slot[k] += light[k];
                }
                if let (Some(layers), Some(plan)) = (&mut film.layers, self.layers) {
                    let trail = &wave.trail(ray as u32);
                    let to = (trail, EMISSION, plan.of_emitter(emitter));
                    layers.add(plan, pixel, to, light);
                }
            }
        }
    }

    /// Adds the radiance of the hit surfaces that shine.
    pub(super) fn add_emission(
        &self,
        wave: &Paths,
        (samples, depth): (SampleNumbers, u32),
        (instance, primitive): (&[u64], &[u32]),
        buffer: &HitBuffer,
        film: &mut Film,
    ) {
        if !self.materials.any_shines {
            return;
        }
        for hit in 0..buffer.len() {
            let look = &self.materials.rows[self.materials.number(buffer.material[hit]) as usize];
            let Some(mut radiance) = look.shine() else {
                continue;
            };
            if let Some(varied) = &look.varied {
                radiance = self.shine_at((look, varied), (samples, depth), wave, (buffer, hit));
            }
            let ray = buffer.row[hit] as usize;
            if self.only_indirect && wave.straight[ray] {
                continue;
            }
            let own = wave.pdf[ray];
            let mut part = 1.0;
            if depth > 0 && own < f32::MAX && !look.material.layers.unlit {
                let point = buffer.point.get(hit);
                let emitter = self
                    .luminaires
                    .emitter_at(instance[ray], primitive[ray], point);
                let org = Vec3::<f64>::from(wave.origin(ray));
                let [nx, ny, nz] = wave.normal.row(ray);
                let other = self.luminaires.emitters.pdf::<f32>(
                    [emitter],
                    org,
                    Vec3::new(nx, ny, nz),
                    Vec3::<f64>::from(point) - org,
                );
                part = share(own, other);
            }
            let weight = wave.rays.weight.row(ray);
            let pixel = wave.rays.pixel[ray];
            let light: Rgb = std::array::from_fn(|k| weight[k] * radiance[k] * part);
            let slot = &mut film.slots[pixel as usize];
            for k in 0..3 {
                slot[k] += light[k];
            }
            if let (Some(layers), Some(plan)) = (&mut film.layers, self.layers) {
                let number = self.materials.number(buffer.material[hit]);
                let trail = &wave.trail(ray as u32);
                let to = (trail, EMISSION, plan.of_material(number));
                layers.add(plan, pixel, to, light);
            }
        }
    }

    /// Takes from all paths what the media on their way absorb (Beer and Lambert).
    pub(super) fn absorb(&self, wave: &mut Paths, buffer: &HitBuffer) {
        for hit in 0..buffer.len() {
            let ray = buffer.row[hit] as usize;
            let way = buffer.point.get(hit) - DVec3::from_array(wave.rays.org(ray));
            let left = self
                .materials
                .left(&wave.media(ray as u32), way.length() as f32);
            let weight = wave.rays.weight.row(ray);
            let left = std::array::from_fn(|k| weight[k] * left[k]);
            wave.rays.weight.set(ray, left);
        }
    }
}

/// Rounds directions to f32.
#[inline(always)]
pub(super) fn narrow<L: Lanes<Scalar = f32>>(v: Vec3<L::Double>) -> Vec3<L> {
    Vec3::new(L::narrow(v.x), L::narrow(v.y), L::narrow(v.z))
}
