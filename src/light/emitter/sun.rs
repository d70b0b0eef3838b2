//! Directional lights: deltas, or discs in the sky that are sampled uniformly.

use super::place::{Place, Row};
use lanecast_model::scene::Rgb;
use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::elementary::sin_cos_turns;
use lanecast_numerics::math::lanes::Lanes;
use std::f64::consts::{PI, TAU};

/// A directional light as importances and rays that miss need it.
#[derive(Clone, Copy, Debug)]
pub struct Sun {
    pub id: u32,
    /// Unit direction to the middle.
    pub towards: [f32; 3],
    /// 1 − cos of the half angle; 0 for a delta.
    pub versine: f32,
    /// The radiance of the disc; 0 of a delta.
    pub radiance: Rgb,
    /// The mean irradiance of the three channels.
    pub irradiance: f32,
    /// The density over the disc; 0 of a delta.
    pub pdf: f32,
    /// The squared chord between the middle and the rim, and what f32 may add to it.
    chord: f32,
}

impl Sun {
    /// Prepares the light of a row and its irradiance on a surface that faces it.
    pub fn new(id: u32, row: &Row, irradiance: Rgb) -> Sun {
        // ∫ cos over the disc is π sin², with sin² = h(2 − h) of h = 1 − cos.
        let facing = PI * row.s * (2.0 - row.s);
        let disc = row.s > 0.0;
        let radiance = |e: f32| {
            if disc {
                (f64::from(e) / facing) as f32
            } else {
                0.0
            }
        };
        Sun {
            id,
            towards: row.n.map(|x| x as f32),
            versine: row.s as f32,
            radiance: irradiance.map(radiance),
            irradiance: irradiance.iter().sum::<f32>() / 3.0,
            pdf: if disc {
                (1.0 / (TAU * row.s)) as f32
            } else {
                0.0
            },
            chord: ((2.0 * row.s).sqrt() + 2.0 * f64::from(f32::EPSILON)).powi(2) as f32,
        }
    }

    /// Returns the lanes whose direction lies in the disc.
    #[inline(always)]
    pub fn contains<L: Lanes<Scalar = f32>>(&self, dir: Vec3<L>) -> L::Mask {
        // By the chord, since the cosine of a small angle has no digits in f32.
        let apart = dir - Vec3::splat(self.towards);
        apart.length_squared().le(L::splat(self.chord))
    }
}

/// Maps points of the unit square to unit directions of the lanes' discs.
#[inline(always)]
pub fn sample<L: Lanes<Scalar = f32>>(place: &Place<L>, u: [L; 2]) -> Vec3<L::Double> {
    let (one, two) = (L::Double::splat(1.0), L::Double::splat(2.0));
    let (sin, cos) = sin_cos_turns(u[1]);
    let versine = place.s * u[0].widen();
    let radial = (versine * (two - versine)).sqrt();
    let (x, y) = (radial * cos.widen(), radial * sin.widen());
    place.u * x + place.v * y + place.n * (one - versine)
}
