//! Renders a scene to a picture: camera rays, samples, tiles, film.

mod adaptive;
mod blur;
mod blur_direct;
mod camera;
mod config;
mod edges;
mod film;
mod frames;
mod ground;
mod inspect;
mod irradiance;
mod items;
mod layers;
mod mattes;
mod motion;
mod part;
mod path_probe;
mod paths;
mod picture;
mod pixel_order;
mod progress;
mod ranges;
mod sampler;
mod silhouettes;
mod slices;
mod sums;
mod tile;
mod window;

pub use crate::io::{AovSet, Picture};
pub use crate::shade::path::Ground;
pub use adaptive::{Adaptive, Reached};
pub use camera::RayGenerator;
pub use config::{Backdrop, Cost, Exposure, Grid, Inspection, Integrator, RenderConfig, TileOrder};
pub use film::bytes as picture_bytes;
pub use frames::FrameMemory;
pub use ground::ground_albedo;
pub use inspect::{Reading, legend};
pub use irradiance::{CacheCounts, IndirectCaching, LightCache};
pub use mattes::{instance_name, material_name};
pub use motion::{Moment, motion_vectors};
pub use part::{Merge, is_part, parts_of, render_part, render_samples, window_key};
pub use path_probe::{Block, PathProbe};
pub use picture::{
    FinishedTile, RenderError, Rendered, View, Worker, render, render_after, render_blurred,
    render_keeping, render_showing, render_with,
};
pub use pixel_order::{BLOCK, every_second_bit};
pub use progress::Progress;
pub use ranges::ConfigError;
pub use sampler::sample_position;
pub use sampler::{mix, unit};
pub use silhouettes::{Rectangle, silhouette};
pub use slices::{Slice, SliceError, Slices};
pub use window::Window;
