//! Errors of a command, and their exit codes.

use lanecast_io::{LoadError, SaveError};
use lanecast_measure::verify::Interrupted;
use lanecast_picture::render::RenderError;
use thiserror::Error;

#[derive(Debug, Error)]
pub enum CliError {
    /// A check that ran to its end and failed.
    #[error("{0}")]
    Short(String),
    #[error("{0}")]
    Usage(String),
    #[error(transparent)]
    Load(#[from] LoadError),
    #[error(transparent)]
    Save(#[from] SaveError),
    /// An input that is no scene.
    #[error("{0}")]
    Input(String),
    /// A picture that would need more memory than is free.
    #[error("{0}")]
    Memory(String),
    /// A viewer that cannot be reached.
    #[error("{0}")]
    Display(String),
    #[error("standard output: cannot be written: {0}")]
    Stdout(std::io::Error),
    /// Interrupted with a part of the work done, which stays.
    #[error("{0}")]
    Stopped(String),
    #[error("interrupted; nothing was written")]
    Interrupted,
    /// Interrupted while results waited for the reader of a pipe.
    #[error("interrupted while nobody read the results; no file was written")]
    Unread,
}

impl From<RenderError> for CliError {
    fn from(error: RenderError) -> CliError {
        match error {
            RenderError::Interrupted => CliError::Interrupted,
            RenderError::Memory { .. } => CliError::Memory(error.to_string()),
            RenderError::OtherLight => CliError::Input(error.to_string()),
            RenderError::NoPaths | RenderError::MovingLights { .. } | RenderError::Outputs => {
                CliError::Usage(error.to_string())
            }
        }
    }
}

impl From<Interrupted> for CliError {
    fn from(_: Interrupted) -> CliError {
        CliError::Interrupted
    }
}

impl CliError {
    pub fn exit_code(&self) -> u8 {
        match self {
            CliError::Short(_) => 1,
            // An output that names one of the scene's own files is a usage error, too:
            // it is detected before the file is read.
            CliError::Usage(_) | CliError::Load(LoadError::Output { .. }) => 2,
            CliError::Load(_) | CliError::Input(_) | CliError::Memory(_) => 3,
            CliError::Save(_) | CliError::Stdout(_) | CliError::Display(_) => 4,
            CliError::Interrupted | CliError::Stopped(_) | CliError::Unread => 130,
        }
    }
}
