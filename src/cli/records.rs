//! Two PLY files compared record by record.
//!
//! In: two binary little-endian files with the same header, comments aside. Out: how many records differ in each property
//! and by how much, and the first place where they do. Both files are read in step, a megabyte at a time.
//!
//! Records with lists have no fixed size; from the first element that has some, the rest of the files is compared byte by
//! byte.

use super::exit::{Exit, Failure};
use super::text::{counted, exact};
use crate::input::ply::{Element, Encoding, Header, PropertyKind, ScalarType};
use crate::input::{ByteSource, InputError, IoMode};
use std::path::Path;

/// Bytes of each file in memory.
const CHUNK: u64 = 1 << 20;

/// A file whose header has been read.
#[derive(Debug)]
pub struct Records {
    source: ByteSource,
    header: Header,
}

impl Records {
    /// Opens a file.
    ///
    /// # Errors
    /// If it cannot be read or is not binary little-endian PLY.
    pub fn open(path: &Path) -> Result<Records, Failure> {
        // Not mapped: both files are read once from front to back.
        let source = ByteSource::open(path, IoMode::Read)?;
        let header = Header::read(&source)?;
        if header.encoding != Encoding::BinaryLittleEndian {
            let reason =
                format!("the file is {}, but only binary little-endian PLY is compared", header.encoding);
            return Err(Failure::about(Exit::BadInput, path, reason));
        }
        Ok(Records { source, header })
    }

    fn truncated(&self, element: &Element, offset: u64, needed: u64) -> InputError {
        let (path, length) = (self.source.path().to_owned(), self.source.len());
        InputError::Truncated { path, element: element.name.clone(), offset, needed, length }
    }
}

/// How the headers of two files differ, one sentence for each difference.
pub fn header_differences(a: &Records, b: &Records) -> Vec<String> {
    let (a, b) = (&a.header.elements, &b.header.elements);
    let mut found = Vec::new();
    let names = |elements: &[Element]| elements.iter().map(|e| e.name.clone()).collect::<Vec<_>>().join(", ");
    if names(a) != names(b) {
        found.push(format!("the elements are {} and {}", names(a), names(b)));
        return found;
    }
    let properties = |element: &Element| {
        element.properties.iter().map(|p| format!("{} {}", p.kind, p.name)).collect::<Vec<_>>().join(", ")
    };
    for (a, b) in a.iter().zip(b) {
        if a.count != b.count {
            let (n, m) = (counted(a.count, "record", "records"), counted(b.count, "record", "records"));
            found.push(format!("element `{}` has {n} and {m}", a.name));
        }
        if a.properties != b.properties {
            let (p, q) = (properties(a), properties(b));
            found.push(format!("element `{}` has the properties {p} and {q}", a.name));
        }
    }
    found
}

/// What differs in one property, over all records.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name of the element.
    pub element: String,
    /// Name of the property.
    pub property: String,
    /// Records of the element.
    pub records: u64,
    /// Records whose bytes differ in this property.
    pub differing: u64,
    /// Largest absolute difference of two numbers.
    pub largest: f64,
    /// Records in which one or both are no number, so that there is no difference to speak of.
    pub undefined: u64,
}

/// What differs in two files with the same header.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Differences {
    /// The first place, and what is there in both files.
    pub first: Option<String>,
    /// Properties that differ.
    pub columns: Vec<Column>,
    /// Bytes that differ in the part that is compared byte by byte, missing ones included.
    pub bytes: u64,
}

/// Compares all records of `a` and `b`, whose headers are the same.
///
/// # Errors
/// If one of them cannot be read or ends before what its header announces.
pub fn compare(a: &Records, b: &Records) -> Result<Differences, InputError> {
    let mut found = Differences::default();
    let (mut at_a, mut at_b) = (a.header.payload, b.header.payload);
    let mut rest = "behind the last element".to_owned();
    for element in &a.header.elements {
        let Some(layout) = Layout::of(element) else {
            rest = format!("from element `{}` on, which has lists", element.name);
            break;
        };
        // More than 64 bits can count is more than any file has.
        let length = element.count.saturating_mul(layout.size);
        for (file, at) in [(a, at_a), (b, at_b)] {
            if length > file.source.len().saturating_sub(at) {
                return Err(file.truncated(element, at, length));
            }
        }
        compare_element((a, at_a), (b, at_b), element, &layout, &mut found)?;
        (at_a, at_b) = (at_a + length, at_b + length);
    }
    compare_bytes((a, at_a), (b, at_b), &rest, &mut found)?;
    Ok(found)
}

/// Where the properties of an element lie in its records.
struct Layout {
    slots: Vec<(u64, ScalarType)>,
    size: u64,
}

impl Layout {
    /// `None` if the records differ in size.
    fn of(element: &Element) -> Option<Layout> {
        let mut layout = Layout { slots: Vec::new(), size: 0 };
        for property in &element.properties {
            let PropertyKind::Scalar(kind) = property.kind else { return None };
            layout.slots.push((layout.size, kind));
            layout.size += kind.size();
        }
        Some(layout)
    }
}

fn compare_element(
    (a, at_a): (&Records, u64),
    (b, at_b): (&Records, u64),
    element: &Element,
    layout: &Layout,
    found: &mut Differences,
) -> Result<(), InputError> {
    if layout.size == 0 {
        return Ok(());
    }
    let mut columns: Vec<Column> = element
        .properties
        .iter()
        .map(|property| Column {
            element: element.name.clone(),
            property: property.name.clone(),
            records: element.count,
            differing: 0,
            largest: 0.0,
            undefined: 0,
        })
        .collect();
    let at_once = (CHUNK / layout.size).max(1);
    let (mut chunk_a, mut chunk_b) = (Vec::new(), Vec::new());
    let mut first = 0;
    while first < element.count {
        let count = (element.count - first).min(at_once);
        let (offset, length) = (first * layout.size, count * layout.size);
        a.source.read_into(at_a + offset, length, &mut chunk_a)?;
        b.source.read_into(at_b + offset, length, &mut chunk_b)?;
        let size = layout.size as usize;
        let pairs = chunk_a.chunks_exact(size).zip(chunk_b.chunks_exact(size));
        for (record, (x, y)) in (first..).zip(pairs).filter(|(_, (x, y))| x != y) {
            for (column, &(offset, kind)) in columns.iter_mut().zip(&layout.slots) {
                let field = offset as usize..(offset + kind.size()) as usize;
                let (x, y) = (&x[field.clone()], &y[field]);
                if x != y {
                    column.add(number(kind, x), number(kind, y));
                    found.first.get_or_insert_with(|| {
                        let (name, property) = (&column.element, &column.property);
                        let (x, y) = (shown(kind, x), shown(kind, y));
                        format!("element `{name}`, record {record}, property `{property}`: {x} and {y}")
                    });
                }
            }
        }
        first += count;
    }
    found.columns.extend(columns.into_iter().filter(|column| column.differing > 0));
    Ok(())
}

impl Column {
    fn add(&mut self, x: f64, y: f64) {
        self.differing += 1;
        let difference = (x - y).abs();
        if difference.is_nan() {
            self.undefined += 1;
        } else {
            self.largest = self.largest.max(difference);
        }
    }
}

fn compare_bytes(
    (a, at_a): (&Records, u64),
    (b, at_b): (&Records, u64),
    place: &str,
    found: &mut Differences,
) -> Result<(), InputError> {
    let (left_a, left_b) = (a.source.len().saturating_sub(at_a), b.source.len().saturating_sub(at_b));
    let common = left_a.min(left_b);
    let (mut chunk_a, mut chunk_b) = (Vec::new(), Vec::new());
    let mut done = 0;
    while done < common {
        let length = (common - done).min(CHUNK);
        a.source.read_into(at_a + done, length, &mut chunk_a)?;
        b.source.read_into(at_b + done, length, &mut chunk_b)?;
        for (i, (x, y)) in (done..).zip(chunk_a.iter().zip(&chunk_b)).filter(|(_, (x, y))| x != y) {
            found.bytes += 1;
            found.first.get_or_insert_with(|| {
                let (at_a, at_b) = (at_a + i, at_b + i);
                format!("{place}: byte {at_a} of the one is {x}, byte {at_b} of the other is {y}")
            });
        }
        done += length;
    }
    found.bytes += left_a.abs_diff(left_b);
    if left_a != left_b {
        found.first.get_or_insert_with(|| {
            let (n, m) = (counted(left_a, "byte", "bytes"), counted(left_b, "byte", "bytes"));
            format!("{place}: {n} and {m}")
        });
    }
    Ok(())
}

/// The bytes of a field, whose length is that of its type, as an array.
fn raw<const N: usize>(bytes: &[u8]) -> [u8; N] {
    let mut raw = [0; N];
    raw.copy_from_slice(bytes);
    raw
}

/// The value of a field. Exact for every type.
fn number(kind: ScalarType, bytes: &[u8]) -> f64 {
    match kind {
        ScalarType::I8 => i8::from_le_bytes(raw(bytes)).into(),
        ScalarType::U8 => u8::from_le_bytes(raw(bytes)).into(),
        ScalarType::I16 => i16::from_le_bytes(raw(bytes)).into(),
        ScalarType::U16 => u16::from_le_bytes(raw(bytes)).into(),
        ScalarType::I32 => i32::from_le_bytes(raw(bytes)).into(),
        ScalarType::U32 => u32::from_le_bytes(raw(bytes)).into(),
        ScalarType::F32 => f32::from_le_bytes(raw(bytes)).into(),
        ScalarType::F64 => f64::from_le_bytes(raw(bytes)),
    }
}

/// The value of a field with as many figures as its type needs, and no more.
fn shown(kind: ScalarType, bytes: &[u8]) -> String {
    match kind {
        // As a double it would have figures that a float does not have.
        ScalarType::F32 => format!("{:?}", f32::from_le_bytes(raw(bytes))),
        _ => exact(number(kind, bytes)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str =
        "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\nproperty uchar c\n";

    fn file(directory: &Path, name: &str, header: &str, payload: &[u8]) -> Records {
        let path = directory.join(name);
        std::fs::write(&path, [header.as_bytes(), b"end_header\n", payload].concat()).expect("write");
        Records::open(&path).expect("open")
    }

    fn payload(xs: [f32; 2], cs: [u8; 2]) -> Vec<u8> {
        xs.iter().zip(cs).flat_map(|(x, c)| [x.to_le_bytes().as_slice(), &[c]].concat()).collect()
    }

    #[test]
    fn properties_are_compared_one_by_one() {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let a = file(directory.path(), "a", HEADER, &payload([1.0, f32::NAN], [3, 4]));
        let b = file(directory.path(), "b", &format!("{HEADER}comment x\n"), &payload([1.5, 2.0], [3, 9]));
        assert!(header_differences(&a, &b).is_empty());
        assert_eq!(compare(&a, &a).expect("compare"), Differences::default());
        let found = compare(&a, &b).expect("compare");
        assert_eq!(found.first.as_deref(), Some("element `vertex`, record 0, property `x`: 1.0 and 1.5"));
        let columns: Vec<_> = found
            .columns
            .iter()
            .map(|c| (c.property.as_str(), c.differing, c.largest, c.undefined))
            .collect();
        assert_eq!(columns, [("x", 2, 0.5, 1), ("c", 1, 5.0, 0)]);
    }

    #[test]
    fn lists_and_trailing_bytes_are_compared_as_bytes() {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let header = format!("{HEADER}element face 1\nproperty list uchar uchar vertex_indices\n");
        let same = payload([1.0, 2.0], [3, 4]);
        let a = file(directory.path(), "a", &header, &[same.as_slice(), &[3, 0, 1, 2]].concat());
        let b = file(directory.path(), "b", &header, &[same.as_slice(), &[4, 0, 1, 2, 3]].concat());
        let found = compare(&a, &b).expect("compare");
        assert_eq!((found.bytes, found.columns.len()), (2, 0));
        assert!(found.first.expect("a difference").starts_with("from element `face` on"));
    }

    #[test]
    fn headers_are_compared_first() {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let a = file(directory.path(), "a", HEADER, &[]);
        let b = file(
            directory.path(),
            "b",
            &HEADER.replace("vertex 2", "vertex 1").replace("uchar", "char"),
            &[],
        );
        let found = header_differences(&a, &b);
        assert_eq!(found[0], "element `vertex` has 2 records and 1 record");
        assert_eq!(found[1], "element `vertex` has the properties float x, uchar c and float x, char c");
        let error = compare(&a, &a).expect_err("there are no records").to_string();
        assert!(error.contains("truncated") && error.contains("vertex"), "{error}");
    }
}
