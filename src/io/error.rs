//! What can go wrong with files: the file, the place in it, and the remedy.

use crate::scene::SceneError;
use std::path::PathBuf;
use thiserror::Error;

#[derive(Debug, Error)]
pub enum LoadError {
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error(
        "{}: unknown scene format '{extension}'; known are .toml .json .gltf .glb .nff .obj .ply .stl",
        path.display()
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
    /// Found by the scene's own check. `place`: line and column from 1, where
    /// the format can tell.
    #[error("{}{}: {source}", path.display(), colons(place))]
    Scene {
        path: PathBuf,
        place: Option<(u32, u32)>,
        source: SceneError,
    },
}

#[derive(Debug, Error)]
pub enum SaveError {
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error(
        "{}: unknown picture format '{extension}'; known are .png and .exr",
        path.display()
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

fn hint(remedy: &Option<String>) -> String {
    remedy
        .as_ref()
        .map(|r| format!("; {r}"))
        .unwrap_or_default()
}
