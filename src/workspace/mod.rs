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
//! A job can be planned for many tasks, which work in one workspace at the same time, on several machines
//! (`docs/CLUSTER.md`). Then nobody holds a lock, nothing is appended to, and instead of `crease-tiles` there are
//!
//! | file | content | written |
//! |---|---|---|
//! | `crease-mesh.ply` | the input, if tiles cannot be loaded from it as it is | by the process that plans |
//! | `crease-plan` | the command line, files, what is known of the mesh ([`PlanRecord`]) | last by the process that plans |
//! | `plan.json` | the same for schedulers | right after it |
//! | `tiles/NNNNNN.result` | the frames of one tile ([`Results`]) | by a task, whole or not at all |
//! | `groups/NNNNNN.result` | the frames of what a group of tiles leaves ([`Groups`]) | by a task, whole or not at all |
//! | `log/*.jsonl` | what an attempt says of itself ([`AttemptLog`]) | by that attempt |
//! | `crease-done` | the outputs, with their checksums | when all of them are there |
//!
//! Nothing is believed that does not have its checksum. A damaged result of a tile is as if the tile had not been done; a
//! job that does not fit is refused with the name of what differs.

mod attempts;
mod directory;
mod durable;
mod error;
mod frame;
mod groups;
mod job;
mod log;
mod marker;
mod planned;
mod removal;
mod results;

#[cfg(test)]
mod tests;

pub use attempts::AttemptLog;
pub use directory::Workspace;
pub use error::WorkspaceError;
pub use groups::{FoundGroup, GroupWriter, Groups, count_of_groups, tiles_of_group};
pub use job::{FileMark, Identity, InputMark, JobRecord, MeshRecord};
pub use log::{Label, Place};
pub use planned::{AnyPath, DoneOutput, PlanRecord, relative, relative_place};
pub use removal::clean;
pub use results::{Found as FoundResult, Look, Results, name_of as name_of_result, name_of_group};
