//! What is said to a person, and the ways in which nobody may be listening.
//!
//! In: texts. Out: standard output and standard error. A reader that has gone away is no failure, and never a panic. Lines on
//! standard error come above the progress bar, if there is one, and never through it.

use super::colour::{self, ERROR};
use super::exit::{Exit, Failure};
use clap::error::ErrorKind;
use indicatif::ProgressBar;
use std::io::{self, Write};
use std::sync::{Mutex, PoisonError};

/// Writes the result of a command to standard output, in colours only where they are wanted.
///
/// # Errors
/// If it cannot be written, unless the reader has seen enough and hung up.
pub(super) fn print(text: &str) -> Result<(), Failure> {
    match colour::wanted(&io::stdout()) {
        true => print_bytes(text.as_bytes()),
        false => print_bytes(colour::plain(text).as_bytes()),
    }
}

/// The same with bytes for a program, as they are.
///
/// # Errors
/// As for [`print`].
pub(super) fn print_bytes(bytes: &[u8]) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure::new(Exit::Resource, format!("standard output: cannot write: {error}")))
        }
        _ => Ok(()),
    }
}

/// The bar that is on the terminal now.
static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// From now on lines come above `bar`; without one, the terminal is free.
pub(super) fn show_bar(bar: Option<ProgressBar>) {
    let before = std::mem::replace(&mut *BAR.lock().unwrap_or_else(PoisonError::into_inner), bar);
    if let Some(before) = before {
        before.finish_and_clear();
    }
}

/// Writes a line to standard error. If even that fails, there is nobody left to tell.
pub(super) fn say(line: &str) {
    say_bytes(format!("{line}\n").as_bytes());
}

fn say_bytes(bytes: &[u8]) {
    // In one piece, so that lines of several processes do not mix in a log.
    let write = || {
        let _ = io::stderr().lock().write_all(bytes);
    };
    let bar = BAR.lock().unwrap_or_else(PoisonError::into_inner).clone();
    match bar {
        Some(bar) => bar.suspend(write),
        None => write(),
    }
}

/// Reports a failure.
pub(super) fn error(message: &str) {
    show_bar(None);
    say(&match colour::wanted(&io::stderr()) {
        true => in_colour(&error_line(message)),
        false => error_line(message),
    });
}

/// An error line on a terminal.
fn in_colour(line: &str) -> String {
    line.replacen("error:", &colour::styled(ERROR, "error:"), 1)
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
        .with_writer(|| Above)
        .with_ansi(false)
        .log_internal_errors(false)
        .try_init();
}

/// The log, line by line, above the bar.
struct Above;

impl Write for Above {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        say_bytes(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
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
    fn one_word_of_an_error_is_red() {
        let line = in_colour(&error_line("a.ply: error: none"));
        assert_eq!(colour::plain(&line), "crease: error: a.ply: error: none");
        assert!(line.starts_with("crease: \u{1b}") && line.ends_with(" a.ply: error: none"), "{line:?}");
    }

    #[test]
    fn names_with_line_ends_do_not_break_the_line() {
        assert_eq!(one_line("a\nb\r: c"), "a b : c");
    }
}
