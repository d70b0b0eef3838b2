//! Acceleration structures: how they are built, refitted and nested, and that each of them
//! has the hits of the linear scan.

#[path = "../common/mod.rs"]
mod common;

#[cfg(feature = "all-lanes")]
mod accel;
mod build;
mod counts;
mod frames;
mod identity;
mod items;
mod kdtree;
mod nested;
mod shadow_cache;
mod small_scenes;
mod spd;
