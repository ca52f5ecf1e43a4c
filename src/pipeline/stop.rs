//! How a run ends before its end.
//!
//! In: a flag that somebody sets, at any time. Out: [`Error::Stopped`] at the next place where a face or a position would be
//! read, a tile loaded or a result taken. Long steps over the mesh all ask a source for their next block, so it is the
//! source that looks at the flag, and the steps know nothing of it.

use crate::error::Error;
use crate::input::{FaceBlock, InputError, MeshSource};
use crate::mesh::VertexId;
use glam::DVec3;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// The flag of those who never stop.
pub(super) static NEVER: AtomicBool = AtomicBool::new(false);

/// Whether to go on.
pub(super) fn go_on(stop: &AtomicBool) -> Result<(), Error> {
    if stop.load(Ordering::Relaxed) { Err(Error::Stopped) } else { Ok(()) }
}

/// A source that fails as soon as the flag is set.
pub(super) struct Stoppable<'a> {
    pub source: &'a dyn MeshSource,
    pub stop: &'a AtomicBool,
}

impl Stoppable<'_> {
    fn go_on(&self) -> Result<(), InputError> {
        if self.stop.load(Ordering::Relaxed) { Err(InputError::Stopped) } else { Ok(()) }
    }
}

impl MeshSource for Stoppable<'_> {
    fn name(&self) -> String {
        self.source.name()
    }

    fn unchanged(&self) -> Result<(), InputError> {
        self.source.unchanged()
    }

    fn only_usable(&self) -> bool {
        self.source.only_usable()
    }

    fn vertex_count(&self) -> u64 {
        self.source.vertex_count()
    }

    fn face_count(&self) -> u64 {
        self.source.face_count()
    }

    fn block_count(&self) -> usize {
        self.source.block_count()
    }

    fn read_block(&self, block: usize, out: &mut FaceBlock) -> Result<(), InputError> {
        self.go_on()?;
        self.source.read_block(block, out)
    }

    fn read_existing(&self, block: usize, out: &mut FaceBlock) -> Result<u64, InputError> {
        self.go_on()?;
        self.source.read_existing(block, out)
    }

    fn read_placed(
        &self,
        block: usize,
        out: &mut FaceBlock,
        places: &mut Vec<[DVec3; 3]>,
    ) -> Result<(), InputError> {
        self.go_on()?;
        self.source.read_placed(block, out, places)
    }

    fn carries_positions(&self) -> bool {
        self.source.carries_positions()
    }

    fn coordinate_bytes(&self) -> usize {
        self.source.coordinate_bytes()
    }

    fn read_positions(&self, first: VertexId, count: usize, out: &mut Vec<DVec3>) -> Result<(), InputError> {
        self.go_on()?;
        self.source.read_positions(first, count, out)
    }

    fn gather_positions(&self, ids: &[VertexId], out: &mut Vec<DVec3>) -> Result<(), InputError> {
        self.go_on()?;
        self.source.gather_positions(ids, out)
    }

    fn corner_positions(
        &self,
        corners: &[[VertexId; 3]],
        out: &mut Vec<[DVec3; 3]>,
    ) -> Result<(), InputError> {
        self.go_on()?;
        self.source.corner_positions(corners, out)
    }

    fn file(&self) -> Option<&Path> {
        self.source.file()
    }

    fn vertex_offset(&self, id: VertexId) -> Option<u64> {
        self.source.vertex_offset(id)
    }
}
