//! What the program can do. In: arguments. Out: files, text, and how it ended.

mod clean;
mod detect;
mod diff;
mod info;

pub(super) use clean::clean;
pub(super) use detect::detect;
pub(super) use diff::diff;
pub(super) use info::info;
