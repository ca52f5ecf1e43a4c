//! Why temporary files failed.

use std::io;
use std::path::{Path, PathBuf};

/// A temporary file that cannot be written or read back.
#[derive(Debug, thiserror::Error)]
pub enum SpillError {
    /// The operating system refused.
    #[error("temporary file {path}: {action}: {source}", path = path.display())]
    Io {
        /// The file or directory.
        path: PathBuf,
        /// What was being done.
        action: &'static str,
        /// What the system said.
        source: io::Error,
    },
    /// The disk is too small for what is known to come.
    #[error(
        "{path}: some {needed} bytes are needed for temporary files, but only {free} are free; choose another disk with --workspace, or try with --force",
        path = path.display()
    )]
    NoRoom {
        /// The directory.
        path: PathBuf,
        /// Bytes that are needed at most.
        needed: u64,
        /// Bytes that are free.
        free: u64,
    },
    /// The file does not hold what was written to it.
    #[error(
        "temporary file {path}: the block at byte {offset} is damaged ({reason}); check the disk, or choose another with --workspace",
        path = path.display()
    )]
    Corrupt {
        /// The file.
        path: PathBuf,
        /// Where the block starts, in bytes.
        offset: u64,
        /// What does not agree.
        reason: &'static str,
    },
    /// What another process has kept is not what it was when this one looked at it.
    #[error("{path}: what is at byte {offset} is not what it was when the run began; give the same command again", path = path.display())]
    Changed {
        /// The file.
        path: PathBuf,
        /// Where, in bytes.
        offset: u64,
    },
}

impl SpillError {
    /// Wraps what the system said, for [`Result::map_err`].
    pub(super) fn io(path: &Path, action: &'static str) -> impl FnOnce(io::Error) -> SpillError + use<> {
        let path = path.to_owned();
        move |source| SpillError::Io { path, action, source }
    }

    /// Whether the disk is full or a quota is used up.
    pub fn is_out_of_space(&self) -> bool {
        use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
        matches!(self, SpillError::Io { source, .. }
            if matches!(source.kind(), StorageFull | QuotaExceeded | FileTooLarge))
    }
}
