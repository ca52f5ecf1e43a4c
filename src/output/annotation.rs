//! The mesh as it was, with what was found at each vertex: `docs/FORMATS.md` says what each property means.
//!
//! In: a mesh that is read in place, the fields of its vertices, and the lines. Out: a copy of the file in which every vertex has
//! three more properties; all other properties, elements and comments are copied byte for byte. Saliency and class are kept
//! in a temporary file, a row for each vertex ([`super::rows`]), until the lines are known. Then each vertex is joined
//! with the first line through it: places on lines are sorted by vertex, and run along the vertices as the file is
//! copied.

use super::rows::Rows;
use super::{FieldSink, OutputError, PartFile};
use crate::error::Error;
use crate::input::{MeshSource, PlySource};
use crate::mesh::VertexId;
use crate::spill::{Record, ScratchPlace, SizedFile, Sorted, Sorter};
use crate::stitch::{LineSource, LineVertex, StitchError, VertexFields};
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// The properties that are added, as they stand in the header.
const ADDED: [(&str, &str); 3] = [("double", "saliency"), ("uchar", "class"), ("int", "line")];
/// Bytes of a row: saliency and class.
const ROW: usize = 9;
/// No line goes through the vertex.
const NO_LINE: i32 = -1;
/// Memory for rows that are not in place, and then for sorting places, if nothing else is said.
const MEMORY: u64 = 32 << 20;

/// An annotated mesh while it is being made.
pub struct Annotation<'a> {
    mesh: &'a PlySource,
    part: PartFile,
    scratch: ScratchPlace,
    memory: u64,
    /// Made with the first rows.
    rows: Option<(SizedFile, Rows<ROW>)>,
}

impl<'a> Annotation<'a> {
    /// Begins a copy of `mesh`. Temporary files go to `scratch`.
    ///
    /// # Errors
    /// If the vertices of the mesh have such properties already, or the file cannot be created.
    pub fn create(
        target: &Path,
        mesh: &'a PlySource,
        scratch: ScratchPlace,
    ) -> Result<Annotation<'a>, OutputError> {
        let there = mesh.vertex_element().map_or(&[][..], |element| &element.properties);
        if let Some((_, name)) = ADDED.iter().find(|(_, name)| there.iter().any(|p| p.name == *name)) {
            let path = mesh.path().to_owned();
            return Err(OutputError::PropertyExists { path, property: name });
        }
        Ok(Annotation { mesh, part: PartFile::create(target)?, scratch, memory: MEMORY, rows: None })
    }

    /// Chooses how many bytes of memory may be used beside buffers; 32 MiB if nothing is said.
    pub fn with_memory(self, bytes: u64) -> Annotation<'a> {
        Annotation { memory: bytes, ..self }
    }

    /// The rows and their file, which is made if it is not there.
    fn rows(&mut self) -> Result<&mut (SizedFile, Rows<ROW>), OutputError> {
        match &mut self.rows {
            Some(rows) => Ok(rows),
            none => {
                let count = self.mesh.vertex_count();
                let file = SizedFile::create(&self.scratch.dir()?, "fields", count * ROW as u64)?;
                let rows = Rows::new(0, 0, count, self.scratch.clone(), self.memory);
                Ok(none.insert((file, rows)))
            }
        }
    }

    /// Copies the mesh with what was found. What is returned becomes the annotated mesh when it is committed: for outputs that
    /// must appear together.
    ///
    /// # Errors
    /// If the mesh or the lines cannot be read, there are more lines than the property can count, or the file cannot be written.
    pub fn stage(mut self, lines: &dyn LineSource) -> Result<PartFile, Error> {
        let count = lines.counts().lines;
        if count > i32::MAX as u64 {
            let path = self.part.target().to_owned();
            return Err(OutputError::TooLarge { path, count, what: "lines" }.into());
        }
        self.rows()?;
        let Annotation { mesh, part, scratch, memory, rows } = self;
        let visits = visits(lines, memory, &scratch)?;
        let mut first_lines = FirstLines::new(lines, &visits)?;
        let mut out = Out { part: &part, buffer: BufWriter::with_capacity(1 << 20, part.file()) };
        let added = ADDED.map(|(kind, name)| format!("property {kind} {name}"));
        out.put(&mesh.header_with(&added.each_ref().map(String::as_str))?)?;
        let mut raw = mesh.raw();
        raw.before(|bytes| out.put(bytes))?;
        let largest = lines.largest_salience();
        // What goes wrong with the mesh is no error of an output: it comes out beside the rows.
        let mut failure = None;
        if let Some((file, rows)) = rows {
            let copied = rows.finish((file.file(), file.path()), |first, _, chunk| {
                for (id, row) in (first..).zip(chunk.chunks_exact(ROW)) {
                    if let Err(error) = raw.record(|bytes| out.put(bytes)) {
                        failure = Some(error);
                        return Err(stopped(&part));
                    }
                    let line = first_lines.at(VertexId(id))?;
                    out.bytes(&annotation(row, largest, line))?;
                }
                Ok(())
            });
            if let Some(error) = failure {
                return Err(error);
            }
            copied?;
        }
        raw.behind(|bytes| out.put(bytes))?;
        out.finish()?;
        // A mesh that was changed meanwhile is no copy of anything.
        mesh.unchanged()?;
        Ok(part)
    }
}

impl FieldSink for Annotation<'_> {
    fn take(&mut self, fields: &[VertexFields]) -> Result<(), OutputError> {
        let (file, rows) = self.rows()?;
        rows.take((file.file(), file.path()), fields, |v| {
            let mut row = [0; ROW];
            row[..8].copy_from_slice(&v.salience.to_le_bytes());
            row[8] = v.class as u8;
            row
        })
    }
}

/// What ends the copying of rows when the mesh cannot be read; nobody sees it.
fn stopped(part: &PartFile) -> OutputError {
    OutputError::io(part.target(), "cannot write")(std::io::ErrorKind::Interrupted.into())
}

/// The bytes that are added to a record.
fn annotation(row: &[u8], largest: f64, line: i32) -> [u8; 13] {
    let mut bytes = [0; 13];
    let mut salience = [0; 8];
    salience.copy_from_slice(&row[..8]);
    let saliency = match largest > 0.0 {
        true => f64::from_le_bytes(salience) / largest,
        false => 0.0,
    };
    bytes[..8].copy_from_slice(&saliency.to_le_bytes());
    bytes[8] = row[8];
    bytes[9..].copy_from_slice(&line.to_le_bytes());
    bytes
}

/// Where a line runs through a vertex; vertices by their rank among those on lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
struct Visit {
    rank: u64,
    line: u32,
}

impl Record for Visit {
    fn order(&self, other: &Self) -> Ordering {
        self.cmp(other)
    }
}

/// All places on lines, by vertex and line.
fn visits(lines: &dyn LineSource, memory: u64, scratch: &ScratchPlace) -> Result<Sorted<Visit>, OutputError> {
    let mut sorter = Sorter::new("through", memory, scratch);
    for (id, line) in (0u32..).zip(lines.lines()) {
        for rank in line?.vertices {
            sorter.push(Visit { rank, line: id })?;
        }
    }
    Ok(sorter.finish()?)
}

/// The first line through each vertex, for vertices by ascending id.
struct FirstLines<'a> {
    next: Option<(VertexId, i32)>,
    rest: Box<dyn Iterator<Item = Result<(VertexId, i32), OutputError>> + 'a>,
}

impl<'a> FirstLines<'a> {
    fn new(lines: &'a dyn LineSource, visits: &'a Sorted<Visit>) -> Result<FirstLines<'a>, OutputError> {
        let mut visits = visits.iter()?.peekable();
        let first_of = move |(rank, vertex): (u64, Result<LineVertex, StitchError>)| {
            let id = vertex?.id;
            let mut line = NO_LINE;
            // The lowest comes first.
            while let Some(visit) = visits.next_if(|v| v.as_ref().map_or(true, |v| v.rank == rank)) {
                let visit = visit?;
                if line == NO_LINE {
                    line = visit.line as i32;
                }
            }
            Ok((id, line))
        };
        let mut rest = (0u64..).zip(lines.vertices()).map(first_of);
        let next = rest.next().transpose()?;
        Ok(FirstLines { next, rest: Box::new(rest) })
    }

    /// That of `id`, which is larger than any that was asked for before.
    fn at(&mut self, id: VertexId) -> Result<i32, OutputError> {
        match self.next {
            Some((next, line)) if next == id => {
                self.next = self.rest.next().transpose()?;
                Ok(line)
            }
            _ => Ok(NO_LINE),
        }
    }
}

/// The part, with a buffer.
struct Out<'a> {
    part: &'a PartFile,
    buffer: BufWriter<&'a File>,
}

impl Out<'_> {
    fn bytes(&mut self, bytes: &[u8]) -> Result<(), OutputError> {
        self.buffer.write_all(bytes).map_err(OutputError::io(self.part.target(), "cannot write"))
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), Error> {
        Ok(self.bytes(bytes)?)
    }

    fn finish(mut self) -> Result<(), OutputError> {
        self.buffer.flush().map_err(OutputError::io(self.part.target(), "cannot write"))
    }
}
