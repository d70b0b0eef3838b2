//! Options of `lanecast compare`.

use super::values::parse_page;
use crate::output::Sink;
use clap::{Args, value_parser};
use std::path::PathBuf;

#[derive(Args)]
#[command(
    after_help = "Exit code 1 if the pictures differ by more than --max-wrong, --max-rmse or \
                  --max-flip allow; without these, 0 whatever the difference."
)]
pub struct CompareArgs {
    /// The picture: .exr, .hdr, .png or .jpg
    pub a: PathBuf,
    /// The picture that it should be; relative errors are relative to it
    pub b: PathBuf,
    /// Compare only these channels or layers, separated by commas, such as R,G,B or albedo
    /// [default: all, which both must have]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub channels: Option<Vec<String>>,
    /// A pixel is wrong if a channel differs by more than that, or an id at all
    #[arg(long, value_name = "T", default_value_t = 0.0, value_parser = parse_bound)]
    pub tolerance: f64,
    /// Fail if more than N pixels are wrong
    #[arg(long, value_name = "N", value_parser = value_parser!(u64))]
    pub max_wrong: Option<u64>,
    /// Fail if the root of the mean squared error of the colour is larger
    #[arg(long, value_name = "X", value_parser = parse_bound)]
    pub max_rmse: Option<f64>,
    /// Fail if the mean FLIP is larger
    #[arg(long, value_name = "X", value_parser = parse_bound)]
    pub max_flip: Option<f64>,
    /// Show both pictures under a slider, and their differences, as an HTML page
    #[arg(long, value_name = "FILE", value_parser = parse_page)]
    pub html: Option<PathBuf>,
    /// Write machine-readable results; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub json: Option<Sink>,
    /// Threads [default: all hardware threads]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
}

fn parse_bound(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(x) if x >= 0.0 && x.is_finite() => Ok(x),
        _ => Err("write a number from 0 on, such as 0.01".into()),
    }
}
