//! Circles as they are, or with as many sides as OpenSCAD gives them.

use super::arguments::Arguments;
use crate::Curves;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// A circle of `$fn` up to this many sides is a polygon that the author meant, such as the head of
/// a screw.
pub(super) const MEANT_SIDES: f64 = 12.0;

/// The most sides of a circle; `$fn` may be any number.
const MOST_SIDES: f64 = 4096.0;

/// The sides of a circle that must have some where curves are exact.
pub(super) const FINE_SIDES: u32 = 256;

/// Returns the number of sides that OpenSCAD gives a circle of this radius, by $fn, $fa and $fs.
pub(super) fn sides(of: &Arguments, radius: f64) -> u32 {
    let asked = of.number_or("$fn", 0.0);
    let sides = if asked > 0.0 {
        asked.floor().max(3.0)
    } else {
        let [angle, length] = [("$fa", 12.0), ("$fs", 2.0)]
            .map(|(name, default)| of.number_or(name, default).max(0.01));
        (360.0 / angle).min(radius * TAU / length).max(5.0).ceil()
    };
    // NaN becomes 0, and then 3.
    (sides.min(MOST_SIDES) as u32).max(3)
}

/// Returns the number of sides of a circle; `None` if it is round.
pub(super) fn sides_if_any(curves: Curves, of: &Arguments, radius: f64) -> Option<u32> {
    let asked = of.number_or("$fn", 0.0);
    let is_meant = asked > 0.0 && asked.floor() <= MEANT_SIDES;
    (curves == Curves::Facets || is_meant).then(|| sides(of, radius))
}

/// Returns the corners of a regular polygon, the first on the x axis; exactly at quarters.
pub(super) fn circle(radius: f64, sides: u32) -> Vec<DVec2> {
    let corner = |i: u32| {
        let eighths = u64::from(i) * 8;
        let count = u64::from(sides);
        let direction = match (eighths % count == 0).then_some(eighths / count) {
            Some(0) => DVec2::X,
            Some(2) => DVec2::Y,
            Some(4) => DVec2::NEG_X,
            Some(6) => DVec2::NEG_Y,
            _ => {
                let (sin, cos) = libm::sincos(TAU * f64::from(i) / f64::from(sides));
                DVec2::new(cos, sin)
            }
        };
        direction * radius
    };
    (0..sides).map(corner).collect()
}

/// Returns the corners of the sphere that OpenSCAD makes: rings of `sides` corners.
pub(super) fn sphere(radius: f64, sides: u32) -> Vec<Vec<DVec3>> {
    let rings = sides.div_ceil(2);
    let ring = |i: u32| {
        let polar = std::f64::consts::PI * (f64::from(i) + 0.5) / f64::from(rings);
        let (sin, cos) = libm::sincos(polar);
        let corners = circle(radius * sin, sides).into_iter();
        corners.map(|p| p.extend(radius * cos)).collect()
    };
    (0..rings).map(ring).collect()
}
