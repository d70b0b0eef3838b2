//! Sampling of the layered model: one random number chooses a lobe, two a direction of it.

use super::{Layered, Prepared, Stretch, turn};
use crate::bsdf::glass::is_matched;
use crate::bsdf::microfacet::mirror;
use crate::bsdf::sheen::uniform_hemisphere;
use crate::bsdf::{Evaluated, Sampled};
use crate::sampling::cosine_hemisphere;
use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::lanes::{Lanes, Mask, max, min};

impl Layered {
    /// Samples a direction in which the path goes on from a hit.
    #[inline(always)]
    pub fn sample<L: Lanes<Scalar = f32>>(
        &self,
        hit: &Prepared<L>,
        u: [L; 2],
        lobe: L,
    ) -> Sampled<L> {
        let zero = L::zero();
        let (out, chances) = (hit.out, &hit.chances);
        let mut choice = Choice {
            into: Vec3::new(-out.x, -out.y, out.z),
            delta: L::Mask::splat(false),
            single: Evaluated::none(),
        };
        // Each lobe takes the rest of the unit interval from where it begins.
        let mut begin = zero;
        if self.diffuse || self.diffuse_through {
            choice.into = cosine_hemisphere(u);
            if self.diffuse_through {
                let down = lobe.ge(chances.diffuse);
                choice.into.z = L::select(down, -choice.into.z, choice.into.z);
            }
            begin = chances.diffuse + chances.diffuse_through;
        }
        if self.facets() {
            self.sample_facets(hit, u, lobe, begin, &mut choice);
            begin = begin + chances.gloss + chances.glass;
        }
        if let (Some(coat), Some(coated)) = (&self.coat, &hit.coat) {
            let here = lobe.ge(begin);
            let out = coated.out;
            let mut into = Vec3::new(-out.x, -out.y, out.z);
            if !coat.smooth {
                into = mirror(out, coated.ggx.sample(out, coated.stretch, u));
                into.z = max(into.z, zero);
            }
            let mut exact = Evaluated {
                value: [coated.reflectance(out.z); 3],
                pdf: chances.coat,
            };
            if let Some(frame) = &coated.frame {
                into = frame.world_from_local(into);
                // What the coat reflects into the surface is lost.
                let up = into.z.gt(zero);
                exact.value = exact.value.map(|value| L::select(up, value, zero));
                into.z = max(into.z, zero);
            }
            choice.take(here, into, here & L::Mask::splat(coat.smooth), exact);
            begin = begin + chances.coat;
        }
        if self.sheen.is_some() {
            let here = lobe.ge(begin);
            let into = uniform_hemisphere(u);
            choice.take(here, into, L::Mask::splat(false), Evaluated::none());
        }
        let Choice {
            mut into,
            delta,
            single,
        } = choice;
        let all = if self.only_delta() {
            Evaluated::none()
        } else {
            self.eval_turned(hit, into)
        };
        if let Some(Stretch { cos, sin, .. }) = self.stretch {
            into = turn(into, cos, -sin);
        }
        Sampled::of(into, all, delta, single)
    }

    /// Samples gloss and glass from where they begin.
    #[inline(always)]
    fn sample_facets<L: Lanes<Scalar = f32>>(
        &self,
        hit: &Prepared<L>,
        u: [L; 2],
        lobe: L,
        begin: L,
        choice: &mut Choice<L>,
    ) {
        let (zero, one) = (L::zero(), L::splat(1.0));
        let (out, chances) = (hit.out, &hit.chances);
        let facet = if self.smooth {
            Vec3::splat([0.0, 0.0, 1.0])
        } else {
            hit.ggx.sample(out, hit.stretch, u)
        };
        let here = lobe.ge(begin);
        let mut into = mirror(out, facet);
        let mut delta = L::Mask::splat(self.smooth);
        let mut single = Evaluated::none();
        if self.smooth {
            single.value = self.reflectance(hit, out.z);
            single.pdf = chances.gloss;
        } else {
            into.z = max(into.z, zero);
        }
        if self.glass {
            let first = begin + chances.gloss;
            let is_glass = if self.gloss { lobe.ge(first) } else { here };
            let cos = out.dot(facet);
            let shares = self.shares(hit, cos);
            let chance = L::select(chances.glass.gt(zero), chances.glass, one);
            let passes = is_glass & ((lobe - first) / chance).ge(shares.chance);
            let eta = hit.eta;
            let mut window = L::Mask::splat(false);
            let through = if !self.window.thin {
                window = passes & is_matched(eta);
                let bent = facet * (cos / eta - shares.cos) - out / eta;
                Vec3::new(bent.x, bent.y, min(bent.z, zero))
            } else if self.smooth {
                -out
            } else {
                // The mirror image of the reflected ray. A reflection into the surface is
                // none, and neither is its image.
                Vec3::new(into.x, into.y, -into.z)
            };
            let through = Vec3::select(window, -out, through);
            into = Vec3::select(passes, through, into);
            let exact = if self.smooth { is_glass } else { window };
            if exact.any() {
                let scale = if self.window.thin {
                    one
                } else {
                    one / (eta * eta)
                };
                for k in 0..3 {
                    let transmitted = shares.transmitted[k] * scale;
                    let value = L::select(passes, transmitted, shares.reflected[k]);
                    single.value[k] = L::select(exact, value * hit.glass, single.value[k]);
                }
                let side = L::select(passes, one - shares.chance, shares.chance);
                single.pdf = L::select(exact, chances.glass * side, single.pdf);
                delta = delta | exact;
            }
        }
        choice.take(here, into, delta, single);
    }
}

/// The direction of the lobe that was chosen.
struct Choice<L: Lanes> {
    into: Vec3<L>,
    delta: L::Mask,
    /// Of a delta lobe, its value and probability.
    single: Evaluated<L>,
}

impl<L: Lanes<Scalar = f32>> Choice<L> {
    /// Replaces the choice in the lanes of `here`.
    #[inline(always)]
    fn take(&mut self, here: L::Mask, into: Vec3<L>, delta: L::Mask, single: Evaluated<L>) {
        self.into = Vec3::select(here, into, self.into);
        self.delta = (self.delta & !here) | (delta & here);
        for k in 0..3 {
            self.single.value[k] = L::select(here, single.value[k], self.single.value[k]);
        }
        self.single.pdf = L::select(here, single.pdf, self.single.pdf);
    }
}
