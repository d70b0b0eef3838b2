//! Kernels by themselves, against integers of any length, against published roots, and
//! every width of lanes against one lane.

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
