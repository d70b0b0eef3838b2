//! How it is traced: trees and comparison structures ([`accel`]), and queries of rays by
//! packets, tiles and streams ([`trace`]).
//!
//! A part of Lanecast that may change with any version; the crate `lanecast` is what is
//! kept.

use lanecast_model::{csg, geom, plan, scene};
use lanecast_numerics::{math, roots};

pub mod accel;
pub mod trace;
