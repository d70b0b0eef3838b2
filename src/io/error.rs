//! What can go wrong with files: the file, the place in it, and the remedy.

use crate::scene::SceneError;
use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};
use thiserror::Error;

#[derive(Debug, Error)]
pub enum LoadError {
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error(
        "{}: {}; known are .toml .json .gltf .glb .nff .obj .ply .stl",
        path.display(),
        unknown("scene", extension)
    )]
    UnknownFormat { path: PathBuf, extension: String },
    /// `line` and `column` count from 1.
    #[error("{}:{line}:{column}: {message}", path.display())]
    Syntax {
        path: PathBuf,
        line: usize,
        column: usize,
        message: String,
    },
    /// `place` is the entity: `mesh 3, primitive 0, POSITION`.
    #[error("{}: {place}: {message}", path.display())]
    Invalid {
        path: PathBuf,
        place: String,
        message: String,
    },
    #[error("{}: {what} is not supported{}", path.display(), hint(remedy))]
    Unsupported {
        path: PathBuf,
        what: String,
        remedy: Option<String>,
    },
    #[error(
        "{}: it names the file '{named}', which lies outside its folder; \
         move it there, or allow it with --allow-outside",
        path.display()
    )]
    Outside { path: PathBuf, named: String },
    #[error(
        "{}: it names the file '{named}', which an output would replace; \
         give the output another name",
        path.display()
    )]
    Output { path: PathBuf, named: String },
    /// Found by the scene's own check. `place`: line and column from 1, where
    /// the format can tell.
    #[error("{}{}: {source}", path.display(), colons(place))]
    Scene {
        path: PathBuf,
        place: Option<(u32, u32)>,
        source: SceneError,
    },
    /// [`SceneError::NothingToSee`], where something was not imported.
    #[error("{}: {}; {left_out}", path.display(), SceneError::NothingToSee)]
    Empty { path: PathBuf, left_out: String },
}

impl LoadError {
    /// Of a scene whose file does not tell the place.
    pub fn of_scene(path: &Path, source: SceneError) -> LoadError {
        LoadError::Scene {
            path: path.into(),
            place: None,
            source,
        }
    }

    /// Of a mesh's file: in a line, where one can be told.
    pub(super) fn in_mesh_file(
        path: &Path,
        format: &str,
        wrong: (Option<usize>, String),
    ) -> LoadError {
        match wrong {
            (Some(line), message) => LoadError::Syntax {
                path: path.into(),
                line,
                column: 1,
                message,
            },
            (None, message) => LoadError::Invalid {
                path: path.into(),
                place: format.into(),
                message,
            },
        }
    }

    /// Of a file that no importer knows by its name's ending, or of a folder.
    pub(super) fn unknown_format(path: &Path, extension: &str) -> LoadError {
        if path.is_dir() {
            return LoadError::Read {
                path: path.into(),
                source: Error::new(
                    ErrorKind::IsADirectory,
                    "it is a folder; name a scene file in it",
                ),
            };
        }
        LoadError::UnknownFormat {
            path: path.into(),
            extension: extension.into(),
        }
    }
}

#[derive(Debug, Error)]
pub enum SaveError {
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error(
        "{}: {}; known are .png and .exr",
        path.display(),
        unknown("picture", extension)
    )]
    UnknownFormat { path: PathBuf, extension: String },
    #[error("{}: {message}", path.display())]
    Encode { path: PathBuf, message: String },
}

fn colons(place: &Option<(u32, u32)>) -> String {
    place
        .map(|(line, column)| format!(":{line}:{column}"))
        .unwrap_or_default()
}

fn unknown(of: &str, extension: &str) -> String {
    match extension {
        "" => format!("its name has no ending that tells a {of} format"),
        _ => format!("unknown {of} format '{extension}'"),
    }
}

fn hint(remedy: &Option<String>) -> String {
    remedy
        .as_ref()
        .map(|r| format!("; {r}"))
        .unwrap_or_default()
}
