//! Positions from the vertex element.
//!
//! In: vertex ids. Out: their coordinates as `f64`, exactly as stored. Records of one size are decoded straight
//! from the map; without a map, ids are gathered into few large reads. Records with lists are reached by walking
//! from the nearest kept offset.

use super::layout::{Records, VertexLayout};
use super::record::{Place, Window};
use super::scalar::{Scalar, ScalarType};
use crate::input::{ByteSource, InputError};
use crate::mesh::VertexId;
use glam::DVec3;

/// Bytes between two vertices that are read along rather than skipped.
const GAP: u64 = 4 << 10;
/// Bytes of one read at most.
const RUN: u64 = 1 << 20;
/// Bytes read at a time while walking from a kept offset.
const STEP: u64 = 16 << 10;

/// The vertex element of one file.
#[derive(Debug)]
pub(super) struct Vertices {
    pub layout: VertexLayout,
    /// Name of the element, for messages.
    pub element: String,
    /// Number of records.
    pub count: u64,
    /// Where x, y and z lie in a record.
    pub places: [Place; 3],
}

/// How a record of fixed size becomes a position.
enum Decoder {
    /// Three `float` in a row, from that byte on.
    Floats(usize),
    /// Three `double` in a row, from that byte on.
    Doubles(usize),
    /// Anything else.
    Mixed([Place; 3]),
}

fn packed<T: Scalar + Into<f64>>(record: &[u8], offset: usize) -> DVec3 {
    let bytes = &record[offset..offset + 3 * T::SIZE];
    let [x, y, z] = [0, 1, 2].map(|axis| T::read(&bytes[axis * T::SIZE..]).into());
    DVec3::new(x, y, z)
}

fn mixed(record: &[u8], places: &[Place; 3]) -> DVec3 {
    let [x, y, z] = places.map(|place| place.kind.to_f64(&record[place.offset as usize..]));
    DVec3::new(x, y, z)
}

impl Decoder {
    fn new(places: &[Place; 3]) -> Self {
        let [x, y, z] = places;
        let kind = x.kind;
        let row = y.offset == x.offset + kind.size() && z.offset == y.offset + kind.size();
        let same = y.kind == kind && z.kind == kind;
        match kind {
            ScalarType::F32 if row && same => Self::Floats(x.offset as usize),
            ScalarType::F64 if row && same => Self::Doubles(x.offset as usize),
            _ => Self::Mixed(*places),
        }
    }

    #[inline]
    fn decode(&self, record: &[u8]) -> DVec3 {
        match self {
            Self::Floats(offset) => packed::<f32>(record, *offset),
            Self::Doubles(offset) => packed::<f64>(record, *offset),
            Self::Mixed(places) => mixed(record, places),
        }
    }
}

impl Vertices {
    /// Appends the positions of `count` vertices from `first` on.
    pub fn read(
        &self,
        source: &ByteSource,
        first: u64,
        count: u64,
        out: &mut Vec<DVec3>,
    ) -> Result<(), InputError> {
        let Some(end) = first.checked_add(count).filter(|&end| end <= self.count) else {
            return Err(self.no_such(source, first.saturating_add(count.saturating_sub(1))));
        };
        // No more than the file has bytes.
        out.reserve(count as usize);
        match &self.layout.records {
            &Records::Fixed { start, stride } => {
                let decoder = Decoder::new(&self.places);
                let per_read = (RUN / stride).max(1);
                let mut scratch = Vec::new();
                let mut next = first;
                while next < end {
                    let records = per_read.min(end - next);
                    let bytes = source.bytes(start + next * stride, records * stride, &mut scratch)?;
                    out.extend(bytes.chunks_exact(stride as usize).map(|record| decoder.decode(record)));
                    next += records;
                }
            }
            Records::Walked { offsets, every } => {
                let mut cursor = Cursor::new(self, source, offsets, *every);
                for id in first..end {
                    out.push(cursor.position(id)?);
                }
            }
        }
        Ok(())
    }

    /// Replaces `out` by the positions of the strictly ascending `ids`.
    pub fn gather(
        &self,
        source: &ByteSource,
        ids: &[VertexId],
        out: &mut Vec<DVec3>,
    ) -> Result<(), InputError> {
        out.clear();
        if let Some(id) = ids.iter().find(|id| id.0 >= self.count) {
            return Err(self.no_such(source, id.0));
        }
        out.reserve(ids.len());
        match &self.layout.records {
            &Records::Fixed { start, stride } => {
                let decoder = Decoder::new(&self.places);
                if source.mapped().is_some() {
                    source.will_read_records(ids.iter().map(|id| start + id.0 * stride), stride);
                    for id in ids {
                        // Borrows from the map, hence no scratch.
                        let mut scratch = Vec::new();
                        out.push(decoder.decode(source.bytes(
                            start + id.0 * stride,
                            stride,
                            &mut scratch,
                        )?));
                    }
                    return Ok(());
                }
                gather_runs(source, start, stride, ids, &decoder, out)
            }
            Records::Walked { offsets, every } => {
                let mut cursor = Cursor::new(self, source, offsets, *every);
                for id in ids {
                    out.push(cursor.position(id.0)?);
                }
                Ok(())
            }
        }
    }

    /// Replaces `out` by the positions of the corners of each triangle.
    pub fn corners(
        &self,
        source: &ByteSource,
        corners: &[[VertexId; 3]],
        out: &mut Vec<[DVec3; 3]>,
    ) -> Result<(), InputError> {
        out.clear();
        if let (&Records::Fixed { start, stride }, Some(map)) = (&self.layout.records, source.mapped()) {
            self.announce(source, corners, (start, stride));
            let table = Table { vertices: self, source, bytes: &map[start as usize..], stride };
            return match Decoder::new(&self.places) {
                Decoder::Floats(offset) => {
                    table.corners(corners, out, |record| packed::<f32>(record, offset))
                }
                Decoder::Doubles(offset) => {
                    table.corners(corners, out, |record| packed::<f64>(record, offset))
                }
                Decoder::Mixed(places) => table.corners(corners, out, |record| mixed(record, &places)),
            };
        }
        let mut ids: Vec<VertexId> = corners.as_flattened().to_vec();
        ids.sort_unstable();
        ids.dedup();
        let mut positions = Vec::new();
        self.gather(source, &ids, &mut positions)?;
        out.reserve(corners.len());
        // Every corner was gathered, so the search succeeds; the insertion point is never used.
        let place = |id: &VertexId| ids.binary_search(id).unwrap_or_else(|at| at.min(positions.len() - 1));
        out.extend(corners.iter().map(|ids| ids.map(|id| positions[place(&id)])));
        Ok(())
    }

    /// Tells `source` which records these corners will be read from, if they are near each other as those of neighbouring
    /// faces are in a file with some order. Ids may be anything.
    fn announce(&self, source: &ByteSource, corners: &[[VertexId; 3]], (start, stride): (u64, u64)) {
        let (mut first, mut last) = (u64::MAX, 0);
        for id in corners.as_flattened() {
            (first, last) = (first.min(id.0), last.max(id.0));
        }
        if first <= last && last < self.count && last - first < SPREAD * corners.len() as u64 {
            source.will_read(start + first * stride, (last - first + 1) * stride);
        }
    }

    /// Byte offset of a record, if there is one of that number.
    pub fn offset(&self, source: &ByteSource, id: u64) -> Option<u64> {
        if id >= self.count {
            return None;
        }
        match &self.layout.records {
            Records::Fixed { start, stride } => Some(start + id * stride),
            Records::Walked { offsets, every } => {
                let mut cursor = Cursor::new(self, source, offsets, *every);
                cursor.seek(id).ok()?;
                Some(cursor.at)
            }
        }
    }

    #[cold]
    fn no_such(&self, source: &ByteSource, index: u64) -> InputError {
        let name = source.path().display().to_string();
        InputError::NoSuch { name, what: "vertex", index, count: self.count }
    }
}

/// Records for each triangle that are read at once, whether all of them are corners or not: there is half a vertex for each.
const SPREAD: u64 = 4;

/// Records of one size in a map.
struct Table<'a> {
    vertices: &'a Vertices,
    source: &'a ByteSource,
    /// From the first record on.
    bytes: &'a [u8],
    stride: u64,
}

impl Table<'_> {
    /// Compiled once per way to decode, so that the loop over the corners has no branch but the range check.
    fn corners(
        &self,
        corners: &[[VertexId; 3]],
        out: &mut Vec<[DVec3; 3]>,
        decode: impl Fn(&[u8]) -> DVec3,
    ) -> Result<(), InputError> {
        let (count, stride) = (self.vertices.count, self.stride as usize);
        if let Some(id) = corners.as_flattened().iter().find(|id| id.0 >= count) {
            return Err(self.vertices.no_such(self.source, id.0));
        }
        // All records were seen to lie inside the map, whose length is a usize.
        out.extend(
            corners.iter().map(|ids| ids.map(|id| decode(&self.bytes[id.0 as usize * stride..][..stride]))),
        );
        Ok(())
    }
}

/// Reads ascending ids in runs: neighbours and the small gaps between them come with one read.
fn gather_runs(
    source: &ByteSource,
    start: u64,
    stride: u64,
    ids: &[VertexId],
    decoder: &Decoder,
    out: &mut Vec<DVec3>,
) -> Result<(), InputError> {
    let mut scratch = Vec::new();
    let mut rest = ids;
    while let Some(&VertexId(first)) = rest.first() {
        let joins = |pair: &[VertexId]| {
            // An id that does not ascend starts a new run.
            let step = pair[1].0.checked_sub(pair[0].0);
            let near = step.is_some_and(|step| step.saturating_sub(1).saturating_mul(stride) <= GAP);
            near && (pair[1].0 - first + 1) * stride <= RUN
        };
        let length = 1 + rest.windows(2).take_while(|pair| joins(pair)).count();
        let (run, behind) = rest.split_at(length);
        let last = run.last().map_or(first, |id| id.0);
        let bytes = source.bytes(start + first * stride, (last - first + 1) * stride, &mut scratch)?;
        for id in run {
            let at = ((id.0 - first) * stride) as usize;
            out.push(decoder.decode(&bytes[at..at + stride as usize]));
        }
        rest = behind;
    }
    Ok(())
}

/// A place in a walked vertex element.
struct Cursor<'a> {
    vertices: &'a Vertices,
    source: &'a ByteSource,
    offsets: &'a [u64],
    every: u64,
    window: Window<'a>,
    anchors: Vec<u64>,
    /// The record it stands before, and that record's offset.
    record: u64,
    at: u64,
}

impl<'a> Cursor<'a> {
    fn new(vertices: &'a Vertices, source: &'a ByteSource, offsets: &'a [u64], every: u64) -> Self {
        let at = offsets.first().copied().unwrap_or_default();
        let window = Window::new(source, u64::MAX, STEP);
        Self { vertices, source, offsets, every, window, anchors: Vec::new(), record: 0, at }
    }

    /// Walks to record `id`, which must exist.
    fn seek(&mut self, id: u64) -> Result<(), InputError> {
        let checkpoint = id / self.every;
        if id < self.record || self.record < checkpoint * self.every {
            self.record = checkpoint * self.every;
            self.at = self.offsets[checkpoint as usize];
        }
        while self.record < id {
            self.step()?;
        }
        Ok(())
    }

    fn step(&mut self) -> Result<(), InputError> {
        let (record, at) = (self.record, self.at);
        let end = self.vertices.layout.shape.walk(at, &mut self.window, &mut self.anchors);
        self.at = end.map_err(|fault| fault.at(self.source, &self.vertices.element, record, at))?;
        self.record += 1;
        Ok(())
    }

    fn position(&mut self, id: u64) -> Result<DVec3, InputError> {
        self.seek(id)?;
        self.step()?;
        let mut position = [0.0; 3];
        for (value, place) in position.iter_mut().zip(&self.vertices.places) {
            let bytes = self.window.at(self.anchors[place.part] + place.offset, place.kind.size())?;
            *value = place.kind.to_f64(bytes);
        }
        Ok(position.into())
    }
}
