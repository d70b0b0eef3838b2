//! What can go wrong, in one type.

use super::batch::ColumnError;
use super::surfaces::SurfaceError;
use crate::io::{LoadError, SaveError};
use crate::plan::PlanError;
use crate::render::{ConfigError, RenderError, SliceError};
use crate::scene::{SceneError, UnknownCamera};
use thiserror::Error;

/// Everything that the stable interface refuses, with the place and the remedy.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    #[error(transparent)]
    Load(#[from] LoadError),
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Plan(#[from] PlanError),
    #[error(transparent)]
    Columns(#[from] ColumnError),
    #[error(transparent)]
    Surfaces(#[from] SurfaceError),
    #[error(transparent)]
    Camera(#[from] UnknownCamera),
    #[error("RenderConfig: {0}")]
    Config(#[from] ConfigError),
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error(transparent)]
    Slices(#[from] SliceError),
    #[error(transparent)]
    Save(#[from] SaveError),
}
