//! The command `crease`. Everything it does is in the library, so that tests reach it.

use cap::Cap;
use crease::cli::Allocations;
use std::alloc::System;
use std::process::ExitCode;

/// Counts what is allocated, so that a run can say whether it kept within its memory.
#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, usize::MAX);

fn main() -> ExitCode {
    let allocations = Allocations { now: || ALLOCATOR.allocated(), peak: || ALLOCATOR.max_allocated() };
    crease::cli::run(std::env::args_os(), allocations).into()
}
