//! Blocks of triangles from the face element.
//!
//! In: the number of a block. Out: its triangles, polygons cut into the fan around their first corner, every index
//! checked against the number of vertices, unless the caller does. A polygon of less than three corners yields nothing.

use super::layout::{AHEAD, FaceLayout, Records};
use super::record::Window;
use super::scalar::{Scalar, ScalarType};
use crate::input::{ByteSource, FaceBlock, InputError};
use crate::mesh::{FaceId, VertexId};

/// The face element of one file.
#[derive(Debug)]
pub(super) struct Faces {
    pub layout: FaceLayout,
    /// Name of the element, for messages.
    pub element: String,
    /// Number of vertices the indices may name.
    pub vertices: u64,
}

/// What is done about triangles that name a vertex that does not exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Missing {
    /// They are an error.
    Refused,
    /// They are handed out as they are, to somebody who sorts them out.
    Handed,
}

/// An integer that can name a vertex.
trait Index: Scalar {
    /// The vertex, or a number that no vertex has if it is negative.
    fn id(self) -> u64;
}

macro_rules! index {
    ($($number:ty),*) => {$(
        impl Index for $number {
            #[inline]
            fn id(self) -> u64 {
                // Sign extension puts every negative number above 2^63.
                i64::from(self).cast_unsigned()
            }
        }
    )*};
}

index!(i8, u8, i16, u16, i32, u32);

impl Faces {
    /// Number of blocks: at most 2^18.
    pub fn block_count(&self) -> usize {
        self.layout.polygons.div_ceil(self.layout.block) as usize
    }

    /// Replaces `out` by the triangles of block `block`, which must exist.
    pub fn read_block(
        &self,
        source: &ByteSource,
        block: usize,
        missing: Missing,
        out: &mut FaceBlock,
    ) -> Result<(), InputError> {
        out.restart(FaceId(0));
        match self.layout.shape.lists[self.layout.list].item {
            ScalarType::I8 => self.read::<i8>(source, block, missing, out),
            ScalarType::U8 => self.read::<u8>(source, block, missing, out),
            ScalarType::I16 => self.read::<i16>(source, block, missing, out),
            ScalarType::U16 => self.read::<u16>(source, block, missing, out),
            ScalarType::I32 => self.read::<i32>(source, block, missing, out),
            // Indices of a float type were refused when the file was opened.
            ScalarType::U32 | ScalarType::F32 | ScalarType::F64 => {
                self.read::<u32>(source, block, missing, out)
            }
        }
    }

    fn read<I: Index>(
        &self,
        source: &ByteSource,
        block: usize,
        missing: Missing,
        out: &mut FaceBlock,
    ) -> Result<(), InputError> {
        let first = block as u64 * self.layout.block;
        let records = self.layout.block.min(self.layout.polygons - first);
        match &self.layout.records {
            &Records::Fixed { start, stride } => {
                out.first = FaceId(first);
                self.read_triangles::<I>(source, (start, stride), (first, records), missing, out)
            }
            Records::Walked { offsets, .. } => {
                out.first = FaceId(self.layout.first_triangle[block]);
                let until = offsets.get(block + 1).copied().unwrap_or(self.layout.end);
                let triangles = self.layout.first_triangle[block + 1] - self.layout.first_triangle[block];
                out.corners.reserve(triangles as usize);
                self.read_polygons::<I>(source, (offsets[block], until), (first, records), missing, out)
            }
        }
    }

    /// Records of one size, each with three corners.
    fn read_triangles<I: Index>(
        &self,
        source: &ByteSource,
        (start, stride): (u64, u64),
        (first, records): (u64, u64),
        missing: Missing,
        out: &mut FaceBlock,
    ) -> Result<(), InputError> {
        let list = &self.layout.shape.lists[self.layout.list];
        let skip = (list.lead + list.count.size()) as usize;
        let start = start + first * stride;
        let mut scratch = Vec::new();
        let bytes = source.bytes(start, records * stride, &mut scratch)?;
        let ids = |record: &[u8]| {
            let corners = &record[skip..skip + 3 * I::SIZE];
            [0, 1, 2].map(|corner| I::read(&corners[corner * I::SIZE..]).id())
        };
        // Only the largest index of the block is compared, which keeps the loop free of branches.
        let mut largest = 0;
        out.corners.extend(bytes.chunks_exact(stride as usize).map(|record| {
            let [a, b, c] = ids(record);
            largest = largest.max(a).max(b).max(c);
            [a, b, c].map(VertexId)
        }));
        if largest < self.vertices || missing == Missing::Handed {
            return Ok(());
        }
        out.corners.clear();
        for (record, bytes) in (0..).zip(bytes.chunks_exact(stride as usize)) {
            if let Some(index) = ids(bytes).into_iter().find(|&id| id >= self.vertices) {
                return Err(self.out_of_range(source, first + record, start + record * stride, index));
            }
        }
        // Only if the file changed between the two looks at it.
        Err(self.out_of_range(source, first, start, largest))
    }

    /// Records of different sizes, with any number of corners.
    fn read_polygons<I: Index>(
        &self,
        source: &ByteSource,
        (start, until): (u64, u64),
        (first, records): (u64, u64),
        missing: Missing,
        out: &mut FaceBlock,
    ) -> Result<(), InputError> {
        let shape = &self.layout.shape;
        let list = self.layout.list;
        let mut window = Window::new(source, until, AHEAD);
        let mut anchors = Vec::new();
        let mut at = start;
        for record in first..first + records {
            let end = shape
                .walk(at, &mut window, &mut anchors)
                .map_err(|fault| fault.at(source, &self.element, record, at))?;
            let (items, count) = shape.lists[list].items(anchors[list], anchors[list + 1]);
            let bytes = window.at(items, count * I::SIZE as u64)?;
            let mut ids = bytes.chunks_exact(I::SIZE).map(|item| I::read(item).id());
            // Short polygons yield nothing, but a bad index in them is still a sign of a damaged file.
            let absent = ids.clone().find(|&id| id >= self.vertices);
            if let Some(index) = absent.filter(|_| missing == Missing::Refused) {
                out.corners.clear();
                return Err(self.out_of_range(source, record, at, index));
            }
            if let (Some(hub), Some(mut last)) = (ids.next(), ids.next()) {
                out.corners.extend(ids.map(|id| {
                    let triangle = [hub, last, id].map(VertexId);
                    last = id;
                    triangle
                }));
            }
            at = end;
        }
        Ok(())
    }

    #[cold]
    fn out_of_range(&self, source: &ByteSource, face: u64, offset: u64, index: u64) -> InputError {
        let (path, vertices) = (source.path().to_owned(), self.vertices);
        InputError::IndexOutOfRange { path, face, offset, index: index.cast_signed(), vertices }
    }
}
