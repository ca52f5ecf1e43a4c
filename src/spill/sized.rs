//! A temporary file of a known length that is written and read at any place.

use super::{ScratchDir, SpillError};
use std::fs::{self, File, OpenOptions};
use std::path::{Path, PathBuf};

/// Zeros where nothing was written; removed when it is dropped.
#[derive(Debug)]
pub struct SizedFile {
    dir: ScratchDir,
    path: PathBuf,
    file: File,
    length: u64,
}

impl SizedFile {
    /// Makes a file of `length` bytes in `dir` whose name starts with `name`.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn create(dir: &ScratchDir, name: &str, length: u64) -> Result<SizedFile, SpillError> {
        let path = dir.place(name);
        let open = OpenOptions::new().read(true).write(true).create_new(true).open(&path);
        let file = open.map_err(SpillError::io(&path, "cannot create the file"))?;
        dir.grew(length);
        let made = SizedFile { dir: dir.clone(), path, file, length };
        made.file.set_len(length).map_err(SpillError::io(&made.path, "cannot create the file"))?;
        Ok(made)
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The file, to be read and written at any place below its length.
    pub fn file(&self) -> &File {
        &self.file
    }
}

impl Drop for SizedFile {
    fn drop(&mut self) {
        // What cannot be removed goes with the directory.
        let _ = fs::remove_file(&self.path);
        self.dir.shrank(self.length);
    }
}
