//! Measurements of cost and error: rays per second, growth, statistics, and comparisons
//! with the reference.
//!
//! A part of Lanecast that may change with any version; the crate `lanecast` is what is
//! kept.

pub mod adversarial;
pub mod baseline;
pub mod bench;
pub mod clock;
pub mod compare;
pub mod extremes;
pub mod frames;
pub mod generate;
pub mod growth;
pub mod index_stats;
mod instance_names;
pub mod light;
pub mod plot;
pub mod queries;
pub mod ray_kinds;
pub mod rays;
pub mod solvers;
mod stats;
pub mod tradeoff;
pub mod verify;
pub mod volumes;

pub use instance_names::{InstanceName, InstanceNames};
pub use stats::{
    Denoised, FrameStats, PictureSize, PlanSummary, SceneCounts, Stage, Stats, Watch,
    peak_resident_bytes, restart_peak_resident,
};
