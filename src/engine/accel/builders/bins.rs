//! Binned splits (Wald, On fast Construction of SAH-based Bounding Volume
//! Hierarchies, 2007): middles of boxes fall into equal bins on all three axes
//! in one pass, and the cheapest plane between bins is taken.
//!
//! Costs count whole blocks. Equal costs go to the first plane, so the split
//! depends on the rows alone; bins of chunks are merged in their order.

use super::costs::{Costs, Scale};
use super::record::{Bound, Extents, Row};
use crate::math::lanes::{Lanes, f32x4, f32x8};

/// Planes to choose from, and one more. Measured: 16 builds no faster, and 64 no
/// better.
pub(super) const BINS: usize = 32;

/// Adding it leaves a number below 2^23 rounded to an integer in the low bits.
const INTEGER: f32 = 8_388_608.0;

/// Which bins the middle of a row falls into.
#[derive(Clone, Copy)]
pub(super) struct Grid {
    low: f32x4,
    scale: f32x4,
}

impl Grid {
    pub(super) fn over(middles: &Bound) -> Grid {
        let low = middles.store();
        let extent = middles.extent();
        let scale = |axis: usize| {
            let scale = (BINS - 1) as f32 / extent[axis];
            // No extent, or one too large or small: one bin for all.
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

    /// The same for the same row whenever it is asked; below [`BINS`] always.
    #[inline(always)]
    pub(super) fn bins(&self, row: &Row) -> [usize; 4] {
        let negated: f32x4 = Lanes::load(&row[..4]);
        let upper: f32x4 = Lanes::load(&row[4..]);
        let place = (upper - negated - self.low) * self.scale + <f32x4 as Lanes>::splat(INTEGER);
        Lanes::to_array(place).map(|x| x.to_bits() as usize % BINS)
    }
}

/// Boxes and counts by axis and bin.
#[derive(Clone)]
#[repr(C, align(64))]
pub(super) struct Bins {
    bounds: [[Row; BINS]; 3],
    count: [[u32; BINS]; 3],
}

/// Rows whose bin on `axis` is below `bin` go left.
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
            let bound = Bound::of(row);
            for (axis, bin) in bins.into_iter().take(3).enumerate() {
                let sum = &mut self.bounds[axis][bin];
                *sum = bound.union(Bound::of(sum)).store();
                self.count[axis][bin] += 1;
            }
        }
    }

    pub(super) fn merge(&mut self, other: &Bins) {
        for axis in 0..3 {
            for bin in 0..BINS {
                let sum = &mut self.bounds[axis][bin];
                *sum = Bound::of(&other.bounds[axis][bin])
                    .union(Bound::of(sum))
                    .store();
                self.count[axis][bin] += other.count[axis][bin];
            }
        }
    }

    /// Rows that the split sends left.
    pub(super) fn left_of(&self, split: &Split) -> usize {
        let count = &self.count[split.axis][..split.bin];
        count.iter().sum::<u32>() as usize
    }

    /// Boxes of what goes left and right.
    pub(super) fn sides(&self, split: &Split) -> [Bound; 2] {
        let (left, right) = self.bounds[split.axis].split_at(split.bin);
        [left, right].map(|side| {
            let bounds = side.iter().map(Bound::of);
            bounds.fold(Bound::empty(), |all, b| b.union(all))
        })
    }

    /// The cheapest plane; `None` where all middles coincide, or areas overflow.
    pub(super) fn best(&self, costs: &Costs, scale: Scale) -> Option<Split> {
        let mut least = f32::INFINITY;
        let mut best = None;
        for axis in 0..3 {
            let (bounds, count) = (&self.bounds[axis], &self.count[axis]);
            let mut right = [f32::INFINITY; BINS];
            let (mut side, mut n) = (Bound::empty(), 0);
            for bin in (1..BINS).rev() {
                side = Bound::of(&bounds[bin]).union(side);
                n += count[bin] as usize;
                if n > 0 {
                    right[bin] = scale.area(side) * costs.blocks(n);
                }
            }
            (side, n) = (Bound::empty(), 0);
            for bin in 1..BINS {
                side = Bound::of(&bounds[bin - 1]).union(side);
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

/// Rows to one slice or the other, in their order; the middles on both sides.
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

/// The same into one slice: the left rows from its start on, the right ones from
/// its end backwards. Without branches: each row is written to both places, and
/// stays where the next one does not follow. (Of large ranges, which are not in
/// a near cache, that costs more than it saves.)
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

/// Rows and the ranges' extents where nothing is moved: halves at a multiple of
/// a block.
pub(super) fn halve(rows: &[Row], costs: &Costs) -> (usize, [Extents; 2]) {
    let blocks = rows.len().div_ceil(costs.block);
    let left = blocks / 2 * costs.block;
    let (a, b) = rows.split_at(left);
    (left, [Extents::of(a), Extents::of(b)])
}
