//! A directory for temporary files, which goes when the last of its users goes.

use super::SpillError;
use std::fs::{self, DirBuilder};
use std::io::{self, ErrorKind};
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

/// Removes the scratch directories that killed processes have left below `parent`, each with the files in it and nothing
/// else: what holds a directory, or is a link, was not made here and stays. No other process may use `parent`.
///
/// # Errors
/// If the system refuses.
pub fn remove_left_behind(parent: &Path) -> Result<(), SpillError> {
    let failed = |path: &Path| SpillError::io(path, "cannot remove what a run has left behind");
    for entry in fs::read_dir(parent).map_err(failed(parent))? {
        let entry = entry.map_err(failed(parent))?;
        let (path, name) = (entry.path(), entry.file_name());
        let is_directory = entry.file_type().map_err(failed(&path))?.is_dir();
        if is_directory && name.to_str().is_some_and(is_scratch) {
            remove_flat(&path).map_err(failed(&path))?;
        }
    }
    Ok(())
}

/// Whether `name` is `crease-scratch-PID-N`.
fn is_scratch(name: &str) -> bool {
    let number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    let numbers = name.strip_prefix(PREFIX).and_then(|rest| rest.split_once('-'));
    numbers.is_some_and(|(process, n)| number(process) && number(n))
}

/// Removes a directory and the files in it, unless there is something else.
fn remove_flat(directory: &Path) -> io::Result<()> {
    for entry in fs::read_dir(directory)? {
        let entry = entry?;
        if entry.file_type()?.is_file() {
            fs::remove_file(entry.path())?;
        }
    }
    match fs::remove_dir(directory) {
        Err(e) if e.kind() == ErrorKind::DirectoryNotEmpty => Ok(()),
        other => other,
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
    fn what_was_left_behind_goes_and_nothing_else() {
        let parent = tempfile::tempdir().expect("a temporary directory");
        let at = |name: &str| parent.path().join(name);
        for name in
            ["crease-scratch-7-0", "crease-scratch-7", "crease-scratch-7-x", "other", "crease-scratch-8-1"]
        {
            fs::create_dir(at(name)).expect("create");
            fs::write(at(name).join("rows-0"), "bytes").expect("write");
        }
        fs::create_dir(at("crease-scratch-8-1").join("mine")).expect("create");
        std::os::unix::fs::symlink(at("other"), at("crease-scratch-9-0")).expect("link");
        remove_left_behind(parent.path()).expect("removed");
        let mut left: Vec<String> = fs::read_dir(parent.path())
            .expect("list")
            .map(|e| e.expect("entry").file_name().to_string_lossy().into_owned())
            .collect();
        left.sort();
        assert_eq!(
            left,
            ["crease-scratch-7", "crease-scratch-7-x", "crease-scratch-8-1", "crease-scratch-9-0", "other"]
        );
        assert!(at("other").join("rows-0").exists() && at("crease-scratch-8-1").join("mine").exists());
    }

    #[test]
    fn a_missing_parent_is_an_error_that_names_it() {
        let parent = tempfile::tempdir().expect("a temporary directory");
        let error = ScratchDir::create(&parent.path().join("missing")).expect_err("refused");
        assert!(error.to_string().contains("missing") && !error.is_out_of_space(), "{error}");
    }
}
