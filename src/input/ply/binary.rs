//! The payload of a binary PLY file, of either byte order, record by record.
//!
//! Records are believed only as far as their bytes were seen to exist.

use super::header::Element;
use super::record::{Shape, Slot};
use super::scalar::ScalarType;
use super::stream::Role;
use crate::input::convert::Gather;
use crate::input::stream::Stream;
use crate::input::{InputError, InputPlace};

/// Reads `elements`; a record has at most `longest` bytes. The most significant byte comes first if `big`.
pub fn read(
    stream: &mut Stream<'_>,
    big: bool,
    longest: usize,
    elements: &[(&Element, Role)],
    out: &mut Gather,
) -> Result<(), InputError> {
    for &(element, role) in elements {
        let mut table =
            Table { element, role, shape: Shape::new(element), big, longest, corners: Vec::new() };
        if !element.properties.is_empty() {
            for record in 0..element.count {
                table.read(record, stream, out)?;
            }
        }
    }
    Ok(())
}

/// The records of one element.
struct Table<'h> {
    element: &'h Element,
    role: Role,
    shape: Shape,
    big: bool,
    longest: usize,
    corners: Vec<u64>,
}

impl Table<'_> {
    /// Reads the next record, which has the number `record`.
    fn read(&mut self, record: u64, stream: &mut Stream<'_>, out: &mut Gather) -> Result<(), InputError> {
        let place = InputPlace::Byte(stream.offset());
        // Where the parts begin, as in `record`; there are few lists in an element.
        let mut anchors = [0; 8];
        let mut many = Vec::new();
        let anchors: &mut [usize] = match self.shape.lists.len() {
            lists @ ..8 => &mut anchors[..=lists],
            lists => {
                many.resize(lists + 1, 0);
                &mut many
            }
        };
        for (part, list) in self.shape.lists.iter().enumerate() {
            let size = list.count.size() as usize;
            let at = anchors[part] + list.lead as usize;
            let bytes = self.need(at + size, record, place, stream, out)?;
            let count = list.count.to_i64(&native(list.count, &bytes[at..], self.big));
            let Ok(count) = usize::try_from(count) else {
                let reason = format!("a list of {} has the negative length {count}", self.describe(record));
                return Err(out.error(place, reason));
            };
            anchors[part + 1] = at + size + count * list.item.size() as usize;
            self.need(anchors[part + 1], record, place, stream, out)?;
        }
        let end = anchors[self.shape.lists.len()] + self.shape.tail as usize;
        let bytes = self.need(end, record, place, stream, out)?;
        match self.role {
            Role::Vertex(coordinates) => {
                let position = coordinates.map(|property| match self.shape.slots[property] {
                    Slot::Scalar(at) => {
                        let bytes = &bytes[anchors[at.part] + at.offset as usize..];
                        at.kind.to_f64(&native(at.kind, bytes, self.big))
                    }
                    Slot::List(_) => f64::NAN,
                });
                out.vertex(place, position)?;
            }
            Role::Face(property) => {
                self.corners.clear();
                if let Slot::List(part) = self.shape.slots[property] {
                    let list = self.shape.lists[part];
                    let first = anchors[part] + (list.lead + list.count.size()) as usize;
                    let items = bytes[first..anchors[part + 1]].chunks_exact(list.item.size() as usize);
                    for item in items {
                        let index = list.item.to_i64(&native(list.item, item, self.big));
                        let Ok(index) = u64::try_from(index) else {
                            return Err(out.error(place, format!("face {record} names vertex {index}")));
                        };
                        self.corners.push(index);
                    }
                }
                out.polygon(place, &self.corners)?;
            }
            Role::Other => {}
        }
        stream.consume(end);
        Ok(())
    }

    fn describe(&self, record: u64) -> String {
        format!("record {record} of element `{}`", self.element.name)
    }

    /// At least `count` bytes from the start of the record on.
    #[inline]
    fn need<'s>(
        &self,
        count: usize,
        record: u64,
        place: InputPlace,
        stream: &'s mut Stream<'_>,
        out: &Gather,
    ) -> Result<&'s [u8], InputError> {
        // The length of a packed file is not known.
        let left = stream.length().map(|length| length.saturating_sub(stream.offset()));
        let beyond = left.is_some_and(|left| count as u64 > left);
        if count > self.longest && !beyond {
            let what = self.describe(record);
            let reason = format!(
                "{what} has {count} bytes or more: the file is damaged; if it is right, allow more with --memory"
            );
            return Err(out.error(place, reason));
        }
        let bytes = stream.peek(if beyond { 0 } else { count })?;
        if beyond || bytes.len() < count {
            let left = left.unwrap_or(bytes.len() as u64);
            let (what, all) = (self.describe(record), self.element.count);
            let reason = format!(
                "the file is truncated: {what}, of {all}, needs {count} bytes or more, and {left} are left; it is cut off or damaged"
            );
            return Err(out.error(place, reason));
        }
        Ok(bytes)
    }
}

/// The number at the start of `bytes`, least significant byte first.
#[inline]
fn native(kind: ScalarType, bytes: &[u8], big: bool) -> [u8; 8] {
    let size = kind.size() as usize;
    let mut raw = [0; 8];
    raw[..size].copy_from_slice(&bytes[..size]);
    if big {
        raw[..size].reverse();
    }
    raw
}
