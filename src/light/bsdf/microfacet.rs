//! The GGX distribution of microfacets with height-correlated Smith masking, and the sampling
//! of its visible normals.
//!
//! Walter et al. 2007 (distribution, refraction), Heitz 2014 (masking, section 5.3), Dupuy and
//! Benyoub 2023 (visible normals by spherical caps). All directions are local, with z along the
//! normal. Written with S(w) = √(αx²x² + αy²y² + z²), by which masking needs no tangent:
//! G₁(w) = 2z/(z + S(w)), and G₂(o, i)/(4 zₒ zᵢ) = ½/(zᵢ S(o) + zₒ S(i)).

use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::lanes::{Lanes, max};

use lanecast_numerics::math::elementary::sin_cos_turns;

/// The least α: its square and the peak of the lobe are far inside the range of f32.
const LEAST_ALPHA: f32 = 1e-12;

/// A GGX distribution: its roughness α along x and y, and their product.
#[derive(Clone, Copy, Debug)]
pub struct Ggx<L> {
    x: L,
    y: L,
    product: L,
}

impl<L: Lanes<Scalar = f32>> Ggx<L> {
    /// Makes the distribution of one α for all azimuths.
    #[inline(always)]
    pub fn new(alpha: L) -> Ggx<L> {
        let alpha = max(alpha, L::splat(LEAST_ALPHA));
        Ggx {
            x: alpha,
            y: alpha,
            product: alpha * alpha,
        }
    }

    /// Makes the distribution of two α, along x and along y.
    #[inline(always)]
    pub fn stretched(x: L, y: L) -> Ggx<L> {
        let (x, y) = (max(x, L::splat(LEAST_ALPHA)), max(y, L::splat(LEAST_ALPHA)));
        Ggx {
            x,
            y,
            product: x * y,
        }
    }

    /// Returns S(w) of a unit direction.
    #[inline(always)]
    pub fn stretch(&self, w: Vec3<L>) -> L {
        let (x, y) = (self.x * w.x, self.y * w.y);
        (x * x + y * y + w.z * w.z).sqrt()
    }

    /// Returns the density D of normals along `half`, a vector of any length whose square is
    /// `squared`. It has the form sin² + α² cos², which does not cancel at the peak.
    #[inline(always)]
    pub fn density(&self, half: Vec3<L>, squared: L) -> L {
        let ratio = self.y / self.x;
        let inverse = self.x / self.y;
        let spread =
            half.x * half.x * ratio + half.y * half.y * inverse + half.z * half.z * self.product;
        let q = self.product * squared / max(spread, L::splat(f32::MIN_POSITIVE));
        q * q / (L::splat(std::f32::consts::PI) * self.product)
    }

    /// Samples a normal that is visible from `out`, with density
    /// G₁(out) max(out·m, 0) D(m) / out.z. `stretch` is S(out).
    #[inline(always)]
    pub fn sample(&self, out: Vec3<L>, stretch: L, [u, v]: [L; 2]) -> Vec3<L> {
        self.sample_about(out, stretch, u, sin_cos_turns(v))
    }

    /// Does as [`sample`](Self::sample) does, with the sine and cosine of the second number in turns.
    #[inline(always)]
    pub fn sample_about(&self, out: Vec3<L>, stretch: L, u: L, (sin, cos): (L, L)) -> Vec3<L> {
        let (zero, one) = (L::zero(), L::splat(1.0));
        let w = Vec3::new(out.x * self.x, out.y * self.y, out.z) / stretch;
        let z = (one - u) * (one + w.z) - w.z;
        let r = max(one - z * z, zero).sqrt();
        let half = Vec3::new(
            (r * cos + w.x) * self.x,
            (r * sin + w.y) * self.y,
            max(z + w.z, zero),
        );
        half / max(half.length(), L::splat(1e-30))
    }
}

/// Returns G₂(o, i)/(4 zₒ zᵢ) of two directions with their S, z taken positive.
#[inline(always)]
pub fn visibility<L: Lanes<Scalar = f32>>(out: (L, L), into: (L, L)) -> L {
    let sum = into.0 * out.1 + out.0 * into.1;
    L::splat(0.5) / max(sum, L::splat(f32::MIN_POSITIVE))
}

/// Returns the density of directions that mirror a visible normal, over D: G₁(o)/(4 zₒ).
#[inline(always)]
pub fn mirrored_pdf<L: Lanes<Scalar = f32>>(out: (L, L)) -> L {
    L::splat(0.5) / (out.0 + out.1)
}

/// Mirrors `out` at a microfacet's unit normal.
#[inline(always)]
pub fn mirror<L: Lanes<Scalar = f32>>(out: Vec3<L>, normal: Vec3<L>) -> Vec3<L> {
    normal * (L::splat(2.0) * out.dot(normal)) - out
}
