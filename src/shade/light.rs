//! Lights as seen from points, in lanes.

use super::columns::{Doubles, Singles};
use crate::math::bounds::LIGHT_END;
use crate::math::lanes::{Lanes, Mask};
use crate::math::{Vec3, unit};
use crate::scene::{Falloff, Light};

type On = <Doubles as Lanes>::Mask;

/// Where a light lies from points, and what arrives there.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// Lanes where something does.
    pub some: On,
    /// Unit, from the point to the light.
    pub towards: Vec3<Doubles>,
    /// On a surface that faces the light, W/m².
    pub irradiance: [Singles; 3],
}

/// t of a light on rays with [`shadow_dirs`], before it by what rounding may move it
/// ([`LIGHT_END`]).
pub fn end_of(light: &Light) -> f32 {
    match light {
        Light::Point { .. } => LIGHT_END,
        Light::Directional { .. } => f32::INFINITY,
    }
}

/// Directions of shadow rays from where they really start to the light, at t = 1 if it
/// has a place; and which of them are any. `towards`: from the points that are lit.
#[inline(always)]
pub fn shadow_dirs(
    light: &Light,
    org: Vec3<Doubles>,
    towards: Vec3<Doubles>,
) -> (Vec3<Doubles>, On) {
    match light {
        Light::Point { position, .. } => {
            let dir = Vec3::splat(position.to_array()) - org;
            (dir, dir.max_abs().gt(Doubles::zero()))
        }
        Light::Directional { .. } => (towards, On::splat(true)),
    }
}

impl Arrival {
    #[inline(always)]
    pub fn at(light: &Light, point: Vec3<Doubles>) -> Arrival {
        match light {
            Light::Point {
                position,
                intensity,
                falloff,
            } => {
                let dir = Vec3::splat(position.to_array()) - point;
                let distance = dir.length();
                let one = Doubles::splat(1.0);
                let nearness = one / distance;
                let fade = match falloff {
                    Falloff::InverseSquare => nearness * nearness,
                    Falloff::None => one,
                };
                let faded = |i: f32| Singles::narrow(Doubles::splat(f64::from(i)) * fade);
                Arrival {
                    some: !Lanes::eq(distance, Doubles::zero()),
                    towards: dir * nearness,
                    irradiance: intensity.map(faded),
                }
            }
            Light::Directional {
                direction,
                irradiance,
            } => {
                let towards = Vec3::splat((-unit(*direction)).to_array());
                Arrival {
                    some: On::splat(true),
                    towards,
                    irradiance: irradiance.map(Singles::splat),
                }
            }
        }
    }
}
