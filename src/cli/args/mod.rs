//! The arguments of all commands, validated as they are parsed.
//!
//! Each command accepts only the options that it uses, so that no option is silently
//! ignored. `render/config.rs` documents the options' meaning, `values.rs` their
//! values.

mod about;
mod batch;
mod bench;
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
mod tradeoff;
mod values;
mod view;

pub use about::{CompletionsArgs, ManArgs, VersionArgs};
pub use batch::BatchArgs;
pub use bench::BenchArgs;
pub use compare::CompareArgs;
pub use layout::laid_out;
pub use light::{has_lens, needed_integrator};
#[cfg(feature = "view")]
pub use page::OWN_OPTIONS;
pub use page::PageArgs;
pub use thumbs::ThumbsArgs;
pub use tradeoff::{Accuracy, TradeoffArgs};
pub use values::Size;
pub use view::ViewArgs;

use super::error::CliError;
use super::output::Sink;
use super::progress::Style;
use crate::accel::{BuildQuality, KdClip, KdQuality, KdStop};
use crate::io::{Animated, LoadOptions};
use crate::plan::{Accel, Choices, LaneCount, Precision};
use crate::render::{Backdrop, Grid, RenderConfig};
use crate::roots::{Interval, Solver};
use crate::scene::Timeline;
use crate::trace::Caching;
use clap::{Args, value_parser};
use development::DevelopmentArgs;
use glam::DVec3;
use import::ImportArgs;
use light::LightArgs;
use outputs::OutputArgs;
use sequence::SequenceArgs;
use shutter::ShutterArgs;
use std::path::PathBuf;
use values::{
    AccelChoice, Coefficients, LaneCounts, ReuseChoice, Sweeps, parse_accel, parse_backdrop,
    parse_build, parse_caching, parse_coefficients, parse_error, parse_grid, parse_interval,
    parse_kd_clip, parse_kd_stop, parse_lane_counts, parse_lanes, parse_offset, parse_page,
    parse_positive, parse_precision, parse_reuse, parse_scale, parse_seconds, parse_size,
    parse_solver, parse_sweeps,
};

#[derive(Args)]
pub struct RenderArgs {
    /// .toml, .json, .gltf, .glb, .nff, .csg, .scad, .obj, .ply, .stl or .3mf; without it, the built-in scene
    pub scene: Option<PathBuf>,
    /// .png, .jpg, .hdr or .exr; with --samples .sums [default: the scene's name with .png or
    /// .sums, in the current folder]
    #[arg(short, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Choose the options of the fastest way that keeps bounds: within:rmse=X, flip=X, wrong-pixels=N,
    /// separated by commas, or the most accurate of seconds=X (of a picture of 240x135). They are
    /// measured once for each class of scenes, as tradeoff does, and kept in the user's cache
    #[arg(long, value_name = "within:BOUNDS", value_parser = Accuracy::parse, conflicts_with_all = ["spp", "noise", "samples", "sampler", "filter", "cache", "max_depth", "shutter_slices", "precision", "accel", "lanes", "solver", "integrator"])]
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
    #[arg(long, value_name = "WHAT", default_value = "auto", value_parser = parse_backdrop)]
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
    /// .sums files of one picture, whose samples are all from 0 on, in any order
    #[arg(required = true, value_name = "PART")]
    pub parts: Vec<PathBuf>,
    /// .png, .jpg, .hdr or .exr
    #[arg(short, value_name = "FILE")]
    pub output: PathBuf,
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
    /// .toml, .json, .gltf, .glb, .nff, .csg, .scad, .obj, .ply, .stl or .3mf
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
    /// .toml, .json, .gltf, .glb, .nff, .csg, .scad, .obj, .ply, .stl or .3mf; without it, the built-in scene
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
    /// Show progress on standard error: bar (on a terminal; else a line at each tenth), json (a
    /// line every half second), none, or auto, which is a bar on a terminal, else none
    #[arg(long, value_name = "HOW", default_value = "auto", value_parser = Style::parse)]
    pub progress: Style,
    /// Write machine-readable results; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub json: Option<Sink>,
}

#[derive(Args)]
pub struct ProbeArgs {
    /// .toml, .json, .gltf, .glb, .nff, .csg, .scad, .obj, .ply, .stl or .3mf
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
    /// .toml, .json, .gltf, .glb, .nff, .csg, .scad, .obj, .ply, .stl or .3mf
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
    /// Show progress on standard error: bar (on a terminal; else a line at each tenth), json (a
    /// line every half second), none, or auto, which is a bar on a terminal, else none
    #[arg(long, value_name = "HOW", default_value = "auto", value_parser = Style::parse)]
    pub progress: Style,
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
    #[arg(long, value_name = "C0,C1,…", allow_hyphen_values = true, value_parser = parse_coefficients)]
    pub coeffs: Option<Coefficients>,
    /// List of polynomials: {"polynomials": [{"name": …, "coeffs_f64": […]}]}
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
    /// .toml, .json, .gltf, .glb, .nff, .csg, .scad, .obj, .ply, .stl or .3mf
    pub scene: PathBuf,
    /// .toml or .json; meshes go beside it, into the folder NAME_meshes
    pub out: PathBuf,
    #[command(flatten)]
    pub import: ImportArgs,
}

impl ConvertArgs {
    pub fn load_options(&self, outputs: Vec<PathBuf>) -> LoadOptions {
        self.import.load_options(outputs)
    }
}

#[derive(Args)]
pub struct ExportArgs {
    /// .toml, .json, .gltf, .glb, .nff, .csg, .scad, .obj, .ply, .stl or .3mf
    pub scene: PathBuf,
    /// Write a scene description for POV-Ray 3.7; - is standard output
    #[arg(long, value_name = "FILE", required_unless_present = "mitsuba", value_parser = Sink::parse)]
    pub pov: Option<Sink>,
    /// Write a scene for Mitsuba 3: this XML file, and beside it meshes and maps whose names
    /// begin with the file's
    #[arg(long, value_name = "FILE", conflicts_with = "pov", value_parser = parse_page)]
    pub mitsuba: Option<PathBuf>,
    /// Size of Mitsuba's picture, as WIDTHxHEIGHT [default: 1280x720]
    #[arg(long, value_name = "WxH", conflicts_with = "pov", allow_hyphen_values = true, value_parser = parse_size)]
    pub size: Option<Size>,
    /// Maximum number of bounces of Mitsuba's paths [default: 16, as of our own]
    #[arg(long, value_name = "N", conflicts_with = "pov", value_parser = value_parser!(u32).range(0..=255))]
    pub max_depth: Option<u32>,
    #[command(flatten)]
    pub view: ViewArgs,
    #[command(flatten)]
    pub import: ImportArgs,
}

/// Options of the commands that build one structure.
#[derive(Args)]
pub struct BuildArgs {
    /// Build quality of the trees of bvh and item-buffer: medium, or high (slower to
    /// build, often faster to trace)
    #[arg(long = "build", value_name = "QUALITY", default_value = "medium", value_parser = parse_build)]
    pub quality: BuildQuality,
}

/// Options of the commands that follow rays beyond their first hit.
#[derive(Args)]
pub struct DepthArgs {
    /// Maximum number of reflections and refractions of a ray
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = value_parser!(u32).range(0..=255))]
    pub max_depth: u32,
}

/// Options of the commands that trace polynomial surfaces in `fast`.
#[derive(Args)]
pub struct SolverArgs {
    /// Root finder of polynomial surfaces in the precision fast: auto, halving, newton,
    /// sturm, closed, bracketed or bernstein [default: the one that each surface names,
    /// or auto]
    #[arg(long, value_name = "SOLVER", value_parser = parse_solver)]
    pub solver: Option<Solver>,
}

impl SolverArgs {
    /// Checks that the solver has an effect. `precision` is the traced one, or `None`
    /// if `fast` is among several.
    pub fn checked(&self, precision: Option<Precision>) -> Result<Option<Solver>, CliError> {
        match (self.solver, precision) {
            (Some(Solver::Auto) | None, _) | (_, Some(Precision::Fast) | None) => Ok(self.solver),
            (Some(solver), Some(other)) => Err(CliError::Usage(format!(
                "--solver {} is for --precision fast; {} gives the same hits with any solver",
                solver.name(),
                other.name()
            ))),
        }
    }
}

/// Options of every command that traces.
#[derive(Args)]
pub struct CommonArgs {
    /// Size in pixels, as WIDTHxHEIGHT [default: 1280x720; render without SCENE: 800x450; verify: 320x180]
    #[arg(long, value_name = "WxH", allow_hyphen_values = true, value_parser = parse_size)]
    pub size: Option<Size>,
    /// centers: rays through the pixels; corners: one ray through each corner of
    /// (W-1)x(H-1) pixels
    #[arg(long, value_name = "GRID", default_value = "centers", value_parser = parse_grid)]
    pub grid: Grid,
    /// Write times, memory and ray counts as JSON; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub stats: Option<Sink>,
    #[command(flatten)]
    pub import: ImportArgs,
    /// fast: f32 lanes; guarded: f32 lanes, uncertain tests decided exactly; exact: as
    /// guarded, with t refined to the nearest f64 [default: guarded; bench: all;
    /// verify: all]
    #[arg(long, value_name = "MODE", value_parser = parse_precision)]
    pub precision: Option<Precision>,
    /// Rays per packet: auto, 1, 4, 8 or 16; for bench several, separated by commas
    /// [default: auto; bench: auto,1]
    #[arg(long, value_name = "N", value_parser = parse_lane_counts)]
    pub lanes: Option<LaneCounts>,
    /// Acceleration structure: auto, bvh, kd, grid, heap, heap-spheres, item-buffer, or
    /// linear (every primitive is tested)
    #[arg(long, value_name = "NAME", default_value = "auto", value_parser = parse_accel)]
    pub accel: AccelChoice,
    /// Rule by which a k-d tree's cell becomes a leaf: depth, count, both or cost
    /// [default: cost]
    #[arg(long, value_name = "RULE", value_parser = parse_kd_stop)]
    pub kd_stop: Option<KdStop>,
    /// Maximum depth of a k-d tree [default: 8 + 1.3 log2 of the primitives]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(0..=64))]
    pub kd_depth: Option<u32>,
    /// Maximum number of primitives in a leaf for --kd-stop count and both [default: 2]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(0..=1_000_000))]
    pub kd_leaf: Option<u32>,
    /// Bounds of a triangle in a k-d tree's cell: its box, plane or triangle [default:
    /// plane]
    #[arg(long, value_name = "PART", value_parser = parse_kd_clip)]
    pub kd_clip: Option<KdClip>,
    /// Threads that trace [default: all hardware threads; bench: 1]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
    /// Show progress on standard error: bar (on a terminal; else a line at each tenth), json (a
    /// line every half second), none, or auto, which is a bar on a terminal, else none
    #[arg(long, value_name = "HOW", default_value = "auto", value_parser = Style::parse)]
    pub progress: Style,
    /// Write machine-readable results; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub json: Option<Sink>,
    #[command(flatten)]
    pub view: ViewArgs,
    /// Variant of a glTF file's materials (KHR_materials_variants) [default: none]
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Animation of a glTF file, by its name or its number from 0 [default: of --frames and
    /// --shutter the first, else none, and things are as at rest]
    #[arg(long, value_name = "NAME|INDEX")]
    pub animation: Option<String>,
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
        let name = self.common.animation.as_deref();
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
            matte_ranks: self.outputs.cryptomatte_levels,
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

impl BuildArgs {
    fn check(&self, accel: AccelChoice) -> Result<(), CliError> {
        check_build(&[self.quality], &[accel])
    }
}

/// Checks that one of the structures has the trees that `--build` applies to.
fn check_build(builds: &[BuildQuality], accels: &[AccelChoice]) -> Result<(), CliError> {
    let has = |accel: &AccelChoice| matches!(accel.0, None | Some(Accel::Bvh | Accel::ItemBuffer));
    if builds.contains(&BuildQuality::High) && !accels.iter().any(has) {
        return Err(CliError::Usage(
            "--build applies to the trees of bvh and item-buffer; leave it out, or choose one with \
             --accel bvh or --accel item-buffer"
                .into(),
        ));
    }
    Ok(())
}

impl VerifyArgs {
    pub fn config(&self) -> Result<RenderConfig, CliError> {
        self.build.check(self.common.accel)?;
        Ok(RenderConfig {
            max_depth: self.depth.max_depth,
            build: self.build.quality,
            solver: self.solver.checked(self.common.precision)?,
            ..self.common.config(VERIFY_SIZE)?
        })
    }
}

impl CommonArgs {
    /// Returns a configuration with one sample per pixel and no AOVs.
    pub fn config(&self, default_size: Size) -> Result<RenderConfig, CliError> {
        if let Some(LaneCounts(asked)) = &self.lanes
            && asked.len() > 1
        {
            return Err(CliError::Usage(
                "only bench takes several --lanes at once; choose one of them".into(),
            ));
        }
        self.config_of(default_size, &[self.accel])
    }

    /// Returns the configuration for tracing all of `accels`.
    fn config_of(
        &self,
        default_size: Size,
        accels: &[AccelChoice],
    ) -> Result<RenderConfig, CliError> {
        let size = self.size.unwrap_or(default_size);
        if self.grid == Grid::Corners && (size.width < 2 || size.height < 2) {
            return Err(CliError::Usage(
                "--grid corners needs a --size of at least 2x2: a pixel has two corners per side"
                    .into(),
            ));
        }
        let has_kd_options = self.kd_stop.is_some()
            || self.kd_depth.is_some()
            || self.kd_leaf.is_some()
            || self.kd_clip.is_some();
        if has_kd_options && !accels.contains(&AccelChoice(Some(Accel::Kd))) {
            return Err(CliError::Usage(
                "--kd-stop, --kd-depth, --kd-leaf and --kd-clip apply to k-d trees; choose one \
                 with --accel kd"
                    .into(),
            ));
        }
        Ok(RenderConfig {
            width: size.width,
            height: size.height,
            grid: self.grid,
            choices: Choices {
                precision: self.precision.unwrap_or_default(),
                lanes: self
                    .lanes
                    .as_ref()
                    .map_or(LaneCount::Auto, |asked| asked.0[0]),
                accel: self.accel.0,
            },
            kd: self.kd_quality(),
            threads: self.threads,
            camera: self.view.camera.clone(),
            ..RenderConfig::default()
        })
    }

    fn kd_quality(&self) -> KdQuality {
        let default = KdQuality::default();
        KdQuality {
            stop: self.kd_stop.unwrap_or(default.stop),
            depth: self.kd_depth,
            leaf: self.kd_leaf.unwrap_or(default.leaf),
            clip: self.kd_clip.unwrap_or(default.clip),
            ..default
        }
    }

    pub fn load_options(&self, outputs: Vec<PathBuf>) -> LoadOptions {
        LoadOptions {
            variant: self.variant.clone(),
            animation: self.animation.as_ref().map(|name| Animated {
                name: Some(name.clone()),
                timeline: Timeline::whole(1),
                margin: 0,
                blurs: false,
            }),
            ..self.import.load_options(outputs)
        }
    }

    /// Returns the destinations of all results other than pictures.
    pub fn sinks(&self) -> impl Iterator<Item = &Sink> {
        self.stats.iter().chain(&self.json)
    }
}
