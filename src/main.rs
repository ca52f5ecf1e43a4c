//! The command `crease`. Everything it does is in the library, so that tests reach it.

use std::process::ExitCode;

fn main() -> ExitCode {
    crease::cli::run(std::env::args_os()).into()
}
