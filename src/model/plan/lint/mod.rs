//! Lints of scenes: what a user may want to know before tracing. No answer depends on them.

mod coplanar;
mod logic;
mod solids;
mod stacked;

pub use solids::{remarks, searched, solved, spindle, unbounded};
pub use stacked::stacked;
