//! Phong's model with constant coefficients, as NFF and MTL have it: Lambert, a highlight
//! `specular`·(r·v)ⁿ/π that no cosine weighs, a perfect mirror and a window.

use super::fresnel::dielectric;
use super::{Evaluated, Sampled};
use crate::sampling::{cosine_hemisphere, cosine_hemisphere_density};
use lanecast_model::scene::{Material, Model, Rgb};
use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::elementary::{pow, sin_cos_turns};
use lanecast_numerics::math::lanes::{Lanes, Mask, max};
use std::f32::consts::PI;

/// The coefficients, and the probabilities by which lobes are chosen.
#[derive(Clone, Copy, Debug)]
pub struct Phong {
    diffuse: Rgb,
    specular: Rgb,
    exponent: f32,
    mirror: Rgb,
    transmission: f32,
    thin_walled: bool,
    /// Of the diffuse lobe, the highlight and the mirror; the window has the rest.
    chances: [f32; 3],
}

impl Phong {
    /// Takes the coefficients of a material; a material of another model is black.
    pub fn new(material: &Material) -> Phong {
        let clean = |c: Rgb| c.map(|x| if x > 0.0 { x.min(1e6) } else { 0.0 });
        let Model::Phong {
            diffuse,
            specular,
            exponent,
            mirror,
        } = material.model
        else {
            return Phong {
                diffuse: [0.0; 3],
                specular: [0.0; 3],
                exponent: 0.0,
                mirror: [0.0; 3],
                transmission: 0.0,
                thin_walled: false,
                chances: [0.0; 3],
            };
        };
        let exponent = if exponent > 0.0 {
            exponent.min(1e8)
        } else {
            0.0
        };
        let [diffuse, specular, mirror] = [diffuse, specular, mirror].map(clean);
        let transmission = material.transmission.clamp(0.0, 1.0);
        let mean = |c: Rgb| c.iter().map(|x| f64::from(*x)).sum::<f64>() / 3.0;
        // The highlight's albedo is at most 2/(n + 1) of its coefficient.
        let weights = [
            mean(diffuse),
            mean(specular) * 2.0 / (f64::from(exponent) + 1.0),
            mean(mirror),
        ];
        let sum = weights.iter().sum::<f64>() + f64::from(transmission);
        let chances = weights.map(|w| if sum > 0.0 { (w / sum) as f32 } else { 0.0 });
        Phong {
            diffuse,
            specular,
            exponent,
            mirror,
            transmission,
            thin_walled: material.layers.thin_walled,
            chances,
        }
    }

    pub fn is_black(&self) -> bool {
        self.only_delta() && self.mirror == [0.0; 3] && self.transmission == 0.0
    }

    pub fn only_delta(&self) -> bool {
        self.diffuse == [0.0; 3] && self.specular == [0.0; 3]
    }

    pub fn transmits(&self) -> bool {
        self.transmission > 0.0
    }

    /// Returns the albedo of the diffuse lobe.
    #[inline(always)]
    pub fn lambert<L: Lanes<Scalar = f32>>(&self) -> [L; 3] {
        self.diffuse.map(L::splat)
    }

    fn shines(&self) -> bool {
        self.chances[1] > 0.0
    }

    #[inline(always)]
    pub fn eval<L: Lanes<Scalar = f32>>(&self, out: Vec3<L>, into: Vec3<L>) -> Evaluated<L> {
        let zero = L::zero();
        let faces = into.z.gt(zero);
        let cos = cosine_hemisphere_density(into.z);
        let mut value = self.diffuse.map(|d| L::splat(d) * cos);
        let mut pdf = L::splat(self.chances[0]) * cos;
        if self.shines() {
            let mirrored = Vec3::new(-out.x, -out.y, out.z);
            let cos = max(mirrored.dot(into), zero);
            let power = L::select(faces, pow(cos, L::splat(self.exponent)), zero);
            for k in 0..3 {
                value[k] = value[k] + L::splat(self.specular[k] / PI) * power;
            }
            let density = self.chances[1] * (self.exponent + 1.0) / (2.0 * PI);
            pdf = pdf + L::splat(density) * power;
        }
        Evaluated { value, pdf }
    }

    /// Returns what the diffuse lobe makes of [`Phong::eval`].
    pub fn diffuse_part<L: Lanes<Scalar = f32>>(&self, into: Vec3<L>) -> [L; 3] {
        let cos = cosine_hemisphere_density(into.z);
        self.diffuse.map(|d| L::splat(d) * cos)
    }

    #[inline(always)]
    pub fn sample<L: Lanes<Scalar = f32>>(
        &self,
        eta: L,
        out: Vec3<L>,
        u: [L; 2],
        lobe: L,
    ) -> Sampled<L> {
        let (zero, one) = (L::zero(), L::splat(1.0));
        let [diffuse, highlight, mirror] = self.chances;
        let mirrored = Vec3::new(-out.x, -out.y, out.z);
        let mut into = mirrored;
        if diffuse > 0.0 {
            into = cosine_hemisphere(u);
        }
        if self.shines() {
            let around = about(mirrored, self.exponent, u);
            into = Vec3::select(lobe.ge(L::splat(diffuse)), around, into);
        }
        let all = self.eval(out, into);
        // What is left of the unit interval after rounding belongs to the last lobe.
        let delta = if self.only_delta() {
            L::Mask::splat(true)
        } else if self.mirror == [0.0; 3] && self.transmission == 0.0 {
            L::Mask::splat(false)
        } else {
            lobe.ge(L::splat(diffuse + highlight))
        };
        if delta.none() {
            return Sampled::of(into, all, delta, Evaluated::none());
        }
        into = Vec3::select(delta, mirrored, into);
        let mut single = Evaluated {
            value: self.mirror.map(L::splat),
            pdf: L::splat(mirror),
        };
        if self.transmission > 0.0 {
            let ratio = if self.thin_walled { one } else { eta };
            let interface = dielectric(out.z, ratio);
            let passes = if mirror > 0.0 {
                delta & lobe.ge(L::splat(diffuse + highlight + mirror))
            } else {
                delta
            };
            let passed = passes & !interface.total;
            let bent = Vec3::new(-out.x / ratio, -out.y / ratio, -interface.cos);
            into = Vec3::select(passed, bent, into);
            // Under total reflection the mirror also carries the transmitted share; it is
            // chosen by both numbers.
            let share = 1.0 - diffuse - highlight;
            let whole = self.mirror.map(|m| (m + self.transmission).min(1.0));
            for k in 0..3 {
                let reflected = L::select(
                    interface.total,
                    L::splat(whole[k]),
                    L::splat(self.mirror[k]),
                );
                let through = L::splat(self.transmission) / (ratio * ratio);
                single.value[k] = L::select(passed, through, reflected);
            }
            let reflected = L::select(interface.total, L::splat(share), L::splat(mirror));
            single.pdf = L::select(passed, L::splat(share - mirror), reflected);
        }
        single.pdf = max(single.pdf, zero);
        Sampled::of(into, all, delta, single)
    }
}

/// Samples a direction of density (n + 1)/2π cosⁿ about an axis (Duff et al. 2017 for the
/// frame).
#[inline(always)]
fn about<L: Lanes<Scalar = f32>>(axis: Vec3<L>, exponent: f32, u: [L; 2]) -> Vec3<L> {
    let (zero, one) = (L::zero(), L::splat(1.0));
    let z = pow(one - u[0], L::splat(1.0 / (exponent + 1.0)));
    let r = max(one - z * z, zero).sqrt();
    let (sin, cos) = sin_cos_turns(u[1]);
    let (x, y) = (r * cos, r * sin);
    // The axis has z > 0.
    let a = -one / (one + axis.z);
    let b = axis.x * axis.y * a;
    let tangent = Vec3::new(one + axis.x * axis.x * a, b, -axis.x);
    let other = Vec3::new(b, one + axis.y * axis.y * a, -axis.y);
    tangent * x + other * y + axis * z
}
