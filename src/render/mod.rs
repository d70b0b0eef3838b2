//! Renders a scene to a picture: camera rays, samples, tiles, film.

mod adaptive;
mod camera;
mod config;
mod film;
mod frames;
mod items;
mod part;
mod paths;
mod progress;
mod sampler;
mod sums;
mod tile;

pub use crate::io::{AovSet, Picture};
pub use adaptive::Adaptive;
pub use camera::RayGenerator;
pub use config::{Backdrop, Grid, Integrator, RenderConfig, TileOrder};
pub use film::bytes as picture_bytes;
pub use frames::FrameMemory;
pub use part::{Merge, is_part, parts_of, render_part};
pub use progress::Progress;
pub use sampler::sample_position;
pub(crate) use sampler::{mix, unit};
pub(crate) use tile::{BLOCK, every_second_bit};
pub use tile::{FinishedTile, RenderError, Rendered, View, render, render_after, render_with};
