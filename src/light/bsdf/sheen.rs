//! Sheen of fibres (KHR_materials_sheen): the "Charlie" distribution and masking of Conty
//! Estevez and Kulla 2017, "Production friendly microfacet sheen BRDF".

use super::fresnel::unit_interval;
use lanecast_model::scene::Rgb;
use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::elementary::{exp, pow, sin_cos_turns};
use lanecast_numerics::math::lanes::{Lanes, max, min};

/// Intervals of the table of directional albedos.
const ANGLES: usize = 32;

/// A sheen of one colour and roughness.
#[derive(Clone, Copy, Debug)]
pub struct Sheen {
    pub color: Rgb,
    /// 1/α.
    power: f32,
    /// The coefficients a to e of the fit of Λ.
    fit: [f32; 5],
    /// The albedo of a white sheen over √μ.
    albedo: [f32; ANGLES + 1],
}

/// The fits of Λ for α = 0 and α = 1 (table 1 of the paper).
const SMOOTH: [f32; 5] = [25.324_5, 3.324_35, 0.168_01, -1.273_93, -4.859_67];
const ROUGH: [f32; 5] = [21.547_3, 3.829_87, 0.198_23, -1.977_60, -4.320_54];

impl Sheen {
    /// Makes a sheen of α = roughness², and integrates its albedo.
    pub fn new(color: Rgb, roughness: f32) -> Sheen {
        let alpha = (roughness * roughness).max(1e-3);
        let smooth = (1.0 - alpha) * (1.0 - alpha);
        let mut sheen = Sheen {
            color,
            power: 1.0 / alpha,
            fit: std::array::from_fn(|i| ROUGH[i] + smooth * (SMOOTH[i] - ROUGH[i])),
            albedo: [0.0; ANGLES + 1],
        };
        sheen.albedo = std::array::from_fn(|i| {
            let x = i as f32 / ANGLES as f32;
            sheen.integrated((x * x).max(1e-6))
        });
        sheen
    }

    /// Integrates the albedo by the midpoint rule over 48 by 32 directions, dense towards the
    /// horizon.
    fn integrated(&self, mu: f32) -> f32 {
        let (heights, turns) = (48, 32);
        let out = Vec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
        let masking = self.masking(mu);
        let mut sum = 0.0;
        for i in 0..heights {
            let t = (i as f32 + 0.5) / heights as f32;
            let z = t * t;
            let r = (1.0 - z * z).sqrt();
            let visible = visibility(masking, self.masking(z));
            for j in 0..turns {
                // Half the azimuths, for the lobe is symmetric.
                let (sin, cos) = sin_cos_turns((j as f32 + 0.5) / (2 * turns) as f32);
                let into = Vec3::new(r * cos, r * sin, z);
                sum += 2.0 * t * self.spread(out, into) * visible;
            }
        }
        sum / (heights * turns) as f32 * std::f32::consts::TAU
    }

    /// Returns the albedo of a white sheen at the cosine `mu`.
    #[inline(always)]
    pub fn albedo<L: Lanes<Scalar = f32>>(&self, mu: L) -> L {
        let mut lanes = (unit_interval(mu).sqrt() * L::splat(ANGLES as f32)).to_array();
        for x in lanes.as_mut() {
            let i = (*x as usize).min(ANGLES - 1);
            let low = self.albedo[i];
            *x = low + (*x - i as f32) * (self.albedo[i + 1] - low);
        }
        min(L::load(lanes.as_ref()), L::splat(1.0))
    }

    /// Returns Λ at the cosine `mu` (equation 3).
    #[inline(always)]
    pub fn masking<L: Lanes<Scalar = f32>>(&self, mu: L) -> L {
        let [a, b, c, d, e] = self.fit.map(L::splat);
        let one = L::splat(1.0);
        let mu = unit_interval(mu);
        let fit = |x: L| a / (one + b * pow(x, c)) + d * x + e;
        let lower = mu.lt(L::splat(0.5));
        let at = fit(min(mu, one - mu));
        let middle = fit(L::splat(0.5));
        exp(L::select(lower, at, middle + middle - at))
    }

    /// Returns BRDF · cos of a white sheen, for `into` above the surface. `masking` is that of
    /// `out`.
    #[inline(always)]
    pub fn value<L: Lanes<Scalar = f32>>(&self, out: Vec3<L>, masking: L, into: Vec3<L>) -> L {
        let value = self.spread(out, into) * visibility(masking, self.masking(into.z));
        L::select(into.z.gt(L::zero()), value, L::zero())
    }

    /// Returns the density of normals over 4 out.z.
    #[inline(always)]
    fn spread<L: Lanes<Scalar = f32>>(&self, out: Vec3<L>, into: Vec3<L>) -> L {
        let half = out + into;
        let squared = max(half.length_squared(), L::splat(f32::MIN_POSITIVE));
        let sin2 = (half.x * half.x + half.y * half.y) / squared;
        let peak = (2.0 + self.power) / std::f32::consts::TAU;
        let density = L::splat(peak) * pow(unit_interval(sin2), L::splat(0.5 * self.power));
        density / (L::splat(4.0) * out.z)
    }
}

/// Returns the part of facets that both sides see, of their Λ.
#[inline(always)]
fn visibility<L: Lanes<Scalar = f32>>(out: L, into: L) -> L {
    let one = L::splat(1.0);
    one / (one + out + into)
}

/// Samples the hemisphere uniformly, with density 1/2π.
#[inline(always)]
pub fn uniform_hemisphere<L: Lanes<Scalar = f32>>(u: [L; 2]) -> Vec3<L> {
    let one = L::splat(1.0);
    let z = one - u[0];
    let r = (u[0] * (one + z)).sqrt();
    let (sin, cos) = sin_cos_turns(u[1]);
    Vec3::new(r * cos, r * sin, z)
}
