//! `offset`: an outline whose edges are moved along their normals.
//!
//! Each ring becomes one whose edges are moved and joined at the corners, and what these wind
//! around a positive number of times is inside (Chen and McMains 2005, Polygon offsetting by
//! computing winding numbers). The joins are those of the library Clipper 6, by which OpenSCAD
//! offsets, so that facets are the same; `i_overlay`'s own offsets have other ones.

use super::polygons::{Grid, Rings, cleaned, few_enough, positive};
use glam::DVec2;
use std::f64::consts::{PI, TAU};

/// How the corners of an offset look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Corner {
    /// Round, with so many sides to a circle.
    Round(u32),
    /// The edges run on until they meet.
    Sharp,
    /// Cut off at the distance of the edges.
    Cut,
}

/// An edge that is turned by less than this, in radians, is not turned.
const STRAIGHT: f64 = 1e-11;

/// A sharp corner is cut off if its edges turn back to this: 1 + the cosine of the turn, of a limit
/// of 10^6 times the distance.
const SHARPEST: f64 = 2e-12;

/// Moves the edges of rings outward by a distance, or inward by one below 0.
pub(super) fn offset(rings: &Rings, by: f64, corner: Corner) -> Result<Rings, String> {
    few_enough(std::iter::once(rings))?;
    if by == 0.0 || rings.is_empty() {
        return Ok(rings.clone());
    }
    // Outlines run counter-clockwise, and holes clockwise.
    let rings = cleaned(rings)?;
    let points = || rings.iter().flatten();
    let size = points().fold(by.abs(), |most, p| most.max(p.abs().max_element()));
    if !(size < 1e150 && size > 1e-150) {
        return Err("the outline is too large or too small to be offset".into());
    }
    let low = points().fold(DVec2::INFINITY, |low, p| low.min(*p));
    let high = points().fold(DVec2::NEG_INFINITY, |high, p| high.max(*p));
    if (high - low).min_element() <= -2.0 * by {
        return Ok(Rings::new());
    }
    let moved: Rings = rings.iter().map(|ring| moved(ring, by, corner)).collect();
    few_enough(std::iter::once(&moved))?;
    positive(&moved, &Grid::of(moved.iter()))
}

/// Moves the edges of one ring, and joins them.
fn moved(ring: &[DVec2], by: f64, corner: Corner) -> Vec<DVec2> {
    let count = ring.len();
    let normal = |i: usize| {
        let edge = ring[(i + 1) % count] - ring[i % count];
        -edge.perp().normalize_or_zero()
    };
    let mut moved = Vec::with_capacity(count * 2);
    for (i, p) in ring.iter().enumerate() {
        let (before, after) = (normal(i + count - 1), normal(i));
        let (sin, cos) = (before.perp_dot(after), before.dot(after));
        let turn = libm::atan2(sin, cos);
        if sin.abs() < STRAIGHT && cos > 0.0 {
            moved.push(*p + before * by);
            continue;
        }
        if sin * by < 0.0 {
            // The corner itself is between them, so that what runs back winds around nothing.
            moved.extend([*p + before * by, *p, *p + after * by]);
            continue;
        }
        match corner {
            Corner::Sharp if 1.0 + cos >= SHARPEST => {
                moved.push(*p + (before + after) * (by / (1.0 + cos)));
            }
            Corner::Sharp | Corner::Cut => {
                let along = libm::tan(turn * 0.25);
                moved.push(*p + (before + before.perp() * along) * by);
                moved.push(*p + (after - after.perp() * along) * by);
            }
            Corner::Round(sides) => {
                // Clipper takes no chord that is more than a quarter of the radius off.
                let sides = f64::from(sides).max(PI / libm::acos(0.75));
                let step = (TAU / sides).copysign(turn);
                let steps = libm::round(turn / step).max(1.0) as u32;
                let arc = (0..steps).map(|k| {
                    let (sin, cos) = libm::sincos(step * f64::from(k));
                    *p + DVec2::new(cos, sin).rotate(before) * by
                });
                moved.extend(arc);
                moved.push(*p + after * by);
            }
        }
    }
    moved
}
