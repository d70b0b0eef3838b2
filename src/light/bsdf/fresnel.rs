//! Fresnel reflectances: Schlick's term and the exact one of dielectrics.

use lanecast_numerics::math::lanes::{Lanes, max, min};

/// Clamps to [0, 1]; NaN gives 0.
#[inline(always)]
pub fn unit_interval<L: Lanes<Scalar = f32>>(x: L) -> L {
    max(min(x, L::splat(1.0)), L::zero())
}

/// Returns (1 − cos)⁵, Schlick's interpolation (1994) from normal to grazing incidence.
#[inline(always)]
pub fn schlick<L: Lanes<Scalar = f32>>(cos: L) -> L {
    let c = L::splat(1.0) - unit_interval(cos);
    let c2 = c * c;
    c2 * c2 * c
}

/// What a smooth dielectric interface does to a ray.
#[derive(Clone, Copy, Debug)]
pub struct Interface<L: Lanes> {
    /// The unpolarised reflectance; 1 under total internal reflection.
    pub reflectance: L,
    /// The cosine of the refracted ray, positive.
    pub cos: L,
    /// Where all light is reflected.
    pub total: L::Mask,
}

/// Returns what an interface does to a ray at the cosine `cos` ≥ 0; `eta` > 0 is the index of
/// the far side over that of the ray's side.
#[inline(always)]
pub fn dielectric<L: Lanes<Scalar = f32>>(cos: L, eta: L) -> Interface<L> {
    let (zero, one) = (L::zero(), L::splat(1.0));
    let cos = unit_interval(cos);
    let sin2 = (one - cos * cos) / (eta * eta);
    let total = sin2.ge(one);
    let refracted = max(one - sin2, zero).sqrt();
    let least = L::splat(f32::MIN_POSITIVE);
    let (near, far) = (eta * cos, eta * refracted);
    let parallel = (near - refracted) / max(near + refracted, least);
    let across = (cos - far) / max(cos + far, least);
    let reflectance = (parallel * parallel + across * across) * L::splat(0.5);
    Interface {
        reflectance: L::select(total, one, reflectance),
        cos: refracted,
        total,
    }
}
