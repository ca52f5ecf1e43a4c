//! A mesh whose file has no order, rewritten so that tiles can be loaded from it.
//!
//! In: a source in any order, an amount of memory, a scratch directory. Out: sources that give the same faces under the
//! same ids with the same positions. Nothing in here changes the result; it changes how often the disk is asked.
//!
//! Two steps, each of which is left out where it is not needed. Both are external bucket sorts: sequential reads, sequential
//! writes, one bucket in memory at a time (Chiang and Silva, "I/O optimal isosurface extraction", 1997, call the first a
//! *normalisation* of an indexed mesh):
//!
//! 1. [`join`]: corners are written into buckets by range of vertices. Each bucket is met with the positions of its range,
//!    which makes rows of corner and position; these are written into buckets by range of faces, and from those comes a
//!    [`Joined`] mesh: the blocks of the file with the positions of their corners. No position is looked up by id.
//! 2. [`sort`]: faces with ids and positions are written into buckets along a space-filling curve, whose limits come from the
//!    sample of the scan. Each bucket is sorted in memory and cut into blocks of neighbours: a [`SpatialStore`].
//!
//! Temporary disk: a bucket goes as soon as it was read. For f32 coordinates and 32-bit ids a face takes 48 bytes between the
//! buckets of the first step, 36 behind it, 52 in the buckets of the second, and some 20 in the end; as PLY it takes 19.

mod join;
mod layout;
mod sort;
mod store;

pub use join::{Joined, join};
pub use sort::sort;
pub use store::{SortedTable, SpatialStore};

use crate::input::MeshSource;
use layout::Layout;

/// Bytes on the disk that are needed at most at a time, with or without the first step. Blocks have heads, and buckets that
/// turn out too large are copied once more: a twentieth.
pub fn temporary_bytes(source: &dyn MeshSource, joins: bool) -> u64 {
    let layout = Layout::of(source);
    let between = if joins { 3 * layout.placed_corner() } else { 0 };
    let face = layout.face_record().max(between) as u64;
    source.face_count().saturating_mul(face).saturating_mul(21) / 20
}

/// The least memory that the buckets of a mesh of this size fit into, in bytes: with m bytes there are so many of m/4 that
/// their blocks of 1 KiB fill m/2.
pub fn least_memory(source: &dyn MeshSource) -> u64 {
    let layout = Layout::of(source);
    let bytes = source.face_count() as f64 * layout.face_record().max(72) as f64 * 2.0;
    (8.0 * bytes * crate::spill::SMALLEST_BLOCK as f64).sqrt() as u64
}
