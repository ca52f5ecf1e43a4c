//! A file of its own for each process, in memory where the system has such a place.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// The directory that holds it.
pub static DIRECTORY: LazyLock<PathBuf> = LazyLock::new(|| {
    let memory = Path::new("/dev/shm");
    let parent = if memory.is_dir() { memory.to_owned() } else { std::env::temp_dir() };
    let directory = parent.join(format!("crease-fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&directory).expect("a directory");
    directory
});

/// Writes `bytes` to `name` and returns where that is.
#[allow(dead_code, reason = "not every target has a file")]
pub fn written(name: &str, bytes: &[u8]) -> PathBuf {
    let path = DIRECTORY.join(name);
    std::fs::write(&path, bytes).expect("write");
    path
}
