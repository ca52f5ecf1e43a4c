//! A file that appears under its name only when it is whole.
//!
//! It is written as `NAME.part` beside its place, synced, and renamed; the directory is synced last, so that the name
//! survives a power cut as well as the bytes. A part that is not committed is removed. It is locked while it is written: two
//! runs that were given the same name would mix their bytes.

use super::OutputError;
use crate::spill::point;
use std::fs::{File, OpenOptions, TryLockError};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// An output that is being written.
pub struct PartFile {
    target: PathBuf,
    part: PathBuf,
    file: File,
    committed: bool,
}

impl PartFile {
    /// Begins to write `target`. An existing file is not touched until [`PartFile::commit`].
    ///
    /// # Errors
    /// If the part cannot be created, or another process writes it.
    pub fn create(target: &Path) -> Result<PartFile, OutputError> {
        let part = part_of(target);
        let failed = OutputError::io(target, "cannot create the file");
        loop {
            // What an earlier run has left in it goes when it is ours.
            let open = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&part);
            let file = open.map_err(&failed)?;
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => return Err(OutputError::InUse { path: target.to_owned() }),
                // A file system without locks has none to respect.
                Ok(()) | Err(TryLockError::Error(_)) => {}
            }
            let id = |found: std::fs::Metadata| (found.dev(), found.ino());
            let ids = (file.metadata().map(id), std::fs::metadata(&part).map(id));
            // Another process may have given it its name, or removed it, before it was ours.
            if matches!(ids, (Ok(a), Ok(b)) if a == b) {
                // From here on it goes if something fails.
                let begun = PartFile { target: target.to_owned(), part, file, committed: false };
                begun.file.set_len(0).map_err(&failed)?;
                return Ok(begun);
            }
        }
    }

    /// The file to write to.
    pub fn file(&self) -> &File {
        &self.file
    }

    /// Where it is until it is whole.
    pub(super) fn path(&self) -> &Path {
        &self.part
    }

    /// The name it will have.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Makes what is written durable, under no name yet.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn sync(&self) -> Result<(), OutputError> {
        self.file.sync_all().map_err(OutputError::io(&self.target, "cannot sync the file"))
    }

    /// Makes the file durable and gives it its name.
    ///
    /// # Errors
    /// If the system refuses; the target is then as it was before. Only if it fails in the very last step, when nobody knows
    /// whether the name would survive a power cut, there is no target.
    pub fn commit(mut self) -> Result<(), OutputError> {
        self.sync()?;
        // What can be refused is asked for while nothing has happened yet.
        let directory = File::open(directory_of(&self.target))
            .map_err(OutputError::io(&self.target, "cannot open the directory"))?;
        std::fs::rename(&self.part, &self.target)
            .map_err(OutputError::io(&self.target, "cannot give the file its name"))?;
        self.committed = true;
        point("output-renamed");
        directory.sync_all().map_err(|error| {
            // A run that failed leaves no result behind that the next one would trip over.
            let _ = std::fs::remove_file(&self.target);
            OutputError::io(&self.target, "cannot sync the directory")(error)
        })
    }
}

impl Drop for PartFile {
    fn drop(&mut self) {
        if !self.committed {
            // Nothing can be done about a part that cannot be removed, and nobody mistakes it for a result.
            let _ = std::fs::remove_file(&self.part);
        }
    }
}

/// The name of `target` until it is whole.
pub fn part_of(target: &Path) -> PathBuf {
    let mut name = target.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    target.with_file_name(name)
}

/// The directory that `target` is in.
pub fn directory_of(target: &Path) -> &Path {
    match target.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}

/// Refuses to replace what is there, before any work is done for it.
///
/// # Errors
/// If `target` exists and `force` is not given.
pub fn check_target(target: &Path, force: bool) -> Result<(), OutputError> {
    match target.try_exists() {
        Ok(true) if !force => Err(OutputError::Exists { path: target.to_owned() }),
        Ok(_) => Ok(()),
        Err(source) => Err(OutputError::Io { path: target.to_owned(), action: "cannot look at it", source }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn a_file_appears_when_it_is_whole() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let target = dir.path().join("a.ply");
        let part = PartFile::create(&target).expect("create");
        part.file().write_all(b"half").expect("write");
        assert!(!target.exists());
        assert!(matches!(PartFile::create(&target), Err(OutputError::InUse { .. })));
        assert_eq!(std::fs::read(part_of(&target)).expect("read"), b"half");
        drop(part);
        assert_eq!(std::fs::read_dir(dir.path()).expect("list").count(), 0);
        let part = PartFile::create(&target).expect("create");
        part.file().write_all(b"whole").expect("write");
        part.commit().expect("commit");
        assert_eq!(std::fs::read(&target).expect("read"), b"whole");
        assert!(check_target(&target, false).is_err() && check_target(&target, true).is_ok());
    }
}
