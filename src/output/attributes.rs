//! The table of all vertices in input order, as binary PLY; `docs/FORMATS.md` says what each field means.
//!
//! Tiles finish in any order and own vertices all over the file, but every record has the same size: its place follows
//! from its id. A first sequential pass writes the positions, with zeros for vertices that no face uses; tiles write
//! theirs into place; a last pass divides the saliency by its maximum, which is known only then. A tile whose vertices lie
//! all over the file would write them one by one: its rows go into buckets by range of ids, and the last pass takes them
//! from there.

use super::part_file::{PartFile, directory_of};
use super::{FieldSink, OutputError};
use crate::error::Error;
use crate::input::MeshSource;
use crate::mesh::VertexId;
use crate::spill::{Buckets, SMALLEST_BLOCK, ScratchPlace, SpillFile};
use crate::stitch::{Class, VertexFields};
use glam::DVec3;
use std::io::{BufWriter, Write};
use std::os::unix::fs::FileExt;
use std::path::Path;

/// Bytes of a record: eight doubles and the class.
const RECORD: usize = 65;
/// Where the saliency lies in a record.
const SALIENCY: usize = 56;
/// Records handled at a time.
const CHUNK: usize = 1 << 14;

/// Rows written at once, on average, below which a tile's rows go into buckets. A write costs as much as some 16 rows.
const SHORT_RUN: usize = 16;
/// Memory for the buckets while tiles come in, and for one bucket's range of rows in the end.
const SPOOL_MEMORY: u64 = 32 << 20;
/// Bytes of a row in a bucket: id, five numbers, class. The position is there already.
const SPOOLED: usize = 8 + RECORD - POSITION;
/// Bytes of the position in a record.
const POSITION: usize = 24;

/// The table while it is being written.
pub struct AttributeFile {
    part: PartFile,
    /// Where scattered rows are kept, by range of ids.
    spool: Option<Buckets>,
    scratch: ScratchPlace,
    memory: u64,
    /// Length of the header.
    start: u64,
    vertices: u64,
}

impl AttributeFile {
    /// Begins the table: header, and the position of every vertex of `source`.
    ///
    /// # Errors
    /// If the source cannot be read or the file cannot be written.
    pub fn create(target: &Path, source: &dyn MeshSource) -> Result<AttributeFile, Error> {
        let vertices = source.vertex_count();
        let header = format!(
            "ply\nformat binary_little_endian 1.0\ncomment vertex attributes found by crease\n\
             element vertex {vertices}\nproperty double x\nproperty double y\nproperty double z\n\
             property double l1\nproperty double l2\nproperty double l3\n\
             property double omega\nproperty double saliency\nproperty uchar class\nend_header\n"
        );
        let part = PartFile::create(target)?;
        let failed = OutputError::io(target, "cannot write");
        let mut out = BufWriter::with_capacity(1 << 20, part.file());
        out.write_all(header.as_bytes()).map_err(&failed)?;
        let mut positions = Vec::new();
        let mut first = 0;
        while first < vertices {
            let count = (vertices - first).min(CHUNK as u64);
            positions.clear();
            source.read_positions(VertexId(first), count as usize, &mut positions)?;
            for &position in &positions {
                out.write_all(&record(position, [0.0; 5], Class::Face)).map_err(&failed)?;
            }
            first += count;
        }
        out.flush().map_err(&failed)?;
        drop(out);
        let scratch = ScratchPlace::below(directory_of(target));
        let start = header.len() as u64;
        Ok(AttributeFile { part, spool: None, scratch, memory: SPOOL_MEMORY, start, vertices })
    }

    /// Chooses where temporary files go; the default is the directory of the table.
    pub fn with_scratch(mut self, scratch: ScratchPlace) -> AttributeFile {
        self.scratch = scratch;
        self
    }

    /// Chooses how many bytes of memory scattered rows may take; 32 MiB if nothing is said.
    pub fn with_memory(mut self, bytes: u64) -> AttributeFile {
        self.memory = bytes;
        self
    }

    /// Rows of a bucket: they fit into the memory in the end, and buckets of the least size fit into it before.
    fn range(&self) -> u64 {
        let fits = self.memory / RECORD as u64;
        fits.max(self.vertices.saturating_mul(SMALLEST_BLOCK as u64) / self.memory.max(1)).max(CHUNK as u64)
    }

    /// Keeps rows for the last pass.
    fn keep(&mut self, fields: &[VertexFields]) -> Result<(), OutputError> {
        let range = self.range();
        let spool = match &mut self.spool {
            Some(spool) => spool,
            none => {
                let count = self.vertices.div_ceil(range) as usize;
                none.insert(Buckets::create(&self.scratch.dir()?, "rows", count, self.memory))
            }
        };
        let mut row = Vec::with_capacity(SPOOLED);
        for v in fields {
            row.clear();
            row.extend(v.id.0.to_le_bytes());
            row.extend(&record_of(v)[POSITION..]);
            spool.write((v.id.0 / range) as usize, &row)?;
        }
        Ok(())
    }

    /// Divides the saliency by `largest` and gives the file its name.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(self, largest: f64) -> Result<(), OutputError> {
        self.stage(largest)?.commit()
    }

    /// Divides the saliency by `largest`: the file is complete, and has no name yet.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn stage(mut self, largest: f64) -> Result<PartFile, OutputError> {
        let failed = OutputError::io(self.part.target(), "cannot write");
        let range = if self.spool.is_some() { self.range() } else { CHUNK as u64 };
        let files = self.spool.take().map(Buckets::finish).transpose()?;
        let mut kept = files.into_iter().flatten();
        let mut buffer = vec![0u8; self.vertices.min(range) as usize * RECORD];
        let mut first = 0;
        loop {
            let rows = kept.next();
            if first >= self.vertices || (largest <= 0.0 && rows.is_none()) {
                break;
            }
            let count = (self.vertices - first).min(range);
            let chunk = &mut buffer[..count as usize * RECORD];
            let at = self.start + first * RECORD as u64;
            self.part.file().read_exact_at(chunk, at).map_err(&failed)?;
            if let Some(rows) = rows {
                insert(&rows, first, chunk)?;
            }
            if largest > 0.0 {
                normalise(chunk, largest);
            }
            self.part.file().write_all_at(chunk, at).map_err(&failed)?;
            first += count;
        }
        Ok(self.part)
    }
}

impl FieldSink for AttributeFile {
    fn take(&mut self, fields: &[VertexFields]) -> Result<(), OutputError> {
        let runs = fields.chunk_by(|a, b| a.id.0 + 1 == b.id.0).count();
        // A table that fits into memory is sorted there by the system.
        let large = self.vertices.saturating_mul(RECORD as u64) > self.memory;
        if large && fields.len() < SHORT_RUN * runs {
            return self.keep(fields);
        }
        let failed = OutputError::io(self.part.target(), "cannot write");
        let mut bytes = Vec::new();
        // Ids ascend; runs without a gap are written at once.
        for run in fields.chunk_by(|a, b| a.id.0 + 1 == b.id.0) {
            for part in run.chunks(CHUNK) {
                bytes.clear();
                for v in part {
                    bytes.extend(record_of(v));
                }
                let at = self.start + part[0].id.0 * RECORD as u64;
                self.part.file().write_all_at(&bytes, at).map_err(&failed)?;
            }
        }
        Ok(())
    }
}

/// Puts the rows of a bucket into the records from `first` on.
fn insert(rows: &SpillFile, first: u64, records: &mut [u8]) -> Result<(), OutputError> {
    let mut reader = rows.reader()?;
    while let Some(block) = reader.next_block()? {
        for row in block.chunks_exact(SPOOLED) {
            let (id, values) = row.split_at(8);
            let mut raw = [0; 8];
            raw.copy_from_slice(id);
            let at = (u64::from_le_bytes(raw) - first) as usize * RECORD;
            records[at + POSITION..at + RECORD].copy_from_slice(values);
        }
    }
    Ok(())
}

/// Divides the saliency of all records by `largest`.
fn normalise(records: &mut [u8], largest: f64) {
    for record in records.chunks_exact_mut(RECORD) {
        let mut bytes = [0; 8];
        bytes.copy_from_slice(&record[SALIENCY..SALIENCY + 8]);
        let saliency = f64::from_le_bytes(bytes) / largest;
        record[SALIENCY..SALIENCY + 8].copy_from_slice(&saliency.to_le_bytes());
    }
}

fn record_of(v: &VertexFields) -> [u8; RECORD] {
    let [l1, l2, l3] = v.eigenvalues;
    record(v.position, [l1, l2, l3, v.omega, v.salience], v.class)
}

fn record(position: DVec3, values: [f64; 5], class: Class) -> [u8; RECORD] {
    let mut record = [0; RECORD];
    let numbers = position.to_array().into_iter().chain(values);
    for (slot, x) in record.chunks_exact_mut(8).zip(numbers) {
        slot.copy_from_slice(&x.to_le_bytes());
    }
    record[RECORD - 1] = class as u8;
    record
}
