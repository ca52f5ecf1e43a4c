//! What is said while the work is done, and how.

use super::OUTPUT;
use clap::{Args, ValueEnum};

/// What is said while the work is done.
#[derive(Debug, Args)]
pub(in crate::cli) struct ShowArgs {
    /// How progress is shown on standard error: `bar`, `plain` lines, `json` (one object on each line), or `none`. `auto`
    /// shows a bar on a terminal and lines elsewhere.
    #[arg(long, value_enum, value_name = "KIND", help_heading = OUTPUT, default_value = "auto", hide_possible_values = true)]
    pub progress: ProgressKind,

    /// Log details of the work to standard error. The environment variable RUST_LOG chooses more finely.
    #[arg(short, long, help_heading = OUTPUT)]
    pub verbose: bool,
}

/// How progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum ProgressKind {
    Auto,
    Bar,
    Plain,
    Json,
    None,
}
