//! Lights without extent: points and directions.

use super::materials::Rgb;
use glam::DVec3;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    Point {
        /// The position in world space.
        position: DVec3,
        /// The radiant intensity in W/sr; with [`Falloff::None`] the irradiance at any
        /// distance, in W/m².
        intensity: Rgb,
        falloff: Falloff,
    },
    Directional {
        /// The direction in which the light travels, in world space, of any length > 0.
        direction: DVec3,
        /// The irradiance on a surface that faces the light, in W/m².
        irradiance: Rgb,
    },
}

/// The decrease of a point light with distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Falloff {
    InverseSquare,
    /// No decrease, for formats whose lights have none (NFF, POV SDL).
    None,
}
