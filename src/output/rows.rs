//! Rows of one size, one for each vertex, that come in any order and are read in the order of their ids.
//!
//! Tiles finish in any order and own vertices all over the file, but every row has the same size: its place follows from its
//! id, and runs of neighbours are written at once. A tile whose vertices lie all over the file would write them one by one: its
//! rows go into buckets by range of ids, and are put in place when all have come. Nothing is held but the buffers of the
//! buckets, and in the end one range of rows.

use super::OutputError;
use crate::spill::{Buckets, SMALLEST_BLOCK, ScratchPlace, SpillFile};
use crate::stitch::VertexFields;
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;

/// Rows handled at a time.
pub(super) const CHUNK: usize = 1 << 14;
/// Rows written at once, on average, below which a tile's rows go into buckets. A write costs as much as some 16 rows.
const SHORT_RUN: usize = 16;

/// Where rows of `WIDTH` bytes go.
pub(super) struct Rows<const WIDTH: usize> {
    /// Where the first row starts in the file.
    start: u64,
    /// Bytes at the start of a row that are in the file already: buckets need not carry them.
    there: usize,
    count: u64,
    /// Where scattered rows are kept, by range of ids.
    spool: Option<Buckets>,
    scratch: ScratchPlace,
    memory: u64,
}

impl<const WIDTH: usize> Rows<WIDTH> {
    /// Rows for `count` vertices from byte `start` on, of which the first `there` bytes of each are in the file already.
    /// Buckets go to `scratch`, and take `memory` bytes.
    pub fn new(start: u64, there: usize, count: u64, scratch: ScratchPlace, memory: u64) -> Rows<WIDTH> {
        Rows { start, there, count, spool: None, scratch, memory }
    }

    /// The same with buckets elsewhere.
    pub fn with_scratch(self, scratch: ScratchPlace) -> Rows<WIDTH> {
        Rows { scratch, ..self }
    }

    /// The same with another amount of memory.
    pub fn with_memory(self, memory: u64) -> Rows<WIDTH> {
        Rows { memory, ..self }
    }

    /// Takes what `row` makes of `fields`, whose ids ascend, for `file`, which is called `name`.
    pub fn take(
        &mut self,
        (file, name): (&File, &Path),
        fields: &[VertexFields],
        row: impl Fn(&VertexFields) -> [u8; WIDTH],
    ) -> Result<(), OutputError> {
        let runs = fields.chunk_by(|a, b| a.id.0 + 1 == b.id.0).count();
        // A table that fits into memory is sorted there by the system.
        let large = self.count.saturating_mul(WIDTH as u64) > self.memory;
        if large && fields.len() < SHORT_RUN * runs {
            return self.keep(fields, row);
        }
        let failed = OutputError::io(name, "cannot write");
        let mut bytes = Vec::new();
        // Runs without a gap are written at once.
        for run in fields.chunk_by(|a, b| a.id.0 + 1 == b.id.0) {
            for part in run.chunks(CHUNK) {
                bytes.clear();
                part.iter().for_each(|v| bytes.extend(row(v)));
                let at = self.start + part[0].id.0 * WIDTH as u64;
                file.write_all_at(&bytes, at).map_err(&failed)?;
            }
        }
        Ok(())
    }

    /// Keeps rows in buckets.
    fn keep(
        &mut self,
        fields: &[VertexFields],
        row: impl Fn(&VertexFields) -> [u8; WIDTH],
    ) -> Result<(), OutputError> {
        let range = self.range();
        let spool = match &mut self.spool {
            Some(spool) => spool,
            none => {
                let count = self.count.div_ceil(range) as usize;
                none.insert(Buckets::create(&self.scratch.dir()?, "rows", count, self.memory))
            }
        };
        let mut kept = Vec::with_capacity(8 + WIDTH);
        for v in fields {
            kept.clear();
            kept.extend(v.id.0.to_le_bytes());
            kept.extend(&row(v)[self.there..]);
            spool.write((v.id.0 / range) as usize, &kept)?;
        }
        Ok(())
    }

    /// Rows of a bucket: they fit into the memory in the end, and buckets of the least size fit into it before.
    fn range(&self) -> u64 {
        let fits = self.memory / WIDTH as u64;
        fits.max(self.count.saturating_mul(SMALLEST_BLOCK as u64) / self.memory.max(1)).max(CHUNK as u64)
    }

    /// Whether there are rows that are not in place.
    pub fn scattered(&self) -> bool {
        self.spool.is_some()
    }

    /// Reads all rows from `file`, which is called `name`, and hands them to `visit` by ranges of ids, each with its first id
    /// and the byte where it lies in the file.
    pub fn finish(
        mut self,
        (file, name): (&File, &Path),
        mut visit: impl FnMut(u64, u64, &mut [u8]) -> Result<(), OutputError>,
    ) -> Result<(), OutputError> {
        let failed = OutputError::io(name, "cannot read");
        let range = if self.scattered() { self.range() } else { CHUNK as u64 };
        let files = self.spool.take().map(Buckets::finish).transpose()?;
        let mut kept = files.into_iter().flatten();
        let mut buffer = vec![0u8; self.count.min(range) as usize * WIDTH];
        let mut first = 0;
        while first < self.count {
            let count = (self.count - first).min(range);
            let chunk = &mut buffer[..count as usize * WIDTH];
            let at = self.start + first * WIDTH as u64;
            file.read_exact_at(chunk, at).map_err(&failed)?;
            if let Some(rows) = kept.next() {
                self.insert(&rows, first, chunk)?;
            }
            visit(first, at, chunk)?;
            first += count;
        }
        Ok(())
    }

    /// Puts the rows of a bucket into the rows from `first` on.
    fn insert(&self, kept: &SpillFile, first: u64, rows: &mut [u8]) -> Result<(), OutputError> {
        let mut reader = kept.reader()?;
        while let Some(block) = reader.next_block()? {
            for row in block.chunks_exact(8 + WIDTH - self.there) {
                let (id, values) = row.split_at(8);
                let mut raw = [0; 8];
                raw.copy_from_slice(id);
                let at = (u64::from_le_bytes(raw) - first) as usize * WIDTH;
                rows[at + self.there..at + WIDTH].copy_from_slice(values);
            }
        }
        Ok(())
    }
}
