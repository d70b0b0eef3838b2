//! Importer of OpenSCAD's `.csg`: what a `.scad` program makes, as a tree of solids.
//!
//! The text becomes nodes (`syntax`), nodes become solids and outlines (`nodes`), and these a scene
//! (`emit`). Spheres, cylinders and cones are what they are, not the facets that OpenSCAD
//! approximates them by, unless `$fn` is so small that a polygon is meant or [`Curves::Facets`] is
//! asked for. Colours are those of OpenSCAD's view.
//!
//! z is up in OpenSCAD, and y in a scene: (x, y, z) of the file is (x, z, −y) of the scene.
//!
//! Nothing recurses over the file's tree, and what a small number may ask for is bounded.

mod arguments;
mod budget;
mod clusters;
mod crossings;
mod curves;
mod emit;
mod facets;
mod flat_nodes;
mod foreign;
mod frames;
mod hulls;
mod meshes;
mod nodes;
mod offsets;
mod openscad;
mod outlines;
mod placing;
mod polygons;
mod program;
mod solid_nodes;
mod solids;
mod syntax;
mod turn;

use crate::scene::SceneBuilder;
use crate::shared::text::decode;
use crate::{ImportReport, LoadError, LoadOptions};
use std::path::{Path, PathBuf};

/// How OpenSCAD's curves are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Curves {
    /// Round, unless `$fn` is 12 or less.
    #[default]
    Exact,
    /// With the sides that OpenSCAD gives them.
    Facets,
}

/// Reads a `.csg` file into the builder.
pub(super) fn import(
    path: &Path,
    options: &LoadOptions,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<(), LoadError> {
    let bytes = options.read(path)?;
    read(path, &bytes, options, scene, report)
}

/// Reads what OpenSCAD makes of a `.scad` program. Places in messages are those in its `.csg`.
pub(super) fn import_program(
    path: &Path,
    options: &LoadOptions,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<(), LoadError> {
    let bytes = program::csg_of(path, options, report)?;
    let csg = PathBuf::from(format!("{} as .csg", path.display()));
    read(&csg, &bytes, options, scene, report)
}

fn read(
    path: &Path,
    bytes: &[u8],
    options: &LoadOptions,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<(), LoadError> {
    let text = decode(path, bytes)?;
    let tree = syntax::Tree::parse(path, &text)?;
    let (mut solids, shown) = nodes::Reader::new(path, &tree, options, report).read()?;
    emit::Emitter::new(scene).emit(&mut solids, shown);
    Ok(())
}
