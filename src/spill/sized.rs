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

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::FileExt;

    #[test]
    fn what_was_not_written_is_zero() {
        let parent = tempfile::tempdir().expect("a temporary directory");
        let dir = ScratchDir::create(parent.path()).expect("a directory");
        let made = SizedFile::create(&dir, "rows", 5000).expect("a file");
        made.file().write_all_at(b"here", 4000).expect("written");
        let mut bytes = vec![1; 5000];
        made.file().read_exact_at(&mut bytes, 0).expect("read");
        assert!(bytes[4000..4004] == *b"here" && bytes.iter().filter(|&&byte| byte != 0).count() == 4);
        assert_eq!((dir.bytes(), fs::read_dir(dir.path()).expect("list").count()), (5000, 1));
        drop(made);
        assert_eq!((dir.bytes(), fs::read_dir(dir.path()).expect("list").count()), (0, 0));
    }
}
