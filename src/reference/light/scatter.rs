//! What a path of the reference does at a surface: it aims at a light, and goes on.

use super::bsdf::{Color, Sample};
use super::emitters::LightSample;
use super::inside::{Media, index};
use super::maps::Frame;
use super::matter::Matter;
use super::path::{Place, State, Step, greatest, share, times};
use super::rounding::Nudge;
use super::surface::Surface;
use super::{LightRay, LightReference};
use glam::DVec3;

/// Rays to a sampled point of a body end at this fraction of the way (S73).
const BODY_END: f64 = 1.0 - 1.0 / 65_536.0;

/// Paths that are scattered this often take part in Russian roulette (S74).
const ROULETTE_DEPTH: u32 = 3;

impl LightReference<'_> {
    /// Scatters a path at a surface.
    pub(super) fn scatter(
        &self,
        state: &State,
        place: Place,
        (at, matter): (&Surface, &Matter),
        nudge: Nudge,
    ) -> Step {
        let pad = |pad: u32| self.sobol.pad(place.pixel, place.sample, pad);
        let [u, v, lobe, roulette] = pad(2 + 2 * place.depth);
        let moved = |u: f64, by: f64| (u + by).clamp(0.0, 1.0);
        let mut lobe = moved(lobe, nudge.lobe);
        let mut behind = state.media.clone();
        let (mut eta, mut displaced) = (1.0, false);
        if matter.has_medium {
            let [near, far];
            (behind, [near, far]) = self.cross(&state.media, at);
            displaced = near == far;
            eta = index(&self.matter, far) / index(&self.matter, near);
        }
        let mut passes = displaced;
        if matter.opacity < 1.0 {
            passes |= lobe >= matter.opacity;
            lobe = (lobe / matter.opacity).min(1.0 - f64::from(f32::EPSILON));
        }
        if passes {
            let next = State {
                // Rays to lights do not pass the surfaces of displaced media.
                pdf: if displaced { f64::INFINITY } else { state.pdf },
                origin: Some(state.origin()),
                org: at.leave(state.dir),
                dir: state.dir.normalize(),
                media: behind,
                ..state.clone()
            };
            return Step {
                next: Some(next),
                ..Step::default()
            };
        }
        if matter.ends() {
            return Step::default();
        }
        let frame = Frame::of_half(at.ns, nudge.frame);
        let out = frame.to_local(-state.dir.normalize()) + nudge.turn;
        let shading = Shading {
            frame,
            out: out.normalize(),
            eta: eta * (1.0 + nudge.eta),
            at,
            matter,
        };
        let mut light = None;
        if !matter.bsdf.only_delta() && !self.emitters.is_empty() {
            let [u, v, pick, _] = pad(3 + 2 * place.depth);
            let from = (at.scattered(true, false), shading.light_normal());
            let aim = [moved(u, nudge.aim[0]), moved(v, nudge.aim[1])];
            let sample = self.emitters.sample(from, moved(pick, nudge.pick), aim);
            if let Some(mut sample) = sample {
                sample.dir += nudge.shift * sample.blur;
                light = shading.aim(&sample, state.weight, nudge.into);
                if let Some(ray) = &mut light {
                    let above = sample.dir.dot(at.facing) > 0.0 || at.curved;
                    let media = if above { &state.media } else { &behind };
                    if let Some(medium) = media.innermost(&self.matter) {
                        let way = match sample.far {
                            true => f64::INFINITY,
                            false => DVec3::from_array(ray.dir).length(),
                        };
                        ray.weight = times(ray.weight, self.matter[medium as usize].left(way));
                    }
                }
            }
        }
        let numbers = [moved(u, nudge.spread[0]), moved(v, nudge.spread[1])];
        let sample = matter.bsdf.sample(shading.eta, shading.out, numbers, lobe);
        let next = sample.and_then(|sample| {
            let roulette = (place.depth, roulette + nudge.roulette);
            shading.go_on(state, &sample, behind, roulette)
        });
        Step {
            gained: [0.0; 3],
            light,
            next,
        }
    }
}

/// A surface with directions in its frame.
struct Shading<'s> {
    frame: Frame,
    out: DVec3,
    eta: f64,
    at: &'s Surface,
    matter: &'s Matter,
}

impl Shading<'_> {
    /// Returns the normal by which light is sampled: none where light from both sides counts.
    fn light_normal(&self) -> DVec3 {
        match self.matter.bsdf.transmits() {
            true => DVec3::ZERO,
            false => self.at.ns,
        }
    }

    /// Returns the ray towards a light, unless no light would be scattered.
    fn aim(&self, light: &LightSample, weight: Color, nudge: DVec3) -> Option<LightRay> {
        let into = self.frame.to_local(light.dir.normalize()) + nudge;
        let above = light.dir.dot(self.at.facing) > 0.0 || self.at.curved;
        let shown = into.z > 0.0;
        let right = match self.matter.bsdf.transmits() {
            true => above == shown,
            false => above && shown,
        };
        if !right {
            return None;
        }
        let found = self.matter.bsdf.eval(self.eta, self.out, into);
        let part = match light.delta {
            true => 1.0,
            false => share(light.pdf, found.pdf),
        };
        let arriving = light.radiance.map(|c| c * part / light.pdf);
        let weight = times(times(weight, found.value), arriving);
        let org = self.at.scattered(above, false);
        let start = self.at.scattered(true, false);
        let (dir, t_max) = match light.far {
            true => (light.dir, f64::INFINITY),
            false => (start + light.dir - org, BODY_END),
        };
        (greatest(weight) > 0.0).then(|| LightRay {
            org: org.to_array(),
            dir: dir.to_array(),
            t_max,
            weight,
            blocked: false,
        })
    }

    /// Returns the path that goes on in a sampled direction, unless it ends.
    fn go_on(
        &self,
        state: &State,
        sample: &Sample,
        behind: Media,
        (depth, roulette): (u32, f64),
    ) -> Option<State> {
        let through = sample.through();
        let dir = self.frame.to_world(sample.into);
        // A shading normal may send a ray to the wrong side of the surface.
        let above = dir.dot(self.at.facing) > 0.0 || self.at.curved && !sample.delta && !through;
        if above == through {
            return None;
        }
        let mut weight = times(state.weight, sample.weight);
        let thin = self.matter.thin_walled;
        let mut compression = state.compression;
        if through && !thin {
            compression *= self.eta * self.eta;
        }
        if depth >= ROULETTE_DEPTH {
            let survival = (greatest(weight) * compression).sqrt().min(1.0);
            if roulette >= survival {
                return None;
            }
            weight = weight.map(|c| c / survival);
        }
        let straight = thin && through && sample.delta;
        (greatest(weight) > 0.0).then(|| State {
            org: self.at.scattered(above, sample.delta),
            dir,
            weight,
            pdf: match (straight, sample.delta) {
                (true, _) => state.pdf,
                (_, true) => f64::INFINITY,
                _ => sample.pdf,
            },
            normal: match straight {
                true => state.normal,
                false => self.light_normal(),
            },
            compression,
            media: if through { behind } else { state.media.clone() },
            origin: straight.then(|| state.origin()),
            straight: straight && state.straight,
        })
    }
}
