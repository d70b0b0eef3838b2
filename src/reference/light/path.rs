//! The reference's paths: one ray after another.

use super::bsdf::Color;
use super::inside::Media;
use super::matter::Matter;
use super::rounding::Nudge;
use super::surface::Surface;
use super::{LightRay, LightReference, Path, Vertex};
use crate::Hit;
use glam::DVec3;

/// The number of a path's sample, and how often it was scattered before.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub pixel: [u32; 2],
    pub sample: u32,
    pub depth: u32,
}

/// A path that goes on.
#[derive(Clone, Debug)]
pub struct State {
    pub org: DVec3,
    pub dir: DVec3,
    pub weight: Color,
    /// The density with which scattering chose the direction; infinite where no light
    /// sampling competes.
    pub pdf: f64,
    /// The normal by which light was sampled where the ray left; zero for both sides.
    pub normal: DVec3,
    /// The factor by which refraction compressed radiance.
    pub compression: f64,
    pub media: Media,
    /// Where light was sampled that the ray may meet, if it has passed holes and panes since.
    pub origin: Option<DVec3>,
    /// Whether the path has come straight from the camera, through holes and panes.
    pub straight: bool,
}

impl State {
    /// Returns where light was sampled that the ray may meet.
    pub fn origin(&self) -> DVec3 {
        self.origin.unwrap_or(self.org)
    }
}

/// What a path does where its ray ends.
#[derive(Clone, Debug, Default)]
pub struct Step {
    /// What the pixel gets from the surface itself, or the sky.
    pub gained: Color,
    /// Not traced yet.
    pub light: Option<LightRay>,
    pub next: Option<State>,
}

/// The power heuristic (Veach 1997, section 9.2.4).
pub fn share(own: f64, other: f64) -> f64 {
    match own.is_finite() {
        true => own * own / (own * own + other * other),
        false => 1.0,
    }
}

pub fn times(a: Color, b: Color) -> Color {
    std::array::from_fn(|k| a[k] * b[k])
}

pub fn plus(a: Color, b: Color) -> Color {
    std::array::from_fn(|k| a[k] + b[k])
}

pub fn greatest(c: Color) -> f64 {
    c[0].max(c[1]).max(c[2])
}

impl LightReference<'_> {
    /// Traces the path of a pixel's sample.
    pub fn trace(&self, pixel: [u32; 2], sample: u32) -> Path {
        self.walk(pixel, sample, None, (0, Nudge::default()))
    }

    /// Traces a path; along the rays of `on` if there are some, which are then taken as they
    /// are, with their weights. The numbers of one depth are nudged.
    pub(super) fn walk(
        &self,
        pixel: [u32; 2],
        sample: u32,
        on: Option<&[Vertex]>,
        (at, nudge): (u32, Nudge),
    ) -> Path {
        let mut path = Path::default();
        let none = Nudge::default();
        let camera = if at == 0 { nudge.camera } else { [0.0; 2] };
        let mut waiting = Some(self.begin(pixel, sample, camera));
        for depth in 0..=self.settings.max_depth {
            let Some(mut state) = waiting else {
                break;
            };
            if let Some(on) = on {
                let Some(vertex) = on.get(depth as usize) else {
                    break;
                };
                state.org = DVec3::from_array(vertex.org);
                state.dir = DVec3::from_array(vertex.dir);
                state.weight = vertex.weight;
            }
            let place = Place {
                pixel,
                sample,
                depth,
            };
            let hit = self.nearest(&state);
            let nudge = if at == depth { nudge } else { none };
            let mut step = self.step(&state, place, hit.as_ref(), nudge);
            path.radiance = plus(path.radiance, step.gained);
            if let Some(light) = &mut step.light {
                let (blocked, arrives) = self.arriving(light);
                light.blocked = blocked;
                path.radiance = plus(path.radiance, arrives);
            }
            path.vertices.push(Vertex {
                org: state.org.to_array(),
                dir: state.dir.to_array(),
                weight: state.weight,
                met: hit.map(|hit| (hit.instance, hit.primitive)),
                light: step.light,
            });
            waiting = step.next;
        }
        path
    }

    pub(super) fn nearest(&self, state: &State) -> Option<Hit> {
        let (org, dir) = (state.org.to_array(), state.dir.to_array());
        self.reference.nearest(org, dir, f64::INFINITY)
    }

    /// Returns the camera ray of a pixel's sample, through a point of the pixel, which may be
    /// moved by parts of a pixel.
    pub(super) fn begin(&self, [x, y]: [u32; 2], sample: u32, moved: [f64; 2]) -> State {
        let [u, v, _, _] = self.sobol.pad([x, y], sample, 0);
        let camera = &self.settings.camera;
        let [width, height] = self.settings.size.map(f64::from);
        let ([dx, dy], weight) = self.filter.sample([u, v], sample);
        let across = 2.0 * (f64::from(x) + 0.5 + dx + moved[0]) / width - 1.0;
        let up = 1.0 - 2.0 * (f64::from(y) + 0.5 + dy + moved[1]) / height;
        let half = camera.projection.half_height();
        let aside = camera.right * (across * width / height * half) + camera.up * (up * half);
        let (org, dir) = match camera.projection.is_parallel() {
            false => (camera.eye, camera.forward + aside),
            true => (camera.eye + aside, camera.forward),
        };
        State {
            org,
            dir,
            weight: [weight; 3],
            pdf: f64::INFINITY,
            normal: DVec3::ZERO,
            compression: 1.0,
            media: self.around_eye.clone(),
            origin: None,
            straight: true,
        }
    }

    /// Continues a path at its ray's end.
    pub(super) fn step(
        &self,
        state: &State,
        place: Place,
        hit: Option<&Hit>,
        nudge: Nudge,
    ) -> Step {
        let Some(hit) = hit else {
            return Step {
                gained: self.sky(state, nudge.look),
                ..Step::default()
            };
        };
        let mut at = self.surface(state.org, state.dir, hit);
        at.lift(nudge.lift);
        let matter = &self.matter[at.material as usize];
        if matter.bsdf.transmits() {
            at.flatten();
        }
        let mut weight = state.weight;
        if let Some(medium) = state.media.innermost(&self.matter) {
            let way = at.point.distance(state.org);
            weight = times(weight, self.matter[medium as usize].left(way));
        }
        let state = &State {
            weight,
            ..state.clone()
        };
        let gained = self.emission(state, place.depth, (hit, &at, matter));
        let ends = matter.ends() && matter.opacity >= 1.0;
        if place.depth == self.settings.max_depth || ends {
            return Step {
                gained,
                ..Step::default()
            };
        }
        Step {
            gained,
            ..self.scatter(state, place, (&at, matter), nudge)
        }
    }

    fn sky(&self, state: &State, look: DVec3) -> Color {
        if let (true, Some(backdrop)) = (state.straight, self.settings.backdrop) {
            return times(state.weight, backdrop.map(f64::from));
        }
        let dir = (state.dir.normalize() + look).normalize();
        let (radiance, other) = self.emitters.sky(dir, state.origin(), state.normal);
        let part = share(state.pdf, other);
        times(state.weight, radiance.map(|c| c * part))
    }

    fn emission(
        &self,
        state: &State,
        depth: u32,
        (hit, at, matter): (&Hit, &Surface, &Matter),
    ) -> Color {
        if matter.shine == [0.0; 3] {
            return [0.0; 3];
        }
        let mut part = 1.0;
        if depth > 0 && state.pdf.is_finite() && !matter.unlit {
            let id = (hit.instance, hit.primitive);
            let from = (state.origin(), state.normal);
            let to = at.point - state.origin();
            part = share(state.pdf, self.emitters.pdf(id, from, to));
        }
        times(state.weight, matter.shine.map(|c| c * part))
    }

    /// Returns whether a ray towards light is blocked by anything, and what arrives by it:
    /// holes and smooth panes let a part pass (S76).
    pub(super) fn arriving(&self, light: &LightRay) -> (bool, Color) {
        if !self.reference.blocked(light.org, light.dir, light.t_max) {
            return (false, light.weight);
        }
        let mut weight = light.weight;
        let dir = DVec3::from_array(light.dir);
        let (mut org, mut end) = (DVec3::from_array(light.org), light.t_max);
        for _ in 0..MOST_PASSED {
            let Some(hit) = self.reference.nearest(org.to_array(), dir.to_array(), end) else {
                return (true, weight);
            };
            let at = self.surface(org, dir, &hit);
            let matter = &self.matter[at.material as usize];
            let cos = dir.normalize().dot(at.ns).abs();
            weight = times(weight, matter.straight(cos));
            org = at.leave(dir);
            end -= hit.t;
            if greatest(weight) <= 0.0 || end <= 0.0 {
                break;
            }
        }
        (true, [0.0; 3])
    }
}

/// Rays towards light pass no more surfaces than this.
const MOST_PASSED: usize = 65;
