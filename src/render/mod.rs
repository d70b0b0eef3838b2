//! From a scene to a picture: tiles, samples, film.

mod config;
mod progress;

pub use crate::io::{AovSet, Picture};
pub use config::{AccelChoice, Grid, LaneCount, Precision, RenderConfig};
pub use progress::Progress;
