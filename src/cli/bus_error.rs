//! What is said when a mapped input goes away underneath.
//!
//! In: the input and the stage of the run. Out: a message for the handler of [`crate::input::exit_on_bus_error`], which can
//! only write and end the process, so that everything it says was prepared before. It says what any other error of the
//! input says: the file, the stage, what to do; and the exit code is that of a bad input.

use super::console::error_line;
use super::exit::Exit;
use crate::input::{exit_on_bus_error, say_on_bus_error};
use crate::pipeline::Stage;
use std::io::IsTerminal;
use std::path::Path;
use std::sync::OnceLock;

/// The input of this process: a command has one.
static INPUT: OnceLock<String> = OnceLock::new();

/// Begins to watch `input`. Called before it is opened.
pub(super) fn watch(input: &Path) {
    let input = INPUT.get_or_init(|| input.display().to_string());
    prepare(input, "open");
    if let Err(error) = exit_on_bus_error(Exit::BadInput.code()) {
        // Everything else works without.
        tracing::warn!(%error, "bus errors are not reported");
    }
}

/// Tells what the run is doing from now on.
pub(super) fn enter(stage: Stage) {
    if let Some(input) = INPUT.get() {
        prepare(input, stage.name());
    }
}

fn prepare(input: &str, stage: &str) {
    // A progress bar may stand on the line.
    let clear = if std::io::stderr().is_terminal() { "\r\x1b[K" } else { "" };
    let line = error_line(&message(input, stage));
    say_on_bus_error(format!("{clear}{line}\n"));
}

fn message(input: &str, stage: &str) -> String {
    format!(
        "{input}: a part of the file is gone: it was cut off, or its disk failed, while it was read; run again when nobody \
         writes to it, or on a copy (found in stage `{stage}`)"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_message_names_file_and_stage() {
        let message = message("scan.ply", Stage::Tiles.name());
        assert!(message.starts_with("scan.ply: ") && message.contains("stage `tiles`"), "{message}");
    }
}
