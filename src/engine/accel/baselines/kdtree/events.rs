//! Events, at which entries begin and end along the axes, and the sweep over them that finds
//! the cheapest plane (Wald and Havran 2006, section 4).
//!
//! An event is one u64, so that sorting numbers sorts events by position, then axis, then
//! kind: entries that end at a plane come before those that lie in it, and these before those
//! that begin there. No two events of a cell are equal, so their order does not depend on the
//! sorting algorithm.

use super::quality::KdQuality;
use crate::math::Aabb32;

/// An event: position (32 bits, ordered), axis (2), kind (2), entry of the cell (28).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Event(u64);

pub(super) const END: usize = 0;
pub(super) const PLANAR: usize = 1;
pub(super) const START: usize = 2;

const ENTRY: u64 = (1 << 28) - 1;

impl Event {
    fn new(position: f32, axis: usize, kind: usize, entry: usize) -> Event {
        // The sum turns −0 into 0.
        let bits = (position + 0.0).to_bits();
        let ordered = bits ^ (((bits as i32 >> 31) as u32) | 1 << 31);
        Event(u64::from(ordered) << 32 | (axis as u64) << 30 | (kind as u64) << 28 | entry as u64)
    }

    pub(super) fn position(self) -> f32 {
        let ordered = (self.0 >> 32) as u32;
        let bits = if ordered >> 31 != 0 {
            ordered ^ 1 << 31
        } else {
            !ordered
        };
        f32::from_bits(bits)
    }

    /// Returns the position and the axis as one number.
    fn plane(self) -> u64 {
        self.0 >> 30
    }

    pub(super) fn axis(self) -> usize {
        (self.0 >> 30 & 3) as usize
    }

    pub(super) fn kind(self) -> usize {
        (self.0 >> 28 & 3) as usize
    }

    pub(super) fn entry(self) -> usize {
        (self.0 & ENTRY) as usize
    }

    /// Returns the same event with the entry's number in a child cell.
    pub(super) fn renumbered(self, entry: usize) -> Event {
        Event(self.0 & !ENTRY | entry as u64)
    }
}

/// Appends all events of one entry, unsorted.
pub(super) fn push_events(region: &Aabb32, entry: usize, events: &mut Vec<Event>) {
    for axis in 0..3 {
        let (low, high) = (region.min[axis], region.max[axis]);
        if low == high {
            events.push(Event::new(low, axis, PLANAR, entry));
        } else {
            events.push(Event::new(low, axis, START, entry));
            events.push(Event::new(high, axis, END, entry));
        }
    }
}

/// A split of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Split {
    pub axis: usize,
    pub position: f32,
    /// Whether entries in the plane go to the lower child.
    pub planar_low: bool,
    /// The cost in primitive tests if both children were leaves.
    pub cost: f64,
}

/// The measure of a cell to which the probability that a ray meets it is proportional: the
/// area, or the length if all cells lie on a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Measure {
    Area,
    Length,
}

impl Measure {
    /// Returns the measure of a cell.
    pub(super) fn size(self, cell: &Aabb32) -> f64 {
        let d: [f64; 3] = std::array::from_fn(|k| f64::from(cell.max[k]) - f64::from(cell.min[k]));
        match self {
            Measure::Area => d[0] * d[1] + d[1] * d[2] + d[2] * d[0],
            Measure::Length => d[0] + d[1] + d[2],
        }
    }
}

/// Returns the part of a cell below a plane, and the part above.
pub(super) fn halves(cell: &Aabb32, axis: usize, position: f32) -> [Aabb32; 2] {
    let (mut low, mut high) = (*cell, *cell);
    low.max[axis] = position;
    high.min[axis] = position;
    [low, high]
}

/// Finds the cheapest plane strictly inside the cell at which some entry begins or ends, the
/// first of equal ones.
pub(super) fn best_split(
    events: &[Event],
    entries: usize,
    cell: &Aabb32,
    measure: Measure,
    quality: &KdQuality,
) -> Option<Split> {
    let whole = measure.size(cell);
    let (mut below, mut above) = ([0_usize; 3], [entries; 3]);
    let mut best: Option<Split> = None;
    let mut i = 0;
    while i < events.len() {
        let (plane, axis, position) = (events[i].plane(), events[i].axis(), events[i].position());
        let mut counts = [0_usize; 3];
        while i < events.len() && events[i].plane() == plane {
            counts[events[i].kind()] += 1;
            i += 1;
        }
        above[axis] -= counts[PLANAR] + counts[END];
        if cell.min[axis] < position && position < cell.max[axis] {
            let [p, q] = halves(cell, axis, position).map(|half| measure.size(&half) / whole);
            let mut consider = |low: usize, high: usize, planar_low: bool| {
                let factor = if low == 0 || high == 0 {
                    f64::from(quality.empty_factor)
                } else {
                    1.0
                };
                let cost =
                    f64::from(quality.node_cost) + factor * (p * low as f64 + q * high as f64);
                if best.is_none_or(|b| cost < b.cost) {
                    best = Some(Split {
                        axis,
                        position,
                        planar_low,
                        cost,
                    });
                }
            };
            consider(below[axis] + counts[PLANAR], above[axis], true);
            if counts[PLANAR] > 0 {
                consider(below[axis], above[axis] + counts[PLANAR], false);
            }
        }
        below[axis] += counts[START] + counts[PLANAR];
    }
    best
}

/// Merges two sorted lists.
pub(super) fn merged(a: &[Event], b: &[Event]) -> Vec<Event> {
    let mut all = Vec::with_capacity(a.len() + b.len());
    let (mut i, mut j) = (0, 0);
    while i < a.len() && j < b.len() {
        if a[i] < b[j] {
            all.push(a[i]);
            i += 1;
        } else {
            all.push(b[j]);
            j += 1;
        }
    }
    all.extend_from_slice(&a[i..]);
    all.extend_from_slice(&b[j..]);
    all
}

#[cfg(test)]
mod tests;
