//! Why lines cannot be stitched.

use crate::spill::SpillError;

/// Lines that cannot be held or stored.
#[derive(Debug, thiserror::Error)]
pub enum StitchError {
    /// What is open between tiles does not fit.
    #[error(
        "{needed} bytes would be needed for lines that cross tiles, and {memory} are there; the last of them has {vertices} \
         vertices and lies near ({x}, {y}, {z}); give more memory, or larger tiles",
        x = near[0], y = near[1], z = near[2]
    )]
    TooLarge {
        /// Candidate vertices of the component that did not fit.
        vertices: u64,
        /// One of its vertices.
        near: [f64; 3],
        /// Bytes that would be needed.
        needed: u64,
        /// Bytes that may be used.
        memory: u64,
    },
    /// There are more vertices on lines than a set in memory can index.
    #[error(
        "{count} vertices on lines are more than a set of lines in memory can index; stream them instead"
    )]
    TooMany {
        /// How many.
        count: u64,
    },
    /// A temporary file failed.
    #[error(transparent)]
    Spill(#[from] SpillError),
}
