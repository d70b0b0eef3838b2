//! What a render is asked to do: one value, filled by the command line or by a
//! program, read by the plan and the renderer.
//!
//! Ranges (sizes, counts) are checked where the numbers come in, on the command
//! line; programs that fill this themselves stay within the documented ranges.

use super::AovSet;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RenderConfig {
    /// Pixels. Both sides at least 1, with [`Grid::Corners`] at least 2.
    pub width: u32,
    pub height: u32,
    pub grid: Grid,
    /// Samples per pixel, at least 1; exactly 1 with [`Grid::Corners`].
    pub spp: u32,
    pub precision: Precision,
    pub lanes: LaneCount,
    pub accel: AccelChoice,
    /// `None`: as many as the machine runs at once.
    pub threads: Option<u32>,
    pub seed: u64,
    /// How often a ray may be mirrored or refracted.
    pub max_depth: u32,
    /// A camera's name, or its number from 0; `None` is the first.
    pub camera: Option<String>,
    pub aovs: AovSet,
}

impl Default for RenderConfig {
    fn default() -> RenderConfig {
        RenderConfig {
            width: 1280,
            height: 720,
            grid: Grid::default(),
            spp: 1,
            precision: Precision::default(),
            lanes: LaneCount::default(),
            accel: AccelChoice::default(),
            threads: None,
            seed: 0,
            max_depth: 5,
            camera: None,
            aovs: AovSet::default(),
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

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// f32 lanes.
    Fast,
    /// f64 lanes; what they cannot settle is decided exactly.
    #[default]
    Exact,
}

impl Precision {
    pub fn name(self) -> &'static str {
        match self {
            Precision::Fast => "fast",
            Precision::Exact => "exact",
        }
    }
}

/// Rays per packet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LaneCount {
    /// The plan chooses for the machine and the precision.
    #[default]
    Auto,
    One,
    Four,
    Eight,
    Sixteen,
}

impl LaneCount {
    pub fn name(self) -> &'static str {
        match self {
            LaneCount::Auto => "auto",
            LaneCount::One => "1",
            LaneCount::Four => "4",
            LaneCount::Eight => "8",
            LaneCount::Sixteen => "16",
        }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AccelChoice {
    /// The plan chooses for each geometry.
    #[default]
    Auto,
    Bvh,
    Linear,
}

impl AccelChoice {
    pub fn name(self) -> &'static str {
        match self {
            AccelChoice::Auto => "auto",
            AccelChoice::Bvh => "bvh",
            AccelChoice::Linear => "linear",
        }
    }
}
