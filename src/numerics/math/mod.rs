//! Lanes, vectors, affine maps, boxes, intervals, error-bounded numbers and exact
//! integers. This module imports nothing else of the project.

mod aabb;
mod affine;
mod axis_order;
pub mod bounds;
pub mod double_double;
pub mod dyadic;
pub mod elementary;
pub mod int;
mod interval;
pub mod lanes;
pub mod number;
mod ratio;
mod unit;
mod vec3;

pub use aabb::{Aabb, Aabb32, round_down, round_up};
pub use affine::Affine;
pub use axis_order::AxisOrder;
pub use interval::Interval;
pub use number::{ExactSign, Number, is_power_of_two};
pub use ratio::Ratio;
pub use unit::{length, unit, units, units_and_lengths};
pub use vec3::{Vec3, unordered_dot};
