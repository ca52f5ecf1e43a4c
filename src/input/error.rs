//! What can be wrong with an input, with the place in the file and what to do about it.

use crate::spill::SpillError;
use std::fmt;
use std::io;
use std::path::PathBuf;

/// Where in a file something is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputPlace {
    /// A line of a text, counted from 1.
    Line(u64),
    /// A byte of a binary file, counted from 0; of a packed one, as it is when unpacked.
    Byte(u64),
}

impl fmt::Display for InputPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            InputPlace::Line(line) => write!(f, "line {line}"),
            InputPlace::Byte(byte) => write!(f, "byte {byte}"),
        }
    }
}

/// An input that cannot be read or that is not a mesh.
#[derive(Debug, thiserror::Error)]
pub enum InputError {
    /// The operating system refused.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file is not what it was when it was opened.
    #[error("{path}: the file changed while it was read: {reason}; run again when nobody writes to it, or on a copy", path = path.display())]
    Changed {
        /// The file.
        path: PathBuf,
        /// What is different.
        reason: String,
    },
    /// The file is not the one that a job was planned for.
    #[error("{path}: not the file that the job was planned for: {reason}; put that in its place, or plan the job again", path = path.display())]
    NotPlanned {
        /// The file.
        path: PathBuf,
        /// What is different.
        reason: String,
    },
    /// The path names a directory, a pipe, a device.
    #[error("{path}: not a regular file", path = path.display())]
    NotAFile {
        /// The path as given.
        path: PathBuf,
    },
    /// The file is not in a format that is read here.
    #[error("{path}: {reason}", path = path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong and what to do.
        reason: String,
    },
    /// The file ends before what its header announces.
    #[error("{path}: the file is truncated: element `{element}` needs {needed} bytes from offset {offset} on, but the file has {length}", path = path.display())]
    Truncated {
        /// The file.
        path: PathBuf,
        /// The element that does not fit.
        element: String,
        /// Where that element starts, in bytes.
        offset: u64,
        /// How many bytes it needs at least.
        needed: u64,
        /// Length of the file in bytes.
        length: u64,
    },
    /// A face names a vertex that does not exist.
    #[error("{path}: face {face} at byte {offset} names vertex {index}, but the file has {vertices} vertices; repair the mesh, or leave such faces out with --bad-faces skip", path = path.display())]
    IndexOutOfRange {
        /// The file.
        path: PathBuf,
        /// The record of element `face`, counted from 0 before polygons are cut.
        face: u64,
        /// Where its record starts, in bytes.
        offset: u64,
        /// What it names.
        index: i64,
        /// How many vertices there are.
        vertices: u64,
    },
    /// A record with lists cannot be read as what the header says.
    #[error("{path}: record {record} of element `{element}` at byte {offset}: {reason}", path = path.display())]
    BadRecord {
        /// The file.
        path: PathBuf,
        /// The element the record belongs to.
        element: String,
        /// The record, counted from 0 within its element.
        record: u64,
        /// Where it starts, in bytes.
        offset: u64,
        /// What is wrong with it.
        reason: String,
    },
    /// A file that is read from its start to its end makes no sense at some place.
    #[error("{path}: {place}: {reason}", path = path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Where it is.
        place: InputPlace,
        /// What is wrong there, and what to do.
        reason: String,
    },
    /// A face given in memory names a vertex that does not exist.
    #[error("face {face} names vertex {index}, but only {vertices} vertices were given")]
    MemoryIndex {
        /// The face, counted from 0.
        face: u64,
        /// What it names.
        index: u32,
        /// How many positions were given.
        vertices: u64,
    },
    /// A copy of the mesh in temporary files failed.
    #[error(transparent)]
    Spill(#[from] SpillError),
    /// Somebody wants the run to end; not a fault of the input.
    #[error("stopped")]
    Stopped,
    /// The caller asked for something the mesh does not have.
    #[error("{name}: {what} {index} was asked for, but there are only {count}")]
    NoSuch {
        /// The mesh.
        name: String,
        /// What was asked for: `vertex` or `block`.
        what: &'static str,
        /// Which one.
        index: u64,
        /// How many there are.
        count: u64,
    },
    /// A coordinate is NaN, infinite, or too large to be multiplied.
    #[error("{path}: vertex {vertex} at byte {offset} has the position ({x}, {y}, {z}): coordinates must be finite and below 1e75 in magnitude; repair the mesh, or leave out the faces that use such vertices with --bad-faces skip", path = path.display())]
    BadCoordinate {
        /// The file.
        path: PathBuf,
        /// The vertex.
        vertex: u64,
        /// Where its record starts, in bytes.
        offset: u64,
        /// As read.
        x: f64,
        /// As read.
        y: f64,
        /// As read.
        z: f64,
    },
}
