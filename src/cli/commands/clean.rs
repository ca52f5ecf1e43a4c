//! `crease clean`: gives up what an interrupted run has kept.
//!
//! In: a workspace. Out: the directory without it. Files that are not ours stay, and so does the directory then.

use crate::cli::args::CleanArgs;
use crate::cli::console;
use crate::cli::exit::{Exit, Failure};
use crate::workspace;

/// Does what `args` ask for.
///
/// # Errors
/// If there is no workspace, or a run works there.
pub(in crate::cli) fn clean(args: &CleanArgs) -> Result<Exit, Failure> {
    workspace::clean(&args.directory)?;
    let left = if args.directory.exists() { "; other files are in the directory, which stays" } else { "" };
    console::print(&format!("{}: removed{left}\n", args.directory.display()))?;
    Ok(Exit::Done)
}
