//! Lights as seen from a point.

use crate::math::bounds::LIGHT_END;
use crate::math::{length, unit};
use crate::scene::{Falloff, Light, Rgb};
use glam::DVec3;

/// Where a light lies from a point, and what arrives.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// Unit, from the point to the light.
    pub towards: DVec3,
    /// The shadow ray: its direction, and where it ends: before the light, by what
    /// rounding may move it ([`LIGHT_END`]).
    pub dir: DVec3,
    pub t_max: f32,
    /// On a surface that faces the light, W/m².
    pub irradiance: Rgb,
}

impl Arrival {
    /// `None` where nothing arrives.
    pub fn at(light: &Light, point: DVec3) -> Option<Arrival> {
        match light {
            Light::Point {
                position,
                intensity,
                falloff,
            } => {
                let dir = *position - point;
                let distance = length(dir);
                if distance == 0.0 {
                    return None;
                }
                let fade = match falloff {
                    Falloff::InverseSquare => 1.0 / (distance * distance),
                    Falloff::None => 1.0,
                };
                Some(Arrival {
                    towards: dir / distance,
                    dir,
                    t_max: LIGHT_END,
                    irradiance: intensity.map(|i| (f64::from(i) * fade) as f32),
                })
            }
            Light::Directional {
                direction,
                irradiance,
            } => {
                let towards = -unit(*direction);
                Some(Arrival {
                    towards,
                    dir: towards,
                    t_max: f32::INFINITY,
                    irradiance: *irradiance,
                })
            }
        }
    }
}
