//! What is traced: primitives ([`geom`]), CSG programs ([`csg`]), the tables of a scene
//! ([`scene`]), and what a scene requires ([`plan`]).
//!
//! A part of Lanecast that may change with any version; the crate `lanecast` is what is
//! kept.

pub use lanecast_numerics::{math, roots};

pub mod csg;
pub mod geom;
pub mod plan;
pub mod scene;
