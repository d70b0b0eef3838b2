//! Lights as seen from shaded points, in lanes.

use super::columns::{Doubles, Singles};
use crate::math::bounds::LIGHT_END;
use crate::math::lanes::{Lanes, Mask};
use crate::math::{Vec3, unit};
use crate::scene::{Falloff, Light, Rgb};
use glam::DVec3;

type LaneMask = <Doubles as Lanes>::Mask;

/// Direction to a light from points, and the irradiance that arrives there.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Lanes that the light reaches.
    pub some: LaneMask,
    /// Unit direction from the point to the light.
    pub towards: Vec3<Doubles>,
    /// Irradiance on a surface that faces the light, W/m².
    pub irradiance: [Singles; 3],
}

/// Returns t_max of the [`shadow_dirs`] rays: the light's t, less what rounding may
/// move it by ([`LIGHT_END`]).
pub fn shadow_t_max(light: &Light) -> f32 {
    match light {
        Light::Directional { .. } => f32::INFINITY,
        _ => LIGHT_END,
    }
}

/// Returns the directions of shadow rays from their offset origins to the light, and
/// the lanes with a nonzero direction. A light with a position lies at t = 1. `towards`
/// is the direction from the shaded points.
#[inline(always)]
pub fn shadow_dirs(
    light: &Light,
    org: Vec3<Doubles>,
    towards: Vec3<Doubles>,
) -> (Vec3<Doubles>, LaneMask) {
    match light.position() {
        Some(position) => {
            let dir = Vec3::splat(position.to_array()) - org;
            (dir, dir.max_abs().gt(Doubles::zero()))
        }
        None => (towards, LaneMask::splat(true)),
    }
}

impl LightSample {
    #[inline(always)]
    pub fn at(light: &Light, point: Vec3<Doubles>) -> LightSample {
        match light {
            Light::Point {
                position,
                intensity,
                falloff,
                ..
            } => LightSample::from_point(*position, *intensity, *falloff, point),
            Light::Spot {
                position,
                direction,
                intensity,
                inner,
                outer,
                ..
            } => {
                let full = Falloff::InverseSquare;
                let sample = LightSample::from_point(*position, *intensity, full, point);
                let axis = Vec3::splat(unit(*direction).to_array());
                let fade = cone_fade(*inner, *outer, -sample.towards.dot(axis));
                LightSample {
                    irradiance: sample.irradiance.map(|i| i * fade),
                    ..sample
                }
            }
            Light::Directional {
                direction,
                irradiance,
                ..
            } => {
                let towards = Vec3::splat((-unit(*direction)).to_array());
                LightSample {
                    some: LaneMask::splat(true),
                    towards,
                    irradiance: irradiance.map(Singles::splat),
                }
            }
            // Only paths find light with an extent.
            Light::Rectangle { center, .. } | Light::Disc { center, .. } => {
                let intensity = light.mean_intensity();
                LightSample::from_point(*center, intensity, Falloff::InverseSquare, point)
            }
        }
    }

    #[inline(always)]
    fn from_point(
        position: DVec3,
        intensity: Rgb,
        falloff: Falloff,
        point: Vec3<Doubles>,
    ) -> LightSample {
        let dir = Vec3::splat(position.to_array()) - point;
        let distance = dir.length();
        let one = Doubles::splat(1.0);
        let nearness = one / distance;
        let fade = match falloff {
            Falloff::InverseSquare => nearness * nearness,
            Falloff::None => one,
        };
        let faded = |i: f32| Singles::narrow(Doubles::splat(f64::from(i)) * fade);
        LightSample {
            some: !Lanes::eq(distance, Doubles::zero()),
            towards: dir * nearness,
            irradiance: intensity.map(faded),
        }
    }
}

/// Returns a spot light's share of its full intensity in a direction at this cosine from its
/// axis: glTF's, the square of a ramp between the cosines of the two cones.
#[inline(always)]
fn cone_fade(inner: f64, outer: f64, cos: Doubles) -> Singles {
    let (full, none) = (libm::cos(inner), libm::cos(outer));
    // glTF's least width of the ramp.
    let scale = 1.0 / (full - none).max(1e-3);
    let ramp = (cos - Doubles::splat(none)) * Doubles::splat(scale);
    let ramp = ramp.max(Doubles::zero()).min(Doubles::splat(1.0));
    Singles::narrow(ramp * ramp)
}
