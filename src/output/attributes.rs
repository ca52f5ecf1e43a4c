//! The table of all vertices in input order, as binary PLY; `docs/FORMATS.md` says what each field means.
//!
//! A first sequential pass writes the positions, with zeros for vertices that no face uses; tiles write theirs into place
//! ([`super::rows`]); a last pass divides the saliency by its maximum, which is known only then.

use super::part_file::{PartFile, directory_of};
use super::rows::{CHUNK, Rows};
use super::{FieldSink, OutputError};
use crate::error::Error;
use crate::input::MeshSource;
use crate::mesh::VertexId;
use crate::spill::ScratchPlace;
use crate::stitch::{Class, VertexFields};
use glam::DVec3;
use std::io::{BufWriter, Write};
use std::os::unix::fs::FileExt;
use std::path::Path;

/// Bytes of a record: eight doubles and the class.
const RECORD: usize = 65;
/// Where the saliency lies in a record.
const SALIENCY: usize = 56;
/// Memory for rows that are not in place, if nothing else is said.
const SPOOL_MEMORY: u64 = 32 << 20;
/// Bytes of the position in a record.
const POSITION: usize = 24;

/// The table while it is being written.
pub struct AttributeFile {
    part: PartFile,
    rows: Rows<RECORD>,
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
        let rows = Rows::new(header.len() as u64, POSITION, vertices, scratch, SPOOL_MEMORY);
        Ok(AttributeFile { part, rows })
    }

    /// Chooses where temporary files go; the default is the directory of the table.
    pub fn with_scratch(self, scratch: ScratchPlace) -> AttributeFile {
        AttributeFile { rows: self.rows.with_scratch(scratch), ..self }
    }

    /// Chooses how many bytes of memory scattered rows may take; 32 MiB if nothing is said.
    pub fn with_memory(self, bytes: u64) -> AttributeFile {
        AttributeFile { rows: self.rows.with_memory(bytes), ..self }
    }

    /// Divides the saliency by `largest` and gives the file its name.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(self, largest: f64) -> Result<(), OutputError> {
        self.stage(largest)?.commit()
    }

    /// Divides the saliency by `largest`. What is returned becomes the table when it is committed: for outputs that must appear
    /// together.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn stage(self, largest: f64) -> Result<PartFile, OutputError> {
        let AttributeFile { part, rows } = self;
        if largest > 0.0 || rows.scattered() {
            let failed = OutputError::io(part.target(), "cannot write");
            rows.finish((part.file(), part.target()), |_, at, chunk| {
                if largest > 0.0 {
                    normalise(chunk, largest);
                }
                part.file().write_all_at(chunk, at).map_err(&failed)
            })?;
        }
        Ok(part)
    }
}

impl FieldSink for AttributeFile {
    fn take(&mut self, fields: &[VertexFields]) -> Result<(), OutputError> {
        self.rows.take((self.part.file(), self.part.target()), fields, record_of)
    }
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
