//! Many temporary files that are written at the same time: the first half of an external bucket sort.

use super::{LARGEST_BLOCK, SMALLEST_BLOCK, ScratchDir, SpillError, SpillFile, SpillWriter};

/// Writers that keep their handle; with more, each file is opened for each block. Far below any limit on open files.
const MOST_HANDLES: usize = 64;

/// Files that share an amount of memory.
#[derive(Debug)]
pub struct Buckets {
    writers: Vec<SpillWriter>,
}

impl Buckets {
    /// The largest number of buckets that `memory` bytes are enough for, if each has a block of about `block` bytes.
    pub fn most(memory: u64, block: usize) -> usize {
        (memory / block.clamp(SMALLEST_BLOCK, LARGEST_BLOCK) as u64).clamp(1, 1 << 16) as usize
    }

    /// Begins `count` files in `dir` whose names start with `name`, which hold `memory` bytes together, as long as that is
    /// [`SMALLEST_BLOCK`] for each.
    pub fn create(dir: &ScratchDir, name: &str, count: usize, memory: u64) -> Buckets {
        let block = (memory / count.max(1) as u64).min(LARGEST_BLOCK as u64) as usize;
        let writer = |_| {
            let writer = SpillWriter::create(dir, name, block);
            if count <= MOST_HANDLES { writer } else { writer.closing() }
        };
        Buckets { writers: (0..count).map(writer).collect() }
    }

    /// Appends a record to a bucket.
    ///
    /// # Errors
    /// If its file cannot be written.
    #[inline]
    pub fn write(&mut self, bucket: usize, record: &[u8]) -> Result<(), SpillError> {
        self.writers[bucket].write(record)
    }

    /// Bytes that were written to a bucket.
    pub fn payload(&self, bucket: usize) -> u64 {
        self.writers[bucket].payload()
    }

    /// Ends all files.
    ///
    /// # Errors
    /// If one cannot be written.
    pub fn finish(self) -> Result<Vec<SpillFile>, SpillError> {
        self.writers.into_iter().map(SpillWriter::finish).collect()
    }
}
