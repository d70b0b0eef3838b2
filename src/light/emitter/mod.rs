//! Emitters: what shines in a scene, and how next-event estimation samples it.
//!
//! [`Emitters::sample`] picks an emitter for each point with a probability that follows its
//! importance there ([`importance`]), and a direction to it. [`Emitters::pdf`] and
//! [`Emitters::sky`] tell with what density it would have made a direction that a ray has
//! taken by itself, for multiple importance sampling. Nothing here knows of visibility.
//!
//! - Bodies (spheres, triangles, rectangles; two-sided) are sampled uniformly over the solid
//!   angle that they subtend.
//! - Rectangles and discs of the table are no bodies of the scene: scattered rays look for them
//!   ([`Emitters::panels_on`]) and camera rays do not. Rectangles are sampled as
//!   bodies are, discs by [`disc`]; most shine on one side.
//! - Point and spot lights have no body that a ray could meet: without radius they are deltas,
//!   with one they are balls that only this sampling finds.
//! - What is infinitely far (the environment, suns) is one mixture of densities: whichever of
//!   them made a direction, the radiance is that of all of them together, and so is the density.
//!
//! Constant skies are not sampled: BSDF sampling does it as well.

mod body;
mod directions;
mod disc;
mod few;
mod importance;
mod place;
mod rectangle;
mod sphere;
mod sun;
#[cfg(test)]
pub(crate) mod tests;
mod tree;
mod tree_build;
mod triangle;

use crate::environment::{Compensation, SkyMap};
pub use body::{Body, Emitter};
use body::{Prepared, prepare, sides};
use few::Chances;
use glam::DVec3;
use importance::{Bounds, Facing, Receiver};
use lanecast_model::scene::{Environment, Rgb};
use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::lanes::{Lanes, Mask};
use place::{Place, Row};
use std::f64::consts::PI;
use std::sync::Arc;
use sun::Sun;

/// The id of no emitter.
pub const NONE: u32 = u32::MAX;

/// Directions from points to the lights that were picked for them.
#[derive(Clone, Copy, Debug)]
pub struct LightSample<L: Lanes> {
    /// Lanes that have a sample; in others all else is meaningless but never NaN.
    pub some: L::Mask,
    /// The emitter's id; that of the environment is their count.
    pub emitter: L::Ids,
    /// From the point to the sampled point of the light, which lies at t = 1; of unit length
    /// if the light is infinitely far.
    pub dir: Vec3<L::Double>,
    pub far: L::Mask,
    /// The radiance that arrives without obstacles; of a delta light the irradiance on a
    /// surface that faces it.
    pub radiance: [L; 3],
    /// The density over solid angle, the probability of the pick included; that probability
    /// alone for delta lights.
    pub pdf: L,
    /// Lanes whose light no ray meets, so that the weight of this sample is 1: points, spots,
    /// and suns without extent; also points and spots with a radius, which have a density.
    pub delta: L::Mask,
}

/// How an emitter is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// A degenerate or black one, which is never picked.
    Nothing,
    Sphere,
    Triangle,
    Rectangle,
    /// A point or spot light without extent.
    Point,
    /// A point or spot light with a radius.
    Ball,
    /// A rectangle or disc that no ray meets.
    Panel,
    Disc,
    /// A directional light without extent, or a disc in the sky.
    Sun,
    /// The environment, whose id is the count of emitters.
    Sky,
}

/// Scattered rays look for at most this many rectangles and discs of the table.
const MOST_PANELS: usize = 64;

/// The number of kinds.
const KINDS: usize = Kind::Sky as usize + 1;

/// The emitters of a scene, prepared for sampling.
#[derive(Clone, Debug)]
pub struct Emitters {
    kinds: Vec<Kind>,
    rows: Vec<Row>,
    /// Radiance of bodies and balls; intensity of points.
    light: Vec<Rgb>,
    facing: Vec<Facing>,
    /// Ids of emitters with a place that shine.
    local: Vec<u32>,
    bounds: Vec<Bounds>,
    /// Over `local`, if there are many.
    tree: Option<tree::Tree>,
    /// The place in `local` of each id, [`NONE`] for others.
    slots: Vec<u32>,
    /// Ids of the rectangles and discs of the table.
    panels: Vec<u32>,
    suns: Vec<Sun>,
    sky: Option<Arc<SkyMap>>,
    background: Rgb,
    /// The mean irradiance that the sampled part of the environment brings, 0 for none.
    sky_irradiance: f32,
}

impl Emitters {
    /// Prepares emitters, whose ids are their places in the list. Degenerate and black ones
    /// keep their ids and are never sampled. The background is the radiance of a sky without
    /// an environment.
    pub fn new(
        emitters: Vec<Emitter>,
        environment: Option<&Environment>,
        background: Rgb,
    ) -> Emitters {
        Emitters::with_compensation(emitters, environment, background, Compensation::Compensated)
    }

    /// As [`Emitters::new`], with a choice how the environment is sampled.
    pub fn with_compensation(
        emitters: Vec<Emitter>,
        environment: Option<&Environment>,
        background: Rgb,
        compensation: Compensation,
    ) -> Emitters {
        // Scattered rays alone find a sky of one radiance best.
        let uniform = environment.and_then(Environment::uniform_radiance);
        let background = uniform.unwrap_or(background);
        let environment = environment.filter(|_| uniform.is_none());
        let sky = environment.map(|map| Arc::new(SkyMap::new(map, compensation)));
        Emitters::under(sky, emitters, background)
    }

    /// Prepares other emitters under the same sky, which they share.
    pub fn under_same_sky(&self, emitters: Vec<Emitter>) -> Emitters {
        Emitters::under(self.sky.clone(), emitters, self.background)
    }

    fn under(sky: Option<Arc<SkyMap>>, emitters: Vec<Emitter>, background: Rgb) -> Emitters {
        let mut all = Emitters {
            kinds: Vec::with_capacity(emitters.len()),
            rows: Vec::with_capacity(emitters.len()),
            light: Vec::with_capacity(emitters.len()),
            facing: Vec::with_capacity(emitters.len()),
            local: Vec::new(),
            bounds: Vec::new(),
            tree: None,
            slots: Vec::with_capacity(emitters.len()),
            panels: Vec::new(),
            suns: Vec::new(),
            background,
            // Of uniform radiance the irradiance is π times it.
            sky_irradiance: sky
                .as_ref()
                .map_or(0.0, |sky| sky.sampled_mean() * PI as f32),
            sky,
        };
        for (id, emitter) in (0..).zip(&emitters) {
            all.add(id, emitter);
        }
        if all.local.len() > few::FEW {
            let boxes = all
                .local
                .iter()
                .map(|&id| sides(&emitters[id as usize].body));
            let boxes: Vec<_> = boxes.collect();
            all.tree = Some(tree_build::build(&all.bounds, &boxes));
        }
        all
    }

    /// Returns the number of emitters, which is the id of the environment.
    pub fn count(&self) -> usize {
        self.kinds.len()
    }

    /// Whether nothing can be sampled.
    pub fn is_empty(&self) -> bool {
        self.local.is_empty() && self.far_count() == 0
    }

    /// Says whether scattered rays may meet a rectangle or disc of the table.
    pub fn has_panels(&self) -> bool {
        !self.panels.is_empty() && self.meets_panels()
    }

    /// Says whether scattered rays have to look for rectangles and discs of the table
    /// ([`Emitters::panels_on`]); many are found by sampling alone.
    pub fn meets_panels(&self) -> bool {
        self.panels.len() <= MOST_PANELS
    }

    /// Lists the rectangles and discs of the table that a ray meets on a side that shines,
    /// before t: their ids, t and radiance.
    pub fn panels_on(
        &self,
        org: DVec3,
        dir: DVec3,
        before: f64,
    ) -> impl Iterator<Item = (u32, f64, Rgb)> {
        let some = match self.meets_panels() {
            true => &self.panels[..],
            false => &[],
        };
        some.iter().filter_map(move |&id| {
            let (row, kind) = (&self.rows[id as usize], self.kinds[id as usize]);
            let [u, v, n, origin] = [row.u, row.v, row.n, row.origin].map(DVec3::from_array);
            let along = dir.dot(n);
            if along >= 0.0 && self.facing[id as usize] == Facing::Front {
                return None;
            }
            let t = (origin - org).dot(n) / along;
            let at = org + dir * t - origin;
            let (x, y) = (at.dot(u), at.dot(v));
            let within = match kind {
                Kind::Disc => x * x + y * y <= row.s * row.s,
                _ => x >= 0.0 && y >= 0.0 && x <= row.s && y <= row.t,
            };
            (t > 0.0 && t < before && within).then(|| (id, t, self.light[id as usize]))
        })
    }

    /// Returns the weights of the second and third corner of a triangle at a point of it, and
    /// twice its area.
    pub fn on_triangle(&self, id: u32, point: DVec3) -> ([f64; 2], f64) {
        let row = &self.rows[id as usize];
        let [u, v, n, origin] = [row.u, row.v, row.n, row.origin].map(DVec3::from_array);
        let at = (point - origin) / n.length();
        let n = n.normalize_or_zero();
        let weights = [at.cross(v).dot(n), u.cross(at).dot(n)];
        (weights.map(|x| x.clamp(0.0, 1.0)), u.cross(v).length())
    }

    /// Returns the cosine between a direction and the normal of a flat emitter, at least 0.
    pub fn cosine(&self, id: u32, dir: DVec3) -> f64 {
        let n = DVec3::from_array(self.rows[id as usize].n);
        dir.normalize_or_zero().dot(n.normalize_or_zero()).abs()
    }

    /// Counts the emitters that are sampled, by kind.
    pub fn counts(&self) -> Vec<(&'static str, usize)> {
        let named = [
            (Kind::Sphere, "sphere"),
            (Kind::Triangle, "triangle"),
            (Kind::Rectangle, "rectangle"),
            (Kind::Point, "point"),
            (Kind::Ball, "ball"),
            (Kind::Panel, "rectangle of light"),
            (Kind::Disc, "disc of light"),
            (Kind::Sun, "sun"),
        ];
        let count = |kind: Kind| self.kinds.iter().filter(|k| **k == kind).count();
        let counts = named.map(|(kind, name)| (name, count(kind)));
        counts.into_iter().filter(|(_, n)| *n > 0).collect()
    }

    /// Says whether emitters are chosen by a tree, and not one by one.
    pub fn has_tree(&self) -> bool {
        self.tree.is_some()
    }

    /// Says whether the environment is sampled; even ones are not.
    pub fn samples_sky(&self) -> bool {
        self.sky_irradiance > 0.0
    }

    /// Returns the bytes of all tables.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.kinds)
            + size_of_val(&*self.rows)
            + size_of_val(&*self.light)
            + size_of_val(&*self.facing)
            + size_of_val(&*self.local)
            + size_of_val(&*self.slots)
            + size_of_val(&*self.bounds)
            + self.tree.as_ref().map_or(0, tree::Tree::bytes)
            + self.sky.as_ref().map_or(0, |sky| sky.bytes())
    }

    /// Returns how many infinitely far lights are sampled.
    fn far_count(&self) -> usize {
        self.suns.len() + usize::from(self.sky_irradiance > 0.0)
    }

    /// Returns the id of sun k, or of the environment after the last sun.
    fn far_id(&self, k: usize) -> u32 {
        self.suns
            .get(k)
            .map_or(self.kinds.len() as u32, |sun| sun.id)
    }

    fn add(&mut self, id: u32, emitter: &Emitter) {
        let Prepared {
            kind,
            row,
            light,
            bounds,
        } = prepare(emitter);
        let black = light.iter().all(|&x| x <= 0.0) || light.iter().any(|x| !x.is_finite());
        let kind = if black { Kind::Nothing } else { kind };
        self.facing.push(bounds.facing);
        let has_place = !matches!(kind, Kind::Nothing | Kind::Sun | Kind::Sky);
        let slot = if has_place {
            self.local.len() as u32
        } else {
            NONE
        };
        self.slots.push(slot);
        match kind {
            Kind::Nothing | Kind::Sky => {}
            Kind::Sun => self.suns.push(Sun::new(id, &row, light)),
            _ => {
                self.local.push(id);
                self.bounds.push(bounds);
                if matches!(kind, Kind::Panel | Kind::Disc) {
                    self.panels.push(id);
                }
            }
        }
        self.kinds.push(kind);
        self.rows.push(row);
        self.light.push(light);
    }

    /// Samples a light for each active lane. `normal` is the shading normal on the side from
    /// which light counts, zero if it counts from both. `pick` selects the emitter, `u` the
    /// direction; all are in [0, 1).
    #[inline(always)]
    pub fn sample<L: Lanes<Scalar = f32>>(
        &self,
        point: Vec3<L::Double>,
        normal: Vec3<L>,
        active: L::Mask,
        pick: L,
        u: [L; 2],
    ) -> LightSample<L> {
        let mut sample = LightSample {
            some: L::Mask::splat(false),
            emitter: L::ids(NONE),
            dir: Vec3::new(
                L::Double::splat(0.0),
                L::Double::splat(0.0),
                L::Double::splat(1.0),
            ),
            far: L::Mask::splat(false),
            radiance: [L::zero(); 3],
            pdf: L::splat(1.0),
            delta: L::Mask::splat(false),
        };
        if self.is_empty() || active.none() {
            return sample;
        }
        let receiver = Receiver::new(point, normal);
        let chances = Chances::of(self, &receiver);
        let (ids, chance) = chances.choose(self, &receiver, active, pick);
        sample.emitter = ids;
        sample.pdf = chance;
        let kinds = self.kinds_of::<L>(ids);
        // Without rows only the environment is there, which needs none.
        let place = Place::<L>::gather(&self.rows, ids, point);
        let light = self.light_of::<L>(ids);
        if kinds.any(Kind::Triangle) {
            sample.triangle(kinds.mask::<L>(Kind::Triangle), &place, light, u);
        }
        if kinds.any(Kind::Rectangle) {
            sample.rectangle(kinds.mask::<L>(Kind::Rectangle), &place, light, u);
        }
        if kinds.any(Kind::Sphere) {
            sample.sphere(kinds.mask::<L>(Kind::Sphere), &place, light, u);
        }
        if kinds.any(Kind::Ball) || kinds.any(Kind::Point) {
            let [ball, point] = [Kind::Ball, Kind::Point].map(|kind| kinds.mask::<L>(kind));
            self.ball(&mut sample, ball, point, &place, light, u);
        }
        if kinds.any(Kind::Panel) || kinds.any(Kind::Disc) {
            let [panel, disc] = [Kind::Panel, Kind::Disc].map(|kind| kinds.mask::<L>(kind));
            self.flat(&mut sample, panel, disc, &place, light, u);
        }
        if kinds.any(Kind::Sun) || kinds.any(Kind::Sky) {
            let [sun, sky] = [Kind::Sun, Kind::Sky].map(|kind| kinds.mask::<L>(kind));
            self.far(&mut sample, sun, sky, &place, light, &receiver, &chances, u);
        }
        // What is black, in an emitter's own plane, or beyond f32 brings no light.
        let [r, g, b] = sample.radiance;
        let most = L::splat(f32::MAX);
        let shines = (r + g + b).gt(L::zero()) & (r + g + b).le(most);
        let dense = sample.pdf.gt(L::zero()) & sample.pdf.le(most);
        let length = L::narrow(sample.dir.max_abs());
        sample.some = sample.some & active & shines & dense & length.gt(L::zero());
        let bright = |x| L::select(sample.some, x, L::zero());
        sample.radiance = sample.radiance.map(bright);
        sample.pdf = L::select(sample.some, sample.pdf, L::splat(1.0));
        sample
    }

    /// Returns the density with which [`Emitters::sample`] would have made `dir`, the vector
    /// from the point to where it meets the emitter; 0 where it never would, and for
    /// [`NONE`].
    #[inline(always)]
    pub fn pdf<L: Lanes<Scalar = f32>>(
        &self,
        ids: L::Ids,
        point: Vec3<L::Double>,
        normal: Vec3<L>,
        dir: Vec3<L::Double>,
    ) -> L {
        let kinds = self.kinds_of::<L>(ids);
        let bodies = [
            Kind::Triangle,
            Kind::Rectangle,
            Kind::Sphere,
            Kind::Panel,
            Kind::Disc,
        ];
        if self.is_empty() || !bodies.iter().any(|&kind| kinds.any(kind)) {
            return L::zero();
        }
        let receiver = Receiver::new(point, normal);
        let place = Place::<L>::gather(&self.rows, ids, point);
        let mut pdf = L::zero();
        if kinds.any(Kind::Triangle) {
            let of = L::splat(1.0) / triangle::Seen::of(&place).angle;
            pdf = L::select(kinds.mask::<L>(Kind::Triangle), of, pdf);
        }
        if kinds.any(Kind::Rectangle) {
            let of = rectangle::Seen::of(&place).pdf(&place, dir);
            pdf = L::select(kinds.mask::<L>(Kind::Rectangle), of, pdf);
        }
        if kinds.any(Kind::Panel) {
            let of = rectangle::Seen::of(&place).pdf(&place, dir);
            pdf = L::select(kinds.mask::<L>(Kind::Panel), of, pdf);
        }
        if kinds.any(Kind::Disc) {
            let of = disc::pdf(&place, dir);
            pdf = L::select(kinds.mask::<L>(Kind::Disc), of, pdf);
        }
        if kinds.any(Kind::Sphere) {
            let of = sphere::Seen::of(&place).pdf(&place, dir);
            pdf = L::select(kinds.mask::<L>(Kind::Sphere), of, pdf);
        }
        let pdf = pdf * Chances::of(self, &receiver).of_local(self, &receiver, ids);
        let good = pdf.gt(L::zero()) & pdf.le(L::splat(f32::MAX));
        L::select(good, pdf, L::zero())
    }

    /// Returns the radiance from a direction in which nothing lies, and the density with which
    /// [`Emitters::sample`] would have made it for this point and normal.
    #[inline(always)]
    pub fn sky<L: Lanes<Scalar = f32>>(
        &self,
        dir: Vec3<L>,
        point: Vec3<L::Double>,
        normal: Vec3<L>,
    ) -> ([L; 3], L) {
        if self.sky_irradiance == 0.0 && self.suns.iter().all(|sun| sun.versine == 0.0) {
            return (self.sky_radiance(dir), L::zero());
        }
        let receiver = Receiver::new(point, normal);
        self.sky_with(dir, &receiver, &Chances::of(self, &receiver))
    }

    /// Returns the radiance from a direction in which nothing lies.
    #[inline(always)]
    pub fn sky_radiance<L: Lanes<Scalar = f32>>(&self, dir: Vec3<L>) -> [L; 3] {
        let sky = match &self.sky {
            Some(sky) => sky.radiance(dir),
            None => self.background.map(L::splat),
        };
        self.with_suns(dir, sky)
    }

    /// Lists the suns whose discs a direction lies in: their ids and radiance.
    pub fn suns_at(&self, dir: [f32; 3]) -> impl Iterator<Item = (u32, Rgb)> {
        let dir = Vec3::new(dir[0], dir[1], dir[2]);
        let suns = self.suns.iter().filter(|sun| sun.versine > 0.0);
        suns.filter(move |sun| sun.contains::<f32>(dir).any())
            .map(|sun| (sun.id, sun.radiance))
    }

    /// Adds the suns' discs to the radiance of the sky.
    #[inline(always)]
    fn with_suns<L: Lanes<Scalar = f32>>(&self, dir: Vec3<L>, mut radiance: [L; 3]) -> [L; 3] {
        for sun in self.suns.iter().filter(|sun| sun.versine > 0.0) {
            let within = sun.contains(dir);
            for (sum, light) in radiance.iter_mut().zip(sun.radiance) {
                *sum = *sum + L::select(within, L::splat(light), L::zero());
            }
        }
        radiance
    }

    #[inline(always)]
    fn sky_with<L: Lanes<Scalar = f32>>(
        &self,
        dir: Vec3<L>,
        receiver: &Receiver<L>,
        chances: &Chances<L>,
    ) -> ([L; 3], L) {
        let (radiance, mut pdf) = match &self.sky {
            Some(sky) if self.sky_irradiance > 0.0 => {
                let (radiance, pdf) = sky.radiance_and_pdf(dir);
                (
                    radiance,
                    pdf * chances.of_far(self, receiver, self.suns.len()),
                )
            }
            Some(sky) => (sky.radiance(dir), L::zero()),
            None => (self.background.map(L::splat), L::zero()),
        };
        for (k, sun) in self.suns.iter().enumerate() {
            if sun.versine > 0.0 {
                let of = chances.of_far(self, receiver, k) * L::splat(sun.pdf);
                pdf = pdf + L::select(sun.contains(dir), of, L::zero());
            }
        }
        (self.with_suns(dir, radiance), pdf)
    }

    #[inline(always)]
    fn kinds_of<L: Lanes>(&self, ids: L::Ids) -> Kinds {
        let mut bits = [0; KINDS];
        for (lane, &id) in ids.as_ref().iter().enumerate() {
            let kind = match self.kinds.get(id as usize) {
                Some(&kind) => kind,
                None if id as usize == self.kinds.len() => Kind::Sky,
                None => Kind::Nothing,
            };
            bits[kind as usize] |= 1 << lane;
        }
        Kinds(bits)
    }

    #[inline(always)]
    fn light_of<L: Lanes<Scalar = f32>>(&self, ids: L::Ids) -> [L; 3] {
        let ids = ids.as_ref();
        let of = |i: usize| self.light.get(ids[i] as usize).copied().unwrap_or_default();
        let Vec3 { x, y, z } = Vec3::of_lanes(of);
        [x, y, z]
    }
}

/// The lanes of each kind, as bits.
#[derive(Clone, Copy, Debug)]
struct Kinds([u32; KINDS]);

impl Kinds {
    #[inline(always)]
    fn any(self, kind: Kind) -> bool {
        self.0[kind as usize] != 0
    }

    #[inline(always)]
    fn mask<L: Lanes>(self, kind: Kind) -> L::Mask {
        L::Mask::from_bits(self.0[kind as usize])
    }
}
