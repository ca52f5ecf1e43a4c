//! Temporary files read back: from start to end, or block by block. No byte is handed out before its block was checked.

use super::SpillError;
use super::file::{Extent, HEAD, SpillFile, head};
use std::fs::File;
use std::io::{self, Read};
use std::os::unix::fs::FileExt;
use std::path::Path;

/// Reads one block of `file` at `extent` into `out`.
fn read_block(file: &SpillFile, handle: &File, extent: Extent, out: &mut Vec<u8>) -> Result<(), SpillError> {
    let corrupt =
        |reason| SpillError::Corrupt { path: file.path().to_owned(), offset: extent.offset, reason };
    let whole = HEAD as u64 + u64::from(extent.bytes);
    if extent.offset.checked_add(whole).is_none_or(|end| end > file.length()) {
        return Err(corrupt("it would reach beyond the end of the file"));
    }
    out.clear();
    out.resize(HEAD + extent.bytes as usize, 0);
    handle.read_exact_at(out, extent.offset).map_err(|e| match e.kind() {
        io::ErrorKind::UnexpectedEof => corrupt("the file was cut off"),
        _ => SpillError::io(file.path(), "cannot read")(e),
    })?;
    if out[..HEAD] != head(extent.offset, &out[HEAD..]) {
        return Err(corrupt("its checksum differs"));
    }
    out.drain(..HEAD);
    Ok(())
}

/// Reads a temporary file from its start to its end. Holds one block.
#[derive(Debug)]
pub struct SpillReader<'a> {
    file: &'a SpillFile,
    handle: Option<File>,
    block: Vec<u8>,
    /// How much of the block was read through [`Read`].
    taken: usize,
    /// Where the next block starts.
    next: u64,
}

impl<'a> SpillReader<'a> {
    pub(super) fn new(file: &'a SpillFile, handle: Option<File>) -> SpillReader<'a> {
        SpillReader { file, handle, block: Vec::new(), taken: 0, next: 0 }
    }

    /// The next block; `None` behind the last. A record that fits a block lies in one.
    ///
    /// # Errors
    /// If the file cannot be read or the block is not the one that was written.
    pub fn next_block(&mut self) -> Result<Option<&[u8]>, SpillError> {
        self.block.clear();
        self.taken = 0;
        let Some(handle) = self.handle.as_ref().filter(|_| self.next < self.file.length()) else {
            return Ok(None);
        };
        let mut bytes = [0; 4];
        handle.read_exact_at(&mut bytes, self.next).map_err(|e| match e.kind() {
            io::ErrorKind::UnexpectedEof => SpillError::Corrupt {
                path: self.file.path().to_owned(),
                offset: self.next,
                reason: "the file was cut off",
            },
            _ => SpillError::io(self.file.path(), "cannot read")(e),
        })?;
        let extent = Extent { offset: self.next, bytes: u32::from_le_bytes(bytes) };
        read_block(self.file, handle, extent, &mut self.block)?;
        self.next += (HEAD + self.block.len()) as u64;
        Ok(Some(&self.block))
    }
}

impl Read for SpillReader<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        while self.taken == self.block.len() {
            if self.next_block().map_err(io::Error::other)?.is_none() {
                return Ok(0);
            }
        }
        let count = out.len().min(self.block.len() - self.taken);
        out[..count].copy_from_slice(&self.block[self.taken..self.taken + count]);
        self.taken += count;
        Ok(count)
    }
}

/// Reads blocks of a temporary file in any order. Shared between threads; the file goes with it, unless it is kept.
#[derive(Debug)]
pub struct BlockReader {
    file: SpillFile,
    handle: Option<File>,
}

impl BlockReader {
    pub(super) fn new(file: SpillFile, handle: Option<File>) -> BlockReader {
        BlockReader { file, handle }
    }

    /// The file.
    pub fn file(&self) -> &SpillFile {
        &self.file
    }

    /// Has the file stay behind as `path`, on the same disk, for [`SpillFile::kept`].
    ///
    /// # Errors
    /// If the system refuses, or nothing was ever written.
    pub fn keep(&mut self, path: &Path) -> Result<(), SpillError> {
        match &self.handle {
            Some(handle) => self.file.keep(handle, path),
            None => {
                Err(SpillError::Corrupt { path: path.to_owned(), offset: 0, reason: "the file is empty" })
            }
        }
    }

    /// Replaces `out` by the payload of the block at `extent`.
    ///
    /// # Errors
    /// If the file cannot be read or the block is not the one that was written.
    pub fn read(&self, extent: Extent, out: &mut Vec<u8>) -> Result<(), SpillError> {
        match &self.handle {
            Some(handle) => read_block(&self.file, handle, extent, out),
            None => Err(SpillError::Corrupt {
                path: self.file.path().to_owned(),
                offset: extent.offset,
                reason: "the file is empty",
            }),
        }
    }
}
