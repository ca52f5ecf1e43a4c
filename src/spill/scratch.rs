//! A directory for temporary files, which goes when the last of its users goes.

use super::SpillError;
use std::fs::{self, DirBuilder};
use std::io::ErrorKind;
use std::os::unix::fs::DirBuilderExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// What the names of all scratch directories start with.
pub const PREFIX: &str = "crease-scratch-";

/// A directory of our own. Clones share it; it is removed with all that is in it when the last clone, writer, file and
/// reader are dropped, after an error as after success. A killed process leaves it behind, under a name that says whose it
/// was.
#[derive(Clone, Debug)]
pub struct ScratchDir(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    path: PathBuf,
    /// Bytes in files now, and the most there were.
    bytes: AtomicU64,
    peak: AtomicU64,
    /// Number of the next file, so that names never clash.
    next: AtomicU64,
}

impl Drop for Inner {
    fn drop(&mut self) {
        // Nothing can be done about a directory that cannot be removed; its name says what it is.
        let _ = fs::remove_dir_all(&self.path);
    }
}

impl ScratchDir {
    /// Makes a directory below `parent`, which must exist. Nobody else may look into it.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn create(parent: &Path) -> Result<ScratchDir, SpillError> {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        loop {
            let n = NEXT.fetch_add(1, Ordering::Relaxed);
            let path = parent.join(format!("{PREFIX}{}-{n}", std::process::id()));
            match DirBuilder::new().mode(0o700).create(&path) {
                Ok(()) => {
                    let [bytes, peak, next] = [0; 3].map(AtomicU64::new);
                    return Ok(ScratchDir(Arc::new(Inner { path, bytes, peak, next })));
                }
                // Left behind by a process that had our number.
                Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
                Err(e) => return Err(SpillError::io(&path, "cannot create the directory")(e)),
            }
        }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.0.path
    }

    /// Bytes in its files now.
    pub fn bytes(&self) -> u64 {
        self.0.bytes.load(Ordering::Relaxed)
    }

    /// The most bytes that were in its files at a time.
    pub fn peak_bytes(&self) -> u64 {
        self.0.peak.load(Ordering::Relaxed)
    }

    /// A path for a new file that starts with `name`.
    pub(super) fn place(&self, name: &str) -> PathBuf {
        self.0.path.join(format!("{name}-{}", self.0.next.fetch_add(1, Ordering::Relaxed)))
    }

    pub(super) fn grew(&self, by: u64) {
        let now = self.0.bytes.fetch_add(by, Ordering::Relaxed) + by;
        self.0.peak.fetch_max(now, Ordering::Relaxed);
    }

    pub(super) fn shrank(&self, by: u64) {
        self.0.bytes.fetch_sub(by, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_goes_with_its_last_user() {
        let parent = tempfile::tempdir().expect("a temporary directory");
        let a = ScratchDir::create(parent.path()).expect("create");
        let b = ScratchDir::create(parent.path()).expect("create");
        assert_ne!(a.path(), b.path());
        fs::write(a.place("x"), "bytes").expect("write");
        let (path, again) = (a.path().to_owned(), a.clone());
        drop(a);
        assert!(path.is_dir());
        drop(again);
        assert!(!path.exists() && b.path().is_dir());
        drop(b);
        assert_eq!(fs::read_dir(parent.path()).expect("list").count(), 0);
    }

    #[test]
    fn a_missing_parent_is_an_error_that_names_it() {
        let parent = tempfile::tempdir().expect("a temporary directory");
        let error = ScratchDir::create(&parent.path().join("missing")).expect_err("refused");
        assert!(error.to_string().contains("missing") && !error.is_out_of_space(), "{error}");
    }
}
