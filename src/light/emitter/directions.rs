//! Sampled directions to each kind of emitter, in the lanes that picked one of it.

use super::few::Chances;
use super::importance::{Facing, Receiver};
use super::place::{Place, narrow};
use super::{Emitters, LightSample, disc, rectangle, sphere, sun, triangle};
use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::lanes::{Lanes, Mask};
use std::f64::consts::PI;

impl Emitters {
    #[inline(always)]
    pub(super) fn ball<L: Lanes<Scalar = f32>>(
        &self,
        sample: &mut LightSample<L>,
        ball: L::Mask,
        point: L::Mask,
        place: &Place<L>,
        light: [L; 3],
        u: [L; 2],
    ) {
        let one = L::Double::splat(1.0);
        let to = place.origin;
        let square = to.length_squared().max(L::Double::splat(1e-300));
        let (slope, start, constant) = self.facing_of::<L>(sample.emitter);
        // A spot light's fade; of all others the ramp is 1.
        let cos = -(to.dot(place.n) / square.sqrt());
        let ramp = (cos * slope + start).max(L::Double::splat(0.0)).min(one);
        let fade = L::narrow(ramp * ramp);
        let decrease = L::narrow(L::Double::select(constant, one, one / square));
        let mut dir = to;
        let mut factor = decrease * fade;
        let mut pdf = L::splat(1.0);
        if ball.any() {
            let seen = sphere::Seen::of(place);
            let on_ball = seen.sample(place, u);
            let mask = <L::Double as Lanes>::Mask::from_bits(ball.bits());
            dir = Vec3::select(mask, on_ball, dir);
            // The ball's radiance is intensity/πr²; without decrease irradiance/(π sin²).
            let disc = L::Double::select(constant, seen.sin_squared, place.s * place.s);
            let radiance = L::narrow(one / (disc * L::Double::splat(PI))) * fade;
            factor = L::select(ball, radiance, factor);
            pdf = L::select(ball, seen.pdf(place, on_ball), pdf);
        }
        sample.put(ball | point, dir, light.map(|x| x * factor), pdf);
        sample.delta = sample.delta | ball | point;
    }

    /// Samples rectangles and discs of the table.
    #[inline(always)]
    pub(super) fn flat<L: Lanes<Scalar = f32>>(
        &self,
        sample: &mut LightSample<L>,
        panel: L::Mask,
        disc: L::Mask,
        place: &Place<L>,
        light: [L; 3],
        u: [L; 2],
    ) {
        let mut one_sided = 0;
        for (lane, &id) in sample.emitter.as_ref().iter().enumerate() {
            let is_front = self.facing.get(id as usize) == Some(&Facing::Front);
            one_sided |= u32::from(is_front) << lane;
        }
        if panel.any() {
            sample.rectangle(panel, place, light, u);
        }
        if disc.any() {
            let (dir, within, pdf) = disc::sample(place, u);
            sample.put(disc & within, dir, light, pdf);
        }
        let both = panel | disc;
        let front = sample.dir.dot(place.n).lt(L::Double::zero());
        let front = L::Mask::from_bits(front.bits() | !one_sided);
        sample.some = sample.some & (front | !both);
        if !self.meets_panels() {
            sample.delta = sample.delta | both;
        }
    }

    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    pub(super) fn far<L: Lanes<Scalar = f32>>(
        &self,
        sample: &mut LightSample<L>,
        sun: L::Mask,
        sky: L::Mask,
        place: &Place<L>,
        light: [L; 3],
        receiver: &Receiver<L>,
        chances: &Chances<L>,
        u: [L; 2],
    ) {
        let mask = sun | sky;
        let mut dir = sun::sample(place, u);
        if let (true, Some(map)) = (sky.any(), &self.sky) {
            let to = map.sample(u);
            let to = Vec3::new(to.x.widen(), to.y.widen(), to.z.widen());
            let in_sky = <L::Double as Lanes>::Mask::from_bits(sky.bits());
            dir = Vec3::select(in_sky, to, dir);
        }
        // Of deltas the sample is what the light says, of all else what the sky there is.
        let disc = L::narrow(place.s).gt(L::zero()) | sky;
        let (radiance, pdf) = self.sky_with(narrow(dir), receiver, chances);
        let radiance = std::array::from_fn(|c| L::select(disc, radiance[c], light[c]));
        let pdf = L::select(disc, pdf, sample.pdf);
        sample.put(mask, dir, radiance, L::splat(1.0));
        sample.pdf = L::select(mask, pdf, sample.pdf);
        sample.far = sample.far | mask;
        sample.delta = sample.delta | (mask & !disc);
    }

    /// Returns slope and start of the spot lights' ramps, and lanes without decrease.
    #[inline(always)]
    #[allow(clippy::type_complexity)]
    pub(super) fn facing_of<L: Lanes<Scalar = f32>>(
        &self,
        ids: L::Ids,
    ) -> (L::Double, L::Double, <L::Double as Lanes>::Mask) {
        let mut ramp = [
            L::Double::splat(0.0).to_array(),
            L::Double::splat(1.0).to_array(),
        ];
        let mut constant = 0;
        for (lane, &id) in ids.as_ref().iter().enumerate() {
            match self.facing.get(id as usize) {
                Some(&Facing::Spot { .. }) => {
                    let row = &self.rows[id as usize];
                    ramp[0].as_mut()[lane] = row.u[0];
                    ramp[1].as_mut()[lane] = row.u[1];
                }
                Some(Facing::Everywhere) => constant |= 1 << lane,
                _ => {}
            }
        }
        let [slope, start] = ramp.map(|x| L::Double::load(x.as_ref()));
        (
            slope,
            start,
            <L::Double as Lanes>::Mask::from_bits(constant),
        )
    }
}

impl<L: Lanes<Scalar = f32>> LightSample<L> {
    #[inline(always)]
    pub(super) fn triangle(&mut self, mask: L::Mask, place: &Place<L>, light: [L; 3], u: [L; 2]) {
        let seen = triangle::Seen::of(place);
        let [a, b] = seen.sample(u).map(L::widen);
        let dir = place.origin + place.u * a + place.v * b;
        self.put(mask, dir, light, L::splat(1.0) / seen.angle);
    }

    #[inline(always)]
    pub(super) fn rectangle(&mut self, mask: L::Mask, place: &Place<L>, light: [L; 3], u: [L; 2]) {
        let seen = rectangle::Seen::of(place);
        let [a, b] = seen.sample(u).map(L::widen);
        let dir = place.origin + place.u * (a * place.s) + place.v * (b * place.t);
        let some = mask & seen.angle.gt(L::zero());
        self.put(some, dir, light, seen.pdf(place, dir));
    }

    #[inline(always)]
    pub(super) fn sphere(&mut self, mask: L::Mask, place: &Place<L>, light: [L; 3], u: [L; 2]) {
        let seen = sphere::Seen::of(place);
        let dir = seen.sample(place, u);
        self.put(mask, dir, light, seen.pdf(place, dir));
    }

    /// Puts samples into some lanes; the density is multiplied by what is there, the
    /// probability of the pick.
    #[inline(always)]
    pub(super) fn put(&mut self, mask: L::Mask, dir: Vec3<L::Double>, radiance: [L; 3], pdf: L) {
        let wide = <L::Double as Lanes>::Mask::from_bits(mask.bits());
        self.dir = Vec3::select(wide, dir, self.dir);
        for (old, new) in self.radiance.iter_mut().zip(radiance) {
            *old = L::select(mask, new, *old);
        }
        self.pdf = L::select(mask, self.pdf * pdf, self.pdf);
        self.some = self.some | mask;
    }
}
