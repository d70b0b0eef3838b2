//! Acceleration structures: trees over boxes, and how rays walk them.
//!
//! A tree knows boxes and ranges, never geometry: what a leaf means is the
//! caller's closure. Invariant that makes every structure give the same bits:
//! a hit only counts with its t inside the padded box of its own primitive, as
//! [`Slabs`] computes it, and a box's interval contains those of all boxes
//! inside it, rounding included. So pruning by boxes never changes an answer,
//! and a linear scan gives the same one.

mod block;
mod boxes;
mod builders;
mod bvh;
mod combined;
mod count;
mod facets;
mod forest;
mod frustum;
mod grid;
mod groups;
mod heap;
mod index;
mod kdtree;
mod plant;
mod prefetch;
mod sah;
mod sequence;
mod shared_faces;
mod slabs;
#[cfg(test)]
mod suite;
mod tags;
mod wide;
mod wide_stream;
mod world;

pub use block::{Apart, Block, Blocks, Shared, UNUSED, VERTICES};
pub use boxes::{BoxRow, BoxRows, ItemBoxes};
pub use builders::{BuildQuality, MAX_DEPTH, build_boxes, build_mesh, refit, refit_boxes};
pub use bvh::{Child, Node, Stack, Tree, WIDTH};
pub use combined::{Combined, PLACEMENT, SLOWEST};
pub use count::{Count, Counter, Counts};
pub use facets::{FacetTrees, Facets};
pub use forest::{AnyIndex, AnyScratch, Forest, Forests, MeshIndex, NestedForest, WideForest};
pub use frustum::{Frustum, WideStack};
pub use grid::{Density, Grid};
pub use groups::{Group, Groups, Link, Reach};
pub use heap::{Boxes, Heap, Queue, Spheres, Volumes};
pub use index::{Figures, Index, Leaf, Primitives};
pub use kdtree::{KdClip, KdQuality, KdStop, KdTree, build as kd_build};
pub use prefetch::prefetch;
pub use sah::{Quality, build, linear};
pub use sequence::{Kept, Renewal, WORST_REFIT};
pub use shared_faces::{SharedFace, SharedFaces};
pub use slabs::{SKEW, Slabs};
pub use wide::{WIDE, WideMesh, WideNode, WideTree};
pub use wide_stream::{STREAM, StreamRays, StreamStack};
pub use world::{Entry, Structure, World, corner_bounds};
