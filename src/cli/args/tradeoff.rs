//! Options of `tradeoff`.

use super::common::ProgressArgs;
use super::import::{ImportArgs, scene_path};
use super::shutter::ShutterArgs;
use super::values::{Size, parse_page, parse_size};
use super::view::ViewArgs;
use crate::output::Sink;
use clap::{Args, value_parser};
use lanecast_measure::tradeoff::Bound;
use std::path::PathBuf;

#[derive(Args)]
#[command(
    after_help = "Times are medians of pictures that are rendered in turns. Errors are those of the colour \
                  against a converged picture of other random numbers; wrong pixels those whose camera \
                  ray meets something else than the exact reference says."
)]
pub struct TradeoffArgs {
    /// .toml, .json, .gltf, .glb, .nff, .csg, .scad, .obj, .ply, .stl or .3mf, or - for standard input
    #[arg(value_parser = scene_path())]
    pub scene: PathBuf,
    /// Write a page with the trade, all pictures and their differences
    #[arg(long, value_name = "FILE", value_parser = parse_page)]
    pub html: Option<PathBuf>,
    /// Print the options of the fastest way that keeps these bounds, separated by commas, and
    /// nothing else: wrong-pixels=N, rmse=X, flip=X; with seconds=X those of the way nearest to the
    /// converged picture
    #[arg(long, value_name = "BOUNDS", value_delimiter = ',', value_parser = parse_bound)]
    pub within: Vec<Bound>,
    /// Size in pixels, as WIDTHxHEIGHT [default: 320x180]
    #[arg(long, value_name = "WxH", allow_hyphen_values = true, value_parser = parse_size)]
    pub size: Option<Size>,
    /// Pictures of each way, of which the median time counts; of one that takes seconds, fewer
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = value_parser!(u32).range(1..=1000))]
    pub reps: u32,
    /// Samples per pixel of the converged picture [default: 1024; of direct light 64]
    #[arg(long, value_name = "SPP", value_parser = value_parser!(u32).range(1..=65_536))]
    pub converged: Option<u32>,
    /// Threads [default: all hardware threads]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
    #[command(flatten)]
    pub view: ViewArgs,
    #[command(flatten)]
    pub shutter: ShutterArgs,
    #[command(flatten)]
    pub import: ImportArgs,
    #[command(flatten)]
    pub progress: ProgressArgs,
    /// Write machine-readable results; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub json: Option<Sink>,
}

/// The bounds of `--accuracy`.
#[derive(Clone, Debug)]
pub struct Accuracy(pub Vec<Bound>);

impl Accuracy {
    pub fn parse(text: &str) -> Result<Accuracy, String> {
        let bounds = text
            .strip_prefix("within:")
            .ok_or("expected within: and bounds, such as within:rmse=0.02,flip=0.05")?;
        let bounds: Result<_, _> = bounds.split(',').map(parse_bound).collect();
        Ok(Accuracy(bounds?))
    }
}

fn parse_bound(text: &str) -> Result<Bound, String> {
    let expected = || "expected wrong-pixels=N, rmse=X, flip=X or seconds=X".to_owned();
    let (name, value) = text.split_once('=').ok_or_else(expected)?;
    let number = || match value.trim().parse::<f64>() {
        Ok(x) if x >= 0.0 && x.is_finite() => Ok(x),
        _ => Err(format!("{value} is no number of 0 or more")),
    };
    match name.trim() {
        "wrong-pixels" => match value.trim().parse() {
            Ok(most) => Ok(Bound::WrongPixels(most)),
            Err(_) => Err(format!("{value} is no whole number of 0 or more")),
        },
        "rmse" => Ok(Bound::Rmse(number()?)),
        "flip" => Ok(Bound::Flip(number()?)),
        "seconds" => Ok(Bound::Seconds(number()?)),
        _ => Err(expected()),
    }
}
