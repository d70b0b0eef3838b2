//! Options of reading scene files.

use super::values::parse_scad_curves;
use crate::io::{Curves, LoadOptions};
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
pub struct ImportArgs {
    /// Allow files that the scene names outside its folder
    #[arg(long)]
    pub allow_outside: bool,
    /// Curves of OpenSCAD's files: exact (polygons where $fn is 12 or less) or facets (as
    /// OpenSCAD makes them) [default: exact]
    #[arg(long, value_name = "CURVES", value_parser = parse_scad_curves)]
    pub scad_curves: Option<Curves>,
}

impl ImportArgs {
    pub fn load_options(&self, outputs: Vec<PathBuf>) -> LoadOptions {
        LoadOptions {
            allow_outside: self.allow_outside,
            outputs,
            scad_curves: self.scad_curves.unwrap_or_default(),
            ..LoadOptions::default()
        }
    }
}
