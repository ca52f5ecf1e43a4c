//! Every way a run can fail, by layer. The layers' own errors say file, place and remedy; this one joins them.

use crate::config::ParamError;
use crate::input::InputError;
use crate::mesh::TileId;
use crate::output::OutputError;
use crate::partition::LoadError;
use crate::spill::SpillError;
use crate::stitch::StitchError;
use crate::workspace::WorkspaceError;
use glam::DVec3;

/// A run that did not succeed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The input cannot be read or is not a mesh.
    #[error(transparent)]
    Input(InputError),
    /// The input is not what it was when the run began, so that nothing that was read from it can be believed.
    #[error("{error} (found in stage `{stage}`)")]
    Changed {
        /// What the run was doing when that was seen.
        stage: &'static str,
        /// What is different.
        error: InputError,
    },
    /// A parameter does not suit this mesh.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// A tile cannot be held.
    #[error(transparent)]
    Load(LoadError),
    /// What one place depends on needs more memory than there is, so that smaller tiles would be of no use.
    #[error(
        "{faces} faces or more around ({x}, {y}, {z}) depend on each other; to work on them takes {mib} MiB or more, and tiles may \
         use {allowed} MiB: allow more with --memory",
        x = at.x, y = at.y, z = at.z, mib = bytes.div_ceil(1 << 20), allowed = memory >> 20
    )]
    NoRoom {
        /// The corner of lowest coordinates of the place.
        at: DVec3,
        /// Faces that were counted before loading stopped.
        faces: u64,
        /// What so many need.
        bytes: u64,
        /// What tiles may use.
        memory: u64,
    },
    /// What must be known of the whole mesh needs more memory than there is.
    #[error(
        "{needed} MiB of memory or more are needed to plan a mesh of this size, and {allowed} MiB are allowed: allow more with --memory",
        needed = needed.div_ceil(1 << 20), allowed = memory >> 20
    )]
    NoMemory {
        /// What is needed.
        needed: u64,
        /// What is allowed.
        memory: u64,
    },
    /// A temporary file failed.
    #[error(transparent)]
    Spill(#[from] SpillError),
    /// The lines cannot be held.
    #[error(transparent)]
    Stitch(StitchError),
    /// A result cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The workspace cannot be used, or not for this job.
    #[error(transparent)]
    Workspace(#[from] WorkspaceError),
    /// Somebody wanted the run to end. What was kept in the workspace is safe.
    #[error("stopped")]
    Stopped,
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

impl From<InputError> for Error {
    fn from(error: InputError) -> Error {
        match error {
            InputError::Spill(error) => Error::Spill(error),
            InputError::Stopped => Error::Stopped,
            other => Error::Input(other),
        }
    }
}

impl From<LoadError> for Error {
    fn from(error: LoadError) -> Error {
        match error {
            LoadError::Input(error) => error.into(),
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
