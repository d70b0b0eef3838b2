//! Files in and out: scenes, meshes, pictures, ray sets.
//!
//! [`load`] reads any scene format by its extension. Importers fill a
//! [`SceneBuilder`]; what they must leave out goes into [`Dropped`] and becomes
//! one summarised warning. Input is never trusted: every length is checked
//! before it is used, every file that a scene names stays in the scene's folder
//! ([`Folder`]), and every error carries the file, the place and the remedy.

mod atomic;
mod dropped;
mod error;
mod folder;
mod native;
mod nff;
mod openexr;
mod picture;
mod place;
mod png;
mod rays;
mod srgb;

pub use atomic::{Outputs, check_writable, discard_unfinished};
pub use dropped::Dropped;
pub use error::{LoadError, SaveError};
pub use folder::Folder;
pub use native::json_schema;
pub use picture::{AovSet, Picture, PictureFile, picture_files};
pub use rays::{RaySet, TriangleSet};
pub use srgb::SrgbEncoder;

use crate::scene::{MeshData, Scene, SceneBuilder};
use std::path::Path;

/// A scene and what was left out of it.
#[derive(Debug)]
pub struct Loaded {
    pub scene: Scene,
    /// One line, ready for people; `None` where nothing was left out.
    pub warning: Option<String>,
}

#[derive(Clone, Copy, Debug, Default)]
pub struct LoadOptions {
    /// Files that the scene names may lie outside its folder.
    pub allow_outside: bool,
}

/// Reads, checks and completes a scene file: `.toml`, `.json`, `.gltf`, `.glb`,
/// `.nff`, `.obj`, `.ply`, `.stl`.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let mut scene = SceneBuilder::default();
    let mut dropped = Dropped::default();
    import(path, options, &mut scene, &mut dropped)?;
    let scene = scene.finish().map_err(|source| LoadError::Scene {
        path: path.into(),
        source,
    })?;
    Ok(Loaded {
        scene,
        warning: dropped.summary(),
    })
}

fn import(
    path: &Path,
    options: &LoadOptions,
    scene: &mut SceneBuilder,
    dropped: &mut Dropped,
) -> Result<(), LoadError> {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    match extension.as_str() {
        "toml" => native::import(path, native::Syntax::Toml, options, scene, dropped),
        "json" => native::import(path, native::Syntax::Json, options, scene, dropped),
        "nff" => nff::import(path, scene, dropped),
        _ => Err(LoadError::UnknownFormat {
            path: path.into(),
            extension,
        }),
    }
}

/// The one mesh of a mesh file, for scene files that name it.
fn import_mesh(
    path: &Path,
    _options: &LoadOptions,
    _dropped: &mut Dropped,
) -> Result<MeshData, LoadError> {
    Err(LoadError::Unsupported {
        path: path.into(),
        what: "this mesh format".into(),
        remedy: None,
    })
}
