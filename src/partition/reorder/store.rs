//! The result of the sort: blocks of faces that are neighbours in space, each with all that a tile needs of it.
//!
//! A block holds its faces by ascending id. Stored are the ids of the faces, a table of their vertices (ids and positions)
//! and, for each corner, its row in the table: neighbours share vertices, so this takes half of what whole faces take.

use super::layout::{Face, Layout, number, put};
use crate::input::{FaceBlock, InputError, MeshSource};
use crate::mesh::{FaceId, VertexId};
use crate::partition::{BlockSummary, Bounds};
use crate::spill::{BlockReader, Extent, SpillError, SpillFile};
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A mesh in spatial order. The faces have the ids of the file it was made from.
pub struct SpatialStore<'a> {
    pub(super) source: &'a dyn MeshSource,
    pub(super) layout: Layout,
    pub(super) blocks: BlockReader,
    pub(super) extents: Vec<Extent>,
    pub(super) summaries: Vec<BlockSummary>,
}

/// What must be known to use a store again that was kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SortedTable {
    /// Bytes of the file.
    bytes: u64,
    extents: Vec<Extent>,
    summaries: Vec<BlockSummary>,
}

/// Bytes of a row number in a table of so many vertices.
fn row_width(vertices: usize) -> usize {
    if vertices <= 1 << 16 { 2 } else { 4 }
}

/// Writes `faces`, which ascend, as a block.
pub(super) fn encode(layout: &Layout, faces: &[Face]) -> (Vec<u8>, BlockSummary) {
    let mut table: Vec<(VertexId, DVec3)> =
        faces.iter().flat_map(|face| face.corners.into_iter().zip(face.places)).collect();
    table.sort_unstable_by_key(|row| row.0);
    table.dedup_by_key(|row| row.0);
    let mut bounds = Bounds::EMPTY;
    table.iter().for_each(|row| bounds.add(row.1));
    let mut out = Vec::new();
    put(&mut out, faces.len() as u64, 4);
    put(&mut out, table.len() as u64, 4);
    faces.iter().for_each(|face| put(&mut out, face.id.0, layout.face));
    table.iter().for_each(|row| put(&mut out, row.0.0, layout.vertex));
    table.iter().for_each(|row| layout.put_position(&mut out, row.1));
    let rows = row_width(table.len());
    for id in faces.iter().flat_map(|face| face.corners) {
        // All corners are in the table.
        let row = table.partition_point(|row| row.0 < id);
        put(&mut out, row as u64, rows);
    }
    (out, BlockSummary { bounds, faces: faces.len() as u32 })
}

/// Reads a block. Its bytes were checked, so it is what was written.
fn decode(layout: &Layout, bytes: &[u8], out: &mut FaceBlock, places: &mut Vec<[DVec3; 3]>) {
    let (head, rest) = bytes.split_at(8);
    let (faces, vertices) = (number(&head[..4]) as usize, number(&head[4..]) as usize);
    let (face_ids, rest) = rest.split_at(faces * layout.face);
    let (vertex_ids, rest) = rest.split_at(vertices * layout.vertex);
    let (positions, rows) = rest.split_at(vertices * layout.position());
    let table: Vec<(VertexId, DVec3)> = vertex_ids
        .chunks_exact(layout.vertex)
        .zip(positions.chunks_exact(layout.position()))
        .map(|(id, position)| (VertexId(number(id)), layout.read_position(position)))
        .collect();
    out.restart(FaceId(0));
    out.ids.extend(face_ids.chunks_exact(layout.face).map(|id| FaceId(number(id))));
    out.first = out.ids.first().copied().unwrap_or_default();
    places.clear();
    let width = row_width(vertices);
    for face in rows.chunks_exact(3 * width) {
        let corners = [0, 1, 2].map(|i| table[number(&face[i * width..][..width]) as usize]);
        out.corners.push(corners.map(|row| row.0));
        places.push(corners.map(|row| row.1));
    }
}

impl<'a> SpatialStore<'a> {
    /// Has the file stay behind as `path`, on the same disk. It is there for good when its directory was synced.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn keep(&mut self, path: &Path) -> Result<SortedTable, SpillError> {
        self.blocks.keep(path)?;
        let (extents, summaries) = (self.extents.clone(), self.summaries.clone());
        Ok(SortedTable { bytes: self.bytes(), extents, summaries })
    }

    /// A store of the faces of `source` that was kept as `path`. Every block of it is read and checked, using the current
    /// thread pool: better now than after days.
    ///
    /// # Errors
    /// If it is not there or not what it was.
    pub fn reopen(
        source: &'a dyn MeshSource,
        path: &Path,
        table: SortedTable,
    ) -> Result<SpatialStore<'a>, SpillError> {
        let store = SpatialStore::reopen_unread(source, path, table)?;
        let checked: Vec<Result<(), SpillError>> =
            store.extents.par_iter().map(|&extent| store.blocks.read(extent, &mut Vec::new())).collect();
        checked.into_iter().collect::<Result<(), _>>()?;
        Ok(store)
    }

    /// The same where many processes use one store: each block is checked when it is read, and no other.
    ///
    /// # Errors
    /// If it is not there, or has another length.
    pub fn reopen_unread(
        source: &'a dyn MeshSource,
        path: &Path,
        table: SortedTable,
    ) -> Result<SpatialStore<'a>, SpillError> {
        let blocks = SpillFile::kept(path, table.bytes)?.blocks()?;
        let SortedTable { extents, summaries, .. } = table;
        Ok(SpatialStore { source, layout: Layout::of(source), blocks, extents, summaries })
    }

    /// Its blocks, for the plan.
    pub fn summaries(&self) -> &[BlockSummary] {
        &self.summaries
    }

    /// Bytes it takes on the disk.
    pub fn bytes(&self) -> u64 {
        self.blocks.file().length()
    }
}

impl MeshSource for SpatialStore<'_> {
    fn name(&self) -> String {
        self.source.name()
    }

    fn vertex_count(&self) -> u64 {
        self.source.vertex_count()
    }

    fn face_count(&self) -> u64 {
        self.source.face_count()
    }

    fn block_count(&self) -> usize {
        self.extents.len()
    }

    fn read_block(&self, block: usize, out: &mut FaceBlock) -> Result<(), InputError> {
        self.read_placed(block, out, &mut Vec::new())
    }

    fn read_placed(
        &self,
        block: usize,
        out: &mut FaceBlock,
        places: &mut Vec<[DVec3; 3]>,
    ) -> Result<(), InputError> {
        let Some(&extent) = self.extents.get(block) else {
            let (index, count) = (block as u64, self.block_count() as u64);
            return Err(InputError::NoSuch { name: self.name(), what: "block", index, count });
        };
        let mut bytes = Vec::new();
        self.blocks.read(extent, &mut bytes)?;
        decode(&self.layout, &bytes, out, places);
        Ok(())
    }

    fn carries_positions(&self) -> bool {
        true
    }

    fn coordinate_bytes(&self) -> usize {
        self.source.coordinate_bytes()
    }

    fn read_positions(&self, first: VertexId, count: usize, out: &mut Vec<DVec3>) -> Result<(), InputError> {
        self.source.read_positions(first, count, out)
    }

    fn gather_positions(&self, ids: &[VertexId], out: &mut Vec<DVec3>) -> Result<(), InputError> {
        self.source.gather_positions(ids, out)
    }

    fn corner_positions(
        &self,
        corners: &[[VertexId; 3]],
        out: &mut Vec<[DVec3; 3]>,
    ) -> Result<(), InputError> {
        self.source.corner_positions(corners, out)
    }

    fn vertex_offset(&self, id: VertexId) -> Option<u64> {
        self.source.vertex_offset(id)
    }
}
