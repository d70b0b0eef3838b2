//! How pictures are made: shading and integrators ([`shade`]), samples, tiles and films
//! ([`render`]), and the library's front door ([`tracer`]).
//!
//! A part of Lanecast that may change with any version; the crate `lanecast` is what is
//! kept.

use lanecast_engine::{accel, trace};
use lanecast_io as io;
use lanecast_light as light;
use lanecast_model::{geom, plan, scene};
use lanecast_numerics::{math, roots};

pub mod render;
pub mod shade;
pub mod tracer;
