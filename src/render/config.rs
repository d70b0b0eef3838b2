//! What a render is asked to do: one value, filled by the command line or by a
//! program, read by the plan and the renderer.
//!
//! Ranges (sizes, counts) are checked where the numbers come in, on the command
//! line; programs that fill this themselves stay within the documented ranges.

use super::AovSet;
use crate::accel::{BuildQuality, KdQuality};
use crate::plan::Choices;
use crate::roots::Solver;
use crate::trace::Caching;

#[derive(Clone, Debug, PartialEq)]
pub struct RenderConfig {
    /// Pixels. Both sides at least 1, with [`Grid::Corners`] at least 2.
    pub width: u32,
    pub height: u32,
    pub grid: Grid,
    /// Samples per pixel, at least 1; exactly 1 with [`Grid::Corners`].
    pub spp: u32,
    pub choices: Choices,
    /// What finds where rays meet polynomial surfaces in the precision `fast`; `None`:
    /// what each surface says.
    pub solver: Option<Solver>,
    /// Of wide trees, where they are built. No bit of an exact picture depends
    /// on it.
    pub build: BuildQuality,
    /// How a k-d tree is built, where one is.
    pub kd: KdQuality,
    /// Whether shadow rays try the last occluder of their light first. No bit of
    /// the picture depends on it.
    pub shadow_cache: Caching,
    /// `None`: as many as the machine runs at once.
    pub threads: Option<u32>,
    pub seed: u64,
    /// How often a ray may be mirrored or refracted.
    pub max_depth: u32,
    /// A camera's name, or its number from 0; `None` is the first.
    pub camera: Option<String>,
    pub aovs: AovSet,
    pub tiles: TileOrder,
}

impl Default for RenderConfig {
    fn default() -> RenderConfig {
        RenderConfig {
            width: 1280,
            height: 720,
            grid: Grid::default(),
            spp: 1,
            choices: Choices::default(),
            solver: None,
            build: BuildQuality::default(),
            kd: KdQuality::default(),
            shadow_cache: Caching::default(),
            threads: None,
            seed: 0,
            max_depth: 5,
            camera: None,
            aovs: AovSet::default(),
            tiles: TileOrder::default(),
        }
    }
}

/// Where the rays of a W×H picture go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Grid {
    /// Through the pixels; a lone sample through their centres.
    #[default]
    Centers,
    /// One ray through each corner of a (W−1)×(H−1) pixel grid, edges included.
    Corners,
}

impl Grid {
    /// As it is written on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Grid::Centers => "centers",
            Grid::Corners => "corners",
        }
    }
}

/// In which order tiles are handed to the threads. No bit of the picture
/// depends on it; the tests see to that.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TileOrder {
    /// Row by row.
    #[default]
    Scanline,
    /// The last tile first.
    Reverse,
    /// Tiles of 16×16 pixels instead of 32×32, row by row.
    Small,
}
