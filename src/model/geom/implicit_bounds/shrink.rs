//! Shrinks a box to the zeros in it.
//!
//! One face after the other is moved inward. A heap orders cells of the box by how far they reach
//! towards the face; the farthest is bisected where the polynomial varies most. Halves that
//! certainly hold no zero are discarded, by the range of values over the half or by the mean value
//! form (Moore, Interval Analysis, 1966) f(c) + f'(X)·(X − c), whose excess shrinks with the
//! square of the width. The same form narrows cells, axis by axis. The face moves to the farthest
//! remaining cell once that is small, or once a change of sign shows a zero not far below it.
//!
//! The first rounds are coarse. Each begins with the box of the round before, so cells take on its
//! shape, and a small surface in a large box is found in few steps.

use super::work::Work;
use crate::geom::{Clip, Sphere};
use crate::math::Interval;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// The most rounds until the box no longer shrinks; each takes off a quarter at least.
const ROUNDS: usize = 400;
/// The precision of a face relative to the box's extent: in the coarse rounds, and in the last
/// one.
const COARSE: f64 = 1.0 / 8.0;
const FINE: f64 = 1.0 / 512.0;
/// The size of a cell on every axis, relative to the precision of a face, at which it is not
/// bisected.
const FLOOR: f64 = 1.0 / 4.0;
/// The most evaluations for one face in a coarse round.
const COARSE_EVALUATIONS: u64 = 6000;
/// The size relative to the largest coordinate below which nothing is resolved.
const RESOLUTION: f64 = 1.0 / (1_u64 << 32) as f64;

/// Returns a smaller box that holds all zeros of the given one; `None` if there are none.
pub(super) fn shrunk(
    work: &mut Work,
    clip: Option<&Clip>,
    region: [Interval; 3],
) -> Option<[Interval; 3]> {
    let mut region = region;
    for _ in 0..ROUNDS {
        let before = region;
        // Half of the budget is left for the last round.
        let half = work.left() / 2;
        let mut part = work.part(half);
        for face in 0..6 {
            let mut share = part.part_of_evaluations(COARSE_EVALUATIONS);
            region = moved_in(&mut share, clip, &region, face, COARSE)?;
            part.give_back(share);
        }
        work.give_back(part);
        let shrinks = |k: usize| region[k].width() < 0.75 * before[k].width();
        let is_resolved = |k: usize| region[k].width() <= resolution(&region);
        let again = (0..3).any(|k| shrinks(k) && !is_resolved(k));
        if !again || work.is_spent() {
            break;
        }
    }
    for face in 0..6 {
        let mut part = work.part(work.left() / (6 - face as u64));
        region = moved_in(&mut part, clip, &region, face, FINE)?;
        work.give_back(part);
    }
    Some(region)
}

fn resolution(region: &[Interval; 3]) -> f64 {
    region.iter().fold(0.0, |m, x| f64::max(m, x.max_abs())) * RESOLUTION
}

/// A box that may hold zeros.
struct Cell {
    region: [Interval; 3],
    /// The axis to bisect.
    axis: usize,
    /// How far the cell reaches towards the face.
    reach: f64,
    number: u64,
}

impl Ord for Cell {
    /// Orders by reach; among equal cells the latest, which is the smallest, comes first.
    fn cmp(&self, other: &Cell) -> Ordering {
        let reach = self.reach.total_cmp(&other.reach);
        reach.then(self.number.cmp(&other.number))
    }
}

impl PartialOrd for Cell {
    fn partial_cmp(&self, other: &Cell) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Cell {
    fn eq(&self, other: &Cell) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Cell {}

/// Returns the box with one face moved inward as far as the precision (relative to its extent) and
/// the budget allow. Faces 0 and 1 are those of the least and the largest x.
fn moved_in(
    work: &mut Work,
    clip: Option<&Clip>,
    whole: &[Interval; 3],
    face: usize,
    precision: f64,
) -> Option<[Interval; 3]> {
    let (axis, side) = (face / 2, if face.is_multiple_of(2) { -1.0 } else { 1.0 });
    let reach = |region: &[Interval; 3]| {
        if side < 0.0 {
            -region[axis].low
        } else {
            region[axis].high
        }
    };
    let small: [f64; 3] =
        std::array::from_fn(|k| (whole[k].width() * precision).max(resolution(whole)));
    // The farthest points found with f below and above zero: a zero lies between them.
    let mut signs = [f64::NEG_INFINITY; 2];
    let mut cells = BinaryHeap::new();
    let mut number = 0;
    let mut add = |cells: &mut BinaryHeap<Cell>, region: [Interval; 3], gradient: [f64; 3]| {
        number += 1;
        let part = |k: usize| {
            let part = region[k].width() / small[k];
            if part > FLOOR {
                gradient[k] * region[k].width()
            } else {
                -1.0
            }
        };
        cells.push(Cell {
            region,
            axis: (0..3).fold(0, |w, k| if part(k) > part(w) { k } else { w }),
            reach: reach(&region),
            number,
        });
    };
    add(&mut cells, *whole, small.map(|x| 1.0 / x));
    while let Some(cell) = cells.pop() {
        let part = |k: usize| cell.region[k].width() / small[k];
        let at = &cell.region[cell.axis];
        let middle = at.middle();
        let is_certain = cell.reach - signs[0].min(signs[1]) <= small[axis];
        let is_small = (0..3).all(|k| !(part(k) > FLOOR));
        let is_stuck = !(at.low < middle && middle < at.high);
        if is_certain || is_small || is_stuck || work.is_spent() {
            let mut result = *whole;
            if side < 0.0 {
                result[axis].low = 0.0 - cell.reach;
            } else {
                result[axis].high = cell.reach;
            }
            return Some(result);
        }
        for mut half in halves(&cell.region, cell.axis, middle) {
            let slopes = slopes_unless_clear(work, clip, &mut half, |sign, point| {
                let is_seen = clip.is_none_or(|clip| holds(clip, &point));
                let along = side * point[axis];
                if is_seen && along > signs[sign] {
                    signs[sign] = along;
                }
            });
            if let Some(slopes) = slopes {
                add(&mut cells, half, slopes);
            }
        }
    }
    None
}

pub(super) fn halves(region: &[Interval; 3], axis: usize, middle: f64) -> [[Interval; 3]; 2] {
    let [mut below, mut above] = [*region; 2];
    below[axis].high = middle;
    above[axis].low = middle;
    [below, above]
}

/// Returns how steep the polynomial may be in a box along each axis; `None` if the box certainly
/// has no zero in the clip. Calls `seen` with a point of the box where the polynomial certainly is
/// below (0) or above (1) zero, if it finds one.
pub(super) fn slopes_unless_clear(
    work: &mut Work,
    clip: Option<&Clip>,
    region: &mut [Interval; 3],
    mut seen: impl FnMut(usize, [f64; 3]),
) -> Option<[f64; 3]> {
    loop {
        let is_outside = clip.is_some_and(|clip| is_outside(clip, region));
        if is_outside || work.values(region).excludes_zero() {
            return None;
        }
        let center = region.map(|x| x.middle());
        let at_center = work.values(&center.map(Interval::point));
        let gradient = work.slopes(region).gradient;
        let before = *region;
        narrow(region, &center, &at_center, &gradient)?;
        if at_center.excludes_zero() {
            seen(usize::from(at_center.low > 0.0), center);
        }
        let is_less = |k: usize| region[k].width() < 0.5 * before[k].width();
        if !(0..3).any(is_less) || work.is_spent() {
            return Some(gradient.map(|g| g.max_abs()));
        }
    }
}

/// Narrows a box axis by axis to where the mean value form may be zero: an interval Newton step on
/// each axis along which the slope has one sign. `None` if nothing is left.
fn narrow(
    region: &mut [Interval; 3],
    center: &[f64; 3],
    at_center: &Interval,
    gradient: &[Interval; 3],
) -> Option<()> {
    let terms: [Interval; 3] = std::array::from_fn(|k| {
        let off = region[k].minus(&Interval::point(center[k]));
        gradient[k].times(&off)
    });
    for k in 0..3 {
        let others = at_center.plus(&terms[(k + 1) % 3]);
        let others = others.plus(&terms[(k + 2) % 3]);
        if others.plus(&terms[k]).excludes_zero() {
            return None;
        }
        if gradient[k].excludes_zero() {
            let root = Interval::point(center[k]).minus(&others.over(&gradient[k]));
            region[k].low = region[k].low.max(root.low);
            region[k].high = region[k].high.min(root.high);
        }
        if !(region[k].low <= region[k].high) {
            return None;
        }
    }
    Some(())
}

/// Says whether a point is in the clip, up to rounding.
fn holds(clip: &Clip, point: &[f64; 3]) -> bool {
    match clip {
        Clip::Sphere(s) => {
            let squared = |k: usize| (point[k] - s.center[k]) * (point[k] - s.center[k]);
            squared(0) + squared(1) + squared(2) <= s.radius * s.radius
        }
        Clip::Cuboid(c) => (0..3).all(|k| c.min[k] <= point[k] && point[k] <= c.max[k]),
    }
}

/// Returns the range over a box of squared distances from a sphere's centre, minus its squared
/// radius.
fn above_sphere(sphere: &Sphere, region: &[Interval; 3]) -> Interval {
    let squared = |k: usize| {
        let off = region[k].minus(&Interval::point(sphere.center[k]));
        off.squared()
    };
    let sum = squared(0).plus(&squared(1)).plus(&squared(2));
    sum.minus(&Interval::point(sphere.radius).squared())
}

/// Says whether a box certainly has no point of the clip.
fn is_outside(clip: &Clip, region: &[Interval; 3]) -> bool {
    match clip {
        Clip::Sphere(s) => above_sphere(s, region).low > 0.0,
        Clip::Cuboid(c) => (0..3).any(|k| region[k].high < c.min[k] || region[k].low > c.max[k]),
    }
}

/// Says whether a box certainly lies in the clip.
pub(super) fn is_inside(clip: &Clip, region: &[Interval; 3]) -> bool {
    match clip {
        Clip::Sphere(s) => above_sphere(s, region).high <= 0.0,
        Clip::Cuboid(c) => (0..3).all(|k| region[k].low >= c.min[k] && region[k].high <= c.max[k]),
    }
}
