//! What the program can do. In: arguments. Out: files, text, and how it ended.

mod clean;
mod completions;
mod detect;
mod diff;
mod group;
mod info;
mod man;
mod plan;
mod status;
mod stitch;
mod tile;

pub(super) use clean::clean;
pub(super) use completions::completions;
pub(super) use detect::detect;
pub(super) use diff::diff;
pub(super) use info::info;
pub(super) use man::man;
pub(super) use plan::plan;
pub(super) use status::status;
pub(super) use stitch::stitch;
pub(super) use tile::tile;
