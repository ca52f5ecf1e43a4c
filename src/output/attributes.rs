//! The table of all vertices in input order, as binary PLY; `docs/FORMATS.md` says what each field means.
//!
//! Tiles finish in any order and own vertices all over the file, but every record has the same size: its place follows
//! from its id. A first sequential pass writes the positions, with zeros for vertices that no face uses; tiles write
//! theirs into place; a last pass divides the saliency by its maximum, which is known only then. Nothing is held in
//! memory beyond one buffer.

use super::part_file::PartFile;
use super::{FieldSink, OutputError};
use crate::error::Error;
use crate::input::MeshSource;
use crate::mesh::VertexId;
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

/// The table while it is being written.
pub struct AttributeFile {
    part: PartFile,
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
        Ok(AttributeFile { part, start: header.len() as u64, vertices })
    }

    /// Divides the saliency by `largest` and gives the file its name.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(self, largest: f64) -> Result<(), OutputError> {
        let failed = OutputError::io(self.part.target(), "cannot write");
        let mut buffer = vec![0u8; CHUNK * RECORD];
        let mut first = 0;
        while first < self.vertices && largest > 0.0 {
            let count = (self.vertices - first).min(CHUNK as u64);
            let chunk = &mut buffer[..count as usize * RECORD];
            let at = self.start + first * RECORD as u64;
            self.part.file().read_exact_at(chunk, at).map_err(&failed)?;
            for record in chunk.chunks_exact_mut(RECORD) {
                let mut bytes = [0; 8];
                bytes.copy_from_slice(&record[SALIENCY..SALIENCY + 8]);
                let saliency = f64::from_le_bytes(bytes) / largest;
                record[SALIENCY..SALIENCY + 8].copy_from_slice(&saliency.to_le_bytes());
            }
            self.part.file().write_all_at(chunk, at).map_err(&failed)?;
            first += count;
        }
        self.part.commit()
    }
}

impl FieldSink for AttributeFile {
    fn take(&mut self, fields: &[VertexFields]) -> Result<(), OutputError> {
        let failed = OutputError::io(self.part.target(), "cannot write");
        let mut bytes = Vec::new();
        // Ids ascend; runs without a gap are written at once.
        for run in fields.chunk_by(|a, b| a.id.0 + 1 == b.id.0) {
            for part in run.chunks(CHUNK) {
                bytes.clear();
                for v in part {
                    let [l1, l2, l3] = v.eigenvalues;
                    bytes.extend(record(v.position, [l1, l2, l3, v.omega, v.salience], v.class));
                }
                let at = self.start + part[0].id.0 * RECORD as u64;
                self.part.file().write_all_at(&bytes, at).map_err(&failed)?;
            }
        }
        Ok(())
    }
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
