//! The polygons that readers found, read back.

use super::gather::{Faces, Gathered, Part};
use crate::input::InputError;
use crate::spill::{SpillError, SpillReader};
use std::io::{ErrorKind, Read};

/// Goes through the polygons of all files, in order.
pub struct Polygons<'a> {
    gathered: &'a Gathered,
    reader: SpillReader<'a>,
    parts: std::slice::Iter<'a, Part>,
    part: Option<&'a Part>,
    /// Polygons of this part that were handed out.
    done: u64,
    bytes: Vec<u8>,
}

impl<'a> Polygons<'a> {
    /// All polygons of `gathered`.
    pub fn new(gathered: &'a Gathered) -> Result<Polygons<'a>, InputError> {
        let mut parts = gathered.parts.iter();
        let part = parts.next();
        Ok(Polygons {
            gathered,
            reader: gathered.polygons.reader()?,
            parts,
            part,
            done: 0,
            bytes: Vec::new(),
        })
    }

    /// Appends the corners of the next polygon to `out`, as places among the vertices of all files; their number, or
    /// `None` if there are no more.
    pub fn next(&mut self, out: &mut Vec<u64>) -> Result<Option<usize>, InputError> {
        let part = loop {
            match self.part {
                None => return Ok(None),
                Some(part) if self.done < part.polygons => break part,
                Some(_) => (self.part, self.done) = (self.parts.next(), 0),
            }
        };
        let first = part.first_vertex;
        self.done += 1;
        if part.faces == Faces::Soup {
            let corner = first + 3 * (self.done - 1);
            out.extend(corner..corner + 3);
            return Ok(Some(3));
        }
        let mut count = [0; 4];
        self.reader.read_exact(&mut count).map_err(|e| self.damaged(e))?;
        // A number that this program wrote, behind a checksum.
        let count = u32::from_le_bytes(count) as usize;
        self.bytes.resize(4 * count, 0);
        self.reader.read_exact(&mut self.bytes).map_err(|e| damaged(self.gathered, e))?;
        let number = |bytes: &[u8]| u64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
        out.extend(self.bytes.chunks_exact(4).map(|bytes| first + number(bytes)));
        Ok(Some(count))
    }

    fn damaged(&self, error: std::io::Error) -> InputError {
        damaged(self.gathered, error)
    }
}

/// What a reader says through [`Read`], as what it is.
fn damaged(gathered: &Gathered, error: std::io::Error) -> InputError {
    let path = gathered.polygons.path().to_owned();
    let kind = error.kind();
    InputError::Spill(match error.downcast::<SpillError>() {
        Ok(error) => error,
        Err(_) if kind == ErrorKind::UnexpectedEof => {
            SpillError::Corrupt { path, offset: gathered.polygons.length(), reason: "a polygon is cut off" }
        }
        Err(source) => SpillError::Io { path, action: "cannot read", source },
    })
}
