//! PLY files of all encodings, from start to end.
//!
//! In: a stream. Out: its vertices and polygons, as [`PlySource`](super::PlySource) would hand them out if the same mesh were
//! binary little-endian. Elements that come before the later of the two are passed over; what follows is not looked at.

use super::header::{Element, Encoding, Header, PropertyKind};
use super::scalar::ScalarType;
use super::{Needs, ascii, binary};
use crate::input::InputError;
use crate::input::convert::Gather;
use crate::input::stream::Stream;

/// What an element is needed for.
#[derive(Clone, Copy, Debug)]
pub enum Role {
    /// Positions: the properties x, y and z.
    Vertex([usize; 3]),
    /// Polygons: the property with the corners.
    Face(usize),
    /// Nothing but to get past it.
    Other,
}

/// Whether `stream`, a PLY file of which nothing has been consumed, could be read in place if it were not packed.
pub fn is_in_place(stream: &mut Stream<'_>) -> Result<bool, InputError> {
    Ok(Header::peek(stream)?.encoding == Encoding::BinaryLittleEndian)
}

/// Reads the whole file; what must be in memory of it at a time has at most `longest` bytes.
pub fn read(stream: &mut Stream<'_>, longest: usize, out: &mut Gather) -> Result<(), InputError> {
    let (header, lines) = Header::take(stream)?;
    let count = |name: &str| header.elements.iter().filter(|e| e.name == name).map(|e| e.count).max();
    if count("vertex").unwrap_or(0) == 0 && count("face").unwrap_or(0) == 0 {
        // An empty tile among others; if there are no others, the caller says so.
        return Ok(());
    }
    let refused = |reason| InputError::Format { path: stream.path().to_owned(), reason };
    let needs = Needs::find(&header).map_err(refused)?;
    let last = needs.vertex.max(needs.face);
    let elements = header.elements.iter().enumerate().take(last + 1).map(|(index, element)| {
        let role = match index {
            i if i == needs.vertex => Role::Vertex(needs.coordinates),
            i if i == needs.face => Role::Face(needs.indices),
            _ => Role::Other,
        };
        (element, role)
    });
    let elements: Vec<(&Element, Role)> = elements.collect();
    elements.iter().try_for_each(|(element, _)| check_lengths(element)).map_err(refused)?;
    match header.encoding {
        Encoding::Ascii => ascii::read(stream, lines + 1, longest, &elements, out),
        Encoding::BinaryBigEndian => binary::read(stream, true, longest, &elements, out),
        Encoding::BinaryLittleEndian => binary::read(stream, false, longest, &elements, out),
    }
}

/// The file format allows lists whose length is a float; there is no way to walk them.
fn check_lengths(element: &Element) -> Result<(), String> {
    for property in &element.properties {
        if let PropertyKind::List { count: count @ (ScalarType::F32 | ScalarType::F64), .. } = property.kind {
            return Err(format!(
                "the list `{}` of element `{}` has a length of type {count}; re-save the file with a list length of an \
                 integer type",
                property.name, element.name
            ));
        }
    }
    Ok(())
}
