//! The arguments of all commands, checked as they are read.
//!
//! A command takes the options that it uses and refuses the others, which would
//! promise what they do not do. What the options mean is in `render/config.rs`,
//! what their values may be in `values.rs`.

mod values;

pub use values::Size;

use super::error::CliError;
use super::output::Sink;
use crate::accel::{BuildQuality, KdClip, KdQuality, KdStop};
use crate::io::{AovSet, LoadOptions};
use crate::measure::generate::Generated;
use crate::measure::kinds::Order;
use crate::plan::{Accel, Choices, LaneCount, Precision};
use crate::render::{Grid, RenderConfig};
use crate::roots::{Interval, Solver};
use crate::trace::Caching;
use clap::{Args, value_parser};
use glam::DVec3;
use std::path::PathBuf;
use values::{
    AccelChoice, BenchAccels, BenchBuilds, BenchCachings, BenchKinds, Coefficients, GrowthRange,
    PeerChoice, ReuseChoice, Sweeps, no_tiles, parse_accel, parse_accels, parse_aovs,
    parse_bench_builds, parse_build, parse_caching, parse_cachings, parse_coefficients,
    parse_error, parse_generated, parse_grid, parse_growth, parse_interval, parse_kd_clip,
    parse_kd_stop, parse_kinds, parse_lanes, parse_offset, parse_order, parse_page, parse_peers,
    parse_precision, parse_reuse, parse_scale, parse_size, parse_solver, parse_sweeps,
};

#[derive(Args)]
pub struct RenderArgs {
    /// .toml, .json, .gltf, .glb, .nff, .obj, .ply or .stl; without it, the built-in scene
    pub scene: Option<PathBuf>,
    /// .png or .exr [default: the scene's name, as .png, here]
    #[arg(short, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Samples per pixel [default: 1; the built-in scene: 4]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=65_536))]
    pub spp: Option<u32>,
    /// Extra outputs of each pixel's first sample, separated by commas: depth, position, normal, albedo, instance_id, primitive_id
    #[arg(long, value_name = "NAMES", value_parser = parse_aovs)]
    pub aov: Option<AovSet>,
    /// Of the samples' positions
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Whether shadow rays try the last occluder first: on or off; the picture is the same
    #[arg(long, value_name = "USE", default_value = "on", value_parser = parse_caching)]
    pub shadow_cache: Caching,
    #[command(flatten)]
    pub build: BuildArgs,
    #[command(flatten)]
    pub depth: DepthArgs,
    #[arg(long, value_name = "I/N", hide = true, value_parser = no_tiles)]
    pub tile: Option<String>,
    /// Render N pictures at times from 0 to 1 of the scene's motion: name_0000.png and so on
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=100_000))]
    pub frames: Option<u32>,
    /// What camera rays take over from the frame before: depth, hit, none or auto, which is depth
    /// where meshes are placed; no bit depends on it
    #[arg(long, value_name = "WHAT", default_value = "auto", requires = "frames", value_parser = parse_reuse)]
    pub reuse: ReuseChoice,
    #[command(flatten)]
    pub solver: SolverArgs,
    #[command(flatten)]
    pub common: CommonArgs,
}

#[derive(Args)]
pub struct VerifyArgs {
    /// .toml, .json, .gltf, .glb, .nff, .obj, .ply or .stl
    pub scene: PathBuf,
    /// Fail only where a mode has more wrong answers than this [default: 0; fast may have any]
    #[arg(long, value_name = "N")]
    pub allow_wrong: Option<u64>,
    /// Ask the reference about every K-th pixel only; best without a common factor with the width
    #[arg(long, value_name = "K", value_parser = value_parser!(u64).range(1..))]
    pub sample: Option<u64>,
    /// N rays more, aimed at edges, corners, silhouettes and tangents
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=10_000_000))]
    pub adversarial: Option<u32>,
    /// Of the aimed rays
    #[arg(long, value_name = "N", default_value_t = 0, requires = "adversarial")]
    pub seed: u64,
    /// Scale everything, lights and cameras too, about the world's origin
    #[arg(long, value_name = "S", default_value_t = 1.0, allow_hyphen_values = true, value_parser = parse_scale)]
    pub scale: f64,
    /// Then move it
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
#[command(override_usage = "lanecast bench [OPTIONS] <SCENE>\n       \
                            lanecast bench [OPTIONS] --mesh <FILE> --rays <FILE>\n       \
                            lanecast bench [OPTIONS] --growth <MIN:MAX>")]
pub struct BenchArgs {
    /// .toml, .json, .gltf, .glb, .nff, .obj, .ply or .stl; or --mesh and --rays, or --growth
    #[arg(required_unless_present_any = ["mesh", "rays", "growth"])]
    pub scene: Option<PathBuf>,
    /// Write the scene's triangles and rays as .msh and .rays files
    #[arg(long, value_name = "DIR", conflicts_with_all = ["mesh", "rays"])]
    pub export: Option<PathBuf>,
    /// Trace this .msh file; with --rays, in place of SCENE
    #[arg(long, value_name = "FILE", requires = "rays", conflicts_with = "scene")]
    pub mesh: Option<PathBuf>,
    /// Trace the rays of this .rays file; may be given more than once
    #[arg(long, value_name = "FILE", requires = "mesh", conflicts_with = "scene")]
    pub rays: Vec<PathBuf>,
    /// Measure generated meshes of MIN to MAX triangles, two sizes a decade, in place of SCENE
    #[arg(long, value_name = "MIN:MAX", allow_hyphen_values = true, conflicts_with_all = ["scene", "mesh", "rays", "export", "camera", "solver"], value_parser = parse_growth)]
    pub growth: Option<GrowthRange>,
    /// What --growth generates: sphere, needles or building
    #[arg(long, value_name = "MESH", default_value = "sphere", requires = "growth", value_parser = parse_generated)]
    pub generate: Generated,
    /// Ray kinds, separated by commas: primary, ortho, shadow, lightshadow, directional, areashadow, mirror, diffuse, diffuse_any [default: all]
    #[arg(long, value_name = "KINDS", conflicts_with_all = ["mesh", "rays"], value_parser = parse_kinds)]
    pub kinds: Option<BenchKinds>,
    /// Order of the camera's rays, which others keep: scanline, tile, morton or random
    #[arg(long, value_name = "ORDER", default_value = "tile", conflicts_with_all = ["mesh", "rays"], value_parser = parse_order)]
    pub order: Order,
    /// Structures measured in one run, separated by commas, in place of --accel
    #[arg(long, value_name = "NAMES", conflicts_with = "accel", value_parser = parse_accels)]
    pub accels: Option<BenchAccels>,
    /// Another tracer beside ours, on the same rays: embree
    #[arg(long, value_name = "NAME", value_parser = parse_peers)]
    pub peers: Option<PeerChoice>,
    /// Runs of each measurement: the median and the best are reported
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = value_parser!(u32).range(1..=10_000))]
    pub reps: u32,
    /// Measure N frames of the scene's motion instead: what camera rays gain by the frame before, and a fitted tree against a built one
    #[arg(long, value_name = "N", requires = "scene", conflicts_with_all = ["mesh", "rays", "export", "growth", "kinds", "accels", "build", "peers", "plot"], value_parser = value_parser!(u32).range(2..=10_000))]
    pub frames: Option<u32>,
    /// Times that each structure is built, in turns
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = value_parser!(u32).range(1..=1000))]
    pub builds: u32,
    /// How the bvh's and the item buffer's trees are built: medium, high, or both beside each other
    #[arg(long, value_name = "QUALITY", default_value = "medium", value_parser = parse_bench_builds)]
    pub build: BenchBuilds,
    /// Whether any-hit rays try the last occluder first: on, off, or both beside each other
    #[arg(long, value_name = "USE", default_value = "on", value_parser = parse_cachings)]
    pub shadow_cache: BenchCachings,
    /// Draw the results, as an HTML page
    #[arg(long, value_name = "FILE", value_parser = parse_page)]
    pub plot: Option<PathBuf>,
    #[command(flatten)]
    pub solver: SolverArgs,
    #[command(flatten)]
    pub common: CommonArgs,
}

#[derive(Args)]
pub struct PlanArgs {
    /// .toml, .json, .gltf, .glb, .nff, .obj, .ply or .stl; without it, the built-in scene
    pub scene: Option<PathBuf>,
    #[command(flatten)]
    pub build: BuildArgs,
    #[command(flatten)]
    pub common: CommonArgs,
}

#[derive(Args)]
pub struct ExtremesArgs {
    /// Rays at each value of a sweep; closest hit and any hit are asked of each
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = value_parser!(u32).range(1..=1 << 20))]
    pub rays: u32,
    /// Sweeps, separated by commas [default: all]
    #[arg(long, value_name = "NAMES", value_parser = parse_sweeps)]
    pub only: Option<Sweeps>,
    /// Of the scenes and rays
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Draw the results, as an HTML page
    #[arg(long, value_name = "FILE", value_parser = parse_page)]
    pub plot: Option<PathBuf>,
    /// fast, guarded or exact alone [default: all three]
    #[arg(long, value_name = "MODE", value_parser = parse_precision)]
    pub precision: Option<Precision>,
    /// Rays per packet: auto, 1, 4, 8 or 16
    #[arg(long, value_name = "N", default_value = "auto", value_parser = parse_lanes)]
    pub lanes: LaneCount,
    /// Threads that ask the reference [default: as many as the machine runs at once]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
    /// Machine-readable results; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub json: Option<Sink>,
}

#[derive(Args)]
pub struct ProbeArgs {
    /// .toml, .json, .gltf, .glb, .nff, .obj, .ply or .stl
    pub scene: PathBuf,
    /// Where the ray starts
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = parse_offset)]
    pub org: DVec3,
    /// Where it points, of any length but 0; t counts such lengths
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = parse_offset)]
    pub dir: DVec3,
    /// Files that the scene names may lie outside its folder
    #[arg(long)]
    pub allow_outside: bool,
    /// Machine-readable results; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub json: Option<Sink>,
}

#[derive(Args)]
pub struct MeasureArgs {
    /// .toml, .json, .gltf, .glb, .nff, .obj, .ply or .stl
    pub scene: PathBuf,
    /// One line for each shape that appears, in its own space, and not for each root
    #[arg(long)]
    pub per_shape: bool,
    /// Relative half width of the 95 % interval of volume and area to reach
    #[arg(long, value_name = "R", default_value_t = 5e-4, value_parser = parse_error)]
    pub error: f64,
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// [default: one per core]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
    /// Files that the scene names may lie outside its folder
    #[arg(long)]
    pub allow_outside: bool,
    /// Machine-readable results; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub json: Option<Sink>,
}

impl MeasureArgs {
    pub fn load_options(&self, outputs: Vec<PathBuf>) -> LoadOptions {
        LoadOptions {
            allow_outside: self.allow_outside,
            outputs,
        }
    }
}

#[derive(Args)]
pub struct RootsArgs {
    /// Coefficients of the polynomial, the constant one first
    #[arg(long, value_name = "C0,C1,…", allow_hyphen_values = true, value_parser = parse_coefficients)]
    pub coeffs: Option<Coefficients>,
    /// A list of polynomials: {"polynomials": [{"name": …, "coeffs_f64": […]}]}
    #[arg(long, value_name = "FILE", conflicts_with = "coeffs")]
    pub file: Option<PathBuf>,
    /// Only roots above LOW and up to HIGH, which belongs to it; each may be infinite
    #[arg(long, value_name = "LOW,HIGH", default_value = "-inf,inf", allow_hyphen_values = true, value_parser = parse_interval)]
    pub interval: Interval,
    /// auto, halving, newton, sturm, closed, bracketed or bernstein [default: the roots of auto, and all others beside it]
    #[arg(long, value_name = "SOLVER", value_parser = parse_solver)]
    pub solver: Option<Solver>,
    /// Time and missed roots by degree, of --file, as an HTML page
    #[arg(
        long,
        value_name = "FILE",
        requires = "file",
        conflicts_with = "coeffs",
        value_parser = parse_page
    )]
    pub plot: Option<PathBuf>,
    /// Machine-readable results; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub json: Option<Sink>,
}

#[derive(Args)]
pub struct ExportArgs {
    /// .toml, .json, .gltf, .glb, .nff, .obj, .ply or .stl
    pub scene: PathBuf,
    /// As a scene description for POV-Ray 3.7; - for standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub pov: Sink,
    /// A camera's name, or its number from 0 [default: the first]
    #[arg(long, value_name = "NAME|INDEX")]
    pub camera: Option<String>,
    /// Files that the scene names may lie outside its folder
    #[arg(long)]
    pub allow_outside: bool,
}

/// Of the commands that build one structure.
#[derive(Args)]
pub struct BuildArgs {
    /// How the bvh's and the item buffer's trees are built: medium, or high (slower to build, at best faster to trace)
    #[arg(long = "build", value_name = "QUALITY", default_value = "medium", value_parser = parse_build)]
    pub quality: BuildQuality,
}

/// Of the commands that follow rays beyond their first hit.
#[derive(Args)]
pub struct DepthArgs {
    /// Mirrorings and refractions of a ray
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = value_parser!(u32).range(0..=255))]
    pub max_depth: u32,
}

/// Of the commands that trace as rays are met in `fast`.
#[derive(Args)]
pub struct SolverArgs {
    /// What finds where rays meet polynomial surfaces in the precision fast: auto, halving, newton, sturm, closed, bracketed or bernstein [default: what each surface says, or auto]; of no other surfaces
    #[arg(long, value_name = "SOLVER", value_parser = parse_solver)]
    pub solver: Option<Solver>,
}

impl SolverArgs {
    /// `precision`: of what is traced, or `None` where `fast` is among it.
    pub fn checked(&self, precision: Option<Precision>) -> Result<Option<Solver>, CliError> {
        match (self.solver, precision) {
            (Some(Solver::Auto) | None, _) | (_, Some(Precision::Fast) | None) => Ok(self.solver),
            (Some(solver), Some(other)) => Err(CliError::Usage(format!(
                "--solver {} is for --precision fast; {} decides what rays meet exactly, \
                 whatever finds it",
                solver.name(),
                other.name()
            ))),
        }
    }
}

/// What every command that traces uses.
#[derive(Args)]
pub struct CommonArgs {
    /// Pixels, as WIDTHxHEIGHT [default: 1280x720; verify: 320x180]
    #[arg(long, value_name = "WxH", allow_hyphen_values = true, value_parser = parse_size)]
    pub size: Option<Size>,
    /// centers: through the pixels; corners: one ray through each corner of (W-1)x(H-1) pixels
    #[arg(long, value_name = "GRID", default_value = "centers", value_parser = parse_grid)]
    pub grid: Grid,
    /// Times, memory and ray counts, as JSON; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub stats: Option<Sink>,
    /// Files that the scene names may lie outside its folder
    #[arg(long)]
    pub allow_outside: bool,
    /// fast: f32 lanes; guarded: f32 lanes, doubts decided exactly; exact: f64 lanes, the same way [default: guarded; bench: all; verify: all]
    #[arg(long, value_name = "MODE", value_parser = parse_precision)]
    pub precision: Option<Precision>,
    /// Rays per packet: auto, 1, 4, 8 or 16 [default: auto; bench: auto and 1]
    #[arg(long, value_name = "N", value_parser = parse_lanes)]
    pub lanes: Option<LaneCount>,
    /// What finds the primitives that a ray meets: auto, bvh, kd, grid, heap, heap-spheres, item-buffer, or linear (every one is tested)
    #[arg(long, value_name = "NAME", default_value = "auto", value_parser = parse_accel)]
    pub accel: AccelChoice,
    /// When a k-d tree's cell becomes a leaf: depth, count, both or cost [default: cost]
    #[arg(long, value_name = "RULE", value_parser = parse_kd_stop)]
    pub kd_stop: Option<KdStop>,
    /// A k-d tree's greatest depth [default: 8 + 1.3 log2 of the primitives]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(0..=64))]
    pub kd_depth: Option<u32>,
    /// Primitives that --kd-stop count and both call few [default: 2]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(0..=1_000_000))]
    pub kd_leaf: Option<u32>,
    /// What stands for a triangle in a k-d tree's cell: its box, plane or triangle [default: plane]
    #[arg(long, value_name = "PART", value_parser = parse_kd_clip)]
    pub kd_clip: Option<KdClip>,
    /// Threads that trace [default: as many as the machine runs at once; bench: 1]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
    /// Machine-readable results; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub json: Option<Sink>,
    /// A camera's name, or its number from 0 [default: the first]
    #[arg(long, value_name = "NAME|INDEX")]
    pub camera: Option<String>,
}

impl ProbeArgs {
    pub fn load_options(&self, outputs: Vec<PathBuf>) -> LoadOptions {
        LoadOptions {
            allow_outside: self.allow_outside,
            outputs,
        }
    }
}

impl ExportArgs {
    pub fn load_options(&self, outputs: Vec<PathBuf>) -> LoadOptions {
        LoadOptions {
            allow_outside: self.allow_outside,
            outputs,
        }
    }
}

pub const RENDER_SIZE: Size = Size {
    width: 1280,
    height: 720,
};

/// Smaller, because the reference answers each pixel in its own slow way.
pub const VERIFY_SIZE: Size = Size {
    width: 320,
    height: 180,
};

/// The first picture that somebody makes should have smooth edges.
const BUILTIN_SPP: u32 = 4;

impl RenderArgs {
    pub fn config(&self) -> Result<RenderConfig, CliError> {
        let config = self.common.config(RENDER_SIZE)?;
        self.build.check(self.common.accel)?;
        let corners = config.grid == Grid::Corners;
        if let (true, Some(spp @ 2..)) = (corners, self.spp) {
            return Err(CliError::Usage(format!(
                "--grid corners traces one ray through each corner; leave out --spp {spp}"
            )));
        }
        let spp = match self.scene {
            None if !corners => BUILTIN_SPP,
            _ => 1,
        };
        Ok(RenderConfig {
            spp: self.spp.unwrap_or(spp),
            seed: self.seed,
            build: self.build.quality,
            max_depth: self.depth.max_depth,
            shadow_cache: self.shadow_cache,
            aovs: self.aov.unwrap_or_default(),
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

impl BenchArgs {
    pub fn config(&self, default_size: Size) -> Result<RenderConfig, CliError> {
        let accels = match &self.accels {
            Some(BenchAccels(accels)) => accels,
            None => std::slice::from_ref(&self.common.accel),
        };
        check_build(&self.build.0, accels)?;
        self.common.config_of(default_size, accels)
    }
}

impl BuildArgs {
    fn check(&self, accel: AccelChoice) -> Result<(), CliError> {
        check_build(&[self.quality], &[accel])
    }
}

/// `--build` speaks of trees that one of the structures has.
fn check_build(builds: &[BuildQuality], accels: &[AccelChoice]) -> Result<(), CliError> {
    let has = |accel: &AccelChoice| matches!(accel.0, None | Some(Accel::Bvh | Accel::ItemBuffer));
    if builds.contains(&BuildQuality::High) && !accels.iter().any(has) {
        return Err(CliError::Usage(
            "--build is of the bvh's and the item buffer's trees; leave it out, or ask for one \
             with --accel bvh or --accel item-buffer"
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
    /// One sample a pixel, and nothing beside the picture.
    pub fn config(&self, default_size: Size) -> Result<RenderConfig, CliError> {
        self.config_of(default_size, &[self.accel])
    }

    /// `accels`: all structures that are traced.
    fn config_of(
        &self,
        default_size: Size,
        accels: &[AccelChoice],
    ) -> Result<RenderConfig, CliError> {
        let size = self.size.unwrap_or(default_size);
        if self.grid == Grid::Corners && (size.width < 2 || size.height < 2) {
            return Err(CliError::Usage(
                "--grid corners needs a --size of at least 2x2: a pixel has two corners a side"
                    .into(),
            ));
        }
        let of_kd = self.kd_stop.is_some()
            || self.kd_depth.is_some()
            || self.kd_leaf.is_some()
            || self.kd_clip.is_some();
        if of_kd && !accels.contains(&AccelChoice(Some(Accel::Kd))) {
            return Err(CliError::Usage(
                "--kd-stop, --kd-depth, --kd-leaf and --kd-clip are of k-d trees; ask for one \
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
                lanes: self.lanes.unwrap_or_default(),
                accel: self.accel.0,
            },
            kd: self.kd_quality(),
            threads: self.threads,
            camera: self.camera.clone(),
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
            allow_outside: self.allow_outside,
            outputs,
        }
    }

    /// Where results other than pictures go.
    pub fn sinks(&self) -> impl Iterator<Item = &Sink> {
        self.stats.iter().chain(&self.json)
    }
}
