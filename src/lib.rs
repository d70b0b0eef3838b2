//! Lanecast: a CPU ray tracer that knows how wrong it is.

pub mod cli;
pub mod geom;
pub mod io;
pub mod math;
pub mod measure;
pub mod render;
pub mod scene;
pub mod trace;
