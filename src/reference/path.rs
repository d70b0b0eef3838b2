//! The oracle's own shadow rays, from a hit to a light.
//!
//! The start lies off the surface, on the side that the ray came from, by several times the
//! error of the hit point (Pharr, Jakob and Humphreys, *Physically Based Rendering*,
//! "Managing Rounding Error"): the error of o + t·d, and that of the object ray as seen
//! from the world (docs/numerics/oracle.md, O7).

use super::approx::{Approx, add, exact3, scaled};
use super::ray::dot;
use super::{Hit, Reference};
use crate::scene::Light;

/// The answer of one shadow ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shadow {
    /// Whether the light is hidden from the point.
    pub blocked: bool,
    /// Whether the light lies in the surface's plane to within rounding, so that a bit of
    /// the normal decides on which side it is.
    pub grazing: bool,
}

/// Traces a shadow ray towards `light` from the hit of the ray `org`, `dir`. A light behind
/// the surface is hidden by it.
pub fn shadow(
    reference: &Reference,
    org: [f64; 3],
    dir: [f64; 3],
    hit: &Hit,
    light: &Light,
) -> Shadow {
    let Left { point, off } = leaving(reference, org, dir, hit);
    let facing = if dot(hit.normal, dir) > 0.0 {
        -1.0
    } else {
        1.0
    };
    let normal = hit.normal.map(|x| x * facing);
    let start: [f64; 3] = std::array::from_fn(|k| point[k] + normal[k] * off);

    let (to_light, t_max) = match light {
        Light::Point { position, .. } | Light::Spot { position, .. } => {
            let p = position.to_array();
            (std::array::from_fn(|k| p[k] - start[k]), 1.0)
        }
        Light::Rectangle { center, .. } | Light::Disc { center, .. } => {
            let p = center.to_array();
            (std::array::from_fn(|k| p[k] - start[k]), 1.0)
        }
        Light::Directional { direction, .. } => (direction.to_array().map(|x| -x), f64::INFINITY),
    };
    let above = dot(normal, to_light);
    let rounding = 1e-12 * to_light.iter().map(|x| x.abs()).sum::<f64>();
    Shadow {
        blocked: above <= 0.0 || reference.blocked(start, to_light, t_max),
        grazing: above.abs() <= rounding,
    }
}

/// Where a ray met a surface, and how far off it rays that leave have to start.
#[derive(Clone, Copy, Debug)]
pub struct Left {
    pub point: [f64; 3],
    /// Along the normal, on the side on which the ray leaves.
    pub off: f64,
}

/// Computes the point of a hit, and the distance from it at which rays leave (O7).
pub fn leaving(reference: &Reference, org: [f64; 3], dir: [f64; 3], hit: &Hit) -> Left {
    let t = Approx {
        value: hit.t,
        error: hit.t.abs() * f64::EPSILON,
    };
    let point = add(exact3(org), scaled(exact3(dir), t));
    let along_normal: f64 = (0..3).map(|k| hit.normal[k].abs() * point[k].error).sum();
    let size = (0..3).fold(0.0, |m, k| {
        f64::max(m, f64::max(org[k].abs(), point[k].value.abs()))
    });
    let placement = reference.condition_of(hit);
    Left {
        point: point.map(|x| x.value),
        // 8 times the point's error along the normal, and 32·2v of the coordinates (O7).
        off: 8.0 * along_normal + 32.0 * f64::EPSILON * placement * size,
    }
}
