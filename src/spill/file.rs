//! A temporary file, while it is written and when it is whole.
//!
//! The file is a row of blocks: the number of bytes (u32) and their checksum (u64), little-endian, then the bytes. The
//! checksum is XXH3 with the offset of the block as its seed, so that a block in the wrong place is a wrong block.

use super::reader::{BlockReader, SpillReader};
use super::{LARGEST_BLOCK, SMALLEST_BLOCK, ScratchDir, SpillError};
use serde::{Deserialize, Serialize};
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::xxh3_64_with_seed;

/// Bytes before the payload of a block.
pub(super) const HEAD: usize = 12;

/// Where a block lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Extent {
    /// Where it starts, in bytes.
    pub offset: u64,
    /// Bytes of its payload.
    pub bytes: u32,
}

/// The head of a block that starts at `offset`.
pub(super) fn head(offset: u64, payload: &[u8]) -> [u8; HEAD] {
    let mut head = [0; HEAD];
    head[..4].copy_from_slice(&(payload.len() as u32).to_le_bytes());
    head[4..].copy_from_slice(&xxh3_64_with_seed(payload, offset).to_le_bytes());
    head
}

/// Writes a temporary file from its start to its end. The file is created with its first block, and removed if the writer
/// is dropped unfinished.
#[derive(Debug)]
pub struct SpillWriter {
    file: SpillFile,
    /// Head and payload of the block that is being filled.
    pending: Vec<u8>,
    /// The handle; none before the first block, and none between blocks if handles are not kept.
    handle: Option<File>,
    keep_open: bool,
}

impl SpillWriter {
    /// Begins a file in `dir` whose name starts with `name`. Blocks have about `block_bytes`, which is brought between
    /// [`SMALLEST_BLOCK`] and [`LARGEST_BLOCK`]; the writer holds one of them.
    pub fn create(dir: &ScratchDir, name: &str, block_bytes: usize) -> SpillWriter {
        let block = block_bytes.clamp(SMALLEST_BLOCK, LARGEST_BLOCK);
        let path = dir.place(name);
        let file = SpillFile { dir: Some(dir.clone()), path, length: 0, payload: 0, block, largest: 0 };
        SpillWriter { file, pending: Vec::new(), handle: None, keep_open: true }
    }

    /// Opens the file for each block anew, so that there can be many writers.
    pub(super) fn closing(mut self) -> SpillWriter {
        self.keep_open = false;
        self
    }

    /// Appends a record. Records of at most a block are not cut: each lies in one block.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&mut self, mut record: &[u8]) -> Result<(), SpillError> {
        let room = |pending: &Vec<u8>, block: usize| block - pending.len().max(HEAD);
        let block = self.file.block;
        if record.len() > room(&self.pending, block) {
            self.end_block()?;
        }
        if self.pending.is_empty() {
            self.pending.reserve_exact(block);
        }
        while !record.is_empty() {
            if self.pending.is_empty() {
                self.pending.resize(HEAD, 0);
            }
            let (now, later) = record.split_at(record.len().min(room(&self.pending, block)));
            self.pending.extend_from_slice(now);
            record = later;
            if !record.is_empty() {
                self.end_block()?;
            }
        }
        Ok(())
    }

    /// Appends `payload` as a block of its own, however large (below 4 GiB), for [`BlockReader::read`].
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write_block(&mut self, payload: &[u8]) -> Result<Extent, SpillError> {
        self.end_block()?;
        let offset = self.file.length;
        let head = head(offset, payload);
        self.append(&head)?;
        self.append(payload)?;
        self.count(payload.len());
        Ok(Extent { offset, bytes: payload.len() as u32 })
    }

    /// Where the file is; nothing is there before the first block.
    pub fn path(&self) -> &Path {
        &self.file.path
    }

    /// Bytes written so far, heads not counted.
    pub fn payload(&self) -> u64 {
        self.file.payload + self.pending.len().saturating_sub(HEAD) as u64
    }

    /// Ends the file.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(mut self) -> Result<SpillFile, SpillError> {
        self.end_block()?;
        Ok(self.file)
    }

    /// Writes what is pending as a block.
    fn end_block(&mut self) -> Result<(), SpillError> {
        if self.pending.len() <= HEAD {
            return Ok(());
        }
        let mut block = std::mem::take(&mut self.pending);
        let head = head(self.file.length, &block[HEAD..]);
        block[..HEAD].copy_from_slice(&head);
        self.append(&block)?;
        self.count(block.len() - HEAD);
        // The buffer is used again.
        block.clear();
        self.pending = block;
        Ok(())
    }

    fn count(&mut self, payload: usize) {
        self.file.payload += payload as u64;
        self.file.largest = self.file.largest.max(payload);
    }

    fn append(&mut self, bytes: &[u8]) -> Result<(), SpillError> {
        let mut handle = match self.handle.take() {
            Some(handle) => handle,
            None => OpenOptions::new()
                .append(true)
                .create(true)
                .open(&self.file.path)
                .map_err(SpillError::io(&self.file.path, "cannot create the file"))?,
        };
        handle.write_all(bytes).map_err(SpillError::io(&self.file.path, "cannot write"))?;
        self.file.length += bytes.len() as u64;
        if let Some(dir) = &self.file.dir {
            dir.grew(bytes.len() as u64);
        }
        if self.keep_open {
            self.handle = Some(handle);
        }
        Ok(())
    }
}

/// A temporary file that was written; removed when it is dropped, unless it is kept.
#[derive(Debug)]
pub struct SpillFile {
    /// Where it counts as temporary; none for a file that is kept.
    dir: Option<ScratchDir>,
    path: PathBuf,
    /// Bytes on the disk.
    length: u64,
    /// Bytes without the heads of the blocks.
    payload: u64,
    /// Size of the blocks.
    block: usize,
    /// Most payload of a block.
    largest: usize,
}

impl SpillFile {
    /// Where it is; nothing is there if nothing was written.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes on the disk.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Bytes that were written, without heads.
    pub fn payload(&self) -> u64 {
        self.payload
    }

    /// Bytes that a reader of this file holds: those of the largest block.
    pub fn reader_bytes(&self) -> usize {
        self.largest
    }

    /// Reads the file from its start.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn reader(&self) -> Result<SpillReader<'_>, SpillError> {
        let handle = (self.length > 0).then(|| self.open()).transpose()?;
        Ok(SpillReader::new(self, handle))
    }

    /// Reads single blocks of the file, from any thread.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn blocks(self) -> Result<BlockReader, SpillError> {
        let handle = (self.length > 0).then(|| self.open()).transpose()?;
        Ok(BlockReader::new(self, handle))
    }

    /// A file of so many bytes that another process has kept, for [`SpillFile::blocks`].
    ///
    /// # Errors
    /// If the file is not there or has another length.
    pub fn kept(path: &Path, length: u64) -> Result<SpillFile, SpillError> {
        let found = fs::metadata(path).map_err(SpillError::io(path, "cannot open the file"))?.len();
        if found != length {
            let (path, offset) = (path.to_owned(), found.min(length));
            return Err(SpillError::Corrupt { path, offset, reason: "the file has another length" });
        }
        let (path, payload) = (path.to_owned(), length);
        Ok(SpillFile { dir: None, path, length, payload, block: SMALLEST_BLOCK, largest: 0 })
    }

    /// Gives the file the name `path`, on the same disk, where it stays. What is in it is on the disk by then, if `handle`
    /// is one of it; the name is not, as long as nobody syncs the directory.
    pub(super) fn keep(&mut self, handle: &File, path: &Path) -> Result<(), SpillError> {
        handle.sync_all().map_err(SpillError::io(&self.path, "cannot sync the file"))?;
        fs::rename(&self.path, path).map_err(SpillError::io(&self.path, "cannot give the file its name"))?;
        self.path = path.to_owned();
        if let Some(dir) = self.dir.take() {
            dir.shrank(self.length);
        }
        Ok(())
    }

    fn open(&self) -> Result<File, SpillError> {
        File::open(&self.path).map_err(SpillError::io(&self.path, "cannot open the file"))
    }
}

impl Drop for SpillFile {
    fn drop(&mut self) {
        if let (Some(dir), true) = (&self.dir, self.length > 0) {
            // What cannot be removed goes with the directory.
            let _ = fs::remove_file(&self.path);
            dir.shrank(self.length);
        }
    }
}
