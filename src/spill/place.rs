//! A scratch directory that is made when the first file goes there: most runs need none.

use super::{ScratchDir, SpillError};
use std::fmt::Debug;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// What scratch directories stand on: a directory that may have to be made first.
pub trait Ground: Debug + Send + Sync {
    /// The directory, which exists by then.
    ///
    /// # Errors
    /// If it cannot be made.
    fn ground(&self) -> Result<PathBuf, SpillError>;
}

impl Ground for PathBuf {
    fn ground(&self) -> Result<PathBuf, SpillError> {
        Ok(self.clone())
    }
}

/// Where temporary files go. Clones share the directory; it is removed with the last user of it.
#[derive(Clone, Debug)]
pub struct ScratchPlace {
    ground: Arc<dyn Ground>,
    dir: Arc<Mutex<Option<ScratchDir>>>,
}

impl ScratchPlace {
    /// Below `parent`, which exists.
    pub fn below(parent: &Path) -> ScratchPlace {
        ScratchPlace::on(Arc::new(parent.to_owned()))
    }

    /// On `ground`, which is made when the directory is.
    pub fn on(ground: Arc<dyn Ground>) -> ScratchPlace {
        ScratchPlace { ground, dir: Arc::default() }
    }

    /// Another directory on the same ground.
    pub fn beside(&self) -> ScratchPlace {
        ScratchPlace::on(Arc::clone(&self.ground))
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
            None => Ok(dir.insert(ScratchDir::create(&self.ground.ground()?)?).clone()),
        }
    }

    /// What [`ScratchPlace::dir`] would be in, without making the directory itself.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn ground(&self) -> Result<PathBuf, SpillError> {
        self.ground.ground()
    }
}

impl From<&Path> for ScratchPlace {
    fn from(parent: &Path) -> ScratchPlace {
        ScratchPlace::below(parent)
    }
}
