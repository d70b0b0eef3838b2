//! The figures of a solid in a unit of its own size, before they are placed.

use super::moments::Symmetric;
use glam::DVec3;
use serde::Serialize;

/// Bound on the roundings of a closed formula of a few dozen operations, relative to the
/// magnitudes of its terms.
pub const ROUNDINGS: f64 = 64.0 * f64::EPSILON;

/// The way in which a figure was found, the most certain first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// A formula; the error is a bound on its roundings.
    #[default]
    ClosedForm,
    /// Sums over a closed surface of triangles; the error is a bound on roundings.
    Divergence,
    /// Nested quadrature; the error is an estimate from two rules.
    Quadrature,
    /// Random lines; the error is the half-width of the 95 % confidence interval.
    Sampling,
}

/// Figures of a solid about an origin near it, in lengths of a unit of about its size.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Body {
    pub volume: f64,
    pub volume_error: f64,
    pub area: f64,
    pub area_error: f64,
    pub centroid: DVec3,
    /// Bound on the distance of `centroid` from the exact one.
    pub centroid_error: f64,
    /// Second moments ∫(p − c)(p − c)ᵀ about the centroid c.
    pub spread: Symmetric,
    /// Error of each entry of `spread`.
    pub spread_error: f64,
    pub method: Method,
    pub area_method: Method,
}
