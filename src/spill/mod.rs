//! Temporary files for what does not fit into memory.
//!
//! In: bytes, record by record. Out: the same bytes, in the order in which they were written. Everything lies in a
//! [`ScratchDir`], which goes with its files when nobody needs it any more, and knows how much of the disk it takes. Files
//! are made of *blocks*, each with a checksum over its bytes and its place, so that a torn, mixed up or damaged block is
//! an error that names the file and the offset, and never a wrong number.
//!
//! Memory: a writer holds one block, a reader holds one block; [`Buckets`] holds one for each of its files; a [`Sorter`] is
//! told how much it may hold. Nothing is synced to the disk, because nothing here outlives the process; but a file that
//! is worth it can be kept ([`BlockReader::keep`]), and is synced then.

mod buckets;
mod disk;
mod error;
mod file;
mod merge;
mod place;
mod plain;
mod point;
mod reader;
mod run;
mod scratch;
mod sized;
mod sorter;

pub use buckets::Buckets;
pub use disk::{check_room, free_bytes, is_in_memory};
pub use error::SpillError;
pub use file::{Extent, SpillFile, SpillWriter};
pub use merge::Merge;
pub use place::{Ground, ScratchPlace};
pub use plain::{PlainFile, PlainWriter};
pub use point::{at_points, point};
pub use reader::{BlockReader, SpillReader};
pub use run::{KeptReader, KeptRun, Run, blocks_of_records};
pub use scratch::{ScratchDir, remove_left_behind};
pub use sized::SizedFile;
pub use sorter::{Record, Sorted, Sorter};

/// Largest block that is worth having: beyond it, a disk does not get faster.
pub const LARGEST_BLOCK: usize = 1 << 20;
/// Smallest block: below it, system calls and headers cost more than the bytes.
pub const SMALLEST_BLOCK: usize = 1 << 10;

#[cfg(test)]
mod tests;
