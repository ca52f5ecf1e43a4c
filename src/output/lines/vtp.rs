//! Lines as PolyData of VTK, which ParaView opens: XML that describes arrays, then the arrays as they are in memory.
//!
//! Sizes follow from the counts, so the place of every array is known before its first number. All arrays of the vertices are
//! filled in one pass, and all arrays of the lines in another, each through a buffer of its own.

use crate::math::DEGREE;
use crate::output::{OutputError, PartFile};
use crate::stitch::{Counts, LineSource, LineVertex, Polyline};
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;

/// Bytes that an array keeps before it writes.
const BUFFER: usize = 1 << 16;
/// Bytes of the length before each array.
const LENGTH: u64 = 8;

/// An array as the XML describes it.
struct Array {
    /// In which element it is.
    element: Element,
    name: &'static str,
    kind: Kind,
    /// Numbers in a tuple.
    components: u64,
    /// How many numbers there are in all.
    numbers: u64,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Element {
    PointData,
    CellData,
    Points,
    Lines,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Float64,
    Int64,
    UInt8,
}

impl Element {
    /// In the order in which they stand in a piece, with what opens them.
    const ALL: [(Element, &str, &str); 4] = [
        (Element::PointData, "PointData", " Scalars=\"saliency\""),
        (Element::CellData, "CellData", " Scalars=\"class\""),
        (Element::Points, "Points", ""),
        (Element::Lines, "Lines", ""),
    ];
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Kind::Float64 => "Float64",
            Kind::Int64 => "Int64",
            Kind::UInt8 => "UInt8",
        }
    }

    fn bytes(self) -> u64 {
        if self == Kind::UInt8 { 1 } else { 8 }
    }
}

/// The arrays of the vertices, then those of the lines.
fn arrays(counts: &Counts) -> [Array; 15] {
    use Element::{CellData, Lines, PointData, Points};
    use Kind::{Float64, Int64, UInt8};
    let Counts { vertices, edges, lines, .. } = *counts;
    let array = |element, name, kind, components, tuples: u64| {
        let numbers = components * tuples;
        Array { element, name, kind, components, numbers }
    };
    [
        array(PointData, "saliency", Float64, 1, vertices),
        array(PointData, "angle", Float64, 1, vertices),
        array(PointData, "class", UInt8, 1, vertices),
        array(PointData, "bend", UInt8, 1, vertices),
        array(PointData, "source", Int64, 1, vertices),
        array(Points, "Points", Float64, 3, vertices),
        array(CellData, "id", Int64, 1, lines),
        array(CellData, "class", UInt8, 1, lines),
        array(CellData, "length", Float64, 1, lines),
        array(CellData, "strength", Float64, 1, lines),
        array(CellData, "angle", Float64, 1, lines),
        array(CellData, "bend", UInt8, 1, lines),
        array(CellData, "closed", UInt8, 1, lines),
        array(Lines, "connectivity", Int64, 1, edges + lines),
        array(Lines, "offsets", Int64, 1, lines),
    ]
}

/// How many of the arrays are those of the vertices.
const OF_VERTICES: usize = 6;

pub(super) fn write(part: &PartFile, lines: &dyn LineSource) -> Result<(), OutputError> {
    let failed = OutputError::io(part.target(), "cannot write");
    let counts = lines.counts();
    let arrays = arrays(&counts);
    let head = head(&counts, &arrays);
    part.file().write_all_at(head.as_bytes(), 0).map_err(&failed)?;
    let mut at = head.len() as u64;
    let mut columns = Vec::with_capacity(arrays.len());
    for array in &arrays {
        columns.push(Column::new(part.file(), at, array).map_err(&failed)?);
        at += LENGTH + array.numbers * array.kind.bytes();
    }
    let (of_vertices, of_lines) = columns.split_at_mut(OF_VERTICES);
    for vertex in lines.vertices() {
        put_vertex(of_vertices, lines, &vertex?).map_err(&failed)?;
    }
    let mut end = 0;
    for (id, line) in (0u64..).zip(lines.lines()) {
        let line = line?;
        end += line.vertices.len() as u64;
        put_line(of_lines, id, &line, end).map_err(&failed)?;
    }
    columns.iter_mut().try_for_each(Column::flush).map_err(&failed)?;
    part.file().write_all_at(b"\n</AppendedData>\n</VTKFile>\n", at).map_err(&failed)
}

/// Everything before the first byte of the first array.
fn head(counts: &Counts, arrays: &[Array]) -> String {
    let mut head = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">\n<PolyData>\n<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"{}\" \
         NumberOfStrips=\"0\" NumberOfPolys=\"0\">\n",
        counts.vertices, counts.lines
    );
    for (element, name, attributes) in Element::ALL {
        head.push_str(&format!("<{name}{attributes}>\n"));
        let mut offset = 0;
        for array in arrays {
            if array.element == element {
                head.push_str(&format!(
                    "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{offset}\"/>\n",
                    array.kind.name(),
                    array.name,
                    array.components
                ));
            }
            offset += LENGTH + array.numbers * array.kind.bytes();
        }
        head.push_str(&format!("</{name}>\n"));
    }
    // The data begin right behind the underscore.
    head.push_str("</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_");
    head
}

fn put_vertex(columns: &mut [Column<'_>], lines: &dyn LineSource, v: &LineVertex) -> io::Result<()> {
    let [saliency, angle, class, bend, source, points] = columns else { return Ok(()) };
    saliency.put(&lines.saliency(v).to_le_bytes())?;
    angle.put(&(v.angle / DEGREE).to_le_bytes())?;
    class.put(&[v.class as u8])?;
    bend.put(&[v.bend as u8])?;
    source.put(&v.id.0.to_le_bytes())?;
    let point = v.point(lines.geometry()).to_array();
    point.iter().try_for_each(|x| points.put(&x.to_le_bytes()))
}

/// `end` is the number of corners of all lines up to this one.
fn put_line(columns: &mut [Column<'_>], id: u64, line: &Polyline, end: u64) -> io::Result<()> {
    let [ids, class, length, strength, angle, bend, closed, connectivity, offsets] = columns else {
        return Ok(());
    };
    let m = &line.measures;
    ids.put(&id.to_le_bytes())?;
    class.put(&[m.class as u8])?;
    length.put(&m.length.to_le_bytes())?;
    strength.put(&m.strength.to_le_bytes())?;
    angle.put(&m.angle.to_le_bytes())?;
    bend.put(&[m.bend as u8])?;
    closed.put(&[u8::from(m.closed)])?;
    line.vertices.iter().try_for_each(|v| connectivity.put(&v.to_le_bytes()))?;
    offsets.put(&end.to_le_bytes())
}

/// An array that is written from its start to its end, beside others.
struct Column<'a> {
    file: &'a File,
    /// Where the next byte goes that is not in the buffer.
    at: u64,
    pending: Vec<u8>,
}

impl<'a> Column<'a> {
    /// Begins at `at` with the length.
    fn new(file: &'a File, at: u64, array: &Array) -> io::Result<Column<'a>> {
        let mut column = Column { file, at, pending: Vec::with_capacity(BUFFER) };
        column.put(&(array.numbers * array.kind.bytes()).to_le_bytes())?;
        Ok(column)
    }

    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        if self.pending.len() + bytes.len() > BUFFER {
            self.flush()?;
        }
        self.pending.extend_from_slice(bytes);
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.write_all_at(&self.pending, self.at)?;
        self.at += self.pending.len() as u64;
        self.pending.clear();
        Ok(())
    }
}
