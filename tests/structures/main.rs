//! Acceleration structures: how they are built, refitted and nested, and that each of them
//! finds what the linear scan finds.

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
