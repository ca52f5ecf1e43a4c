//! First step: every corner meets its position, without a read at random.
//!
//! In: a source whose vertices lie in another order than its faces. Out: its blocks with positions. The three passes are
//! those of a sort-merge join: corners by range of vertices; positions by range of faces; positions by face.

use super::layout::{Layout, number, put};
use crate::input::{FaceBlock, InputError, MeshSource};
use crate::mesh::VertexId;
use crate::spill::{BlockReader, Buckets, Extent, ScratchDir, SpillFile, SpillWriter};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::{PoisonError, RwLock};

/// Files of the result, each of which is an open handle and goes as a whole.
const PARTS: usize = 32;

/// A mesh in the order of its file, with the positions of the corners beside the faces.
#[derive(Debug)]
pub struct Joined<'a> {
    source: Source<'a>,
    layout: Layout,
    parts: Vec<RwLock<Option<BlockReader>>>,
    /// Part and place of the positions of each block.
    extents: Vec<(usize, Extent)>,
}

/// What the joined mesh is made from: it knows the corners.
struct Source<'a>(&'a dyn MeshSource);

impl std::fmt::Debug for Source<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0.name())
    }
}

/// Joins faces and positions within `memory` bytes (and a few blocks of the source), using the current thread pool.
/// `progress` is told of every face twice.
///
/// # Errors
/// If the source or a temporary file fails.
pub fn join<'a>(
    source: &'a dyn MeshSource,
    scratch: &ScratchDir,
    memory: u64,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Joined<'a>, InputError> {
    let layout = Layout::of(source);
    let join = Join { source, layout, scratch, memory, progress };
    let (by_vertex, firsts) = join.corners()?;
    let by_face = join.positions(by_vertex)?;
    join.assemble(by_face, &firsts)
}

struct Join<'a, 'b> {
    source: &'a dyn MeshSource,
    layout: Layout,
    scratch: &'b ScratchDir,
    memory: u64,
    progress: &'b (dyn Fn(u64) + Sync),
}

impl<'a> Join<'a, '_> {
    /// Vertices of a bucket: their positions fill a quarter of the memory.
    fn vertex_range(&self) -> u64 {
        (self.memory / 4 / size_of::<DVec3>() as u64).clamp(1, u64::from(u32::MAX))
    }

    /// Faces of a bucket: the positions of their corners fill a quarter of the memory.
    fn face_range(&self) -> u64 {
        (self.memory / 4 / (3 * self.layout.position()) as u64).clamp(1, u64::from(u32::MAX / 3))
    }

    /// Corners by range of vertices, and the first face of each block.
    fn corners(&self) -> Result<(Vec<SpillFile>, Vec<u64>), InputError> {
        let range = self.vertex_range();
        let count = self.source.vertex_count().div_ceil(range) as usize;
        let mut buckets = Buckets::create(self.scratch, "corners", count, self.memory / 2);
        let (blocks, batch) = (self.source.block_count(), 2 * rayon::current_num_threads());
        let (mut firsts, mut record, mut next) = (vec![0], Vec::new(), 0);
        for start in (0..blocks).step_by(batch) {
            let read: Vec<Result<FaceBlock, InputError>> = (start..blocks.min(start + batch))
                .into_par_iter()
                .map(|block| {
                    let mut faces = FaceBlock::default();
                    self.source.read_block(block, &mut faces).map(|()| faces)
                })
                .collect();
            for block in read {
                let block = block?;
                for (corner, id) in (3 * next..).zip(block.corners.as_flattened()) {
                    record.clear();
                    put(&mut record, id.0 % range, 4);
                    put(&mut record, corner, self.layout.corner);
                    buckets.write((id.0 / range) as usize, &record)?;
                }
                next += block.corners.len() as u64;
                firsts.push(next);
                (self.progress)(block.corners.len() as u64);
            }
        }
        Ok((buckets.finish()?, firsts))
    }

    /// Positions by range of faces. Each bucket of corners goes when it was read.
    fn positions(&self, by_vertex: Vec<SpillFile>) -> Result<Vec<SpillFile>, InputError> {
        let (vertices, range) = (self.source.vertex_count(), self.vertex_range());
        let corners = 3 * self.face_range();
        let count = self.source.face_count().div_ceil(self.face_range()) as usize;
        let mut buckets = Buckets::create(self.scratch, "positions", count, self.memory / 2);
        let (mut positions, mut record) = (Vec::new(), Vec::new());
        for (bucket, file) in (0..).zip(by_vertex) {
            let first = bucket * range;
            positions.clear();
            self.source.read_positions(
                VertexId(first),
                range.min(vertices - first) as usize,
                &mut positions,
            )?;
            let mut reader = file.reader()?;
            while let Some(block) = reader.next_block()? {
                for corner in block.chunks_exact(self.layout.corner_record()) {
                    let (vertex, corner) = (number(&corner[..4]), number(&corner[4..]));
                    record.clear();
                    put(&mut record, corner % corners, 4);
                    self.layout.put_position(&mut record, positions[vertex as usize]);
                    buckets.write((corner / corners) as usize, &record)?;
                }
            }
        }
        Ok(buckets.finish()?)
    }

    /// Positions in the order of the corners, cut into the blocks of the source.
    fn assemble(&self, by_face: Vec<SpillFile>, firsts: &[u64]) -> Result<Joined<'a>, InputError> {
        let face = 3 * self.layout.position();
        let length = |block: usize| (firsts[block + 1] - firsts[block]) as usize * face;
        let (blocks, ranges) = (firsts.len() - 1, by_face.len());
        let (mut parts, mut extents, mut pending) = (Vec::new(), Vec::with_capacity(blocks), Vec::new());
        let mut out = SpillWriter::create(self.scratch, "joined", 0);
        for (range, file) in by_face.into_iter().enumerate() {
            let first = range as u64 * self.face_range();
            let faces = self.face_range().min(self.source.face_count() - first);
            let placed = self.place(file, faces as usize * face)?;
            let mut rest = placed.as_slice();
            while !rest.is_empty() {
                let wanted = length(extents.len()) - pending.len();
                let (now, later) = rest.split_at(wanted.min(rest.len()));
                pending.extend_from_slice(now);
                rest = later;
                if now.len() == wanted {
                    extents.push((parts.len(), out.write_block(&pending)?));
                    pending.clear();
                }
            }
            (self.progress)(faces);
            // A new part for each 1/PARTS of the ranges.
            if (range + 1) * PARTS / ranges != range * PARTS / ranges && range + 1 < ranges {
                let full = std::mem::replace(&mut out, SpillWriter::create(self.scratch, "joined", 0));
                parts.push(RwLock::new(Some(full.finish()?.blocks()?)));
            }
        }
        // Blocks without faces at the end.
        while extents.len() < blocks {
            extents.push((parts.len(), out.write_block(&[])?));
        }
        parts.push(RwLock::new(Some(out.finish()?.blocks()?)));
        Ok(Joined { source: Source(self.source), layout: self.layout, parts, extents })
    }

    /// The positions of one range of faces, `bytes` in all. Every corner was written once.
    fn place(&self, file: SpillFile, bytes: usize) -> Result<Vec<u8>, InputError> {
        let width = self.layout.position();
        let mut placed = vec![0; bytes];
        let mut reader = file.reader()?;
        while let Some(block) = reader.next_block()? {
            for record in block.chunks_exact(self.layout.placed_corner()) {
                let at = number(&record[..4]) as usize * width;
                placed[at..at + width].copy_from_slice(&record[4..]);
            }
        }
        Ok(placed)
    }
}

impl Joined<'_> {
    /// Says that blocks before `block` will not be read again.
    pub(super) fn release_before(&self, block: usize) {
        let needed = self.extents.get(block).map_or(self.parts.len(), |(part, _)| *part);
        for part in &self.parts[..needed] {
            part.write().unwrap_or_else(PoisonError::into_inner).take();
        }
    }
}

impl MeshSource for Joined<'_> {
    fn name(&self) -> String {
        self.source.0.name()
    }

    fn vertex_count(&self) -> u64 {
        self.source.0.vertex_count()
    }

    fn face_count(&self) -> u64 {
        self.source.0.face_count()
    }

    fn block_count(&self) -> usize {
        self.source.0.block_count()
    }

    fn read_block(&self, block: usize, out: &mut FaceBlock) -> Result<(), InputError> {
        self.source.0.read_block(block, out)
    }

    fn read_placed(
        &self,
        block: usize,
        out: &mut FaceBlock,
        places: &mut Vec<[DVec3; 3]>,
    ) -> Result<(), InputError> {
        self.source.0.read_block(block, out)?;
        let (part, extent) = self.extents[block];
        let mut bytes = Vec::new();
        match &*self.parts[part].read().unwrap_or_else(PoisonError::into_inner) {
            Some(part) => part.read(extent, &mut bytes)?,
            None => {
                let (index, count) = (block as u64, self.block_count() as u64);
                return Err(InputError::NoSuch { name: self.name(), what: "block", index, count });
            }
        }
        let width = self.layout.position();
        places.clear();
        places.extend(
            bytes
                .chunks_exact(3 * width)
                .map(|face| [0, 1, 2].map(|corner| self.layout.read_position(&face[corner * width..]))),
        );
        Ok(())
    }

    fn carries_positions(&self) -> bool {
        true
    }

    fn only_usable(&self) -> bool {
        self.source.0.only_usable()
    }

    fn coordinate_bytes(&self) -> usize {
        self.source.0.coordinate_bytes()
    }

    fn read_positions(&self, first: VertexId, count: usize, out: &mut Vec<DVec3>) -> Result<(), InputError> {
        self.source.0.read_positions(first, count, out)
    }

    fn gather_positions(&self, ids: &[VertexId], out: &mut Vec<DVec3>) -> Result<(), InputError> {
        self.source.0.gather_positions(ids, out)
    }

    fn corner_positions(
        &self,
        corners: &[[VertexId; 3]],
        out: &mut Vec<[DVec3; 3]>,
    ) -> Result<(), InputError> {
        self.source.0.corner_positions(corners, out)
    }

    fn vertex_offset(&self, id: VertexId) -> Option<u64> {
        self.source.0.vertex_offset(id)
    }
}
