//! Options of `bench`.

use super::common::{CommonArgs, SolverArgs, check_build};
use super::import::scene_path;
use super::values::{
    BaselineChoice, BenchAccels, BenchBuilds, BenchCachings, BenchKinds, GrowthRange, Orders, Size,
    parse_accels, parse_bench_builds, parse_cachings, parse_generated, parse_growth, parse_kinds,
    parse_orders, parse_page, parse_peers,
};
use crate::error::CliError;
use clap::{Args, value_parser};
use lanecast_measure::generate::Generated;
use lanecast_picture::render::RenderConfig;
use std::path::PathBuf;

#[derive(Args)]
#[command(override_usage = "lanecast bench [OPTIONS] <SCENE>\n       \
                            lanecast bench [OPTIONS] --mesh <FILE> --rays <FILE>\n       \
                            lanecast bench [OPTIONS] --growth <MIN:MAX>")]
pub struct BenchArgs {
    /// .toml, .json, .gltf, .glb, .nff, .csg, .scad, .obj, .ply, .stl or .3mf, or - for standard input; or --mesh and --rays, or --growth
    #[arg(value_parser = scene_path(), required_unless_present_any = ["mesh", "rays", "growth"])]
    pub scene: Option<PathBuf>,
    /// Write the scene's triangles and rays as .msh and .rays files
    #[arg(long, value_name = "DIR", conflicts_with_all = ["mesh", "rays"])]
    pub export: Option<PathBuf>,
    /// Trace this .msh file instead of SCENE; requires --rays
    #[arg(long, value_name = "FILE", requires = "rays", conflicts_with = "scene")]
    pub mesh: Option<PathBuf>,
    /// Trace the rays of this .rays file; may be given more than once
    #[arg(long, value_name = "FILE", requires = "mesh", conflicts_with = "scene")]
    pub rays: Vec<PathBuf>,
    /// Measure generated meshes of MIN to MAX triangles, two sizes per decade, instead
    /// of SCENE
    #[arg(long, value_name = "MIN:MAX", allow_hyphen_values = true, conflicts_with_all = ["scene", "mesh", "rays", "export", "camera", "solver"], value_parser = parse_growth)]
    pub growth: Option<GrowthRange>,
    /// Mesh that --growth generates: sphere, needles or building
    #[arg(long, value_name = "MESH", default_value = "sphere", requires = "growth", value_parser = parse_generated)]
    pub generate: Generated,
    /// Ray kinds, separated by commas: primary, ortho, shadow, lightshadow,
    /// directional, areashadow, mirror, diffuse, diffuse_any [default: all]
    #[arg(long, value_name = "KINDS", conflicts_with_all = ["mesh", "rays"], value_parser = parse_kinds)]
    pub kinds: Option<BenchKinds>,
    /// Orders of the camera rays, which secondary rays keep, separated by commas: scanline,
    /// tile, morton, random
    #[arg(long, value_name = "ORDERS", default_value = "tile", conflicts_with_all = ["mesh", "rays"], value_parser = parse_orders)]
    pub order: Orders,
    /// Structures to measure in one run, separated by commas, instead of --accel
    #[arg(long, value_name = "NAMES", conflicts_with = "accel", value_parser = parse_accels)]
    pub accels: Option<BenchAccels>,
    /// Measure a baseline tracer on the same rays: embree
    #[arg(long, value_name = "NAME", value_parser = parse_peers)]
    pub peers: Option<BaselineChoice>,
    /// Runs of each measurement; the median and the best are reported
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = value_parser!(u32).range(1..=10_000))]
    pub reps: u32,
    /// Measure N frames of the scene's motion instead: camera rays with and without
    /// temporal bounds, and a refitted tree against a rebuilt one
    #[arg(long, value_name = "N", requires = "scene", conflicts_with_all = ["mesh", "rays", "export", "growth", "kinds", "accels", "build", "peers", "plot"], value_parser = value_parser!(u32).range(2..=10_000))]
    pub frames: Option<u32>,
    /// Number of times to build each structure, in turns
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = value_parser!(u32).range(1..=1000))]
    pub builds: u32,
    /// Build quality of the trees of bvh and item-buffer: medium, high, or both to
    /// compare them
    #[arg(long, value_name = "QUALITY", default_value = "medium", value_parser = parse_bench_builds)]
    pub build: BenchBuilds,
    /// Let any-hit rays first test the last occluder: on, off, or both to compare
    /// them
    #[arg(long, value_name = "USE", default_value = "on", value_parser = parse_cachings)]
    pub shadow_cache: BenchCachings,
    /// Draw the results as an HTML page
    #[arg(long, value_name = "FILE", value_parser = parse_page)]
    pub plot: Option<PathBuf>,
    #[command(flatten)]
    pub solver: SolverArgs,
    #[command(flatten)]
    pub common: CommonArgs,
}

impl BenchArgs {
    pub fn config(&self, default_size: Size) -> Result<RenderConfig, CliError> {
        let accels = match &self.accels {
            Some(BenchAccels(accels)) => accels,
            None => std::slice::from_ref(&self.common.accel),
        };
        check_build(&self.build.0, accels)?;
        let Orders(orders) = &self.order;
        let one = self.export.is_some() || self.growth.is_some() || self.frames.is_some();
        if one && orders.len() > 1 {
            return Err(CliError::Usage(
                "--export, --growth and --frames take one --order; choose one of them".into(),
            ));
        }
        self.common.config_of(default_size, accels)
    }
}
