//! The cost model of the builder, and the limits that it keeps.

use super::record::Bound;
use crate::accel::baselines::bvh4::Child;
use crate::accel::wide_bvh::WIDE;

/// The most levels of wide nodes in a built tree.
pub const MAX_DEPTH: usize = 48;

/// The cost of one ray, in box tests of one node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Costs {
    /// Primitives that are tested together, a power of two. A leaf holds whole blocks.
    pub block: usize,
    /// The cost of testing one block.
    pub block_cost: f32,
    /// The most primitives in a leaf of the binary tree.
    pub leaf: usize,
    /// The cost of dividing a leaf, in blocks: a node's child is not free.
    pub split: f32,
}

/// The costs of a tree over triangles. A block has one and a half times as many columns as
/// a node. Leaves divided further than `split` allows save 1 % of expected cost, but leave
/// blocks half empty (docs/decisions/012-finer-leaves.md).
pub(super) const TRIANGLES: Costs = Costs {
    block: WIDE,
    block_cost: 1.5,
    leaf: WIDE,
    split: 0.2,
};

/// The costs of a tree over instances, each of which costs more than a node.
pub(super) const INSTANCES: Costs = Costs {
    block: 1,
    block_cost: 2.0,
    leaf: 4,
    split: 0.1,
};

impl Costs {
    /// Returns the number of blocks that hold `count` primitives.
    #[inline(always)]
    pub(super) fn blocks(&self, count: usize) -> f32 {
        // A shift, because divisions took an eighth of the building time.
        let shift = self.block.trailing_zeros();
        ((count + self.block - 1) >> shift) as i32 as f32
    }

    /// Returns the most primitives in a leaf of the wide tree.
    pub(super) fn most(&self) -> usize {
        if self.block == 1 {
            self.leaf
        } else {
            self.block * Child::MAX_LEAF
        }
    }
}

/// A power of two that scales lengths so that areas stay in f32's range.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale(f32);

impl Scale {
    /// Returns the scale for boxes inside `bounds`.
    pub(super) fn fit(bounds: Bound) -> Scale {
        let [x, y, z] = bounds.extent();
        let size = x.max(y).max(z);
        if !(size.is_finite() && size > 0.0) {
            return Scale(1.0);
        }
        // The limits keep the size and its reciprocal among the normal numbers.
        let exponent = (size.to_bits() >> 23).clamp(2, 252);
        Scale(f32::from_bits((254 - exponent) << 23))
    }

    /// Returns half the scaled surface area of a box that is not empty.
    #[inline(always)]
    pub(super) fn area(self, bounds: Bound) -> f32 {
        let [x, y, z] = bounds.extent().map(|e| e * self.0);
        x * y + y * z + z * x
    }
}
