//! Comparison structures. The wide BVH is faster than each of them on every scene measured
//! (docs/STRUCTURES.md).
//!
//! Each structure orders entries by their boxes, is walked by packets, and passes entries to
//! a leaf by an indirect call ([`Index`], [`Leaf`]). So each is compiled once per lane width,
//! and adds to the build instead of multiplying it. A linear scan is a [`Bvh4`] without
//! nodes. The item buffer's boxes are here as well; its raster is in [`crate::trace`]. The
//! wide BVH and the volume of its beams are in the folder above.

mod any_index;
pub(super) mod bvh4;
pub(super) mod bvh4_build;
pub(super) mod count;
pub(super) mod grid;
pub(super) mod heap;
pub(super) mod index;
#[cfg(test)]
mod index_tests;
pub(super) mod item_boxes;
pub(super) mod kdtree;
mod mailbox;

pub use any_index::{AnyIndex, AnyScratch};
pub use bvh4::{Bvh4, Child, Node, Stack, WIDTH};
pub use bvh4_build::{Bvh4Quality, build as build_bvh4, linear};
pub use count::{Count, Counter, Counts};
pub use grid::{Density, Grid};
pub use heap::{Boxes, Heap, Queue, Spheres, Volumes};
pub use index::{Figures, Index, Leaf, Primitives};
pub use item_boxes::{BoxRow, BoxRows, ItemBoxes};
pub use kdtree::{KdClip, KdQuality, KdStop, KdTree, build as build_kd};
