//! What is said to a person, and the ways in which nobody may be listening.
//!
//! In: texts. Out: standard output and standard error. A reader that has gone away is no failure, and never a panic.

use super::exit::{Exit, Failure};
use clap::error::ErrorKind;
use std::io::{self, Write};

/// Writes the result of a command to standard output.
///
/// # Errors
/// If it cannot be written, unless the reader has seen enough and hung up.
pub(super) fn print(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure::new(Exit::Resource, format!("standard output: cannot write: {error}")))
        }
        _ => Ok(()),
    }
}

/// Writes a line to standard error. If even that fails, there is nobody left to tell.
pub(super) fn say(line: &str) {
    let _ = io::stderr().lock().write_all(format!("{line}\n").as_bytes());
}

/// Reports a failure.
pub(super) fn error(message: &str) {
    say(&error_line(message));
}

/// A failure on one line, whatever is in the message: names of files may contain anything.
pub(super) fn error_line(message: &str) -> String {
    format!("crease: error: {}", one_line(message))
}

fn one_line(message: &str) -> String {
    message.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// Prints the help that was asked for, or says what is wrong with the command line.
pub(super) fn answer(refusal: &clap::Error) -> Exit {
    match refusal.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => match refusal.print() {
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Exit::Resource,
            _ => Exit::Done,
        },
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            // On standard error, like any answer to a mistake.
            let _ = refusal.print();
            Exit::Usage
        }
        _ => {
            error(&condensed(&refusal.render().to_string()));
            Exit::Usage
        }
    }
}

/// The paragraphs of a usage error as one line, without the part that every one of them ends on.
fn condensed(rendered: &str) -> String {
    let mut line = String::new();
    for part in rendered.lines().map(str::trim).filter(|part| !part.is_empty()) {
        if part.starts_with("Usage:") || part.starts_with("For more information") {
            break;
        }
        if !line.is_empty() {
            line.push_str(if line.ends_with(':') { " " } else { "; " });
        }
        line.push_str(part.trim_start_matches("error: ").trim_start_matches("tip: "));
    }
    line.push_str("; --help lists what there is");
    line
}

/// Makes a panic, which is always a bug, say where it happened, on one line.
pub(super) fn report_panics_on_one_line() {
    std::panic::set_hook(Box::new(|info| say(&format!("crease: bug: {}", one_line(&info.to_string())))));
}

/// Starts the log on standard error: what `RUST_LOG` asks for, or `verbose` details, or warnings.
pub(super) fn start_log(verbose: bool) {
    use tracing_subscriber::EnvFilter;
    let default = if verbose { "crease=debug" } else { "warn" };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(default));
    // Whoever embeds this may have a log already, which is as good.
    let _ = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(io::stderr)
        .with_ansi(false)
        .log_internal_errors(false)
        .try_init();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn usage_errors_become_one_line() {
        let rendered = "error: unexpected argument '--forse' found\n\n  tip: a similar argument exists: '--force'\n\n\
                        Usage: crease detect [OPTIONS]\n\nFor more information, try '--help'.\n";
        assert_eq!(
            condensed(rendered),
            "unexpected argument '--forse' found; a similar argument exists: '--force'; --help lists what there is"
        );
        let missing =
            "error: the following required arguments were not provided:\n  <INPUT>\n\nUsage: crease\n";
        assert!(
            condensed(missing).starts_with("the following required arguments were not provided: <INPUT>;")
        );
    }

    #[test]
    fn names_with_line_ends_do_not_break_the_line() {
        assert_eq!(one_line("a\nb\r: c"), "a b : c");
    }
}
