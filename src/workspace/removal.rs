//! How a workspace goes: our files, and nothing else.

use super::directory::{DONE, JOB, MESH, OUTPUTS, PLAN, PLAN_JSON, SORTED, TILES};
use super::{WorkspaceError, attempts, marker, results};
use crate::spill::{SpillError, point, remove_left_behind};
use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// All files but the marker, in the order in which they go: without the job the others are of no use to anybody.
const FILES: [&str; 14] = [
    OUTPUTS,
    "crease-outputs.new",
    DONE,
    "crease-done.new",
    PLAN_JSON,
    "plan.json.new",
    PLAN,
    "crease-plan.new",
    JOB,
    "crease-job.new",
    TILES,
    SORTED,
    MESH,
    "crease-mesh.ply.new",
];

/// Removes the workspace in `directory` and nothing else; the directory too, if nothing else is in it.
///
/// # Errors
/// If there is no workspace of ours, a run works there, or the system refuses.
pub fn clean(directory: &Path) -> Result<(), WorkspaceError> {
    if !marker::is_ours(directory) {
        return Err(WorkspaceError::Foreign { path: directory.to_owned(), marker: marker::MARKER });
    }
    // Whatever the version: it is being given up.
    let _lock = match marker::open(directory) {
        Ok(lock) => lock,
        // Tasks that still work there find their files gone, and end.
        Err(WorkspaceError::Damaged { .. } | WorkspaceError::Planned { .. }) => None,
        Err(other) => return Err(other),
    };
    remove_all(directory)?;
    remove_directory(directory)
}

/// Our files in `directory`, the marker last: what is left after a death in between can be removed in the same way.
pub(super) fn remove_all(directory: &Path) -> Result<(), WorkspaceError> {
    for name in FILES {
        remove_file(&directory.join(name))?;
        point("workspace-half-removed");
    }
    for name in [results::DIRECTORY, results::GROUPS, attempts::DIRECTORY] {
        remove_flat(&directory.join(name), name)?;
    }
    remove_left_behind(directory).map_err(of_spill)?;
    remove_file(&directory.join(marker::MARKER))
}

/// Removes what tasks have left in the directory called `name` of a workspace, and the directory if nothing else is in it.
fn remove_flat(path: &Path, name: &str) -> Result<(), WorkspaceError> {
    let failed = WorkspaceError::io(path, "cannot list the directory");
    let entries = match fs::read_dir(path) {
        Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => return Ok(()),
        entries => entries.map_err(&failed)?,
    };
    for entry in entries {
        let file = entry.map_err(&failed)?.file_name();
        let ours = match name {
            results::DIRECTORY | results::GROUPS => results::is_ours(&file.to_string_lossy()),
            _ => attempts::is_ours(&file.to_string_lossy()),
        };
        if ours {
            remove_file(&path.join(file))?;
        }
    }
    remove_directory(path)
}

/// Removes a file, if it is there.
pub(super) fn remove_file(path: &Path) -> Result<(), WorkspaceError> {
    match fs::remove_file(path) {
        Err(e) if e.kind() != ErrorKind::NotFound => {
            Err(WorkspaceError::io(path, "cannot remove the file")(e))
        }
        _ => Ok(()),
    }
}

/// Removes a directory, if it is there and nothing is in it.
pub(super) fn remove_directory(path: &Path) -> Result<(), WorkspaceError> {
    match fs::remove_dir(path) {
        Err(e) if !matches!(e.kind(), ErrorKind::NotFound | ErrorKind::DirectoryNotEmpty) => {
            Err(WorkspaceError::io(path, "cannot remove the directory")(e))
        }
        _ => Ok(()),
    }
}

/// What no other process can use: temporary files, and files that were being written.
pub(super) fn remove_unfinished(directory: &Path) -> Result<(), WorkspaceError> {
    remove_left_behind(directory).map_err(of_spill)?;
    FILES.iter().filter(|name| name.ends_with(".new")).try_for_each(|name| remove_file(&directory.join(name)))
}

fn of_spill(error: SpillError) -> WorkspaceError {
    match error {
        SpillError::Io { path, action, source } => WorkspaceError::Io { path, action, source },
        other => WorkspaceError::Io {
            path: PathBuf::new(),
            action: "cannot remove temporary files",
            source: io::Error::other(other),
        },
    }
}
