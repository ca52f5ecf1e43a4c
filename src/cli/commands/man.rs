//! `crease man`: the manual pages, made from the same definition as the help.
//!
//! In: perhaps a directory. Out: the main page on standard output, or all pages as files that replace earlier ones.

use crate::cli::args::{Cli, ManArgs};
use crate::cli::console;
use crate::cli::exit::{Exit, Failure};
use clap::{Command, CommandFactory};
use clap_mangen::Man;
use std::fs;
use std::path::Path;

/// Does what `args` ask for.
///
/// # Errors
/// If the pages cannot be written.
pub(in crate::cli) fn man(args: &ManArgs) -> Result<Exit, Failure> {
    let pages = pages()?;
    match (&args.out, pages.first()) {
        (Some(directory), _) => write(directory, &pages)?,
        (None, Some(main)) => console::print_bytes(&main.text)?,
        (None, None) => {}
    }
    Ok(Exit::Done)
}

/// A manual page.
struct Page {
    /// The name of its file.
    name: String,
    text: Vec<u8>,
}

/// The main page and those of all commands.
fn pages() -> Result<Vec<Page>, Failure> {
    let mut main = Cli::command().disable_help_subcommand(true);
    // Gives the commands their full names, `crease-detect`, and what all of them take.
    main.build();
    let commands: Vec<Command> = main.get_subcommands().filter(|c| !c.is_hide_set()).cloned().collect();
    std::iter::once(main).chain(commands).map(page).collect()
}

fn page(command: Command) -> Result<Page, Failure> {
    let page = Man::new(command);
    let mut text = Vec::new();
    page.render(&mut text)
        .map_err(|e| Failure::new(Exit::Internal, format!("a manual page cannot be made: {e}")))?;
    Ok(Page { name: page.get_filename(), text })
}

fn write(directory: &Path, pages: &[Page]) -> Result<(), Failure> {
    let failed = |path: &Path, e| Failure::about(Exit::Resource, path, format!("cannot write: {e}"));
    fs::create_dir_all(directory).map_err(|e| failed(directory, e))?;
    for page in pages {
        let path = directory.join(&page.name);
        fs::write(&path, &page.text).map_err(|e| failed(&path, e))?;
    }
    Ok(())
}
