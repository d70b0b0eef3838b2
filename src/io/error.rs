//! Errors of reading and writing files. Each names the file, the place in it where one is
//! known, and the remedy where there is one.

use crate::scene::SceneError;
use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// The reasons why a file could not be imported.
#[derive(Debug, Error)]
pub enum LoadError {
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error(
        "{}: {}; known are .toml .json .gltf .glb .nff .csg .scad .obj .ply .stl .3mf",
        path.display(),
        unknown("scene", extension)
    )]
    UnknownFormat { path: PathBuf, extension: String },
    /// The file is malformed at a known place. `line` and `column` count from 1.
    #[error("{}:{line}:{column}: {message}", path.display())]
    Syntax {
        path: PathBuf,
        line: usize,
        column: usize,
        message: String,
    },
    /// An entity of the file is wrong; `place` names it: `mesh 3, primitive 0, POSITION`.
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
    /// The imported scene fails its own check. `place` is the entity's line and column, from
    /// 1, if the importer knows them.
    #[error("{}{}: {source}", path.display(), colons(place))]
    Scene {
        path: PathBuf,
        place: Option<(u32, u32)>,
        source: SceneError,
    },
    /// The imported scene is empty ([`SceneError::NothingToSee`]), and something was not
    /// imported.
    #[error("{}: {}; {left_out}", path.display(), SceneError::NothingToSee)]
    Empty { path: PathBuf, left_out: String },
}

impl LoadError {
    /// Wraps an error of the scene in `path`, without line and column.
    pub fn of_scene(path: &Path, source: SceneError) -> LoadError {
        LoadError::Scene {
            path: path.into(),
            place: None,
            source,
        }
    }

    /// Makes the error of a mesh file of this format: a message, and its line if that is
    /// known.
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

    /// Makes the error of a path whose extension no importer knows, or that is a folder.
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

/// The reasons why a file could not be written.
#[derive(Debug, Error)]
pub enum SaveError {
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error(
        "{}: {}; known are .png, .jpg, .hdr and .exr",
        path.display(),
        unknown("picture", extension)
    )]
    UnknownFormat { path: PathBuf, extension: String },
    #[error("{}: {message}", path.display())]
    Encode { path: PathBuf, message: String },
}

/// Formats a place as `:line:column`; empty if there is none.
fn colons(place: &Option<(u32, u32)>) -> String {
    place
        .map(|(line, column)| format!(":{line}:{column}"))
        .unwrap_or_default()
}

/// Says that an extension is no format of the kind `of`, or is missing.
fn unknown(of: &str, extension: &str) -> String {
    match extension {
        "" => format!("its name has no ending that tells a {of} format"),
        _ => format!("unknown {of} format '{extension}'"),
    }
}

/// Formats a remedy to follow a message.
fn hint(remedy: &Option<String>) -> String {
    remedy
        .as_ref()
        .map(|r| format!("; {r}"))
        .unwrap_or_default()
}
