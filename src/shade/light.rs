//! Lights as seen from points, in lanes.

use super::lit::{Doubles, Singles};
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
    /// The shadow ray's direction; it ends at [`end_of`].
    pub dir: Vec3<Doubles>,
    /// On a surface that faces the light, W/m².
    pub irradiance: [Singles; 3],
}

/// t of a light on rays with [`Arrival::dir`], before it by what rounding may move
/// it ([`LIGHT_END`]).
pub fn end_of(light: &Light) -> f32 {
    match light {
        Light::Point { .. } => LIGHT_END,
        Light::Directional { .. } => f32::INFINITY,
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
                let distance = dir.length_squared().sqrt();
                let one = Doubles::splat(1.0);
                let fade = match falloff {
                    Falloff::InverseSquare => one / (distance * distance),
                    Falloff::None => one,
                };
                let towards = Vec3::new(dir.x / distance, dir.y / distance, dir.z / distance);
                let faded = |i: f32| Singles::narrow(Doubles::splat(f64::from(i)) * fade);
                Arrival {
                    some: !Lanes::eq(distance, Doubles::zero()),
                    towards,
                    dir,
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
                    dir: towards,
                    irradiance: irradiance.map(Singles::splat),
                }
            }
        }
    }
}
