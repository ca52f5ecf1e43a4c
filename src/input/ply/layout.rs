//! Where the records of the elements lie.
//!
//! In: the header and the file. Out: for the vertices and the faces, a way from a record's number to its bytes.
//! Records of one size need no index. Records with lists are walked once, when the file is opened, and every so
//! many records their offset is kept. Nothing is allocated from a number in the header before the bytes it stands
//! for were seen to exist.

use super::Needs;
use super::header::{Element, Header};
use super::record::{Fault, List, Shape, Slot, Window};
use crate::input::{BLOCK, ByteSource, InputError};
use serde::{Deserialize, Serialize};

/// Records of a vertex element with lists between two kept offsets.
const VERTICES_PER_CHECKPOINT: u64 = 256;
/// Blocks of faces a mesh has at most, so that what is kept per block stays small.
const BLOCKS: u64 = 1 << 18;
/// Bytes read at a time while walking.
pub(super) const AHEAD: u64 = 1 << 20;

/// From the number of a record to its bytes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Records {
    /// Record `i` lies at `start + i * stride`.
    Fixed { start: u64, stride: u64 },
    /// Record `i * every` lies at `offsets[i]`.
    Walked { offsets: Vec<u64>, every: u64 },
}

/// The vertex element.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct VertexLayout {
    pub shape: Shape,
    pub records: Records,
}

/// The face element.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct FaceLayout {
    pub shape: Shape,
    pub records: Records,
    /// Which list of the shape holds the indices.
    pub list: usize,
    /// Number of records.
    pub polygons: u64,
    /// Records per block.
    pub block: u64,
    /// The first triangle of each block, and the number of triangles; empty if every polygon is a triangle.
    pub first_triangle: Vec<u64>,
    /// Number of triangles.
    pub triangles: u64,
    /// Polygons of less than three corners.
    pub short: u64,
    /// Where the element ends.
    pub end: u64,
}

/// Records per block so that there are at most 2^18 blocks.
fn polygons_per_block(polygons: u64) -> u64 {
    BLOCK.max(polygons.div_ceil(BLOCKS))
}

/// Finds the elements of the header that are needed.
pub(super) fn place(
    source: &ByteSource,
    header: &Header,
    &Needs { vertex, face, indices: list, .. }: &Needs,
) -> Result<(VertexLayout, FaceLayout), InputError> {
    let mut at = header.payload;
    let (mut vertices, mut faces) = (None, None);
    for (index, element) in header.elements.iter().enumerate().take(vertex.max(face) + 1) {
        let run = Run { source, element, shape: Shape::new(element), start: at };
        run.check_least_size()?;
        if index == face {
            let layout = run.faces(list)?;
            at = layout.end;
            faces = Some(layout);
        } else {
            let keep = (index == vertex).then_some(VERTICES_PER_CHECKPOINT);
            let records;
            (records, at) = run.place(keep)?;
            if index == vertex {
                vertices = Some(VertexLayout { shape: run.shape, records });
            }
        }
    }
    match (vertices, faces) {
        (Some(vertices), Some(faces)) => Ok((vertices, faces)),
        _ => Err(format_error(
            source,
            "the elements `vertex` and `face` are not two elements of the file".to_owned(),
        )),
    }
}

pub(super) fn format_error(source: &ByteSource, reason: String) -> InputError {
    InputError::Format { path: source.path().to_owned(), reason }
}

/// One element of the payload while it is being placed.
struct Run<'a> {
    source: &'a ByteSource,
    element: &'a Element,
    shape: Shape,
    start: u64,
}

impl Run<'_> {
    /// Refuses an element whose records cannot fit even if all their lists are empty.
    fn check_least_size(&self) -> Result<(), InputError> {
        let needed = self.element.count.checked_mul(self.shape.least_size());
        match needed.and_then(|needed| self.start.checked_add(needed)) {
            Some(end) if end <= self.source.len() => Ok(()),
            _ => Err(InputError::Truncated {
                path: self.source.path().to_owned(),
                element: self.element.name.clone(),
                offset: self.start,
                needed: needed.unwrap_or(u64::MAX),
                length: self.source.len(),
            }),
        }
    }

    /// Places any element; keeps the offset of each `keep`-th record, if asked to. Returns where it ends.
    fn place(&self, keep: Option<u64>) -> Result<(Records, u64), InputError> {
        if let Some(stride) = self.shape.fixed_size() {
            // Checked: this is the least size.
            return Ok((
                Records::Fixed { start: self.start, stride },
                self.start + self.element.count * stride,
            ));
        }
        let mut offsets = Vec::new();
        let every = keep.unwrap_or(u64::MAX);
        let end = self.walk(0, self.start, |record, at, _| {
            if keep.is_some() && record % every == 0 {
                offsets.push(at);
            }
        })?;
        Ok((Records::Walked { offsets, every }, end))
    }

    /// Walks from record `first` at `at` to the last one, with `visit(record, its offset, its anchors)`.
    fn walk(&self, first: u64, at: u64, mut visit: impl FnMut(u64, u64, &[u64])) -> Result<u64, InputError> {
        self.check_lengths()?;
        let mut window = Window::new(self.source, u64::MAX, AHEAD);
        let mut anchors = Vec::new();
        let mut at = at;
        for record in first..self.element.count {
            let end = self
                .shape
                .walk(at, &mut window, &mut anchors)
                .map_err(|fault| self.fault(fault, record, at))?;
            visit(record, at, &anchors);
            at = end;
        }
        Ok(at)
    }

    fn fault(&self, fault: Fault, record: u64, at: u64) -> InputError {
        fault.at(self.source, &self.element.name, record, at)
    }

    /// The file format allows lists whose length is a float; there is no way to walk them.
    fn check_lengths(&self) -> Result<(), InputError> {
        for (property, slot) in self.element.properties.iter().zip(&self.shape.slots) {
            if let Slot::List(list) = slot
                && !self.shape.lists[*list].count.is_integer()
            {
                return Err(format_error(
                    self.source,
                    format!(
                        "the list `{}` of element `{}` has a length of type {}; re-save the file with a list length \
                         of an integer type",
                        property.name, self.element.name, self.shape.lists[*list].count
                    ),
                ));
            }
        }
        Ok(())
    }

    /// Places the face element, whose corners are in property `property`.
    fn faces(self, property: usize) -> Result<FaceLayout, InputError> {
        let Some(&Slot::List(list)) = self.shape.slots.get(property) else {
            return Err(format_error(
                self.source,
                format!("element `{}` has no list of indices", self.element.name),
            ));
        };
        self.check_lengths()?;
        let polygons = self.element.count;
        let block = polygons_per_block(polygons);
        // As long as records are triangles, the next one lies one stride on.
        let (stride, triangles) = match self.shape.lists.as_slice() {
            [only] => {
                let stride = self.shape.least_size() + 3 * only.item.size();
                (stride, self.leading_triangles(only, stride)?)
            }
            _ => (0, 0),
        };
        let at = self.start + triangles * stride;
        if triangles == polygons {
            let records = Records::Fixed { start: self.start, stride };
            let first_triangle = Vec::new();
            let Self { shape, .. } = self;
            return Ok(FaceLayout {
                shape,
                records,
                list,
                polygons,
                block,
                first_triangle,
                triangles,
                short: 0,
                end: at,
            });
        }
        let mut short = 0;
        let mut next = triangles;
        let passed = (0..triangles).step_by(usize::try_from(block).unwrap_or(usize::MAX));
        let mut first_triangle: Vec<u64> = passed.collect();
        let mut offsets: Vec<u64> =
            first_triangle.iter().map(|record| self.start + record * stride).collect();
        let indices = self.shape.lists[list];
        let end = self.walk(triangles, at, |record, at, anchors| {
            if record % block == 0 {
                offsets.push(at);
                first_triangle.push(next);
            }
            let (_, corners) = indices.items(anchors[list], anchors[list + 1]);
            short += u64::from(corners < 3);
            // At most as many as there are bytes.
            next += corners.saturating_sub(2);
        })?;
        first_triangle.push(next);
        let records = Records::Walked { offsets, every: block };
        Ok(FaceLayout {
            shape: self.shape,
            records,
            list,
            polygons,
            block,
            first_triangle,
            triangles: next,
            short,
            end,
        })
    }

    /// How many records from the first on have three corners, if their only list is `list`.
    fn leading_triangles(&self, list: &List, stride: u64) -> Result<u64, InputError> {
        let fitting = (self.source.len() - self.start) / stride;
        let candidates = self.element.count.min(fitting);
        // The length 3 in little-endian bytes of any integer type.
        let three = &3u64.to_le_bytes()[..list.count.size() as usize];
        let lead = list.lead as usize;
        let per_read = (AHEAD / stride).max(1);
        let mut scratch = Vec::new();
        let mut done = 0;
        while done < candidates {
            let records = per_read.min(candidates - done);
            let bytes = self.source.bytes(self.start + done * stride, records * stride, &mut scratch)?;
            let mut chunks = bytes.chunks_exact(stride as usize);
            let other = match *three {
                [three] => chunks.position(|record| record[lead] != three),
                _ => chunks.position(|record| &record[lead..lead + three.len()] != three),
            };
            if let Some(other) = other {
                return Ok(done + other as u64);
            }
            done += records;
        }
        Ok(candidates)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_blocks_is_bounded() {
        for polygons in [1, 4096, 4097, 1 << 30] {
            assert_eq!(polygons_per_block(polygons), 4096);
        }
        for polygons in [(1 << 30) + 1, 1 << 31, (1 << 40) + 12345, u64::MAX] {
            let block = polygons_per_block(polygons);
            assert!(block > 4096);
            assert!(polygons.div_ceil(block) <= BLOCKS);
        }
    }
}
