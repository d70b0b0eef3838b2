//! CSG: spans and hits against set algebra on rationals and against the reference; faces
//! that coincide; laws of set algebra that hold for every program.

#[path = "../common/mod.rs"]
mod common;

mod asked;
mod coincidence;
mod corners;
mod events;
mod frames;
mod gaps;
mod gates;
mod implicits;
mod intervals;
mod laws;
mod meshes;
mod programs;
mod quadrics;
mod shared;
mod shells;
mod truth;
