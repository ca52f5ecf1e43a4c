//! The file that says that a directory is a workspace, and whose lock says that somebody works there.
//!
//! It is written once and never replaced, so that all processes lock the same file. The lock is that of the operating
//! system: it ends with the process, so there are no stale ones.

use super::WorkspaceError;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// Its name.
pub const MARKER: &str = "crease-workspace";
/// What it starts with, in every version.
const KIND: &str = "crease workspace ";
/// What is in it; the number is that of the format of all files here.
const BEGUN: &str = "crease workspace 1\n";
/// The same if the directory was made for it.
const MADE: &str = "crease workspace 1\nin a directory of its own\n";
/// The same if many tasks work there, each with files of its own: nobody holds the lock while they do.
const PLANNED: &str = "crease workspace 1\nplanned for many tasks\n";
/// More than any version of it has.
const MOST_BYTES: u64 = 4096;

/// Locks the workspace in `directory`, if there is one, and returns the lock and whether the directory was made for it.
///
/// # Errors
/// If another process holds it, or it is of another version.
pub fn open(directory: &Path) -> Result<Option<(File, bool)>, WorkspaceError> {
    let path = directory.join(MARKER);
    loop {
        let file = match OpenOptions::new().read(true).write(true).open(&path) {
            Ok(file) => file,
            Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => return Ok(None),
            Err(e) => return Err(WorkspaceError::io(&path, "cannot open the file")(e)),
        };
        lock(&file, directory)?;
        // Whoever held the lock before may have removed the workspace.
        if is_at(&file, &path) {
            return read(&file, directory).map(|made| Some((file, made)));
        }
    }
}

/// Makes `directory`, which exists, a workspace; `made` if it was made for that.
///
/// # Errors
/// If another process is faster, or the system refuses.
pub fn create(directory: &Path, made: bool) -> Result<(File, bool), WorkspaceError> {
    let path = directory.join(MARKER);
    let failed = WorkspaceError::io(&path, "cannot create the file");
    loop {
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)
            .map_err(&failed)?;
        lock(&file, directory)?;
        if !is_at(&file, &path) {
            continue;
        }
        if file.metadata().map_err(&failed)?.len() > 0 {
            return read(&file, directory).map(|made| (file, made));
        }
        file.write_all(if made { MADE } else { BEGUN }.as_bytes()).map_err(&failed)?;
        file.sync_all().map_err(&failed)?;
        return Ok((file, made));
    }
}

/// Makes `directory`, which exists, the workspace of a planned job, and locks it while it is planned.
///
/// # Errors
/// If another process plans there, it is a workspace of another kind, or the system refuses.
pub fn create_planned(directory: &Path) -> Result<File, WorkspaceError> {
    let path = directory.join(MARKER);
    let failed = WorkspaceError::io(&path, "cannot create the file");
    let open = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
    let mut file = open.map_err(&failed)?;
    lock(&file, directory)?;
    if !is_at(&file, &path) {
        return Err(WorkspaceError::InUse { path: directory.to_owned() });
    }
    if file.metadata().map_err(&failed)?.len() == 0 {
        file.write_all(PLANNED.as_bytes()).map_err(&failed)?;
        file.sync_all().map_err(&failed)?;
    }
    match is_planned(directory)? {
        true => Ok(file),
        false => Err(WorkspaceError::NotPlanned {
            path: directory.to_owned(),
            what: "it is that of a crease detect",
        }),
    }
}

/// Whether `directory` is the workspace of a planned job. Looks without a lock.
///
/// # Errors
/// If the system refuses.
pub fn is_planned(directory: &Path) -> Result<bool, WorkspaceError> {
    let path = directory.join(MARKER);
    match fs::read(&path) {
        Ok(text) => Ok(text == PLANNED.as_bytes()),
        Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => Ok(false),
        Err(e) => Err(WorkspaceError::io(&path, "cannot read")(e)),
    }
}

/// Whether there is a marker of ours, of any version.
pub fn is_ours(directory: &Path) -> bool {
    let mut text = Vec::new();
    let read =
        File::open(directory.join(MARKER)).and_then(|file| file.take(MOST_BYTES).read_to_end(&mut text));
    // A run that is killed at the very beginning leaves an empty one.
    read.is_ok() && (text.is_empty() || text.starts_with(KIND.as_bytes()))
}

fn lock(file: &File, directory: &Path) -> Result<(), WorkspaceError> {
    match file.try_lock() {
        Ok(()) => Ok(()),
        Err(TryLockError::WouldBlock) => Err(WorkspaceError::InUse { path: directory.to_owned() }),
        Err(TryLockError::Error(e)) => {
            tracing::warn!(
                "{}: the file system cannot lock ({e}); do not start a second run there",
                directory.display()
            );
            Ok(())
        }
    }
}

fn is_at(file: &File, path: &Path) -> bool {
    let id = |found: fs::Metadata| (found.dev(), found.ino());
    let ids = (file.metadata().map(id), fs::metadata(path).map(id));
    matches!(ids, (Ok(a), Ok(b)) if a == b)
}

/// Whether the directory was made for the workspace.
fn read(mut file: &File, directory: &Path) -> Result<bool, WorkspaceError> {
    let path = directory.join(MARKER);
    let mut text = Vec::new();
    file.take(MOST_BYTES).read_to_end(&mut text).map_err(WorkspaceError::io(&path, "cannot read"))?;
    match text.as_slice() {
        t if t == BEGUN.as_bytes() => Ok(false),
        t if t == MADE.as_bytes() => Ok(true),
        t if t == PLANNED.as_bytes() => Err(WorkspaceError::Planned { path: directory.to_owned() }),
        b"" => {
            file.write_all(BEGUN.as_bytes()).map_err(WorkspaceError::io(&path, "cannot write"))?;
            Ok(false)
        }
        other => {
            let newer = other.starts_with(KIND.as_bytes());
            let reason = if newer { "of another version of crease, or damaged" } else { "damaged" };
            Err(WorkspaceError::Damaged { directory: directory.to_owned(), path, reason: reason.to_owned() })
        }
    }
}
