//! Options of `thumbs`.

use super::common::ProgressArgs;
use crate::output::Sink;
use clap::{Args, value_parser};
use serde_json::{Map, Value};
use std::path::PathBuf;

#[derive(Args)]
pub struct ThumbsArgs {
    /// Folders, of which all scene files below are shown, or single scene files
    #[arg(required = true, value_name = "FOLDER")]
    pub folders: Vec<PathBuf>,
    /// Folder of the pictures and of the page index.html; it is made if there is none. What is
    /// there already and shows its scene as it is stays
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Size in pixels, as WIDTHxHEIGHT
    #[arg(long, value_name = "WxH", default_value = "256x256")]
    pub size: String,
    /// What is behind the scenes: transparent, white, black, auto, or a linear colour R,G,B
    #[arg(long, value_name = "WHAT", default_value = "transparent")]
    pub background: String,
    /// Samples per pixel
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = value_parser!(u32).range(1..=65_536))]
    pub spp: u32,
    /// Take z for up in .stl, .ply and .obj files, as drawings for printing have it [default: y is up; .scad,
    /// .csg and .3mf files are turned without being asked]
    #[arg(long)]
    pub z_up: bool,
    /// Threads [default: all hardware threads]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
    /// Write machine-readable results; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    pub json: Option<Sink>,
    #[command(flatten)]
    pub progress: ProgressArgs,
}

impl ThumbsArgs {
    /// Returns the options that all pictures are rendered with.
    pub fn options(&self) -> Map<String, Value> {
        let options: [(&str, Value); 3] = [
            ("size", self.size.clone().into()),
            ("background", self.background.clone().into()),
            ("spp", self.spp.into()),
        ];
        let z_up = self.z_up.then(|| ("z-up", "unsaid".into()));
        let options = options.into_iter().chain(z_up);
        options
            .map(|(name, value)| (name.to_owned(), value))
            .collect()
    }
}
