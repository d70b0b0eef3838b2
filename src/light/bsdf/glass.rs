//! The shares that a clear dielectric reflects and transmits: the surface of a solid, and a
//! thin sheet with all its inner reflections.

use super::fresnel::dielectric;
use super::mean;
use lanecast_model::scene::Rgb;
use lanecast_numerics::math::lanes::{Lanes, max, min};

/// What transmits, and how.
#[derive(Clone, Copy, Debug)]
pub struct Glass {
    /// A sheet: light passes unbent.
    pub thin: bool,
    /// The index of refraction of a sheet.
    ior: f32,
    /// A factor of the reflectance (KHR_materials_specular).
    tint: Rgb,
}

/// Shares of light at one interface, and the probability of reflecting.
#[derive(Clone, Copy, Debug)]
pub struct Shares<L: Lanes> {
    pub reflected: [L; 3],
    pub transmitted: [L; 3],
    pub chance: L,
    /// The cosine of the transmitted ray, positive.
    pub cos: L,
}

/// The difference of `eta` from 1 below which a solid's surface bends no light. Where indices
/// match, there is no half vector.
const MATCHED: f32 = 1.0 / 1024.0;

/// The range of indices of refraction that is computed with.
const LEAST_ETA: f32 = 1e-3;
const MOST_ETA: f32 = 1e3;

/// Clamps a ratio of indices to what is computed with, from 1e-3 to 1e3.
#[inline(always)]
pub fn clamped_eta<L: Lanes<Scalar = f32>>(eta: L) -> L {
    max(min(eta, L::splat(MOST_ETA)), L::splat(LEAST_ETA))
}

/// Returns the lanes in which the two sides of a solid's surface are one medium.
#[inline(always)]
pub fn is_matched<L: Lanes<Scalar = f32>>(eta: L) -> L::Mask {
    (eta - L::splat(1.0)).abs().lt(L::splat(MATCHED))
}

impl Glass {
    pub fn new(thin: bool, ior: f32, tint: Rgb) -> Glass {
        Glass { thin, ior, tint }
    }

    /// Returns the shares at the cosine `cos` to a facet. `color` tints what passes once; at a
    /// sheet, what is reflected inside is tinted by each passage.
    ///
    /// A sheet reflects R + (1 − R)² R c²/(1 − R² c²) and transmits (1 − R)² c/(1 − R² c²), the
    /// sums over all orders; a clear one of index 1.5 reflects 1/13 at normal incidence.
    #[inline(always)]
    pub fn shares<L: Lanes<Scalar = f32>>(&self, cos: L, eta: L, color: [L; 3]) -> Shares<L> {
        let (zero, one) = (L::zero(), L::splat(1.0));
        let ratio = if self.thin { L::splat(self.ior) } else { eta };
        let interface = dielectric(cos, ratio);
        let matched = is_matched(ratio);
        let r = L::select(matched, zero, interface.reflectance);
        let tinted = self.tint.map(|t| {
            if t == 1.0 {
                r
            } else {
                L::select(interface.total, one, r * L::splat(t))
            }
        });
        let pairs: [(L, L); 3] = std::array::from_fn(|k| {
            let (r, c) = (tinted[k], color[k]);
            let rest = one - r;
            if self.thin {
                let returned = one - r * r * c * c;
                let returned = L::select(returned.gt(zero), returned, one);
                let inside = rest * rest * c / returned;
                (r + inside * r * c, inside)
            } else {
                (r, rest * c)
            }
        });
        let reflected = pairs.map(|(r, _)| r);
        let transmitted = pairs.map(|(_, t)| t);
        let (a, b) = (mean(reflected), mean(transmitted));
        let none = (a + b).le(zero);
        Shares {
            reflected,
            transmitted,
            chance: L::select(none, one, a / L::select(none, one, a + b)),
            cos: L::select(matched, cos, interface.cos),
        }
    }
}
