//! All that one line has of a surface, where f64 knows that.

use super::chebyshev_nodes::interpolated;
use super::lane_regrouping::by_degree;
use super::{ONE, Rays, double_double_form};
use crate::geom::Tape;
use crate::math::Vec3;
use crate::math::bounds::UNIT;
use crate::roots::lanes::{self as roots, Segment, Simple};
use std::cmp::Ordering;

/// A simple root along a line, the only one between `from` and `to` and a little beyond.
pub type Crossing = Simple;

/// All of a line's crossings between two t, ascending; and the sign of f at the first t.
/// `None`: f64 does not know them all.
pub fn crossings(
    tape: &Tape,
    line: ([f64; 3], [f64; 3]),
    between: [f64; 2],
    found: &mut Vec<Crossing>,
) -> Option<Ordering> {
    found.clear();
    by_degree!(
        tape.degree(),
        N => find_all::<N>(tape, line, between, found),
        None
    )
}

#[inline(never)]
fn find_all<const N: usize>(
    tape: &Tape,
    (org, dir): ([f64; 3], [f64; 3]),
    [from, to]: [f64; 2],
    found: &mut Vec<Crossing>,
) -> Option<Ordering> {
    let width = (to - from) * (1.0 + 4.0 * UNIT);
    if !(width > 0.0 && width.is_finite() && from.is_finite()) {
        return None;
    }
    let rays = Rays {
        org: Vec3::<f64>::splat(org),
        dir: Vec3::splat(dir),
        t_min: from,
        limit: to,
    };
    // The map from s to t rounds; and there is room for an interval a little wider.
    let slack = (from.abs() + width) * (3.01 * UNIT);
    let room = 8.0 * slack / width;
    let mut store = ONE.take().unwrap_or_default();
    let mut settled = |segment: &Segment<f64, N>| {
        let begins = segment.scaled[0];
        found.clear();
        let is_known =
            begins.abs() > segment.first && roots::all(segment, room, &mut store.waiting, found);
        is_known.then(|| begins.total_cmp(&0.0))
    };
    let plain = interpolated::<f64, N>(tape, &rays, (from, width, 0.0), &mut store.values);
    let sign = settled(&plain).or_else(|| {
        let better = double_double_form::interpolated::<N>(tape, (org, dir), from, width);
        settled(&better)
    });
    ONE.set(Some(store));
    let sign = sign?;
    for root in found {
        let at = |s: f64| from + s * width;
        let known = Crossing {
            t: at(root.t),
            from: at(root.from) - slack,
            to: at(root.to) + slack,
        };
        *root = double_double_form::refined(tape, (org, dir), known);
    }
    Some(sign)
}
