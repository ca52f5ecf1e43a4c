//! What a run keeps on the disk so that another can go on where it stopped.
//!
//! In: the plan of a run, and the result of each tile as it comes. Out: the same, after the process was killed at any
//! instant. A [`Workspace`] is a directory with these files; `docs/RELIABILITY.md` says what is promised and why it holds.
//!
//! | file | content | written |
//! |---|---|---|
//! | `crease-workspace` | that the directory is ours; the lock is on it | first |
//! | `crease-job` | parameters, fingerprint of the input, scan, cells ([`JobRecord`]) | once, before the first tile |
//! | `crease-sorted` | the mesh in spatial order, if it was rewritten | before the job |
//! | `crease-tiles` | one frame ([`Label`], checksums, payload) for each result of a tile, one after the other | tile by tile |
//! | `crease-outputs` | the names of the outputs | before the first of them gets its name |
//! | `crease-scratch-PID-N/` | temporary files, of no use to any other process | |
//!
//! Nothing is believed that does not have its checksum. A damaged result of a tile is as if the tile had not been done; a
//! job that does not fit is refused with the name of what differs.

mod directory;
mod durable;
mod error;
mod frame;
mod job;
mod log;
mod marker;
mod removal;

#[cfg(test)]
mod tests;

pub use directory::Workspace;
pub use error::WorkspaceError;
pub use job::{FileMark, Identity, InputMark, JobRecord, MeshRecord};
pub use log::{Label, Place};
pub use removal::clean;
