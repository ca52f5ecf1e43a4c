//! The shape of an element's records, and walking from one record to the next.
//!
//! In: the properties of an element. Out: for elements without lists the one size of all records; for the others a
//! way to step over a record, which yields *anchors*: the offsets at which the parts of fixed size start. Part 0
//! starts with the record, part `k` right after the `k`-th list, so a scalar is found at a fixed distance from the
//! anchor of its part. Lists are believed only after their items were seen to lie inside the file.

use super::header::{Element, PropertyKind};
use super::scalar::ScalarType;
use crate::input::{ByteSource, InputError};
use serde::{Deserialize, Serialize};

/// A list property: how to find its length and its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct List {
    /// Bytes between the anchor of its part and its length.
    pub lead: u64,
    /// Type of its length.
    pub count: ScalarType,
    /// Type of its items.
    pub item: ScalarType,
}

/// Where a scalar lies in a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Place {
    /// Number of lists before it.
    pub part: usize,
    /// Bytes from the anchor of its part.
    pub offset: u64,
    /// Its type.
    pub kind: ScalarType,
}

/// Where a property lies in a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Slot {
    /// A number.
    Scalar(Place),
    /// The list of that position among the lists.
    List(usize),
}

/// What all records of an element have in common.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Shape {
    pub lists: Vec<List>,
    /// Bytes after the last list; the whole record if there is no list.
    pub tail: u64,
    /// One per property, in the order of the header.
    pub slots: Vec<Slot>,
}

impl Shape {
    /// The shape of the records of `element`. Cannot overflow: a header of one MiB has less than 2^20 properties.
    pub fn new(element: &Element) -> Self {
        let mut shape = Self { lists: Vec::new(), tail: 0, slots: Vec::new() };
        for property in &element.properties {
            match property.kind {
                PropertyKind::Scalar(kind) => {
                    let place = Place { part: shape.lists.len(), offset: shape.tail, kind };
                    shape.slots.push(Slot::Scalar(place));
                    shape.tail += kind.size();
                }
                PropertyKind::List { count, item } => {
                    shape.slots.push(Slot::List(shape.lists.len()));
                    shape.lists.push(List { lead: shape.tail, count, item });
                    shape.tail = 0;
                }
            }
        }
        shape
    }

    /// Size of every record, if there are no lists.
    pub fn fixed_size(&self) -> Option<u64> {
        self.lists.is_empty().then_some(self.tail)
    }

    /// Size of a record whose lists are all empty.
    pub fn least_size(&self) -> u64 {
        self.tail + self.lists.iter().map(|list| list.lead + list.count.size()).sum::<u64>()
    }

    /// Steps over the record at `at`: replaces `anchors` by one offset per part and returns where the record ends.
    ///
    /// # Errors
    /// [`Fault::Record`] if a list is negative or ends behind the file, [`Fault::Input`] if the file cannot be read.
    pub fn walk(&self, at: u64, window: &mut Window<'_>, anchors: &mut Vec<u64>) -> Result<u64, Fault> {
        anchors.clear();
        anchors.push(at);
        let mut anchor = at;
        for list in &self.lists {
            let (start, count) = list.open(anchor, window)?;
            // The length has at most 32 bits and an item at most 8 bytes.
            anchor = start
                .checked_add(count * list.item.size())
                .filter(|&end| end <= window.source.len())
                .ok_or_else(|| {
                    Fault::Record(format!(
                        "its list of {count} items runs past the end of the file, which has {} bytes: the file is cut off or damaged",
                        window.source.len()
                    ))
                })?;
            anchors.push(anchor);
        }
        anchor
            .checked_add(self.tail)
            .filter(|&end| end <= window.source.len())
            .ok_or_else(|| Fault::past_end(window))
    }
}

impl List {
    /// Reads the length of the list whose part starts at `anchor`; returns where its items start and how many.
    fn open(&self, anchor: u64, window: &mut Window<'_>) -> Result<(u64, u64), Fault> {
        let size = self.count.size();
        let at = anchor.checked_add(self.lead);
        let start = at.and_then(|at| at.checked_add(size)).filter(|&start| start <= window.source.len());
        let (Some(at), Some(start)) = (at, start) else {
            return Err(Fault::past_end(window));
        };
        let count = self.count.to_i64(window.at(at, size).map_err(Fault::Input)?);
        match u64::try_from(count) {
            Ok(count) => Ok((start, count)),
            Err(_) => Err(Fault::Record(format!("its list has the negative length {count}"))),
        }
    }

    /// Where the items start and how many there are, from the anchors of its part and the next one.
    pub fn items(&self, anchor: u64, next: u64) -> (u64, u64) {
        let start = anchor + self.lead + self.count.size();
        (start, (next - start) / self.item.size())
    }
}

/// Why a record could not be walked; the caller knows which record it was.
#[derive(Debug)]
pub(super) enum Fault {
    /// Its bytes could not be read.
    Input(InputError),
    /// Its bytes make no sense.
    Record(String),
}

impl Fault {
    fn past_end(window: &Window<'_>) -> Self {
        Self::Record(format!(
            "it runs past the end of the file, which has {} bytes: the file is cut off or damaged",
            window.source.len()
        ))
    }

    /// The error for the record it happened in.
    pub fn at(self, source: &ByteSource, element: &str, record: u64, offset: u64) -> InputError {
        match self {
            Self::Input(error) => error,
            Self::Record(reason) => InputError::BadRecord {
                path: source.path().to_owned(),
                element: element.to_owned(),
                record,
                offset,
                reason,
            },
        }
    }
}

/// Small reads at ascending offsets: straight from the map, or from a buffer that is refilled where needed.
pub(super) struct Window<'a> {
    source: &'a ByteSource,
    /// Nothing behind it is read ahead.
    until: u64,
    ahead: u64,
    start: u64,
    buffer: Vec<u8>,
}

impl<'a> Window<'a> {
    /// A window that reads `ahead` bytes at a time, but not ahead of `until`.
    pub fn new(source: &'a ByteSource, until: u64, ahead: u64) -> Self {
        Self { source, until: until.min(source.len()), ahead, start: 0, buffer: Vec::new() }
    }

    /// The `len` bytes at `offset`.
    ///
    /// # Errors
    /// If they are not inside the file, or cannot be read.
    #[inline]
    pub fn at(&mut self, offset: u64, len: u64) -> Result<&[u8], InputError> {
        if self.source.mapped().is_some() {
            // Records come behind a header, so that nothing was announced yet if the start is 0.
            if self.start == 0 || offset < self.start || offset - self.start >= self.ahead {
                self.source.will_read(offset, self.ahead.min(self.until.saturating_sub(offset)));
                self.start = offset;
            }
            return self.source.bytes(offset, len, &mut self.buffer);
        }
        let held = |start: u64, buffer: &[u8]| {
            let from = usize::try_from(offset.checked_sub(start)?).ok()?;
            let to = from.checked_add(usize::try_from(len).ok()?)?;
            (to <= buffer.len()).then_some(from..to)
        };
        let range = match held(self.start, &self.buffer) {
            Some(range) => range,
            None => {
                let ahead = self.ahead.min(self.until.saturating_sub(offset));
                // An empty buffer must not be taken for content if the read fails.
                self.start = offset;
                if let Err(error) = self.source.read_into(offset, ahead.max(len), &mut self.buffer) {
                    self.buffer.clear();
                    return Err(error);
                }
                0..len as usize
            }
        };
        Ok(&self.buffer[range])
    }
}

#[cfg(test)]
mod tests {
    use super::super::header::Property;
    use super::*;
    use crate::input::IoMode;

    fn element(kinds: &[PropertyKind]) -> Element {
        let properties = kinds.iter().map(|&kind| Property { name: "p".to_owned(), kind }).collect();
        Element { name: "e".to_owned(), count: 1, properties }
    }

    fn list(count: ScalarType, item: ScalarType) -> PropertyKind {
        PropertyKind::List { count, item }
    }

    #[test]
    fn slots_count_from_the_end_of_the_list_before() {
        use PropertyKind::Scalar;
        use ScalarType::*;
        let shape =
            Shape::new(&element(&[Scalar(F32), Scalar(U8), list(U16, F64), Scalar(I16), Scalar(F64)]));
        assert_eq!(shape.lists, [List { lead: 5, count: U16, item: F64 }]);
        assert_eq!(shape.tail, 10);
        assert_eq!(shape.least_size(), 17);
        assert_eq!(shape.fixed_size(), None);
        assert_eq!(shape.slots[1], Slot::Scalar(Place { part: 0, offset: 4, kind: U8 }));
        assert_eq!(shape.slots[2], Slot::List(0));
        assert_eq!(shape.slots[4], Slot::Scalar(Place { part: 1, offset: 2, kind: F64 }));
        assert_eq!(Shape::new(&element(&[Scalar(F32), Scalar(U8)])).fixed_size(), Some(5));
        assert_eq!(Shape::new(&element(&[])).fixed_size(), Some(0));
    }

    #[test]
    fn a_walk_stops_at_the_end_of_the_file() {
        use ScalarType::*;
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("records");
        // Tag, list of two shorts, list of one char, tail.
        let bytes = [7, 2, 1, 0, 2, 0, 1, 9, 5, 5];
        let shape = Shape::new(&element(&[
            PropertyKind::Scalar(U8),
            list(U8, I16),
            list(I8, I8),
            PropertyKind::Scalar(U16),
        ]));
        for length in 0..=bytes.len() {
            std::fs::write(&path, &bytes[..length]).unwrap();
            for mode in [IoMode::Map, IoMode::Read] {
                let source = ByteSource::open(&path, mode).unwrap();
                let mut anchors = Vec::new();
                let end = shape.walk(0, &mut Window::new(&source, u64::MAX, 3), &mut anchors);
                if length < bytes.len() {
                    assert!(matches!(end, Err(Fault::Record(_))), "{length} bytes");
                } else {
                    assert_eq!(end.unwrap(), 10);
                    assert_eq!(anchors, [0, 6, 8]);
                    assert_eq!(shape.lists[0].items(anchors[0], anchors[1]), (2, 2));
                    assert_eq!(shape.lists[1].items(anchors[1], anchors[2]), (7, 1));
                }
            }
        }
    }

    #[test]
    fn negative_lengths_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("records");
        std::fs::write(&path, [0xff; 16]).unwrap();
        let source = ByteSource::open(&path, IoMode::Read).unwrap();
        for (kind, wrong) in
            [(ScalarType::I8, "-1"), (ScalarType::I32, "-1"), (ScalarType::U32, "past the end")]
        {
            let shape = Shape::new(&element(&[list(kind, ScalarType::U8)]));
            match shape.walk(0, &mut Window::new(&source, u64::MAX, 16), &mut Vec::new()) {
                Err(Fault::Record(reason)) => assert!(reason.contains(wrong), "{reason}"),
                other => panic!("{other:?}"),
            }
        }
    }
}
