//! `crease completions`: what a shell needs to complete our command lines.
//!
//! In: the name of a shell. Out: its script on standard output, made from the same definition as the help.

use crate::cli::args::{Cli, CompletionsArgs};
use crate::cli::console;
use crate::cli::exit::{Exit, Failure};
use clap::CommandFactory;

/// Does what `args` ask for.
///
/// # Errors
/// If standard output cannot be written.
pub(in crate::cli) fn completions(args: &CompletionsArgs) -> Result<Exit, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "crease", &mut script);
    console::print_bytes(&script)?;
    Ok(Exit::Done)
}
