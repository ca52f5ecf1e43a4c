//! Why a workspace cannot be used.

use std::io;
use std::path::{Path, PathBuf};

/// A workspace that cannot be used, or not for this job.
#[derive(Debug, thiserror::Error)]
pub enum WorkspaceError {
    /// The operating system refused.
    #[error("workspace file {path}: {action}: {source}", path = path.display())]
    Io {
        /// The file or directory.
        path: PathBuf,
        /// What was being done.
        action: &'static str,
        /// What the system said.
        source: io::Error,
    },
    /// Another process works there.
    #[error(
        "{path}: another run works in this workspace; wait for it, or choose another directory with --workspace",
        path = path.display()
    )]
    InUse {
        /// The directory.
        path: PathBuf,
    },
    /// What was begun there was something else.
    #[error(
        "{path}: the workspace belongs to another job: {what} was {before} and is {now}; run that job to its end, choose another \
         directory with --workspace, or give this one up with: crease clean {path}",
        path = path.display()
    )]
    OtherJob {
        /// The directory.
        path: PathBuf,
        /// The name of what differs.
        what: &'static str,
        /// What it was.
        before: String,
        /// What it is.
        now: String,
    },
    /// Many tasks work there, or will.
    #[error(
        "{path}: the workspace was planned for crease tile and crease stitch; go on with these, choose another directory with \
         --workspace, or give it up with: crease clean {path}",
        path = path.display()
    )]
    Planned {
        /// The directory.
        path: PathBuf,
    },
    /// Nothing was planned there.
    #[error("{path}: no job was planned there: {what}; plan one with crease plan --workspace {path}", path = path.display())]
    NotPlanned {
        /// The directory.
        path: PathBuf,
        /// What is there.
        what: &'static str,
    },
    /// The method needs the whole mesh between its passes.
    #[error(
        "--method paper needs numbers of the whole mesh before its lines, and is not planned for many tasks; use crease detect"
    )]
    OneProcess,
    /// There is nothing there that we made.
    #[error("{path}: not a workspace of crease: it has no file {marker}; nothing was removed", path = path.display())]
    Foreign {
        /// The directory.
        path: PathBuf,
        /// What is not there.
        marker: &'static str,
    },
    /// It is damaged, or from a later version.
    #[error("{path}: {reason}; give the workspace up with: crease clean {directory}", path = path.display(), directory = directory.display())]
    Damaged {
        /// The directory.
        directory: PathBuf,
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
}

impl WorkspaceError {
    /// Wraps what the system said, for [`Result::map_err`].
    pub(super) fn io(path: &Path, action: &'static str) -> impl Fn(io::Error) -> WorkspaceError + use<> {
        let path = path.to_owned();
        move |source| WorkspaceError::Io { path: path.clone(), action, source }
    }

    /// Whether the disk is full or a quota is used up.
    pub fn is_out_of_space(&self) -> bool {
        use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
        matches!(self, WorkspaceError::Io { source, .. }
            if matches!(source.kind(), StorageFull | QuotaExceeded | FileTooLarge))
    }
}
