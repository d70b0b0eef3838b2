//! Builders of wide trees by the surface area heuristic (Goldsmith and Salmon 1987).
//!
//! Each step has a file: a row per primitive ([`record`]), a binary tree from the top down
//! ([`binary`], with binned splits in [`bins`] and exact splits in [`sweep`]), reinsertion
//! of its subtrees if the quality is high ([`reinsert`]), the cheapest wide tree that the
//! binary tree contains ([`collapse`]), and blocks of triangles in its order ([`blocks`]).
//! [`costs`] is the cost model. Moved vertices need no new tree ([`refit`]).
//!
//! A tree depends on the primitives alone: no step depends on the number of threads, and of
//! equal costs the first is taken. Rows that all coincide, have no extent, or are too large
//! or small for areas in f32 are halved in their order. Checked by tests/structures/build/.

mod binary;
mod bins;
mod blocks;
mod collapse;
mod costs;
mod record;
mod refit;
mod reinsert;
mod sweep;

pub use costs::MAX_DEPTH;
pub use refit::{refit, refit_boxes};

use super::baselines::bvh4::Child;
use super::block::UNUSED;
use super::bounds::corner_bounds;
use super::wide_bvh::{WIDE, WideBlas, WideBvh};
use crate::math::Aabb32;
use crate::scene::Mesh;
use binary::{Binary, Plan};
use costs::{Costs, INSTANCES, Scale, TRIANGLES};
use rayon::prelude::*;
use record::{Extents, Row, Rows};
use std::ops::Range;

/// How much the builder does to lower the expected cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BuildQuality {
    /// Splits ranges from the top down.
    #[default]
    Medium,
    /// Then moves subtrees to where they cost least, which takes as long again. The expected
    /// cost never exceeds that of `Medium`.
    High,
}

impl BuildQuality {
    pub const ALL: [BuildQuality; 2] = [BuildQuality::Medium, BuildQuality::High];

    /// Returns the name in the command line.
    pub fn name(self) -> &'static str {
        match self {
            BuildQuality::Medium => "medium",
            BuildQuality::High => "high",
        }
    }
}

/// Builds the tree over a mesh's triangles.
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

/// Builds a tree over boxes, and returns it with the order of the boxes in its leaves. A
/// leaf is a range of at most four.
pub fn build_boxes(boxes: &[Aabb32], quality: BuildQuality) -> (WideBvh, Vec<u32>) {
    let (tree, _, order) = wide(boxes.len(), |i| boxes[i], &INSTANCES, quality);
    // Leaves are ranges of the order itself.
    (tree, order)
}

/// A wide tree, the range of the order that each block holds, and the order.
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
    // Reinsertion lowers the cost of the binary tree, which nearly always lowers this one.
    if better.sah < tree.sah {
        (better, blocks, moved)
    } else {
        (tree, leaves, order)
    }
}

/// Rows that a thread makes at a time.
const CHUNK: usize = 1 << 13;

/// Grows the binary tree, and returns it with the order of the primitives. Both are empty
/// if there are no primitives.
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
        scale: Scale::fit(extents.bounds),
    };
    let (rows, spare): (&mut [Row], &mut [Row]) = (rows.rows(), spare.rows());
    binary::grow(rows, spare, &extents, &plan)
}
