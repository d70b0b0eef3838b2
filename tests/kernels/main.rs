//! Kernels by themselves: compared with integers of any length, with published roots, and at
//! every width of lanes with one lane.

#[path = "../common/mod.rs"]
mod common;

mod exact_solids;
mod exact_triangles;
mod guarded_solids;
mod guarded_surfaces;
#[cfg(feature = "all-lanes")]
mod lanes;
mod number;
mod roots;
