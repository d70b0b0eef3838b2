//! What rays meet: the nearest hit, any hit and whole pictures have the same bits whatever
//! finds them, and are those of the reference where a scene is hard for floating point.

#[path = "../common/mod.rs"]
mod common;

mod doubts;
mod ends;
mod far_worlds;
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
mod watertight;
mod waves;
mod wide_tiles;
