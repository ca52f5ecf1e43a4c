//! A temporary file in a format of its user's: neither blocks nor checksums, so that others can read it in place.

use super::{ScratchDir, SpillError};
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes such a file from its start to its end.
#[derive(Debug)]
pub struct PlainWriter {
    file: PlainFile,
    out: BufWriter<File>,
}

impl PlainWriter {
    /// Begins a file in `dir` whose name starts with `name`. `buffer` bytes are written at a time.
    ///
    /// # Errors
    /// If the file cannot be created.
    pub fn create(dir: &ScratchDir, name: &str, buffer: usize) -> Result<PlainWriter, SpillError> {
        let path = dir.place(name);
        let out = File::create_new(&path).map_err(SpillError::io(&path, "cannot create the file"))?;
        let file = PlainFile { dir: dir.clone(), path, length: 0 };
        Ok(PlainWriter { file, out: BufWriter::with_capacity(buffer, out) })
    }

    /// Appends bytes.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), SpillError> {
        self.out.write_all(bytes).map_err(SpillError::io(&self.file.path, "cannot write"))?;
        self.file.length += bytes.len() as u64;
        self.file.dir.grew(bytes.len() as u64);
        Ok(())
    }

    /// Ends the file.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(mut self) -> Result<PlainFile, SpillError> {
        self.out.flush().map_err(SpillError::io(&self.file.path, "cannot write"))?;
        Ok(self.file)
    }
}

/// A temporary file that was written; removed when it is dropped.
#[derive(Debug)]
pub struct PlainFile {
    dir: ScratchDir,
    path: PathBuf,
    length: u64,
}

impl PlainFile {
    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Has the file stay behind as `path`, on the same disk. It is there for good when its directory was synced.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn keep(self, path: &Path) -> Result<(), SpillError> {
        let synced = File::open(&self.path).and_then(|file| file.sync_all());
        synced.map_err(SpillError::io(&self.path, "cannot sync the file"))?;
        // What is dropped now has no name of its own any more.
        fs::rename(&self.path, path).map_err(SpillError::io(&self.path, "cannot give the file its name"))
    }

    /// The directory it lies in.
    pub fn dir(&self) -> &ScratchDir {
        &self.dir
    }
}

impl Drop for PlainFile {
    fn drop(&mut self) {
        // What cannot be removed goes with the directory.
        let _ = fs::remove_file(&self.path);
        self.dir.shrank(self.length);
    }
}
