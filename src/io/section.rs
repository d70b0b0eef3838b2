//! Cuts a scene that is read.

use super::{LoadError, LoadOptions, Loaded};
use crate::scene::{Scene, SceneError};
use std::path::Path;

/// Keeps what is in all of the half-spaces that options name, and warns of what is left as it is. Errors
/// name the file `path`.
pub fn clipped(
    scene: Scene,
    options: &LoadOptions,
    path: &Path,
    warning: Option<String>,
) -> Result<Loaded, LoadError> {
    let refused = |what: &str, remedy: &str| LoadError::Unsupported {
        path: path.into(),
        what: what.into(),
        remedy: Some(remedy.into()),
    };
    if options.clip.is_empty() {
        return Ok(Loaded { scene, warning });
    }
    if scene.moves() {
        return Err(refused(
            "--clip of things that move",
            "leave it out; it cuts things as they stand",
        ));
    }
    let (scene, uncut) = scene.cut(&options.clip, options.hatch).map_err(
        |source| match source {
            SceneError::NothingToSee => refused(
                "--clip that leaves nothing",
                "it keeps what is in ax + by + cz <= d; turn all four signs to keep the other side",
            ),
            source => LoadError::of_scene(path, source),
        },
    )?;
    let left = (uncut.surfaces > 0).then(|| {
        format!(
            "not cut: {} × surface without an inside, other than meshes",
            uncut.surfaces
        )
    });
    let warning = match (warning, left) {
        (Some(warning), Some(left)) => Some(format!("{warning}; {left}")),
        (warning, left) => warning.or(left),
    };
    Ok(Loaded { scene, warning })
}
