//! Acceleration structures: trees over boxes, and their traversals.
//!
//! A tree holds boxes and ranges, never geometry; the caller's closure tests a leaf. One
//! invariant gives every structure the same bits: a hit counts only if its t is inside the
//! padded box of its own primitive, as [`Slabs`] computes it, and a box's interval contains
//! those of all boxes inside it, rounding included (docs/numerics/boxes.md, X4 and X5). So
//! pruning by boxes never changes an answer, and a linear scan gives the same one.

mod accelerator;
mod baselines;
mod block;
mod bounds;
mod builders;
mod clusters;
mod coincident_faces;
mod csg;
mod frustum;
mod instance_bvh;
mod instance_crossings;
mod mesh_crossings;
mod prefetch;
mod refit;
mod slabs;
mod slice;
mod some_instances;
mod tlas_cost;
mod tlas_entry;
mod two_level;
mod wide_bvh;
mod wide_stream;
mod world;

pub use accelerator::{
    Accelerator, BaselineAccelerator, BaselineBlas, NestedAccelerator, WideAccelerator,
};
pub use baselines::{
    AnyIndex, AnyScratch, BoxRow, BoxRows, Boxes, Bvh4, Bvh4Quality, Child, Count, Counter, Counts,
    Density, Figures, Grid, Heap, Index, ItemBoxes, KdClip, KdQuality, KdStop, KdTree, Leaf, Node,
    Primitives, Queue, Spheres, Stack, Volumes, WIDTH, build_bvh4, build_kd, linear,
};
pub use block::{Block, Blocks, IndexedBlock, UNUSED, UnindexedBlock, VERTICES};
pub use bounds::corner_bounds;
pub use builders::{BuildQuality, MAX_DEPTH, build_boxes, build_mesh, refit, refit_boxes};
pub use coincident_faces::{CoincidentFace, CoincidentFaces};
pub use csg::{PLACEMENT, PreparedCsg, SLOWEST};
pub use frustum::{Frustum, WideStack};
pub use instance_bvh::{
    InstanceBvh, InstanceBvhs, InstanceEdge, NodeTrees, Padded, RayExtent, may_meet,
};
pub use instance_crossings::InstanceCrossings;
pub use mesh_crossings::{MeshCrossingTrees, MeshCrossings};
pub use prefetch::prefetch;
pub use refit::{KeptTrees, RefitOutcome, WORST_REFIT};
pub use slabs::{SKEW, Slabs};
pub use tlas_entry::TlasEntry;
pub use wide_bvh::{WIDE, WideBlas, WideBvh, WideNode};
pub use wide_stream::{BoxRays, STREAM, StreamStack};
pub use world::{Structure, World};
