//! Acceleration structures: trees over boxes, and how rays walk them.
//!
//! A tree knows boxes and ranges, never geometry: what a leaf means is the
//! caller's closure. Invariant that makes every structure give the same bits:
//! a hit only counts with its t inside the padded box of its own primitive, as
//! [`Slabs`] computes it, and a box's interval contains those of all boxes
//! inside it, rounding included. So pruning by boxes never changes an answer,
//! and a linear scan gives the same one.

mod baselines;
mod block;
mod builders;
mod coincident_faces;
mod csg;
mod frustum;
mod instance_bvh;
mod levels;
mod mesh_crossings;
mod prefetch;
mod refit;
mod slabs;
mod two_level;
mod wide_bvh;
mod wide_stream;
mod world;

pub use baselines::{
    AnyIndex, AnyScratch, BoxRow, BoxRows, Boxes, Bvh4, Bvh4Quality, Child, Count, Counter, Counts,
    Density, Figures, Grid, Heap, Index, ItemBoxes, KdClip, KdQuality, KdStop, KdTree, Leaf, Node,
    Primitives, Queue, Spheres, Stack, Volumes, WIDTH, build_bvh4, build_kd, linear,
};
pub use block::{Apart, Block, Blocks, Shared, UNUSED, VERTICES};
pub use builders::{BuildQuality, MAX_DEPTH, build_boxes, build_mesh, refit, refit_boxes};
pub use coincident_faces::{CoincidentFace, CoincidentFaces};
pub use csg::{PLACEMENT, PreparedCsg, SLOWEST};
pub use frustum::{Frustum, WideStack};
pub use instance_bvh::{InstanceBvh, InstanceBvhs, InstanceEdge, Reach};
pub use levels::{BaselineBlas, BaselineLevels, Levels, NestedLevels, WideLevels};
pub use mesh_crossings::{MeshCrossingTrees, MeshCrossings};
pub use prefetch::prefetch;
pub use refit::{KeptTrees, RefitOutcome, WORST_REFIT};
pub use slabs::{SKEW, Slabs};
pub use wide_bvh::{WIDE, WideBlas, WideBvh, WideNode};
pub use wide_stream::{BoxRays, STREAM, StreamStack};
pub use world::{Structure, TlasEntry, World, corner_bounds};
