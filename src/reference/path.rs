//! The judge's own way from a hit to the lights.
//!
//! The start lies off the surface, on the side that the ray came from, by
//! several times the error of the hit point (pbrt, "Managing rounding error"):
//! that of o + t·d, and that of the object ray as seen from the world.

use super::approx::{Approx, add, exact3, scaled};
use super::ray::dot;
use super::{Hit, Reference};
use crate::scene::Light;

/// Whether a light is hidden from a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shadow {
    pub blocked: bool,
    /// The light lies in the surface's plane but for rounding: which side it is
    /// on depends on a bit of the normal.
    pub grazing: bool,
}

/// Of the light with this number, from the hit of the ray `org`, `dir`. A light
/// behind the surface is hidden by it.
pub fn shadow(
    reference: &Reference,
    org: [f64; 3],
    dir: [f64; 3],
    hit: &Hit,
    light: &Light,
) -> Shadow {
    let t = Approx {
        value: hit.t,
        error: hit.t.abs() * f64::EPSILON,
    };
    let point = add(exact3(org), scaled(exact3(dir), t));
    let facing = if dot(hit.normal, dir) > 0.0 {
        -1.0
    } else {
        1.0
    };
    let normal = hit.normal.map(|x| x * facing);

    let along_normal: f64 = (0..3).map(|k| normal[k].abs() * point[k].error).sum();
    let size = (0..3).fold(0.0, |m, k| {
        f64::max(m, f64::max(org[k].abs(), point[k].value.abs()))
    });
    let placement = reference.condition_of(hit);
    let off = 8.0 * along_normal + 32.0 * f64::EPSILON * placement * size;
    let start: [f64; 3] = std::array::from_fn(|k| point[k].value + normal[k] * off);

    let (to_light, t_max) = match light {
        Light::Point { position, .. } => {
            let p = position.to_array();
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
