//! Options of reading scene files.

use super::values::{one_of, parse_positive, parse_scad_curves, parse_z_up};
use clap::Args;
use clap::builder::{PathBufValueParser, TypedValueParser};
use glam::DVec3;
use lanecast_io::{Animated, Curves, FORMATS, Given, LoadOptions, ZUp};
use lanecast_model::geom::HalfSpace;
use lanecast_model::scene::{Hatch, Timeline};
use std::path::PathBuf;

/// What messages call a scene that comes from standard input; a file of this name is `./<stdin>`.
pub const STDIN: &str = "<stdin>";

#[derive(Args, Clone)]
pub struct ImportArgs {
    /// Read SCENE as a file of this format, whatever its name is: toml, json, gltf, glb, nff, csg, scad,
    /// obj, ply, stl or 3mf [default: by its name's end; of standard input by its content]
    #[arg(long, value_name = "FORMAT", value_parser = parse_format)]
    pub format: Option<&'static str>,
    /// Allow files that the scene names outside its folder
    #[arg(long)]
    pub allow_outside: bool,
    /// Draw points and lines of .gltf, .glb, .ply and .obj files as balls and round bars of this
    /// radius, in units of the file [default: they are left out]
    #[arg(long, value_name = "R", value_parser = parse_positive)]
    pub point_radius: Option<f64>,
    /// Take z for up in a .stl, .ply or .obj file, and turn it about x; --z-up=unsaid reads files of other
    /// formats as they are [default: y is up; .scad, .csg and .3mf files are turned without being asked]
    #[arg(long, value_name = "FILES", num_args = 0..=1, require_equals = true, default_missing_value = "asked",
          value_parser = parse_z_up)]
    pub z_up: Option<ZUp>,
    /// Curves of OpenSCAD's files: exact (polygons where $fn is 12 or less) or facets (as
    /// OpenSCAD makes them) [default: exact]
    #[arg(long, value_name = "CURVES", value_parser = parse_scad_curves)]
    pub scad_curves: Option<Curves>,
    /// Keep what is in a half-space, ax + by + cz <= d, and show what the plane cuts; may be given
    /// several times
    #[arg(long, value_name = "A,B,C,D", allow_hyphen_values = true, value_parser = parse_plane)]
    pub clip: Vec<HalfSpace>,
    /// Hatch what --clip cuts, at 45 degrees, with lines this far apart in world units, or auto; parts
    /// beside each other differ in direction
    #[arg(long, value_name = "SPACING", value_parser = parse_hatch, requires = "clip")]
    pub hatch: Option<Hatch>,
    /// Variant of a glTF file's materials (KHR_materials_variants) [default: none]
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Animation of a glTF file, by its name or its number from 0 [default: of --frames and
    /// --shutter the first, else none, and things are as at rest]
    #[arg(long, value_name = "NAME|INDEX")]
    pub animation: Option<String>,
}

impl ImportArgs {
    pub fn load_options(&self, outputs: Vec<PathBuf>) -> LoadOptions {
        LoadOptions {
            allow_outside: self.allow_outside,
            outputs,
            variant: self.variant.clone(),
            animation: self.animation.as_ref().map(|name| Animated {
                name: Some(name.clone()),
                timeline: Timeline::whole(1),
                margin: 0,
                blurs: false,
            }),
            point_radius: self.point_radius,
            z_up: self.z_up.unwrap_or_default(),
            scad_curves: self.scad_curves.unwrap_or_default(),
            clip: self.clip.clone(),
            hatch: self.hatch,
            given: self.format.map(|format| Given {
                format: Some(format),
                ..Given::default()
            }),
            ..LoadOptions::default()
        }
    }
}

/// Parses the path of a scene; `-` is standard input, and called [`STDIN`] from there on.
pub(super) fn scene_path() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().map(|path| match path.as_os_str() == "-" {
        true => STDIN.into(),
        false => path,
    })
}

fn parse_format(text: &str) -> Result<&'static str, String> {
    one_of(text, &FORMATS.map(|format| (format, format)))
}

fn parse_hatch(text: &str) -> Result<Hatch, String> {
    let spacing = match text {
        "auto" => None,
        _ => Some(parse_positive(text).map_err(|why| format!("{why}, or auto"))?),
    };
    Ok(Hatch { spacing })
}

fn parse_plane(text: &str) -> Result<HalfSpace, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|x| x.trim().parse()).collect();
    let numbers = numbers.unwrap_or_default();
    match numbers[..] {
        [a, b, c, d] => {
            let normal = DVec3::new(a, b, c);
            if normal == DVec3::ZERO || !normal.is_finite() || !d.is_finite() {
                return Err("a, b and c must be finite and not all 0, and d finite".into());
            }
            // Scaled, so that no product of huge numbers overflows.
            let size = normal.abs().max_element();
            Ok(HalfSpace {
                normal: normal / size,
                offset: d / size,
            })
        }
        _ => Err("expected four numbers A,B,C,D of the half-space ax + by + cz <= d".into()),
    }
}
