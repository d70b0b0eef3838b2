//! Building wide trees by the surface area heuristic (Goldsmith and Salmon
//! 1987).
//!
//! Steps, one file each: a row per primitive ([`record`]), a binary tree top
//! down ([`binary`]: binned splits in [`bins`], exact ones in [`sweep`]),
//! better places for its subtrees if that is asked for ([`reinsert`]), the
//! cheapest wide tree that the binary one contains ([`collapse`]), and blocks of
//! triangles in its order ([`blocks`]). Moved vertices need no new tree
//! ([`refit`]).
//!
//! Trees depend on the primitives alone: no step asks how many threads there
//! are, and equal costs go to the first choice. Rows that all coincide, have no
//! extent, or are too large or small for areas in f32 are halved in their order.
//! Checked by tests/structures/build/.

mod binary;
mod bins;
mod blocks;
mod collapse;
mod record;
mod refit;
mod reinsert;
mod sweep;

pub use refit::{refit, refit_boxes};

use super::baselines::bvh4::Child;
use super::block::UNUSED;
use super::wide_bvh::{WIDE, WideBlas, WideBvh};
use super::world::corner_bounds;
use crate::math::Aabb32;
use crate::scene::Mesh;
use binary::{Binary, Plan};
use rayon::prelude::*;
use record::{Bound, Extents, Row, Rows};
use std::ops::Range;

/// Levels of wide nodes that no built tree exceeds.
pub const MAX_DEPTH: usize = 48;

/// What the builder aims at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BuildQuality {
    /// Splits from the top down.
    #[default]
    Medium,
    /// Then subtrees are moved to where they cost least, which takes once more as
    /// long. Expected cost is never above that of `Medium`.
    High,
}

impl BuildQuality {
    pub const ALL: [BuildQuality; 2] = [BuildQuality::Medium, BuildQuality::High];

    /// As the command line calls it.
    pub fn name(self) -> &'static str {
        match self {
            BuildQuality::Medium => "medium",
            BuildQuality::High => "high",
        }
    }
}

/// What a ray pays, in box tests of one node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Costs {
    /// Primitives that are tested together, a power of two; a leaf holds whole
    /// blocks.
    block: usize,
    /// Of testing one block.
    block_cost: f32,
    /// Primitives that the binary tree's leaves hold at most.
    leaf: usize,
    /// Of dividing a leaf, in blocks: a node's child is not free.
    split: f32,
}

/// A block has half as many columns again as a node. Dividing leaves further
/// than `split` says gains 1 % of expected cost, and half-empty blocks.
const TRIANGLES: Costs = Costs {
    block: WIDE,
    block_cost: 1.5,
    leaf: WIDE,
    split: 0.2,
};

/// Entries are instances and single primitives: each costs more than a node.
const ENTRIES: Costs = Costs {
    block: 1,
    block_cost: 2.0,
    leaf: 4,
    split: 0.1,
};

impl Costs {
    #[inline(always)]
    fn blocks(&self, count: usize) -> f32 {
        // A shift: divisions were an eighth of the builder's time.
        let shift = self.block.trailing_zeros();
        ((count + self.block - 1) >> shift) as i32 as f32
    }

    /// Primitives that a leaf of the wide tree may hold.
    fn most(&self) -> usize {
        if self.block == 1 {
            self.leaf
        } else {
            self.block * Child::MAX_LEAF
        }
    }
}

/// A power of two that brings areas into f32's range, whatever the unit.
#[derive(Clone, Copy, Debug)]
struct Scale(f32);

impl Scale {
    fn of(bounds: Bound) -> Scale {
        let [x, y, z] = bounds.extent();
        let size = x.max(y).max(z);
        if !(size.is_finite() && size > 0.0) {
            return Scale(1.0);
        }
        // Within the normal numbers on both sides.
        let exponent = (size.to_bits() >> 23).clamp(2, 252);
        Scale(f32::from_bits((254 - exponent) << 23))
    }

    /// Half the surface area, of a box that is not empty.
    #[inline(always)]
    fn area(self, bounds: Bound) -> f32 {
        let [x, y, z] = bounds.extent().map(|e| e * self.0);
        x * y + y * z + z * x
    }
}

/// The tree over a mesh's triangles.
pub fn build_mesh(mesh: &Mesh, quality: BuildQuality) -> WideBlas {
    let bounds = |i: usize| corner_bounds(&mesh.corners(i));
    let (mut tree, ranges, order) = wide(mesh.triangles.len(), bounds, &TRIANGLES, quality);
    let triangles = |block: usize| {
        let mut source = [UNUSED; WIDE];
        let range = ranges[block].clone();
        source[..range.len()].copy_from_slice(&order[range]);
        source
    };
    let blocks = blocks::lay_out(mesh, ranges.len(), triangles, &mut tree);
    WideBlas { tree, blocks }
}

/// The tree over boxes, and for each of its entries the box that it came from.
/// Leaves are ranges of at most four entries.
pub fn build_boxes(boxes: &[Aabb32], quality: BuildQuality) -> (WideBvh, Vec<u32>) {
    let (tree, _, order) = wide(boxes.len(), |i| boxes[i], &ENTRIES, quality);
    // Leaves hold the order's ranges as they are.
    (tree, order)
}

/// A wide tree, its blocks' ranges of the order, and the order.
type Wide = (WideBvh, Vec<Range<usize>>, Vec<u32>);

fn wide(
    count: usize,
    bounds: impl Fn(usize) -> Aabb32 + Sync,
    costs: &Costs,
    quality: BuildQuality,
) -> Wide {
    let (nodes, order) = grow(count, bounds, costs);
    let (tree, leaves) = collapse::collapse(&nodes, costs);
    if quality == BuildQuality::Medium || nodes.is_empty() {
        return (tree, leaves, order);
    }
    let (nodes, moved) = reinsert::improve(&nodes, &order);
    let (better, blocks) = collapse::collapse(&nodes, costs);
    // What moves lower is another cost, though nearly always this one too.
    if better.sah < tree.sah {
        (better, blocks, moved)
    } else {
        (tree, leaves, order)
    }
}

/// Rows to a thread at a time.
const CHUNK: usize = 1 << 13;

/// The binary tree and the primitives in its order; neither where there are no
/// primitives.
fn grow(
    count: usize,
    bounds: impl Fn(usize) -> Aabb32 + Sync,
    costs: &Costs,
) -> (Vec<Binary>, Vec<u32>) {
    assert!(count <= Child::MAX_ENTRIES);
    if count == 0 {
        return (Vec::new(), Vec::new());
    }
    let mut rows = Rows::new(count);
    let mut spare = Rows::new(count);
    let parts: Vec<Extents> = rows
        .rows()
        .par_chunks_mut(CHUNK)
        .enumerate()
        .map(|(chunk, rows)| {
            let first = chunk * CHUNK;
            let mut extents = Extents::empty();
            for (i, to) in rows.iter_mut().enumerate() {
                *to = record::row(&bounds(first + i), (first + i) as u32);
                extents.add(to);
            }
            extents
        })
        .collect();
    let extents = parts
        .iter()
        .fold(Extents::empty(), |all, part| part.union(&all));
    let plan = Plan {
        costs: *costs,
        scale: Scale::of(extents.bounds),
    };
    let (rows, spare): (&mut [Row], &mut [Row]) = (rows.rows(), spare.rows());
    binary::grow(rows, spare, &extents, &plan)
}
