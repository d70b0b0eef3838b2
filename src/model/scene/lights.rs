//! Lights without extent: points and directions.

use super::materials::Rgb;
use glam::DVec3;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    Point {
        /// World space.
        position: DVec3,
        /// W/sr; with [`Falloff::None`] the irradiance at any distance, W/m².
        intensity: Rgb,
        falloff: Falloff,
    },
    Directional {
        /// The way the light travels, world space, any length > 0.
        direction: DVec3,
        /// On a surface that faces it, W/m².
        irradiance: Rgb,
    },
}

/// How a point light fades with distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Falloff {
    InverseSquare,
    /// For formats whose lights do not fade (NFF, POV SDL).
    None,
}
