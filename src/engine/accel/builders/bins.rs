//! Binned splits (Wald, On fast Construction of SAH-based Bounding Volume Hierarchies, 2007).
//! One pass sorts the middles of boxes into equal bins on all three axes; then the cheapest
//! plane between bins is taken.
//!
//! Costs count whole blocks. Of equal costs the first plane is taken, and bins of chunks are
//! merged in their order, so the split depends on the rows alone.

use super::costs::{Costs, Scale};
use super::record::{Bound, Extents, Row};
use crate::math::lanes::{Lanes, f32x4, f32x8};

/// The number of bins on each axis. Measured: 16 bins build no faster, and 64 build no better
/// trees.
pub(super) const BINS: usize = 32;

/// 2²³. Its sum with a smaller number holds that number, rounded to an integer, in the low
/// bits.
const INTEGER: f32 = 8_388_608.0;

/// The map from a row's middle to its bins.
#[derive(Clone, Copy)]
pub(super) struct Grid {
    low: f32x4,
    scale: f32x4,
}

impl Grid {
    /// Makes the grid over a box of doubled middles.
    pub(super) fn over(middles: &Bound) -> Grid {
        let low = middles.store();
        let extent = middles.extent();
        let scale = |axis: usize| {
            let scale = (BINS - 1) as f32 / extent[axis];
            // Without an extent, or with one too large or small, all rows fall into one bin.
            if scale.is_finite() && extent[axis].is_finite() && scale > 0.0 {
                scale
            } else {
                0.0
            }
        };
        Grid {
            low: Lanes::load(&[-low[0], -low[1], -low[2], 0.0]),
            scale: Lanes::load(&[scale(0), scale(1), scale(2), 0.0]),
        }
    }

    /// Returns the bins of a row by axis, each below [`BINS`]; the fourth means nothing. The
    /// same row always gives the same bins.
    #[inline(always)]
    pub(super) fn bins(&self, row: &Row) -> [usize; 4] {
        let negated: f32x4 = Lanes::load(&row[..4]);
        let upper: f32x4 = Lanes::load(&row[4..]);
        let place = (upper - negated - self.low) * self.scale + <f32x4 as Lanes>::splat(INTEGER);
        Lanes::to_array(place).map(|x| x.to_bits() as usize % BINS)
    }
}

/// The boxes and counts of rows, by axis and bin.
#[derive(Clone)]
#[repr(C, align(64))]
pub(super) struct Bins {
    bounds: [[Row; BINS]; 3],
    count: [[u32; BINS]; 3],
}

/// A split: rows whose bin on `axis` is below `bin` go left.
#[derive(Clone, Copy, Debug)]
pub(super) struct Split {
    pub axis: usize,
    pub bin: usize,
    pub left: usize,
}

impl Bins {
    pub(super) fn empty() -> Bins {
        Bins {
            bounds: [[Bound::empty().store(); BINS]; 3],
            count: [[0; BINS]; 3],
        }
    }

    pub(super) fn fill(&mut self, rows: &[Row], grid: &Grid) {
        for row in rows {
            let bins = grid.bins(row);
            let bound = Bound::load(row);
            for (axis, bin) in bins.into_iter().take(3).enumerate() {
                let sum = &mut self.bounds[axis][bin];
                *sum = bound.union(Bound::load(sum)).store();
                self.count[axis][bin] += 1;
            }
        }
    }

    pub(super) fn merge(&mut self, other: &Bins) {
        for axis in 0..3 {
            for bin in 0..BINS {
                let sum = &mut self.bounds[axis][bin];
                *sum = Bound::load(&other.bounds[axis][bin])
                    .union(Bound::load(sum))
                    .store();
                self.count[axis][bin] += other.count[axis][bin];
            }
        }
    }

    /// Returns the number of rows that a split sends left.
    pub(super) fn left_of(&self, split: &Split) -> usize {
        let count = &self.count[split.axis][..split.bin];
        count.iter().sum::<u32>() as usize
    }

    /// Returns the boxes of the rows that go left and right.
    pub(super) fn sides(&self, split: &Split) -> [Bound; 2] {
        let (left, right) = self.bounds[split.axis].split_at(split.bin);
        [left, right].map(|side| {
            let bounds = side.iter().map(Bound::load);
            bounds.fold(Bound::empty(), |all, b| b.union(all))
        })
    }

    /// Finds the cheapest plane; `None` if all middles coincide or areas overflow.
    pub(super) fn best(&self, costs: &Costs, scale: Scale) -> Option<Split> {
        let mut least = f32::INFINITY;
        let mut best = None;
        for axis in 0..3 {
            let (bounds, count) = (&self.bounds[axis], &self.count[axis]);
            let mut right = [f32::INFINITY; BINS];
            let (mut side, mut n) = (Bound::empty(), 0);
            for bin in (1..BINS).rev() {
                side = Bound::load(&bounds[bin]).union(side);
                n += count[bin] as usize;
                if n > 0 {
                    right[bin] = scale.area(side) * costs.blocks(n);
                }
            }
            (side, n) = (Bound::empty(), 0);
            for bin in 1..BINS {
                side = Bound::load(&bounds[bin - 1]).union(side);
                n += count[bin - 1] as usize;
                if n == 0 {
                    continue;
                }
                let cost = scale.area(side) * costs.blocks(n) + right[bin];
                if cost < least {
                    least = cost;
                    best = Some(Split { axis, bin, left: n });
                }
            }
        }
        best
    }
}

/// Copies the rows to one of two slices, in their order, and returns the boxes of doubled
/// middles on both sides.
pub(super) fn partition(
    rows: &[Row],
    grid: &Grid,
    split: &Split,
    sides: [&mut [Row]; 2],
) -> [Bound; 2] {
    let mut next = [0; 2];
    let mut middles = Sides::default();
    for row in rows {
        let side = usize::from(grid.bins(row)[split.axis] >= split.bin);
        sides[side][next[side]] = *row;
        next[side] += 1;
        middles.add(row, side);
    }
    middles.0
}

/// Copies the rows into one slice, left rows from its start on and right rows from its end
/// backwards, and returns the boxes of doubled middles on both sides. It has no branches:
/// each row is written to both places, and the next row overwrites the wrong one. For large
/// ranges, which are not in a near cache, [`partition`] is faster.
pub(super) fn partition_in(rows: &[Row], grid: &Grid, split: &Split, to: &mut [Row]) -> [Bound; 2] {
    let (mut first, mut last) = (0, rows.len());
    let to = &mut to[..rows.len()];
    let mut middles = Sides::default();
    for row in rows {
        let side = usize::from(grid.bins(row)[split.axis] >= split.bin);
        to[first] = *row;
        to[last - 1] = *row;
        first += 1 - side;
        last -= side;
        middles.add(row, side);
    }
    middles.0
}

/// The boxes of doubled middles on both sides of a split.
struct Sides([Bound; 2]);

impl Default for Sides {
    fn default() -> Sides {
        Sides([Bound::empty(); 2])
    }
}

impl Sides {
    #[inline(always)]
    fn add(&mut self, row: &Row, side: usize) {
        const OUT: f32 = f32::NEG_INFINITY;
        let middle = Bound::middle(row).0;
        for (k, out) in [[0.0, OUT], [OUT, 0.0]].iter().enumerate() {
            let here = Bound(middle + <f32x8 as Lanes>::splat(out[side]));
            self.0[k] = here.union(self.0[k]);
        }
    }
}

/// Halves rows where they stand, at a multiple of a block, and returns how many are on the
/// left side and the extents of both sides.
pub(super) fn halve(rows: &[Row], costs: &Costs) -> (usize, [Extents; 2]) {
    let blocks = rows.len().div_ceil(costs.block);
    let left = blocks / 2 * costs.block;
    let (a, b) = rows.split_at(left);
    (left, [Extents::measure(a), Extents::measure(b)])
}
