//! Exact splits of small ranges: the surface area heuristic at every place between two
//! neighbours, on all three axes.
//!
//! A range is sorted once per axis. Its parts keep their order, because a split takes the
//! lower ranks of one axis and divides the other two lists stably. Costs count whole blocks,
//! so a split that fills blocks is cheaper than a neighbouring one that starts another.

use super::costs::{Costs, Scale};
use super::record::{Bound, Extents, Row};

/// The most rows of a range that is split exactly.
pub(super) const SMALL: usize = 128;

/// The number of steps of the range's extent in which middles are compared, 2²³ − 1.
const STEPS: f32 = 8_388_607.0;
/// The bits of a rank.
const RANK: u32 = SMALL.ilog2();

/// The ranks of a range's rows by axis.
pub(super) struct Sweep {
    /// `[axis][rank]`: the row.
    sorted: [[u8; SMALL]; 3],
    /// By place: the cost of the rows at and right of it.
    right: [f32; SMALL],
    spare: [u8; SMALL],
}

/// A split: the `left` lowest ranks of `axis` go left.
#[derive(Clone, Copy)]
pub(super) struct Cut {
    axis: usize,
    pub left: usize,
    pub cost: f32,
    pub sides: [Bound; 2],
}

impl Sweep {
    pub(super) fn new() -> Sweep {
        Sweep {
            sorted: [[0; SMALL]; 3],
            right: [0.0; SMALL],
            spare: [0; SMALL],
        }
    }

    /// Sorts the rows along each axis by the middles of their boxes.
    pub(super) fn sort(&mut self, rows: &[Row]) {
        let middles = Extents::measure(rows).middles;
        let low = middles.store();
        let extent = middles.extent();
        for axis in 0..3 {
            let scale = STEPS / extent[axis];
            let scale = if scale.is_finite() { scale } else { 0.0 };
            // A key is the middle's step and then the row, so no two keys are equal.
            let mut key = [u32::MAX; SMALL];
            for (i, row) in rows.iter().enumerate() {
                let middle = row[axis + 4] - row[axis];
                let step = ((middle + low[axis]) * scale).min(STEPS) as u32;
                key[i] = step << RANK | i as u32;
            }
            let mut rank = [0_u32; SMALL];
            for other in &key[..rows.len()] {
                for i in 0..SMALL {
                    rank[i] += u32::from(*other < key[i]);
                }
            }
            for (i, rank) in rank.iter().take(rows.len()).enumerate() {
                self.sorted[axis][*rank as usize] = i as u8;
            }
        }
    }

    /// Finds the cheapest cut of the ranks `first..last`, of which there are at least two;
    /// `None` if areas are not finite.
    pub(super) fn best(
        &mut self,
        rows: &[Row],
        first: usize,
        last: usize,
        costs: &Costs,
        scale: Scale,
    ) -> Option<Cut> {
        let n = last - first;
        let mut least = f32::INFINITY;
        let mut best = None;
        for axis in 0..3 {
            let sorted = &self.sorted[axis][first..last];
            let right = &mut self.right[..n];
            let mut side = Bound::empty();
            for i in (1..n).rev() {
                side = Bound::load(&rows[sorted[i] as usize % SMALL]).union(side);
                right[i] = scale.area(side) * costs.blocks(n - i);
            }
            side = Bound::empty();
            for i in 1..n {
                side = Bound::load(&rows[sorted[i - 1] as usize]).union(side);
                let cost = scale.area(side) * costs.blocks(i) + right[i];
                if cost < least {
                    least = cost;
                    best = Some((axis, i));
                }
            }
        }
        let (axis, left) = best?;
        Some(self.cut(rows, first, last, (axis, left), least))
    }

    /// Cuts the ranks in half at a multiple of a block, where no place is better than another.
    pub(super) fn half(&self, rows: &[Row], first: usize, last: usize, costs: &Costs) -> Cut {
        let left = (last - first).div_ceil(costs.block) / 2 * costs.block;
        self.cut(rows, first, last, (0, left), f32::INFINITY)
    }

    fn cut(
        &self,
        rows: &[Row],
        first: usize,
        last: usize,
        (axis, left): (usize, usize),
        cost: f32,
    ) -> Cut {
        let around = |ranks: &[u8]| {
            let bounds = ranks.iter().map(|i| Bound::load(&rows[*i as usize]));
            bounds.fold(Bound::empty(), |all, b| b.union(all))
        };
        let (a, b) = self.sorted[axis][first..last].split_at(left);
        Cut {
            axis,
            left,
            cost,
            sides: [around(a), around(b)],
        }
    }

    /// Reorders the other two axes so that the left ranks of the cut come first in all three.
    pub(super) fn divide(&mut self, first: usize, last: usize, cut: &Cut) {
        let mut is_left = [false; SMALL];
        for i in &self.sorted[cut.axis][first..first + cut.left] {
            is_left[*i as usize] = true;
        }
        for axis in (0..3).filter(|axis| *axis != cut.axis) {
            let sorted = &mut self.sorted[axis][first..last];
            let (mut left, mut right) = (0, 0);
            for k in 0..sorted.len() {
                let i = sorted[k];
                let goes = is_left[i as usize];
                sorted[left] = i;
                self.spare[right] = i;
                left += usize::from(goes);
                right += usize::from(!goes);
            }
            sorted[left..].copy_from_slice(&self.spare[..right]);
        }
    }

    /// Returns the rows of the ranks, in the order of axis 0 within the cuts made so far.
    pub(super) fn ranks(&self, first: usize, last: usize) -> &[u8] {
        &self.sorted[0][first..last]
    }
}
