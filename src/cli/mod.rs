//! The command line: the only part that prints.
//!
//! In: the words of the command line. Out: an [`Exit`]. Results and summaries go to standard output; progress, the log
//! and errors go to standard error, so that either can be redirected alone. An error is one line.
//!
//! ```text
//!  args ──> commands: detect, info, diff, clean, completions, man; ──> text on stdout
//!             │     plan, tile, stitch, status
//!             │  targets, outcome, summary, records
//!             └──> progress, memory, interrupt ──> stderr
//! ```

mod args;
mod attempt;
mod bus_error;
mod colour;
mod commands;
mod console;
mod description;
mod exit;
mod input;
mod interrupt;
mod kill;
mod memory;
mod memory_limit;
mod outcome;
mod outputs;
mod plan_json;
mod planned;
mod progress;
mod records;
mod summary;
mod targets;
mod text;

pub use exit::Exit;
pub use memory::Allocations;

use args::{Cli, Command};
use exit::Failure;
use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Parses `arguments`, of which the first is the name of the program, and does what they ask for. `allocations` tells
/// what the allocator has handed out meanwhile.
pub fn run(arguments: impl IntoIterator<Item = OsString>, allocations: Allocations) -> Exit {
    console::report_panics_on_one_line();
    kill::arm();
    let words: Vec<OsString> = arguments.into_iter().collect();
    colour::choose(&words);
    let cli = match Cli::parse_words(words.iter().cloned()) {
        Ok(cli) => cli,
        Err(refusal) => return console::answer(&refusal),
    };
    // The hook has said by then what happened and where.
    let outcome = catch_unwind(AssertUnwindSafe(|| match cli.command {
        Command::Detect(args) => commands::detect(&args, &words, allocations),
        Command::Info(args) => commands::info(&args, &words, allocations),
        Command::Diff(args) => commands::diff(&args),
        Command::Clean(args) => commands::clean(&args),
        Command::Plan(args) => commands::plan(&args, &words, allocations),
        Command::Tile(args) => commands::tile(&args, &words, allocations),
        Command::Stitch(args) => commands::stitch(args, &words, allocations),
        Command::Status(args) => commands::status(&args),
        Command::Completions(args) => commands::completions(&args),
        Command::Man(args) => commands::man(&args),
    }))
    .unwrap_or(Err(Failure::new(Exit::Internal, "stopped by a bug")));
    outcome.unwrap_or_else(|failure| {
        console::error(&failure.message);
        failure.exit
    })
}
