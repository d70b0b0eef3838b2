//! Numbers, lanes, vectors, maps and boxes. Imports nothing of ours.

mod aabb;
mod affine;
pub mod lanes;
mod unit;
mod vec3;

pub use aabb::{Aabb, Aabb32, round_down, round_up};
pub use affine::Affine;
pub use unit::{length, unit};
pub use vec3::Vec3;
