//! Why a result could not be written.

use crate::spill::SpillError;
use crate::stitch::StitchError;
use std::io;
use std::path::{Path, PathBuf};

/// An output that cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The operating system refused.
    #[error("{path}: {action}: {source}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was being done.
        action: &'static str,
        /// What the system said.
        source: io::Error,
    },
    /// A temporary file failed.
    #[error(transparent)]
    Spill(#[from] SpillError),
    /// The output is there already.
    #[error("{path}: exists already; give --force to replace it", path = path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// Another process writes it.
    #[error("{path}: another run is writing it; wait for that run, or give another name", path = path.display())]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// The result has more elements than the format can count.
    #[error("{path}: {count} {what} are more than the format can index", path = path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// How many.
        count: u64,
        /// Of what.
        what: &'static str,
    },
    /// The mesh that is to be annotated says such a thing of its vertices already.
    #[error(
        "{path}: its vertices have a property `{property}` already, which the annotated mesh would have twice; rename or drop it",
        path = path.display()
    )]
    PropertyExists {
        /// The mesh.
        path: PathBuf,
        /// The property.
        property: &'static str,
    },
    /// The lines cannot be read back.
    #[error(transparent)]
    Lines(#[from] StitchError),
}

impl OutputError {
    /// Wraps what the system said, for [`Result::map_err`].
    pub(super) fn io(path: &Path, action: &'static str) -> impl Fn(io::Error) -> OutputError + use<> {
        let path = path.to_owned();
        move |source| OutputError::Io { path: path.clone(), action, source }
    }

    /// Whether the disk is full or a quota is used up.
    pub fn is_out_of_space(&self) -> bool {
        use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
        match self {
            OutputError::Io { source, .. } => {
                matches!(source.kind(), StorageFull | QuotaExceeded | FileTooLarge)
            }
            OutputError::Spill(error) => error.is_out_of_space(),
            _ => false,
        }
    }
}
