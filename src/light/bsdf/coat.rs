//! A clear lacquer of index 1.5 (KHR_materials_clearcoat).

use super::albedo::{Albedo, AlbedoRow, mirror_albedo};
use super::fresnel::schlick;
use super::microfacet::{Ggx, mirrored_pdf, visibility};
use crate::sampling::Frame;
use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::lanes::{Lanes, max};

/// The reflectance of the lacquer at normal incidence.
const F0: f32 = 0.04;

/// A lacquer that covers a share of the surface.
#[derive(Clone, Copy, Debug)]
pub struct Coat {
    share: f32,
    alpha: f32,
    albedo: AlbedoRow,
    pub smooth: bool,
}

/// What a coat does at one hit.
#[derive(Clone, Copy, Debug)]
pub struct CoatHit<L> {
    /// About the coat's normal, where that is not the base's.
    pub frame: Option<Frame<L>>,
    /// Where the ray came from, in that frame.
    pub out: Vec3<L>,
    pub ggx: Ggx<L>,
    pub stretch: L,
    /// The share with the compensation of multiple scattering.
    weight: L,
    /// The directional albedo with all weights.
    pub albedo: L,
}

impl Coat {
    pub fn new(share: f32, roughness: f32) -> Coat {
        Coat {
            share,
            alpha: roughness * roughness,
            albedo: AlbedoRow::new(roughness * roughness),
            smooth: roughness == 0.0,
        }
    }

    /// Computes what `out` and the coat's own normal alone decide. `above` is the weight of what
    /// lies above the coat.
    #[inline(always)]
    pub fn prepare<L: Lanes<Scalar = f32>>(
        &self,
        normal: Option<Vec3<L>>,
        out: Vec3<L>,
        above: L,
    ) -> CoatHit<L> {
        let one = L::splat(1.0);
        let frame = normal.map(Frame::about);
        let out = match &frame {
            Some(frame) => super::above(frame.local_from_world(out)),
            None => out,
        };
        let Albedo { white, schlick } = if self.smooth {
            mirror_albedo(out.z)
        } else {
            self.albedo.at(out.z)
        };
        let scale = one + L::splat(F0) * (one - white) / white;
        let weight = above * L::splat(self.share) * scale;
        let ggx = Ggx::new(L::splat(self.alpha));
        CoatHit {
            frame,
            out,
            ggx,
            stretch: ggx.stretch(out),
            weight,
            albedo: weight * (L::splat(F0) * white + L::splat(1.0 - F0) * schlick),
        }
    }

    /// Returns BRDF · cos of a rough coat and the density of its samples, 0 below the surface.
    #[inline(always)]
    pub fn eval<L: Lanes<Scalar = f32>>(&self, hit: &CoatHit<L>, into: Vec3<L>) -> (L, L) {
        let zero = L::zero();
        let out = hit.out;
        let mut up = into.z.gt(zero);
        let mut into = into;
        if let Some(frame) = &hit.frame {
            into = frame.local_from_world(into);
            up = up & into.z.gt(zero);
        }
        let half = out + into;
        let squared = max(half.length_squared(), L::splat(f32::MIN_POSITIVE));
        let density = hit.ggx.density(half, squared);
        let side = (out.z, hit.stretch);
        let cos = max(into.z, zero);
        let visible = visibility(side, (cos, hit.ggx.stretch(into)));
        let to_half = L::splat(0.5) * squared.sqrt();
        let value = hit.reflectance(to_half) * density * (visible * cos);
        let pdf = density * mirrored_pdf(side);
        (L::select(up, value, zero), L::select(up, pdf, zero))
    }
}

impl<L: Lanes<Scalar = f32>> CoatHit<L> {
    /// Returns the Fresnel term with all weights.
    #[inline(always)]
    pub fn reflectance(&self, cos: L) -> L {
        self.weight * (L::splat(F0) + L::splat(1.0 - F0) * schlick(cos))
    }
}
