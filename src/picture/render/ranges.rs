//! The ranges of a configuration's values, for programs that fill one.

use super::config::{Backdrop, Exposure, Grid, RenderConfig};
use super::window::Window;
use crate::scene::ShutterShape;
use thiserror::Error;

/// A value of a configuration that no picture can be made of.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ConfigError {
    #[error(
        "a picture of {width}x{height} pixels; give each side {least} to {}, and both together at \
         most {} pixels",
        RenderConfig::MOST_SIDE,
        RenderConfig::MOST_PIXELS
    )]
    Size { width: u32, height: u32, least: u32 },
    #[error(
        "spp is {}; give it 1 to {} samples a pixel",
        .0,
        RenderConfig::MOST_SAMPLES
    )]
    Samples(u32),
    #[error("Grid::Corners traces one ray through each corner, and spp is {0}; give it 1")]
    CornerSamples(u32),
    #[error(
        "adaptive.most is {}; give it 1 to {} samples a pixel",
        .0,
        RenderConfig::MOST_SAMPLES
    )]
    AdaptiveSamples(u32),
    #[error("adaptive.noise is {0}; give it a number above 0, such as 0.01")]
    Noise(f32),
    #[error("caching.error is {0}; give it a number from 0.02 to 1, such as 0.2")]
    CachingError(f64),
    #[error("max_depth is {}; give it 0 to {}", .0, RenderConfig::MOST_DEPTH)]
    Depth(u32),
    #[error("matte_ranks is {}; give it 1 to {}", .0, RenderConfig::MOST_RANKS)]
    MatteRanks(u32),
    #[error("the backdrop's colour is {0:?}; give it finite numbers of at least 0")]
    Backdrop([f32; 3]),
    #[error(
        "a window of {}x{} pixels at {}, {} of a picture of {width}x{height}; give it at least one \
         pixel, all within the picture, and a corner at multiples of {}",
        window.width, window.height, window.x, window.y, Window::STEP
    )]
    Window {
        window: Window,
        width: u32,
        height: u32,
    },
    #[error("adaptive and caching look at all pixels; leave them out, or the window")]
    WholePictures,
    #[error(
        "the shutter opens at {open} and closes at {close}; let both be finite, and it not close before it opens"
    )]
    ShutterTimes { open: f64, close: f64 },
    #[error("the shutter has no slices; give it at least 1, or as many as Exposure::SLICES")]
    NoSlices,
    #[error(
        "the shutter opens over {rise} of its time and closes over {fall}; give it shares of at \
         least 0 whose sum is at most 1"
    )]
    ShutterShape { rise: f64, fall: f64 },
    #[error("Grid::Corners traces one ray through each corner, at one time; leave out the shutter")]
    CornerShutter,
}

impl RenderConfig {
    /// The most pixels of a side, and of a picture.
    pub const MOST_SIDE: u32 = 65_535;
    pub const MOST_PIXELS: u64 = 1 << 28;
    /// The most samples of a pixel.
    pub const MOST_SAMPLES: u32 = 65_536;
    pub const MOST_DEPTH: u32 = 255;
    pub const MOST_RANKS: u32 = 32;

    /// Checks that all values are in their ranges, and go together. Returns an error for the first
    /// one that is not.
    pub fn check(&self) -> Result<(), ConfigError> {
        let (width, height) = (self.width, self.height);
        let corners = self.grid == Grid::Corners;
        let least = 1 + u32::from(corners);
        let sides = least..=RenderConfig::MOST_SIDE;
        let samples = 1..=RenderConfig::MOST_SAMPLES;
        let pixels = u64::from(width) * u64::from(height);
        let fits = sides.contains(&width) && sides.contains(&height);
        if !fits || pixels > RenderConfig::MOST_PIXELS {
            return Err(ConfigError::Size {
                width,
                height,
                least,
            });
        }
        if !samples.contains(&self.spp) {
            return Err(ConfigError::Samples(self.spp));
        }
        if corners && self.spp > 1 {
            return Err(ConfigError::CornerSamples(self.spp));
        }
        if let Some(adaptive) = &self.adaptive {
            if !samples.contains(&adaptive.most) {
                return Err(ConfigError::AdaptiveSamples(adaptive.most));
            }
            if !(adaptive.noise > 0.0 && adaptive.noise.is_finite()) {
                return Err(ConfigError::Noise(adaptive.noise));
            }
        }
        if let Some(caching) = &self.caching
            && !(0.02..=1.0).contains(&caching.error)
        {
            return Err(ConfigError::CachingError(caching.error));
        }
        if self.max_depth > RenderConfig::MOST_DEPTH {
            return Err(ConfigError::Depth(self.max_depth));
        }
        if !(1..=RenderConfig::MOST_RANKS).contains(&self.matte_ranks) {
            return Err(ConfigError::MatteRanks(self.matte_ranks));
        }
        if let Backdrop::Color(color) = self.backdrop
            && !color.iter().all(|c| *c >= 0.0 && c.is_finite())
        {
            return Err(ConfigError::Backdrop(color));
        }
        if let Some(window) = self.window {
            if !window.lies_in(width, height) {
                return Err(ConfigError::Window {
                    window,
                    width,
                    height,
                });
            }
            if self.adaptive.is_some() || self.caching.is_some() {
                return Err(ConfigError::WholePictures);
            }
        }
        match &self.shutter {
            Some(_) if corners => Err(ConfigError::CornerShutter),
            Some(exposure) => exposure.check(),
            None => Ok(()),
        }
    }
}

impl Exposure {
    fn check(&self) -> Result<(), ConfigError> {
        let Exposure { open, close, .. } = *self;
        // A sum of finite times may be infinite, and so would the middle be.
        if !(open <= close && (close - open).is_finite() && self.middle().is_finite()) {
            return Err(ConfigError::ShutterTimes { open, close });
        }
        if self.slices == 0 {
            return Err(ConfigError::NoSlices);
        }
        match self.shape {
            ShutterShape::Trapezoid { rise, fall }
                if !(rise >= 0.0 && fall >= 0.0 && rise + fall <= 1.0) =>
            {
                Err(ConfigError::ShutterShape { rise, fall })
            }
            _ => Ok(()),
        }
    }
}
