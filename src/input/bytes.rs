//! A file as random-access bytes.
//!
//! In: a path. Out: any range of the file, borrowed from a memory map or read into a buffer of the caller's. Every
//! range is checked against the length the file had when it was opened, so nothing is allocated for bytes that do
//! not exist, and shared use from several threads needs no lock, because reads carry their position.

use super::InputError;
use super::map::map;
use memmap2::Mmap;
use std::fs::{self, File};
use std::io;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// How the bytes of a file are reached.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum IoMode {
    /// Map the file; read it if the system refuses to map it.
    #[default]
    Auto,
    /// Map the file, which must not be changed or truncated during the run.
    Map,
    /// Read each range when it is needed.
    Read,
}

#[derive(Debug)]
enum Backing {
    Map(Mmap),
    File(File),
}

/// A regular file, opened for random access.
#[derive(Debug)]
pub struct ByteSource {
    path: PathBuf,
    len: u64,
    backing: Backing,
}

impl ByteSource {
    /// Opens a regular file.
    ///
    /// # Errors
    /// [`InputError::NotAFile`] for a directory, pipe or device; [`InputError::Io`] if the system refuses.
    pub fn open(path: &Path, mode: IoMode) -> Result<Self, InputError> {
        let io_error = |source| InputError::Io { path: path.to_owned(), source };
        // Before opening, because opening a pipe blocks until somebody writes to it.
        if !fs::metadata(path).map_err(io_error)?.is_file() {
            return Err(InputError::NotAFile { path: path.to_owned() });
        }
        let file = File::open(path).map_err(io_error)?;
        let metadata = file.metadata().map_err(io_error)?;
        if !metadata.is_file() {
            return Err(InputError::NotAFile { path: path.to_owned() });
        }
        // An empty file has nothing to map, and some systems refuse to try.
        let mapped = match mode {
            IoMode::Read => None,
            _ if metadata.len() == 0 => None,
            IoMode::Map => Some(map(&file).map_err(io_error)?),
            IoMode::Auto => map(&file).ok(),
        };
        let (len, backing) = match mapped {
            Some(map) => (map.len() as u64, Backing::Map(map)),
            None => (metadata.len(), Backing::File(file)),
        };
        Ok(Self { path: path.to_owned(), len, backing })
    }

    /// The same, called `path` in messages: for a temporary file, what it was made from.
    pub(super) fn called(self, path: &Path) -> Self {
        Self { path: path.to_owned(), ..self }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Length in bytes when the file was opened.
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Whether the file has no bytes.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// All bytes, if the file is mapped.
    pub fn mapped(&self) -> Option<&[u8]> {
        match &self.backing {
            Backing::Map(map) => Some(map),
            Backing::File(_) => None,
        }
    }

    /// The `len` bytes from `offset` on: borrowed from the map, or read into `scratch`, whose content is replaced.
    ///
    /// # Errors
    /// If the range is not inside the file, or the system cannot read it.
    pub fn bytes<'a>(
        &'a self,
        offset: u64,
        len: u64,
        scratch: &'a mut Vec<u8>,
    ) -> Result<&'a [u8], InputError> {
        match &self.backing {
            Backing::Map(map) => {
                let range = self.range(offset, len)?;
                // The range lies inside the map, whose length is a usize.
                Ok(&map[range.start as usize..range.end as usize])
            }
            Backing::File(_) => {
                self.read_into(offset, len, scratch)?;
                Ok(scratch)
            }
        }
    }

    /// Replaces `out` by the `len` bytes from `offset` on.
    ///
    /// # Errors
    /// If the range is not inside the file, or the system cannot read it.
    pub fn read_into(&self, offset: u64, len: u64, out: &mut Vec<u8>) -> Result<(), InputError> {
        let range = self.range(offset, len)?;
        match &self.backing {
            Backing::Map(map) => {
                out.clear();
                out.extend_from_slice(&map[range.start as usize..range.end as usize]);
            }
            Backing::File(file) => {
                let len = usize::try_from(len).map_err(|_| {
                    self.io_error(io::ErrorKind::OutOfMemory, "more bytes than fit into memory")
                })?;
                // Whatever is in the buffer is overwritten, so only growth needs to be zeroed.
                out.resize(len, 0);
                file.read_exact_at(out, offset)
                    .map_err(|source| InputError::Io { path: self.path.clone(), source })?;
            }
        }
        Ok(())
    }

    fn range(&self, offset: u64, len: u64) -> Result<std::ops::Range<u64>, InputError> {
        match offset.checked_add(len) {
            Some(end) if end <= self.len => Ok(offset..end),
            _ => Err(self.io_error(
                io::ErrorKind::UnexpectedEof,
                format!("{len} bytes were asked for at offset {offset}, but the file has {}", self.len),
            )),
        }
    }

    fn io_error(&self, kind: io::ErrorKind, what: impl Into<String>) -> InputError {
        InputError::Io { path: self.path.clone(), source: io::Error::new(kind, what.into()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODES: [IoMode; 3] = [IoMode::Auto, IoMode::Map, IoMode::Read];

    #[test]
    fn every_mode_hands_out_the_same_ranges() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("bytes");
        let content: Vec<u8> = (0..=255).collect();
        fs::write(&path, &content).unwrap();
        for mode in MODES {
            let source = ByteSource::open(&path, mode).unwrap();
            assert_eq!(source.len(), 256);
            assert_eq!(source.path(), path);
            assert_eq!(source.mapped().is_some(), mode != IoMode::Read);
            let mut scratch = vec![9; 3];
            for (offset, len) in [(0, 256), (0, 0), (256, 0), (7, 9), (255, 1)] {
                let expected = &content[offset as usize..(offset + len) as usize];
                assert_eq!(source.bytes(offset, len, &mut scratch).unwrap(), expected);
                source.read_into(offset, len, &mut scratch).unwrap();
                assert_eq!(scratch, expected);
            }
        }
    }

    #[test]
    fn ranges_outside_the_file_are_errors() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("bytes");
        fs::write(&path, [1, 2, 3]).unwrap();
        for mode in MODES {
            let source = ByteSource::open(&path, mode).unwrap();
            let mut scratch = Vec::new();
            for (offset, len) in [(0, 4), (3, 1), (4, 0), (u64::MAX, 1), (1, u64::MAX), (0, u64::MAX)] {
                assert!(matches!(source.bytes(offset, len, &mut scratch), Err(InputError::Io { .. })));
                assert!(matches!(source.read_into(offset, len, &mut scratch), Err(InputError::Io { .. })));
            }
            assert!(scratch.capacity() < 1024, "nothing may be allocated for bytes that do not exist");
        }
    }

    #[test]
    fn an_empty_file_opens_in_every_mode() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("empty");
        fs::write(&path, []).unwrap();
        for mode in MODES {
            let source = ByteSource::open(&path, mode).unwrap();
            assert!(source.is_empty());
            assert_eq!(source.bytes(0, 0, &mut Vec::new()).unwrap(), b"");
        }
    }

    #[test]
    fn what_is_not_a_regular_file_is_told_from_what_is_missing() {
        let dir = tempfile::tempdir().unwrap();
        for mode in MODES {
            let missing = ByteSource::open(&dir.path().join("missing"), mode);
            assert!(matches!(missing, Err(InputError::Io { .. })));
            for other in [dir.path(), Path::new("/dev/null")] {
                assert!(matches!(ByteSource::open(other, mode), Err(InputError::NotAFile { .. })));
            }
        }
    }
}
