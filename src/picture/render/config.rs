//! The parameters of a render in one value: filled by the command line or by a program,
//! read by the plan and the renderer.
//!
//! The command line checks ranges (sizes, counts) when it parses them; what programs fill
//! themselves, [`RenderConfig::check`] does.

use super::AovSet;
use super::adaptive::Adaptive;
use super::irradiance::IndirectCaching;
use super::window::Window;
use crate::accel::{BuildQuality, KdQuality};
use crate::light::filter::Kind as FilterKind;
use crate::light::sampler::Kind as SamplerKind;
use crate::plan::Choices;
use crate::roots::Solver;
use crate::scene::{Rgb, Shutter, ShutterShape};
use crate::shade::path::Ground;
use crate::trace::Caching;

#[derive(Clone, Debug, PartialEq)]
pub struct RenderConfig {
    /// Size in pixels: both sides at least 1, with [`Grid::Corners`] at least 2, and at most
    /// [`RenderConfig::MOST_SIDE`].
    pub width: u32,
    pub height: u32,
    pub grid: Grid,
    /// Samples per pixel, from 1 to [`RenderConfig::MOST_SAMPLES`]; exactly 1 with [`Grid::Corners`].
    pub spp: u32,
    pub integrator: Integrator,
    /// Random numbers of the integrators that trace paths.
    pub sampler: SamplerKind,
    /// The pixel filter of the integrators that trace paths.
    pub filter: FilterKind,
    /// Adaptive sampling of the integrators that trace paths, in place of `spp`.
    pub adaptive: Option<Adaptive>,
    /// A cache of indirect light for [`Integrator::Path`].
    pub caching: Option<IndirectCaching>,
    pub choices: Choices,
    /// Root finder of polynomial surfaces in the precision `fast`; `None` uses the one
    /// that each surface names.
    pub solver: Option<Solver>,
    /// Build quality of wide trees. No bit of an exact picture depends on it.
    pub build: BuildQuality,
    /// Build quality of a k-d tree, if the plan uses one.
    pub kd: KdQuality,
    /// Lets shadow rays first test the last occluder of their light. No bit of the
    /// picture depends on it.
    pub shadow_cache: Caching,
    /// Number of threads; `None` uses all hardware threads.
    pub threads: Option<u32>,
    pub seed: u64,
    /// The number of the picture in a sequence, so that their noise differs.
    pub frame: u32,
    /// The maximum number of reflections and refractions along a path, at most 255.
    pub max_depth: u32,
    /// A camera's name, or its index from 0; `None` selects the first.
    pub camera: Option<String>,
    /// Layers of light and mattes are made by the integrators that trace paths, and no others.
    pub aovs: AovSet,
    /// Ids that each pixel of a Cryptomatte has room for, from 1 to 32.
    pub matte_ranks: u32,
    /// The ground that was put under the scene, which fades out of the picture; only paths
    /// let it.
    pub ground: Option<Ground>,
    /// What camera rays that meet nothing show.
    pub backdrop: Backdrop,
    pub tiles: TileOrder,
    /// The part of the picture that is rendered; `None` renders the whole. Only whole pictures have
    /// `adaptive` and `caching`, which look at all pixels.
    pub window: Option<Window>,
    /// When light is taken, if not at the scene's own time alone. [`super::Slices`] are made
    /// of it.
    pub shutter: Option<Exposure>,
}

/// The shutter of a picture: an interval of the scene's time, in slices of equal length. A path's
/// time is rounded to the middle of its slice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// Times of the scene's motion, which is from 0 to 1; before and after it nothing moves.
    pub open: f64,
    /// At least `open`.
    pub close: f64,
    pub shape: ShutterShape,
    /// At least 1.
    pub slices: u32,
}

impl Exposure {
    /// The number of slices unless another is asked for.
    pub const SLICES: u32 = 256;

    /// Returns the exposure of a frame at a time of the motion, whose next is `step` later.
    pub fn of_frame(shutter: &Shutter, time: f64, step: f64, slices: u32) -> Exposure {
        Exposure {
            open: time + shutter.open * step,
            close: time + shutter.close * step,
            shape: shutter.shape,
            slices,
        }
    }

    /// Returns the middle of a slice's time.
    pub fn time(&self, slice: u32) -> f64 {
        let share = (f64::from(slice) + 0.5) / f64::from(self.slices);
        self.open * (1.0 - share) + self.close * share
    }

    /// Returns the time in the middle of the shutter's, of which the outputs beside the colour
    /// are.
    pub fn middle(&self) -> f64 {
        0.5 * (self.open + self.close)
    }

    /// Returns the slice of a random number from [0, 1).
    pub fn slice(&self, u: f32) -> u32 {
        let place = self.shape.place(f64::from(u)) * f64::from(self.slices);
        (place as u32).min(self.slices - 1)
    }
}

impl RenderConfig {
    /// Returns the number of samples of each pixel; with [`RenderConfig::adaptive`], the most. It
    /// is one that the filter can have.
    pub fn samples(&self) -> u32 {
        match self.grid {
            Grid::Centers => self.filter.samples(self.spp),
            Grid::Corners => 1,
        }
    }

    /// Returns the rectangle that is rendered.
    pub fn window(&self) -> Window {
        self.window
            .unwrap_or(Window::whole(self.width, self.height))
    }

    /// Returns the width of the image plane over its height.
    pub fn aspect(&self) -> f64 {
        let less = match self.grid {
            Grid::Centers => 0,
            Grid::Corners => 1,
        };
        f64::from(self.width - less) / f64::from(self.height - less)
    }
}

impl Default for RenderConfig {
    fn default() -> RenderConfig {
        RenderConfig {
            width: 1280,
            height: 720,
            grid: Grid::default(),
            spp: 1,
            integrator: Integrator::default(),
            sampler: SamplerKind::default(),
            filter: FilterKind::default(),
            adaptive: None,
            caching: None,
            choices: Choices::default(),
            solver: None,
            build: BuildQuality::default(),
            kd: KdQuality::default(),
            shadow_cache: Caching::default(),
            threads: None,
            seed: 0,
            frame: 0,
            max_depth: 5,
            camera: None,
            aovs: AovSet::default(),
            matte_ranks: 6,
            ground: None,
            backdrop: Backdrop::default(),
            tiles: TileOrder::default(),
            window: None,
            shutter: None,
        }
    }
}

/// How light is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// Lights without extent, mirrors and glass (Whitted 1980); no random numbers.
    #[default]
    Direct,
    /// Paths of light from all that shines, scattered at all surfaces.
    Path,
    /// The share of a white sky that surfaces see.
    Ao,
    /// No light, but what a ray through the pixel's centre meets or costs.
    Inspect(Inspection),
}

impl Integrator {
    /// Says whether pictures show light.
    pub fn shows_light(self) -> bool {
        !matches!(self, Integrator::Inspect(_))
    }
}

/// What a picture without light shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inspection {
    /// Shading normals on the ray's side.
    Normals,
    /// Barycentric coordinates of triangles.
    Uv,
    /// Instances and their primitives.
    Ids,
    /// Depth along the view axis, as the output `depth` has it.
    Depth,
    /// The colour of the material, without light.
    Albedo,
    /// Lines, as of a technical drawing, where instances and materials end, where the surface
    /// turns sharply and where it is interrupted in depth.
    Edges,
    /// What the ray's closest hit has cost. Comparison structures count steps and tests; in
    /// others they are 0.
    Heat(Cost),
}

/// What a ray costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// A weighted sum of the others.
    All,
    /// Steps through the structure.
    Nodes,
    /// Tests of primitives.
    Tests,
    /// Tests that exact arithmetic decided.
    Escalations,
}

/// Image-plane positions of the rays of a W×H picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Grid {
    /// Through the pixels; with one sample per pixel, through their centres.
    #[default]
    Centers,
    /// One ray through each corner of a (W−1)×(H−1) pixel grid, edges included.
    Corners,
}

impl Grid {
    /// Returns the grid's name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Grid::Centers => "centers",
            Grid::Corners => "corners",
        }
    }
}

/// What a picture shows where camera rays meet nothing. The scene is lit by its own background
/// and environment whatever the choice.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Backdrop {
    /// The scene's environment, or its background colour.
    #[default]
    Auto,
    /// A colour, as linear radiance.
    Color(Rgb),
    /// Nothing: the picture gets alpha, and its colour is premultiplied.
    Transparent,
}

/// The order in which threads get the tiles. No bit of the picture depends on it; the
/// tests assert that.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TileOrder {
    /// Spread over the picture, so that the first tenth of them takes about a tenth of the time.
    #[default]
    Spread,
    /// The last tile first.
    Reverse,
    /// Tiles of 16×16 pixels instead of 32×32.
    Small,
}

impl TileOrder {
    /// Returns the tile that is rendered as the one of this number, of `tiles`.
    pub fn tile(self, number: u32, tiles: u32) -> u32 {
        match self {
            TileOrder::Reverse => tiles - 1 - number,
            TileOrder::Spread | TileOrder::Small => {
                let stride = u64::from(golden_stride(tiles));
                (u64::from(number) * stride % u64::from(tiles)) as u32
            }
        }
    }
}

/// Returns the number nearest above the golden section of `tiles` that has no divisor in common
/// with it: its multiples are spread evenly (Knuth, The Art of Computer Programming 3, 6.4).
fn golden_stride(tiles: u32) -> u32 {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let divisor = |mut a: u32, mut b: u32| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let first = (f64::from(tiles) * GOLDEN) as u32;
    (first.max(1)..=tiles)
        .find(|stride| divisor(*stride, tiles) == 1)
        .unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tile_is_rendered_once_and_a_tenth_is_spread() {
        for tiles in [1, 2, 3, 4, 40, 100, 920, 3600] {
            for order in [TileOrder::Spread, TileOrder::Reverse, TileOrder::Small] {
                let mut met: Vec<u32> = (0..tiles).map(|n| order.tile(n, tiles)).collect();
                met.sort_unstable();
                assert!(met.into_iter().eq(0..tiles), "{order:?} of {tiles}");
            }
        }
        // The largest gap between the tiles of the first tenth is at most three times the mean.
        let tiles = 3600;
        let mut tenth: Vec<u32> = (0..360).map(|n| TileOrder::Spread.tile(n, tiles)).collect();
        tenth.sort_unstable();
        assert!(tenth.windows(2).all(|pair| pair[1] - pair[0] <= 30));
    }
}
