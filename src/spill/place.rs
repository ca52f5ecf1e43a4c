//! A scratch directory that is made when the first file goes there: most runs need none.

use super::{ScratchDir, SpillError};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Where temporary files go. Clones share the directory; it is removed with the last user of it.
#[derive(Clone, Debug)]
pub struct ScratchPlace {
    parent: PathBuf,
    dir: Arc<Mutex<Option<ScratchDir>>>,
}

impl ScratchPlace {
    /// Below `parent`.
    pub fn below(parent: &Path) -> ScratchPlace {
        ScratchPlace { parent: parent.to_owned(), dir: Arc::default() }
    }

    /// The directory.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn dir(&self) -> Result<ScratchDir, SpillError> {
        // What is guarded is whole or not there, even if somebody panicked beside it.
        let mut dir = self.dir.lock().unwrap_or_else(PoisonError::into_inner);
        match &*dir {
            Some(dir) => Ok(dir.clone()),
            None => Ok(dir.insert(ScratchDir::create(&self.parent)?).clone()),
        }
    }
}
