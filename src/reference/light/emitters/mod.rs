//! What shines in a scene, for the reference: lights, the sky, and emissive spheres, polygons
//! and meshes; the choice among them, samples of them, and their densities.

mod clusters;
mod gather;
mod importance;
mod shapes;
mod sky_map;
mod tree;

use crate::scene::Light;
use glam::DVec3;
use importance::{Chances, Pick, Receiver};
use shapes::{Aimed, Ball, Rectangle};
use sky_map::SkyMap;
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};
use tree::Tree;

use super::bsdf::Color;
use super::maps::{Frame, cap};
use super::rounding::ROUNDED;

/// More emitters with a place than this are chosen by a tree.
const FEW: usize = 16;

#[derive(Clone, Copy, Debug)]
pub enum Kind {
    Sphere(Ball),
    Triangle([DVec3; 3]),
    Rectangle(Rectangle),
    /// A point or spot light, of a radius or 0.
    Lamp {
        ball: Ball,
        /// Slope and start of a spot light's fade over the cosine to its axis.
        ramp: Option<[f64; 2]>,
        /// Whether it shines without decrease.
        constant: bool,
    },
}

/// What importances need to know.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    pub center: DVec3,
    pub radius: f64,
    /// Corners of a box.
    pub low: DVec3,
    pub high: DVec3,
    /// Normal of flat emitters, axis of spot lights.
    pub axis: DVec3,
    /// Radiance times area, area of the disc for spheres; intensity of lamps.
    pub power: f64,
}

/// An emitter with a place.
#[derive(Clone, Copy, Debug)]
pub struct Emitter {
    pub kind: Kind,
    /// Radiance, or intensity of lamps.
    pub light: Color,
    pub bounds: Bounds,
}

/// A directional light: a disc in the sky, or a point of it.
#[derive(Clone, Copy, Debug)]
struct Sun {
    towards: DVec3,
    /// 1 − cos of the half angle.
    versine: f64,
    irradiance: Color,
}

impl Sun {
    /// The radiance of the disc: the irradiance is π sin² of it.
    fn radiance(&self) -> Color {
        let facing = PI * self.versine * (2.0 - self.versine);
        self.irradiance.map(|e| e / facing)
    }

    fn has_disc(&self) -> bool {
        self.versine > 0.0
    }

    fn contains(&self, dir: DVec3) -> bool {
        self.has_disc() && (dir - self.towards).length_squared() <= 2.0 * self.versine
    }

    fn chance(&self, at: &Receiver) -> f64 {
        let mean = self.irradiance.iter().sum::<f64>() / 3.0;
        at.of_sun(self.towards, self.versine, mean)
    }
}

/// A sample of the light that arrives at a point.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// To the sampled point of the light; unit if it is infinitely far.
    pub dir: DVec3,
    pub far: bool,
    pub radiance: Color,
    /// Over solid angle, the probability of the pick included; that alone for points.
    pub pdf: f64,
    /// No ray meets the light.
    pub delta: bool,
    /// How far the point at the end of `dir` lies from where f32 may put it.
    pub blur: f64,
}

pub struct Emitters {
    near: Vec<Emitter>,
    /// Over `near`, if there are many.
    tree: Option<Tree>,
    suns: Vec<Sun>,
    background: Color,
    map: Option<SkyMap>,
    /// By instance, the way from a hit to its emitter.
    owners: HashMap<u64, gather::Owner>,
}

impl Emitters {
    pub fn is_empty(&self) -> bool {
        self.near.is_empty() && self.suns.is_empty() && self.sampled_sky().is_none()
    }

    /// Returns the environment map, if it is worth sampling.
    fn sampled_sky(&self) -> Option<&SkyMap> {
        self.map.as_ref().filter(|map| map.sampled_mean > 0.0)
    }

    fn chances(&self, at: &Receiver) -> Chances {
        let near = match &self.tree {
            None => self.near.iter().map(|one| at.importance(one)).collect(),
            // All together.
            Some(tree) => vec![tree.importance(at)],
        };
        // Of uniform radiance the irradiance is π times it.
        let sky = self.sampled_sky().map(|map| map.sampled_mean * PI);
        let far = self.suns.iter().map(|sun| sun.chance(at)).chain(sky);
        Chances::new(near, far.collect())
    }

    /// Samples a light for a point. The normal is zero if light counts from both sides.
    pub fn sample(
        &self,
        (point, normal): (DVec3, DVec3),
        pick: f64,
        u: [f64; 2],
    ) -> Option<LightSample> {
        let at = Receiver { point, normal };
        let (mut picked, mut chance) = self.chances(&at).pick(pick)?;
        if let (Some(tree), Pick::Near(_)) = (&self.tree, picked) {
            // What is left of the number, as the near ones come last.
            let (emitter, own) = tree.choose(&at, 1.0 - (1.0 - pick) / chance)?;
            (picked, chance) = (Pick::Near(emitter), chance * own);
        }
        let sample = match picked {
            Pick::Near(k) => self.sample_near(&self.near[k], point, u, chance)?,
            Pick::Far(k) => match (self.suns.get(k), self.sampled_sky()) {
                (Some(sun), _) => self.sample_sun(sun, &at, u, chance),
                (None, map) => self.sample_sky(map?, &at, u),
            },
        };
        let good = sample.radiance.iter().sum::<f64>() > 0.0 && sample.pdf > 0.0;
        (good && sample.dir != DVec3::ZERO).then_some(sample)
    }

    fn sample_near(
        &self,
        emitter: &Emitter,
        point: DVec3,
        u: [f64; 2],
        chance: f64,
    ) -> Option<LightSample> {
        let of = |Aimed { dir, pdf, blur }: Aimed, radiance: Color, delta: bool| LightSample {
            dir,
            far: false,
            radiance,
            pdf: pdf * chance,
            delta,
            blur,
        };
        Some(match emitter.kind {
            Kind::Sphere(ball) => of(ball.seen_from(point).sample(u), emitter.light, false),
            Kind::Triangle(corners) => {
                let aimed = shapes::sample_triangle(corners.map(|p| p - point), u)?;
                of(aimed, emitter.light, false)
            }
            Kind::Rectangle(it) => of(it.seen_from(point).sample(u)?, emitter.light, false),
            Kind::Lamp {
                ball,
                ramp,
                constant,
            } => {
                let ball = ball.seen_from(point);
                let square = ball.center.length_squared().max(1e-300);
                let cos = -ball.center.dot(emitter.bounds.axis) / square.sqrt();
                let fade = ramp.map_or(1.0, |[slope, start]| {
                    (start + cos * slope).clamp(0.0, 1.0).powi(2)
                });
                if ball.radius > 0.0 {
                    // A ball's radiance is intensity/πr²; without decrease the irradiance is
                    // π sin² of it.
                    let disc = match constant {
                        true => ball.sin2(),
                        false => ball.radius * ball.radius,
                    };
                    let radiance = emitter.light.map(|x| x * fade / (PI * disc));
                    return Some(of(ball.sample(u), radiance, true));
                }
                let decrease = if constant { 1.0 } else { 1.0 / square };
                let aimed = Aimed {
                    dir: ball.center,
                    pdf: 1.0,
                    blur: 0.0,
                };
                of(aimed, emitter.light.map(|x| x * fade * decrease), true)
            }
        })
    }

    fn sample_sun(&self, sun: &Sun, at: &Receiver, [u, v]: [f64; 2], chance: f64) -> LightSample {
        let dir = Frame::about(sun.towards).to_world(cap(u * sun.versine, v));
        let (radiance, pdf) = match sun.has_disc() {
            true => self.sky(dir, at.point, at.normal),
            false => (sun.irradiance, chance),
        };
        LightSample {
            dir,
            far: true,
            radiance,
            pdf,
            delta: !sun.has_disc(),
            blur: ROUNDED,
        }
    }

    fn sample_sky(&self, map: &SkyMap, at: &Receiver, u: [f64; 2]) -> LightSample {
        let dir = map.sample(u);
        let (radiance, pdf) = self.sky(dir, at.point, at.normal);
        LightSample {
            dir,
            far: true,
            radiance,
            pdf,
            delta: false,
            blur: ROUNDED,
        }
    }

    /// Returns the density with which a hit's emitter would have been sampled in `dir`, the
    /// vector from the point to the hit.
    pub fn pdf(
        &self,
        (instance, primitive): (u64, u32),
        (point, normal): (DVec3, DVec3),
        dir: DVec3,
    ) -> f64 {
        let Some(k) = self.owner(instance, primitive, point + dir) else {
            return 0.0;
        };
        let of = match self.near[k].kind {
            Kind::Sphere(ball) => ball.seen_from(point).pdf(dir),
            Kind::Triangle(corners) => shapes::triangle_pdf(corners.map(|p| p - point)),
            Kind::Rectangle(it) => it.seen_from(point).pdf(dir),
            Kind::Lamp { .. } => 0.0,
        };
        let at = Receiver { point, normal };
        let chances = self.chances(&at);
        let chance = match &self.tree {
            None => chances.of_near(k),
            Some(tree) => chances.of_near(0) * tree.chance(&at, k),
        };
        let pdf = of * chance;
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    /// Returns the radiance from where nothing lies, and the density of sampling it.
    pub fn sky(&self, dir: DVec3, point: DVec3, normal: DVec3) -> (Color, f64) {
        let (mut radiance, mut pdf) = (self.background, 0.0);
        if let Some(map) = &self.map {
            radiance = map.radiance(dir);
        }
        let in_sun = self.suns.iter().any(|sun| sun.contains(dir));
        if !in_sun && self.sampled_sky().is_none() {
            return (radiance, pdf);
        }
        let chances = self.chances(&Receiver { point, normal });
        if let Some(map) = self.sampled_sky() {
            pdf += chances.of_far(self.suns.len()) * map.pdf(dir);
        }
        for (k, sun) in self.suns.iter().enumerate() {
            if sun.contains(dir) {
                let own = sun.radiance();
                radiance = std::array::from_fn(|c| radiance[c] + own[c]);
                pdf += chances.of_far(k) / (TAU * sun.versine);
            }
        }
        (radiance, pdf)
    }
}

impl Ball {
    fn seen_from(mut self, point: DVec3) -> Ball {
        self.center -= point;
        self
    }
}
