//! What rays meet: nearest hits, any hits and whole pictures have the same bits whatever
//! structure, width and order of rays finds them, and are the reference's on scenes that are
//! hard for floating point.

#[path = "../common/mod.rs"]
mod common;

mod doubts;
mod ends;
mod far_views;
mod far_worlds;
#[cfg(feature = "all-lanes")]
mod from_surfaces;
mod grazing;
#[cfg(feature = "all-lanes")]
mod hard;
mod level_sets;
mod mesh_rays;
mod metamorphic;
mod parallel;
#[cfg(feature = "all-lanes")]
mod pictures;
mod range;
mod spawned;
mod surface_sizes;
mod surfaces_met;
mod tracer;
mod watertight;
mod waves;
mod wide_tiles;
