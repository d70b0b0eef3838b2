//! What a run did and cost, and how wrong it was.

pub mod bench;
pub mod queries;
pub mod rays;
mod stats;
pub mod verify;

pub use stats::{PictureSize, PlanSummary, SceneCounts, Stage, Stats, Watch, peak_resident_bytes};
