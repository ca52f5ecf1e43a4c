//! Records as bytes: in temporary files, and in files that others keep.
//!
//! In a temporary file each record has its length before it, and may lie in several blocks. What is kept for other processes
//! is a row of blocks of whole records, so that a reader needs no more than one of them; who keeps it says where the blocks
//! are, and whether they are still what was written.

use super::sorter::Record;
use super::{SpillError, SpillFile, SpillReader, SpillWriter};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt::Debug;
use std::io::{ErrorKind, Read};
use std::marker::PhantomData;
use std::sync::Arc;

/// Records that somebody else keeps, in their order, block by block.
pub trait Run: Debug + Send + Sync {
    /// Where the first block is.
    fn start(&self) -> u64;

    /// Replaces `out` by the block at `at`, and says where the next one is; `None` behind the last.
    ///
    /// # Errors
    /// If it cannot be read, or is not what was written.
    fn read(&self, at: u64, out: &mut Vec<u8>) -> Result<Option<u64>, SpillError>;

    /// The error for a block that cannot be understood.
    fn damaged(&self, at: u64) -> SpillError;

    /// Bytes of the largest block.
    fn reader_bytes(&self) -> u64;
}

/// A run of somebody else, shared by its readers.
#[derive(Clone, Debug)]
pub struct KeptRun(Arc<dyn Run>);

impl KeptRun {
    /// Of `run`.
    pub fn new(run: Arc<dyn Run>) -> KeptRun {
        KeptRun(run)
    }

    /// What a reader of it holds.
    pub fn reader_bytes(&self) -> u64 {
        self.0.reader_bytes()
    }

    /// All its records in order, each as soon as it is asked for.
    pub fn records<R: DeserializeOwned>(&self) -> KeptReader<'_, R> {
        KeptReader {
            run: &*self.0,
            next: self.0.start(),
            at: 0,
            block: Vec::new(),
            taken: 0,
            kind: PhantomData,
        }
    }
}

/// Reads a run of somebody else.
#[derive(Debug)]
pub struct KeptReader<'a, R> {
    run: &'a dyn Run,
    /// Where the next block is, and where the present one was.
    next: u64,
    at: u64,
    block: Vec<u8>,
    taken: usize,
    kind: PhantomData<R>,
}

impl<R: DeserializeOwned> KeptReader<'_, R> {
    /// The next record.
    ///
    /// # Errors
    /// If the run cannot be read.
    pub fn read(&mut self) -> Result<Option<R>, SpillError> {
        while self.taken == self.block.len() {
            self.taken = 0;
            self.block.clear();
            let Some(next) = self.run.read(self.next, &mut self.block)? else { return Ok(None) };
            self.at = std::mem::replace(&mut self.next, next);
        }
        let rest = &self.block[self.taken..];
        let (record, left) = postcard::take_from_bytes(rest).map_err(|_| self.run.damaged(self.at))?;
        self.taken += rest.len() - left.len();
        Ok(Some(record))
    }
}

/// Hands over `records` as blocks of about `block` bytes, for a [`Run`]; a record that is larger has one for itself.
///
/// # Errors
/// If the records cannot be read, or `take` refuses.
pub fn blocks_of_records<R: Serialize, E>(
    records: impl Iterator<Item = Result<R, E>>,
    block: usize,
    mut take: impl FnMut(&[u8]) -> Result<(), E>,
) -> Result<(), E> {
    let mut bytes = Vec::new();
    for record in records {
        let whole = bytes.len();
        bytes = encoded(&record?, bytes);
        if bytes.len() > block && whole > 0 {
            take(&bytes[..whole])?;
            bytes.drain(..whole);
        }
    }
    if bytes.is_empty() { Ok(()) } else { take(&bytes) }
}

fn encoded<R: Serialize>(record: &R, bytes: Vec<u8>) -> Vec<u8> {
    // Records are plain numbers and lists of them: there is none that cannot be encoded.
    postcard::to_extend(record, bytes).expect("a plain record")
}

/// Writes a record to a temporary file, with its length before it.
pub(super) fn write_record<R: Record>(
    run: &mut SpillWriter,
    record: &R,
    bytes: &mut Vec<u8>,
) -> Result<(), SpillError> {
    bytes.clear();
    bytes.extend([0; 4]);
    *bytes = encoded(record, std::mem::take(bytes));
    let length = (bytes.len() - 4) as u32;
    bytes[..4].copy_from_slice(&length.to_le_bytes());
    run.write(bytes)
}

/// The next record of a temporary file.
pub(super) fn read_record<R: Record>(
    reader: &mut SpillReader<'_>,
    file: &SpillFile,
    bytes: &mut Vec<u8>,
) -> Result<Option<R>, SpillError> {
    let mut length = [0; 4];
    match reader.read(&mut length[..1]).map_err(|e| damaged(file, e))? {
        0 => return Ok(None),
        _ => reader.read_exact(&mut length[1..]).map_err(|e| damaged(file, e))?,
    }
    bytes.resize(u32::from_le_bytes(length) as usize, 0);
    reader.read_exact(bytes).map_err(|e| damaged(file, e))?;
    postcard::from_bytes(bytes).map(Some).map_err(|_| cut(file))
}

/// What a reader says through [`Read`], as what it is.
fn damaged(file: &SpillFile, error: std::io::Error) -> SpillError {
    let kind = error.kind();
    match error.downcast::<SpillError>() {
        Ok(error) => error,
        Err(_) if kind == ErrorKind::UnexpectedEof => cut(file),
        Err(source) => SpillError::Io { path: file.path().to_owned(), action: "cannot read", source },
    }
}

fn cut(file: &SpillFile) -> SpillError {
    SpillError::Corrupt { path: file.path().to_owned(), offset: 0, reason: "a record is cut off" }
}

#[cfg(test)]
mod memory {
    use super::*;

    /// Blocks in memory.
    #[derive(Debug)]
    struct Blocks(Vec<Vec<u8>>);

    impl Run for Blocks {
        fn start(&self) -> u64 {
            0
        }

        fn read(&self, at: u64, out: &mut Vec<u8>) -> Result<Option<u64>, SpillError> {
            let Some(block) = self.0.get(at as usize) else { return Ok(None) };
            out.clone_from(block);
            Ok(Some(at + 1))
        }

        fn damaged(&self, at: u64) -> SpillError {
            SpillError::Changed { path: "memory".into(), offset: at }
        }

        fn reader_bytes(&self) -> u64 {
            self.0.iter().map(Vec::len).max().unwrap_or(0) as u64
        }
    }

    impl KeptRun {
        /// Of these blocks.
        pub fn in_memory(blocks: Vec<Vec<u8>>) -> KeptRun {
            KeptRun::new(Arc::new(Blocks(blocks)))
        }
    }
}
