//! All roots of a polynomial surface along one line, as far as f64 is certain of them.

use super::chebyshev_nodes::interpolated;
use super::lane_regrouping::by_degree;
use super::{PolynomialScratch, Rays, Store, double_double_form};
use crate::geom::Tape;
use crate::math::Vec3;
use crate::math::bounds::UNIT;
use crate::roots::lanes::{self as roots, Segment, Simple};
use std::cmp::Ordering;

/// A simple root along a line, the only one in a neighbourhood of [`from`, `to`].
pub type SimpleCrossing = Simple;

/// Finds all crossings of a line between two t, ascending in `scratch.crossings`, and returns the
/// sign of f at the first t. `None` if f64 is not certain of all of them: first in f64, and then
/// with values in double-double.
pub fn crossings(
    tape: &Tape,
    line: ([f64; 3], [f64; 3]),
    between: [f64; 2],
    scratch: &mut PolynomialScratch,
) -> Option<Ordering> {
    let PolynomialScratch {
        one: store,
        crossings: found,
        ..
    } = scratch;
    found.clear();
    by_degree!(
        tape.degree(),
        N => find_all::<N>(tape, line, between, (store, found)),
        None
    )
}

#[inline(never)]
fn find_all<const N: usize>(
    tape: &Tape,
    (org, dir): ([f64; 3], [f64; 3]),
    [from, to]: [f64; 2],
    (store, found): (&mut Store<f64>, &mut Vec<SimpleCrossing>),
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
    // The map from s to t is off by 3.01u (F10, docs/numerics/polynomials.md); `room` keeps a
    // slightly wider interval free of other roots.
    let slack = (from.abs() + width) * (3.01 * UNIT);
    let room = 8.0 * slack / width;
    let Store {
        values, waiting, ..
    } = store;
    let mut settled = |segment: &Segment<f64, N>| {
        let begins = segment.scaled[0];
        found.clear();
        let is_known = begins.abs() > segment.first && roots::all(segment, room, waiting, found);
        is_known.then(|| begins.total_cmp(&0.0))
    };
    let plain = interpolated::<f64, N>(tape, &rays, (from, width, 0.0), values);
    let sign = settled(&plain).or_else(|| {
        let better = double_double_form::interpolated::<N>(tape, (org, dir), from, width);
        settled(&better)
    });
    let sign = sign?;
    for root in found {
        let at = |s: f64| from + s * width;
        let known = SimpleCrossing {
            t: at(root.t),
            from: at(root.from) - slack,
            to: at(root.to) + slack,
        };
        *root = double_double_form::refined(tape, (org, dir), known);
    }
    Some(sign)
}
