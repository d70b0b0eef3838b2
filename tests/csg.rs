//! Combinations of solids: spans and hits against set algebra on rationals and
//! against the judge; what coincides; laws that hold for all programs.

mod common;

#[path = "csg/asked.rs"]
mod asked;
#[path = "csg/coincidence.rs"]
mod coincidence;
#[path = "csg/corners.rs"]
mod corners;
#[path = "csg/events.rs"]
mod events;
#[path = "csg/frames.rs"]
mod frames;
#[path = "csg/gaps.rs"]
mod gaps;
#[path = "csg/gates.rs"]
mod gates;
#[path = "csg/implicits.rs"]
mod implicits;
#[path = "csg/intervals.rs"]
mod intervals;
#[path = "csg/laws.rs"]
mod laws;
#[path = "csg/meshes.rs"]
mod meshes;
#[path = "csg/programs.rs"]
mod programs;
#[path = "csg/quadrics.rs"]
mod quadrics;
#[path = "csg/shared.rs"]
mod shared;
#[path = "csg/shells.rs"]
mod shells;
#[path = "csg/truth.rs"]
mod truth;
