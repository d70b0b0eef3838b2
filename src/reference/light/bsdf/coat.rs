//! A clear lacquer of index 1.5 over a surface (KHR_materials_clearcoat).

use super::albedo::Albedo;
use super::ggx::{Ggx, schlick};
use glam::DVec3;

/// The reflectance of the lacquer at normal incidence.
const F0: f64 = 0.04;

#[derive(Clone, Debug)]
pub struct Coat {
    share: f64,
    alpha: f64,
    pub ggx: Ggx,
    albedo: Albedo,
    pub smooth: bool,
}

impl Coat {
    pub fn new(share: f64, roughness: f64) -> Coat {
        let alpha = roughness * roughness;
        Coat {
            share,
            alpha,
            ggx: Ggx::new(alpha),
            albedo: Albedo::new(alpha),
            smooth: alpha == 0.0,
        }
    }

    /// Returns the weight of the lacquer's lobe, compensated for multiple scattering (Turquin
    /// 2019), and its directional albedo with that weight.
    pub fn seen(&self, mu: f64) -> [f64; 2] {
        let [e, b] = self.albedo.at(mu, self.alpha);
        let weight = self.share * (1.0 + F0 * (1.0 - e) / e);
        [weight, weight * (F0 * e + (1.0 - F0) * b)]
    }

    /// Returns Schlick's term at the cosine to a facet.
    pub fn fresnel(cos: f64) -> f64 {
        F0 + (1.0 - F0) * schlick(cos)
    }

    /// Returns BRDF · cos for a weight of 1 and the density of a rough lacquer's samples, for
    /// directions above the surface.
    pub fn eval(&self, out: DVec3, into: DVec3) -> [f64; 2] {
        let h = (out + into).normalize();
        let o_h = out.dot(h);
        let masking = self.ggx.masking_shadowing(out, into);
        let value = masking * self.ggx.density(h) / (4.0 * out.z);
        [
            Coat::fresnel(o_h) * value,
            self.ggx.visible(out, h) / (4.0 * o_h),
        ]
    }
}
