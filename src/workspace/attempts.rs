//! What each attempt at some tiles says of itself, for people who wonder why a tile is not there.
//!
//! In: events of one process. Out: a file in `log/` that is this process's alone, because appends of several machines to one
//! file are not atomic everywhere. It is JSON, an object on each line: `started`, `tile` for each tile that is done, `ended`.
//! A process that was killed says no `ended`.

use super::WorkspaceError;
use serde::Serialize;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

/// The directory of the logs, within the workspace.
pub const DIRECTORY: &str = "log";
/// What their names end in.
const EXTENSION: &str = ".jsonl";

/// The log of this process.
#[derive(Debug)]
pub struct AttemptLog {
    path: PathBuf,
    file: File,
}

/// Whether a file of this name is a log.
pub fn is_ours(name: &str) -> bool {
    (name.starts_with("tile-") || name.starts_with("stitch-")) && name.ends_with(EXTENSION)
}

impl AttemptLog {
    /// Begins the log of `attempt` at `what` ("tile-3", "tile-0-7", "stitch") in `workspace`.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn begin(workspace: &Path, what: &str, attempt: &str) -> Result<AttemptLog, WorkspaceError> {
        let directory = workspace.join(DIRECTORY);
        fs::create_dir_all(&directory)
            .map_err(WorkspaceError::io(&directory, "cannot create the directory"))?;
        let path = directory.join(format!("{what}.{attempt}{EXTENSION}"));
        let file = File::create_new(&path).map_err(WorkspaceError::io(&path, "cannot create the file"))?;
        Ok(AttemptLog { path, file })
    }

    /// Says one more thing.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn say(&mut self, event: &impl Serialize) -> Result<(), WorkspaceError> {
        let failed = WorkspaceError::io(&self.path, "cannot write");
        let mut line = serde_json::to_string(event).map_err(|e| failed(e.into()))?;
        line.push('\n');
        self.file.write_all(line.as_bytes()).map_err(&failed)
    }
}
