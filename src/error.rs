//! Every way a run can fail, by layer. The layers' own errors say file, place and remedy; this one joins them.

use crate::config::ParamError;
use crate::input::InputError;
use crate::mesh::TileId;
use crate::output::OutputError;
use crate::partition::LoadError;
use crate::spill::SpillError;
use crate::stitch::StitchError;

/// A run that did not succeed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The input cannot be read or is not a mesh.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A parameter does not suit this mesh.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// A tile cannot be held.
    #[error(transparent)]
    Load(LoadError),
    /// A temporary file failed.
    #[error(transparent)]
    Spill(#[from] SpillError),
    /// The lines cannot be held.
    #[error(transparent)]
    Stitch(StitchError),
    /// A result cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The thread pool could not be started.
    #[error("cannot start the worker threads: {0}; try fewer with --threads")]
    Threads(String),
    /// A bug.
    #[error("internal error in {tile}: {message}")]
    Internal {
        /// Where it happened.
        tile: TileId,
        /// What the panic said.
        message: String,
    },
}

impl From<LoadError> for Error {
    fn from(error: LoadError) -> Error {
        match error {
            LoadError::Input(error) => Error::Input(error),
            other => Error::Load(other),
        }
    }
}

impl From<StitchError> for Error {
    fn from(error: StitchError) -> Error {
        match error {
            StitchError::Spill(error) => Error::Spill(error),
            other => Error::Stitch(other),
        }
    }
}
