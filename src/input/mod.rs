//! Files in, triangles out: random access to a mesh that need not fit into memory.
//!
//! [`open_input`] takes whatever people have: PLY, OBJ, STL, OFF, packed or not, one file or many. A binary little-endian
//! PLY file is read in place; anything else is converted into one first, by a pass over the files in bounded memory.
//!
//! A [`MeshSource`] hands out *blocks* of consecutive triangles and positions by vertex id. Whatever it hands out has
//! been checked: indices are in range and list lengths fit the file, so that nothing behind this layer needs to
//! mistrust the input. Coordinates are handed out as they are; the scan refuses those that are not finite. A [`Sieve`]
//! leaves out the faces that would be refused.

mod bytes;
mod convert;
mod error;
mod files;
mod format;
mod map;
mod memory;
mod obj;
mod off;
mod open;
pub mod ply;
mod sieve;
mod stl;
mod stream;
mod text;

pub use bytes::{ByteSource, IoMode};
pub use convert::{InputFile, Progress, Weld};
pub use error::{InputError, InputPlace};
pub use files::InputFiles;
pub use format::Format;
pub use map::{exit_on_bus_error, say_on_bus_error};
pub use memory::MemorySource;
pub use open::{Input, OpenOptions, bytes_to_convert, open_input};
pub use ply::PlySource;
pub use sieve::{Decided, LARGEST_COORDINATE, LeftOut, Sieve, is_usable};
pub use stream::Packing;

use crate::mesh::{FaceId, VertexId};
use glam::DVec3;
use std::path::Path;

/// Polygons per block, unless the mesh is so large that there would be too many blocks.
pub const BLOCK: u64 = 4096;

/// Triangles of the input by ascending id.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FaceBlock {
    /// Global id of the first triangle.
    pub first: FaceId,
    /// Global id of each triangle where they are not consecutive; empty where they are.
    pub ids: Vec<FaceId>,
    /// Corners of each triangle, in the order of the file.
    pub corners: Vec<[VertexId; 3]>,
}

impl FaceBlock {
    /// Empties the block and makes it one of consecutive triangles from `first` on.
    pub fn restart(&mut self, first: FaceId) {
        self.first = first;
        self.ids.clear();
        self.corners.clear();
    }

    /// Global id of triangle `i` of the block.
    #[inline]
    pub fn id(&self, i: usize) -> FaceId {
        self.ids.get(i).copied().unwrap_or(FaceId(self.first.0 + i as u64))
    }
}

/// Random access to a triangle mesh.
///
/// Implementations are shared between threads; every method may be called from several at a time.
pub trait MeshSource: Sync {
    /// What to call this mesh in messages (usually the path).
    fn name(&self) -> String;

    /// Sees to it that the mesh is still what it was when it was opened. Cheap enough to be asked for each tile.
    ///
    /// # Errors
    /// [`InputError::Changed`] if it is not: then nothing that was read from it can be believed.
    fn unchanged(&self) -> Result<(), InputError> {
        Ok(())
    }

    /// Number of vertices, referenced or not.
    fn vertex_count(&self) -> u64;

    /// Number of triangles, after polygons were cut into fans.
    fn face_count(&self) -> u64;

    /// Number of blocks of triangles.
    fn block_count(&self) -> usize;

    /// Reads block `block` (`< block_count`) into `out`, whose previous content is dropped.
    ///
    /// # Errors
    /// If the file cannot be read, or a corner names a vertex that does not exist.
    fn read_block(&self, block: usize, out: &mut FaceBlock) -> Result<(), InputError>;

    /// Reads block `block` without the triangles that name a vertex that does not exist, and says how many those were. A
    /// source that knows no such triangles, or cannot tell them, reads the block as it is.
    ///
    /// # Errors
    /// If the file cannot be read.
    fn read_existing(&self, block: usize, out: &mut FaceBlock) -> Result<u64, InputError> {
        self.read_block(block, out)?;
        Ok(0)
    }

    /// Whether no triangle is handed out whose coordinates cannot be used; unused vertices may have any.
    fn only_usable(&self) -> bool {
        false
    }

    /// Appends the positions of `count` vertices from `first` on to `out`.
    ///
    /// # Errors
    /// If the file cannot be read.
    fn read_positions(&self, first: VertexId, count: usize, out: &mut Vec<DVec3>) -> Result<(), InputError>;

    /// Replaces `out` by the positions of `ids`, which must be strictly ascending.
    ///
    /// # Errors
    /// If the file cannot be read.
    fn gather_positions(&self, ids: &[VertexId], out: &mut Vec<DVec3>) -> Result<(), InputError>;

    /// Replaces `out` by the positions of the three corners of each triangle.
    ///
    /// # Errors
    /// If the file cannot be read.
    fn corner_positions(
        &self,
        corners: &[[VertexId; 3]],
        out: &mut Vec<[DVec3; 3]>,
    ) -> Result<(), InputError>;

    /// Reads block `block` into `out` and the positions of its corners into `places`, whose previous content is dropped.
    ///
    /// # Errors
    /// If the file cannot be read, or a corner names a vertex that does not exist.
    fn read_placed(
        &self,
        block: usize,
        out: &mut FaceBlock,
        places: &mut Vec<[DVec3; 3]>,
    ) -> Result<(), InputError> {
        self.read_block(block, out)?;
        self.corner_positions(&out.corners, places)
    }

    /// Whether blocks are stored with the positions of their corners, so that [`MeshSource::read_placed`] costs no more
    /// than [`MeshSource::read_block`] and positions should not be asked for by id.
    fn carries_positions(&self) -> bool {
        false
    }

    /// Bytes of a number that holds any coordinate of this mesh exactly: 4 (`f32`) or 8 (`f64`).
    fn coordinate_bytes(&self) -> usize {
        8
    }

    /// The file that the mesh is read from, if it is one.
    fn file(&self) -> Option<&Path> {
        None
    }

    /// Where the vertex is stored: its byte offset in the file, if there is a file.
    fn vertex_offset(&self, id: VertexId) -> Option<u64>;
}
