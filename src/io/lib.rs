//! Files in and out: scenes, meshes, pictures, ray sets.
//!
//! [`load`] reads any scene format by its extension. Importers fill a
//! [`SceneBuilder`]; what they must leave out goes into [`Dropped`] and becomes
//! one summarised warning. Input is never trusted: every length is checked
//! before it is used, every file that a scene names stays in the scene's folder
//! ([`Folder`]), and every error carries the file, the place and the remedy.
//!
//! A part of Lanecast that may change with any version; the crate `lanecast` is what is
//! kept.

use lanecast_model::{geom, scene};
use lanecast_numerics::{math, roots};

mod atomic;
mod dropped;
mod error;
mod flatten;
mod folder;
mod gltf;
mod mesh_data;
mod mtl;
mod native;
mod nff;
mod obj;
mod openexr;
mod picture;
mod place;
mod ply;
mod png;
mod polynomials;
mod pov;
mod precise;
mod rays;
mod srgb;
mod stl;
mod text;

pub use atomic::{Outputs, check_writable, discard_unfinished};
pub use dropped::Dropped;
pub use error::{LoadError, SaveError};
pub use flatten::import_mesh;
pub use folder::Folder;
pub use native::json_schema;
pub use picture::{AovSet, Picture, PictureFile, picture_files};
pub use polynomials::{KnownRoot, Listed, load_polynomials};
pub use pov::{PovError, text as pov_text};
pub use rays::{RaySet, TriangleSet};
pub use srgb::SrgbEncoder;

use crate::scene::{Edge, MeshData, Scene, SceneBuilder, SceneError};
use std::path::{Path, PathBuf};

/// A scene and what was left out of it.
#[derive(Debug)]
pub struct Loaded {
    pub scene: Scene,
    /// One line, ready for people; `None` where nothing was left out.
    pub warning: Option<String>,
}

#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Files that the scene names may lie outside its folder.
    pub allow_outside: bool,
    /// Files that are to be written later: the scene must name none of them.
    pub outputs: Vec<PathBuf>,
}

/// Reads, checks and completes a scene file: `.toml`, `.json`, `.gltf`, `.glb`,
/// `.nff`, `.obj`, `.ply`, `.stl`.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let mut scene = SceneBuilder::default();
    let mut dropped = Dropped::default();
    let places = import(path, options, &mut scene, &mut dropped)?;
    let warning = dropped.summary();
    let scene = scene.finish().map_err(|source| match (&source, &warning) {
        (SceneError::NothingToSee, Some(left_out)) => LoadError::Empty {
            path: path.into(),
            left_out: left_out.clone(),
        },
        _ => LoadError::Scene {
            path: path.into(),
            place: source.entity().and_then(|what| places.as_ref()?.of(what)),
            source,
        },
    })?;
    Ok(Loaded { scene, warning })
}

/// Native scenes also say where their entities stand.
fn import(
    path: &Path,
    options: &LoadOptions,
    scene: &mut SceneBuilder,
    dropped: &mut Dropped,
) -> Result<Option<native::Places>, LoadError> {
    let native = |syntax, scene, dropped| native::import(path, syntax, options, scene, dropped);
    match &*extension(path) {
        "toml" => return native(native::Syntax::Toml, scene, dropped).map(Some),
        "json" => return native(native::Syntax::Json, scene, dropped).map(Some),
        "nff" => nff::import(path, scene, dropped),
        "gltf" | "glb" => gltf::import(path, options, scene, dropped),
        "obj" => obj::import(path, options, scene, dropped),
        "ply" => ply::read(path, dropped).map(|mesh| show(scene, &mesh)),
        "stl" => stl::read(path).map(|mesh| show(scene, &mesh)),
        other => Err(LoadError::of_format(path, other)),
    }?;
    Ok(None)
}

/// The mesh that is all a file has, seen.
fn show(scene: &mut SceneBuilder, mesh: &MeshData) {
    if !mesh.triangles.is_empty() {
        let shape = scene.mesh("", mesh);
        scene.instance("", Edge::shape(shape));
    }
}

/// In lower case, without the dot.
fn extension(path: &Path) -> String {
    path.extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default()
}
