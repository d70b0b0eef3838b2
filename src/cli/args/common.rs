//! Options that several commands have: of structures, of bounces, of root finders, of progress, and of
//! all that trace.

use super::import::ImportArgs;
use super::values::{
    AccelChoice, LaneCounts, Size, parse_accel, parse_build, parse_grid, parse_kd_clip,
    parse_kd_stop, parse_lane_counts, parse_precision, parse_size, parse_solver,
};
use super::view::ViewArgs;
use crate::error::CliError;
use crate::output::Sink;
use crate::progress::Style;
use clap::{Args, value_parser};
use lanecast_engine::accel::{BuildQuality, KdClip, KdQuality, KdStop};
use lanecast_io::LoadOptions;
use lanecast_model::plan::{Accel, Choices, LaneCount, Precision};
use lanecast_numerics::roots::Solver;
use lanecast_picture::render::{Grid, RenderConfig};
use std::path::PathBuf;

/// Options of the commands that build one structure.
#[derive(Args)]
pub struct BuildArgs {
    /// Build quality of the trees of bvh and item-buffer: medium, or high (slower to
    /// build, often faster to trace)
    #[arg(long = "build", value_name = "QUALITY", default_value = "medium", value_parser = parse_build)]
    pub quality: BuildQuality,
}

impl BuildArgs {
    pub(super) fn check(&self, accel: AccelChoice) -> Result<(), CliError> {
        check_build(&[self.quality], &[accel])
    }
}

/// Checks that one of the structures has the trees that `--build` applies to.
pub(super) fn check_build(builds: &[BuildQuality], accels: &[AccelChoice]) -> Result<(), CliError> {
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

/// Options of the commands that follow rays beyond their first hit.
#[derive(Args)]
pub struct DepthArgs {
    /// Maximum number of reflections and refractions of a ray
    #[arg(long, alias = "max-depth", value_name = "N", default_value_t = 5, value_parser = value_parser!(u32).range(0..=255))]
    pub max_bounces: u32,
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

/// Options of the commands that take long.
#[derive(Args, Clone, Copy)]
pub struct ProgressArgs {
    /// Show progress on standard error: bar (on a terminal; else a line at each tenth), json (a
    /// line every half second), none, or auto, which is a bar on a terminal, else none; or on
    /// standard output as an engine of a farm reads it: openjd or afanasy
    #[arg(id = "progress", long = "progress", value_name = "HOW", default_value = "auto", value_parser = Style::parse)]
    pub style: Style,
}

impl ProgressArgs {
    /// Refuses results on standard output beside progress for a farm.
    pub fn check<'a>(&self, mut sinks: impl Iterator<Item = &'a Sink>) -> Result<(), CliError> {
        let is_farm = matches!(self.style, Style::Farm(_));
        match is_farm && sinks.any(|sink| *sink == Sink::Stdout) {
            true => Err(CliError::Usage(
                "--progress openjd and afanasy go to standard output, as the results would; give \
                 these a file"
                    .into(),
            )),
            false => Ok(()),
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
    #[command(flatten)]
    pub progress: ProgressArgs,
    /// Write machine-readable results; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub json: Option<Sink>,
    #[command(flatten)]
    pub view: ViewArgs,
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
    pub(super) fn config_of(
        &self,
        default_size: Size,
        accels: &[AccelChoice],
    ) -> Result<RenderConfig, CliError> {
        self.progress.check(self.sinks())?;
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
        if self.kd_leaf.is_some() && !matches!(self.kd_stop, Some(KdStop::Count | KdStop::Both)) {
            return Err(CliError::Usage(
                "--kd-leaf is for --kd-stop count and both; ask for one of them, or leave it out"
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
        self.import.load_options(outputs)
    }

    /// Returns the destinations of all results other than pictures.
    pub fn sinks(&self) -> impl Iterator<Item = &Sink> {
        self.stats.iter().chain(&self.json)
    }
}
