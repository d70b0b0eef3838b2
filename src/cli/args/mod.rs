//! The arguments of all commands, validated as they are parsed.
//!
//! Each command accepts only the options that it uses, so that no option is silently
//! ignored. `render/config.rs` documents the options' meaning, `values.rs` their
//! values.

mod about;
mod batch;
mod bench;
mod common;
mod compare;
mod development;
mod import;
mod layout;
mod light;
mod outputs;
mod page;
mod sequence;
mod shutter;
mod thumbs;
mod tile;
mod tradeoff;
mod values;
mod view;

pub use about::{CompletionsArgs, ManArgs, VersionArgs};
pub use batch::BatchArgs;
pub use bench::BenchArgs;
pub use compare::CompareArgs;
pub use import::STDIN;
pub use layout::laid_out;
pub use light::{has_lens, needed_integrator};
pub use outputs::Told;
#[cfg(feature = "view")]
pub use page::OWN_OPTIONS;
pub use page::PageArgs;
pub use thumbs::ThumbsArgs;
pub use tile::{TileChoice, TileGrid};
pub use tradeoff::{Accuracy, TradeoffArgs};
pub use values::Size;
pub use view::ViewArgs;

use super::error::CliError;
use super::output::Sink;
use clap::{Args, value_parser};
use common::{BuildArgs, CommonArgs, DepthArgs, ProgressArgs, SolverArgs};
use development::DevelopmentArgs;
use glam::DVec3;
use import::{ImportArgs, scene_path};
use lanecast_engine::trace::Caching;
use lanecast_io::{Animated, LoadOptions};
use lanecast_model::plan::{LaneCount, Precision};
use lanecast_numerics::roots::{Interval, Solver};
use lanecast_picture::render::{Backdrop, Grid, RenderConfig};
use light::LightArgs;
use outputs::OutputArgs;
use sequence::SequenceArgs;
use shutter::ShutterArgs;
use std::path::PathBuf;
use values::{
    Coefficients, ReuseChoice, Sweeps, parse_backdrop, parse_caching, parse_coefficients,
    parse_error, parse_interval, parse_lanes, parse_offset, parse_page, parse_positive,
    parse_precision, parse_reuse, parse_scale, parse_seconds, parse_size, parse_solver,
    parse_sweeps,
};

#[derive(Args)]
pub struct RenderArgs {
    /// .toml, .json, .gltf, .glb, .nff, .csg, .scad, .obj, .ply, .stl or .3mf, or - for standard input; without it, the built-in scene
    #[arg(value_parser = scene_path())]
    pub scene: Option<PathBuf>,
    /// .png, .jpg, .hdr or .exr; with --samples .sums, with --tile .tile [default: the scene's name
    /// with .png, .sums or .tile, in the current folder]
    #[arg(short, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Choose the options of the fastest way that keeps bounds: within:rmse=X, flip=X, wrong-pixels=N,
    /// separated by commas, or the most accurate of seconds=X (of a picture of 240x135). They are
    /// measured once for each class of scenes, as tradeoff does, and kept in the user's cache
    #[arg(long, value_name = "within:BOUNDS", value_parser = Accuracy::parse, conflicts_with_all = ["spp", "noise", "max_spp", "samples", "sampler", "filter", "cache", "cache_error", "max_bounces", "shutter_slices", "precision", "accel", "lanes", "solver", "integrator"])]
    pub accuracy: Option<Accuracy>,
    #[command(flatten)]
    pub light: LightArgs,
    #[command(flatten)]
    pub shutter: ShutterArgs,
    #[command(flatten)]
    pub outputs: OutputArgs,
    #[command(flatten)]
    pub development: DevelopmentArgs,
    /// What shows where camera rays meet nothing: auto (the scene's environment or
    /// background), transparent, white, black, or a linear colour R,G,B
    #[arg(long, value_name = "WHAT", default_value = "auto", allow_hyphen_values = true, value_parser = parse_backdrop)]
    pub background: Backdrop,
    /// Seed of the sample positions
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Let shadow rays first test the last occluder: on or off; the picture is the
    /// same
    #[arg(long, value_name = "USE", default_value = "on", value_parser = parse_caching)]
    pub shadow_cache: Caching,
    #[command(flatten)]
    pub build: BuildArgs,
    #[command(flatten)]
    pub sequence: SequenceArgs,
    /// Temporal bounds of camera rays from the frame before: depth, hit, none, or auto,
    /// which is depth if meshes are placed by transforms; the pictures are the same
    #[arg(long, value_name = "WHAT", default_value = "auto", requires = "frames", value_parser = parse_reuse)]
    pub reuse: ReuseChoice,
    #[command(flatten)]
    pub solver: SolverArgs,
    #[command(flatten)]
    pub common: CommonArgs,
}

#[derive(Args)]
pub struct MergeArgs {
    /// .sums files of one picture, whose samples are all from 0 on, or all of its .tile files, in any
    /// order
    #[arg(required = true, value_name = "PART")]
    pub parts: Vec<PathBuf>,
    /// .png, .jpg, .hdr or .exr
    #[arg(short, value_name = "FILE")]
    pub output: PathBuf,
    /// Write machine-readable results; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub json: Option<Sink>,
    #[command(flatten)]
    pub development: DevelopmentArgs,
}

#[derive(Args)]
#[command(
    after_help = "replay: the reference answers the same rays that the mode traced.\n\
                  independent: the reference traces its own rays from the camera and to the lights, \
                  which also shows lost and leaked light.\n\
                  adversarial: the reference answers the rays of --adversarial.\n\
                  The time of a ray is the least of at least two runs after one that is not timed."
)]
pub struct VerifyArgs {
    /// .toml, .json, .gltf, .glb, .nff, .csg, .scad, .obj, .ply, .stl or .3mf, or - for standard input
    #[arg(value_parser = scene_path())]
    pub scene: PathBuf,
    /// Fail only if a mode has more wrong answers than this [default: 0; fast may have
    /// any number]
    #[arg(long, value_name = "N")]
    pub allow_wrong: Option<u64>,
    /// Ask the reference about every K-th pixel only; best coprime to the width
    #[arg(long, value_name = "K", value_parser = value_parser!(u64).range(1..))]
    pub sample: Option<u64>,
    /// Compare the samples of the path integrator with the reference's own path tracer, and
    /// nothing else
    #[arg(long, conflicts_with_all = ["allow_wrong", "sample", "adversarial"])]
    pub light: bool,
    /// Samples per pixel of --light [default: 16]
    #[arg(long, value_name = "N", requires = "light", value_parser = value_parser!(u32).range(1..=65_536))]
    pub spp: Option<u32>,
    /// Trace N additional rays, aimed at edges, corners, silhouettes and tangents
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=10_000_000))]
    pub adversarial: Option<u32>,
    /// Seed of the aimed rays
    #[arg(long, value_name = "N", default_value_t = 0, requires = "adversarial")]
    pub seed: u64,
    /// Scale the scene with its lights and cameras about the world's origin
    #[arg(long, value_name = "S", default_value_t = 1.0, allow_hyphen_values = true, value_parser = parse_scale)]
    pub scale: f64,
    /// Translate the scene after scaling
    #[arg(long, value_name = "X,Y,Z", default_value = "0,0,0", allow_hyphen_values = true, value_parser = parse_offset)]
    pub offset: DVec3,
    #[command(flatten)]
    pub build: BuildArgs,
    #[command(flatten)]
    pub depth: DepthArgs,
    #[command(flatten)]
    pub solver: SolverArgs,
    #[command(flatten)]
    pub common: CommonArgs,
}

#[derive(Args)]
pub struct PlanArgs {
    /// .toml, .json, .gltf, .glb, .nff, .csg, .scad, .obj, .ply, .stl or .3mf, or - for standard input; without it, the built-in scene
    #[arg(value_parser = scene_path())]
    pub scene: Option<PathBuf>,
    /// Measure what leaving out saves: render the scene with and without one tiny thing of each sort
    /// that it lacks, in turns [size: 320x180, unless --size is given]
    #[arg(long)]
    pub measure: bool,
    #[command(flatten)]
    pub build: BuildArgs,
    #[command(flatten)]
    pub common: CommonArgs,
}

#[derive(Args)]
pub struct ExtremesArgs {
    /// Rays at each value of a sweep, each traced for the closest hit and for any hit
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = value_parser!(u32).range(1..=1 << 20))]
    pub rays: u32,
    /// Sweeps to run, separated by commas [default: all]
    #[arg(long, value_name = "NAMES", value_parser = parse_sweeps)]
    pub only: Option<Sweeps>,
    /// Seed of the scenes and rays
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Draw the results as an HTML page
    #[arg(long, value_name = "FILE", value_parser = parse_page)]
    pub plot: Option<PathBuf>,
    /// Run only fast, guarded or exact [default: all three]
    #[arg(long, value_name = "MODE", value_parser = parse_precision)]
    pub precision: Option<Precision>,
    /// Rays per packet: auto, 1, 4, 8 or 16
    #[arg(long, value_name = "N", default_value = "auto", value_parser = parse_lanes)]
    pub lanes: LaneCount,
    /// Threads that ask the reference [default: all hardware threads]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
    #[command(flatten)]
    pub progress: ProgressArgs,
    /// Write machine-readable results; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub json: Option<Sink>,
}

#[derive(Args)]
pub struct ProbeArgs {
    /// .toml, .json, .gltf, .glb, .nff, .csg, .scad, .obj, .ply, .stl or .3mf, or - for standard input
    #[arg(value_parser = scene_path())]
    pub scene: PathBuf,
    /// Origin of the ray
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = parse_offset)]
    pub org: DVec3,
    /// Direction of the ray, not zero; t is in units of its length
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = parse_offset)]
    pub dir: DVec3,
    #[command(flatten)]
    pub import: ImportArgs,
    /// Write machine-readable results; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub json: Option<Sink>,
}

#[derive(Args)]
pub struct MeasureArgs {
    /// .toml, .json, .gltf, .glb, .nff, .csg, .scad, .obj, .ply, .stl or .3mf, or - for standard input
    #[arg(value_parser = scene_path())]
    pub scene: PathBuf,
    /// Print one line per instanced shape, in its own space, instead of one per root
    #[arg(long)]
    pub per_shape: bool,
    /// Relative error of volume and area to reach, where no formula gives them
    #[arg(long, value_name = "R", default_value_t = 5e-4, value_parser = parse_error)]
    pub error: f64,
    /// Print mass and inertia tensor too, of this mass per unit of volume
    #[arg(long, value_name = "D", value_parser = parse_positive)]
    pub density: Option<f64>,
    /// Stop after that many seconds, and print what is known then
    #[arg(long, value_name = "S", value_parser = parse_seconds)]
    pub time_limit: Option<f64>,
    /// Seed of the lines
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Threads [default: all hardware threads]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
    #[command(flatten)]
    pub import: ImportArgs,
    #[command(flatten)]
    pub progress: ProgressArgs,
    /// Write machine-readable results; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub json: Option<Sink>,
}

impl MeasureArgs {
    pub fn load_options(&self, outputs: Vec<PathBuf>) -> LoadOptions {
        self.import.load_options(outputs)
    }
}

#[derive(Args)]
pub struct RootsArgs {
    /// Coefficients of the polynomial, the constant one first
    #[arg(long, value_name = "C0,C1,...", allow_hyphen_values = true, value_parser = parse_coefficients)]
    pub coeffs: Option<Coefficients>,
    /// List of polynomials: {"polynomials": [{"name": ..., "coeffs_f64": [...]}]}
    #[arg(long, value_name = "FILE", conflicts_with = "coeffs")]
    pub file: Option<PathBuf>,
    /// Find only roots greater than LOW and at most HIGH; both may be infinite
    #[arg(long, value_name = "LOW,HIGH", default_value = "-inf,inf", allow_hyphen_values = true, value_parser = parse_interval)]
    pub interval: Interval,
    /// auto, halving, newton, sturm, closed, bracketed or bernstein [default: the roots
    /// of auto, compared with all others]
    #[arg(long, value_name = "SOLVER", value_parser = parse_solver)]
    pub solver: Option<Solver>,
    /// Draw time and missed roots of --file by degree, as an HTML page
    #[arg(
        long,
        value_name = "FILE",
        requires = "file",
        conflicts_with = "coeffs",
        value_parser = parse_page
    )]
    pub plot: Option<PathBuf>,
    /// Write machine-readable results; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub json: Option<Sink>,
}

#[derive(Args)]
pub struct ConvertArgs {
    /// .toml, .json, .gltf, .glb, .nff, .csg, .scad, .obj, .ply, .stl or .3mf, or - for standard input
    #[arg(value_parser = scene_path())]
    pub scene: PathBuf,
    /// .toml or .json; meshes go beside it, into the folder NAME_meshes
    pub out: PathBuf,
    /// Write machine-readable results; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub json: Option<Sink>,
    #[command(flatten)]
    pub import: ImportArgs,
}

impl ConvertArgs {
    pub fn load_options(&self, outputs: Vec<PathBuf>) -> LoadOptions {
        let options = self.import.load_options(outputs);
        // Of an animation all is written, whatever frames will be asked for.
        let animation = options.animation.map(|animation| Animated {
            blurs: true,
            ..animation
        });
        LoadOptions {
            animation,
            ..options
        }
    }
}

/// Options of `export` that jobs have in themselves, or have no use for.
const OF_SCENES: [&str; 23] = [
    "msh",
    "pov",
    "mitsuba",
    "size",
    "max_bounces",
    "camera",
    "view",
    "orbit",
    "fit",
    "eye",
    "look_at",
    "up",
    "fov_y",
    "orthographic",
    "format",
    "allow_outside",
    "point_radius",
    "z_up",
    "scad_curves",
    "clip",
    "hatch",
    "variant",
    "animation",
];

#[derive(Args)]
#[command(group = clap::ArgGroup::new("target").required(true).args(["pov", "mitsuba", "msh", "openjd"]))]
pub struct ExportArgs {
    /// .toml, .json, .gltf, .glb, .nff, .csg, .scad, .obj, .ply, .stl or .3mf, or - for standard input;
    /// with --openjd the .toml or .json of a job
    #[arg(value_parser = scene_path())]
    pub scene: PathBuf,
    /// Write a scene description for POV-Ray 3.7; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub pov: Option<Sink>,
    /// Write a scene for Mitsuba 3: this XML file, and beside it meshes and maps whose names
    /// begin with the file's
    #[arg(long, value_name = "FILE", conflicts_with = "pov", value_parser = parse_page)]
    pub mitsuba: Option<PathBuf>,
    /// Write the triangles of all meshes in world space, .msh, as bench --mesh reads them
    #[arg(long, value_name = "FILE", conflicts_with_all = ["pov", "mitsuba", "size", "max_bounces"], value_parser = parse_page)]
    pub msh: Option<PathBuf>,
    /// Write a job of lanecast batch as a template of Open Job Description, .yaml, for a farm; - is
    /// standard output
    #[arg(long, value_name = "FILE", conflicts_with_all = OF_SCENES, value_parser = Sink::parse)]
    pub openjd: Option<Sink>,
    /// Size of Mitsuba's picture, as WIDTHxHEIGHT [default: 1280x720]
    #[arg(long, value_name = "WxH", conflicts_with = "pov", allow_hyphen_values = true, value_parser = parse_size)]
    pub size: Option<Size>,
    /// Maximum number of bounces of Mitsuba's paths [default: 16, as of our own]
    #[arg(long, alias = "max-depth", value_name = "N", conflicts_with = "pov", value_parser = value_parser!(u32).range(0..=255))]
    pub max_bounces: Option<u32>,
    /// Write machine-readable results; - is standard output
    #[arg(long, value_name = "FILE", conflicts_with = "openjd", value_parser = Sink::parse)]
    pub json: Option<Sink>,
    #[command(flatten)]
    pub view: ViewArgs,
    #[command(flatten)]
    pub import: ImportArgs,
}

impl ProbeArgs {
    pub fn load_options(&self, outputs: Vec<PathBuf>) -> LoadOptions {
        self.import.load_options(outputs)
    }
}

impl ExportArgs {
    pub fn load_options(&self, outputs: Vec<PathBuf>) -> LoadOptions {
        self.import.load_options(outputs)
    }
}

pub const RENDER_SIZE: Size = Size {
    width: 1280,
    height: 720,
};

/// Of the built-in scene: done in ten seconds by 64 paths a pixel on two cores.
const BUILTIN_SIZE: Size = Size {
    width: 800,
    height: 450,
};

/// Smaller than a render: the scalar reference answers every pixel.
pub const VERIFY_SIZE: Size = Size {
    width: 320,
    height: 180,
};

impl RenderArgs {
    pub fn load_options(&self, outputs: Vec<PathBuf>) -> LoadOptions {
        let name = self.common.import.animation.as_deref();
        LoadOptions {
            animation: self.sequence.animated(name, &self.shutter),
            ..self.common.load_options(outputs)
        }
    }

    /// Returns the configuration before the scene is known, which completes it
    /// ([`LightArgs::complete`]).
    pub fn config(&self) -> Result<RenderConfig, CliError> {
        let config = self.common.config(match self.scene {
            Some(_) => RENDER_SIZE,
            None => BUILTIN_SIZE,
        })?;
        self.build.check(self.common.accel)?;
        self.light.check()?;
        let corners = config.grid == Grid::Corners;
        if let (true, Some(spp @ 2..)) = (corners, self.light.spp) {
            return Err(CliError::Usage(format!(
                "--grid corners traces one ray through each corner; leave out --spp {spp}"
            )));
        }
        Ok(RenderConfig {
            spp: 1,
            seed: self.seed,
            build: self.build.quality,
            shadow_cache: self.shadow_cache,
            aovs: self.outputs.most(),
            matte_ranks: self.outputs.matte_ranks()?,
            backdrop: self.background,
            solver: self.solver.checked(Some(config.choices.precision))?,
            ..config
        })
    }
}

impl PlanArgs {
    pub fn config(&self) -> Result<RenderConfig, CliError> {
        self.build.check(self.common.accel)?;
        Ok(RenderConfig {
            build: self.build.quality,
            ..self.common.config(RENDER_SIZE)?
        })
    }
}

impl VerifyArgs {
    pub fn config(&self) -> Result<RenderConfig, CliError> {
        self.build.check(self.common.accel)?;
        Ok(RenderConfig {
            max_depth: self.depth.max_bounces,
            build: self.build.quality,
            solver: self.solver.checked(self.common.precision)?,
            ..self.common.config(VERIFY_SIZE)?
        })
    }
}
