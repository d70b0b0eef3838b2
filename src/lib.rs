//! Lanecast: a CPU ray tracer that knows how wrong it is.

pub mod accel;
pub mod cli;
pub mod geom;
pub mod io;
pub mod math;
pub mod measure;
pub mod plan;
pub mod reference;
pub mod render;
pub mod scene;
pub mod shade;
pub mod trace;
