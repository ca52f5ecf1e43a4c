//! `crease stitch`: the last step of a planned job, from the results of all tiles to the outputs.
//!
//! In: a workspace. Out: what `detect` writes, byte for byte, because it is the same code: a run that goes on where all tiles are
//! done.

use super::detect::{Origin, named_outputs, run};
use super::status::Status;
use crate::cli::args::StitchArgs;
use crate::cli::console;
use crate::cli::exit::{Exit, Failure};
use crate::cli::memory::Allocations;
use crate::cli::outputs::Outputs;
use crate::cli::planned::{PlannedJob, array};
use crate::workspace::Look;
use std::env;
use std::ffi::OsString;

/// Does what `args` ask for, which come from the command line `words`.
///
/// # Errors
/// If tiles are missing, or anything fails; there is no output then.
pub(in crate::cli) fn stitch(
    args: StitchArgs,
    words: &[OsString],
    allocations: Allocations,
) -> Result<Exit, Failure> {
    console::start_log(args.show.verbose);
    let here = env::current_dir()
        .map_err(|e| Failure::new(Exit::Resource, format!("the current directory: {e}")))?;
    let planned = PlannedJob::open(&here.join(&args.directory))?;
    let mut options = planned.options(Some(&args.node))?;
    (options.quiet, options.show) = (args.quiet, args.show);
    match args.output {
        Some(output) => (options.output, options.report) = (output, args.report),
        // Names that were given there are meant as they were there.
        None => {
            let there = planned.workspace.path().join(planned.record.directory.path());
            env::set_current_dir(&there).map_err(|e| {
                let reason =
                    format!("the directory in which the job was planned: {e}; say where outputs go with -o");
                Failure::about(Exit::Resource, &there, reason)
            })?;
        }
    }
    let files = planned.files();
    let written = Outputs::new(&options.output, &files)?;
    if planned.has_written(&named_outputs(&options, &written))? {
        if !options.quiet {
            console::print("stitched before\n")?;
        }
        return Ok(Exit::Done);
    }
    let status = Status::of(&planned, Look::Bytes)?;
    if !status.missing.is_empty() {
        let missing = array(status.missing.iter().copied());
        let reason = format!(
            "{} of {} tiles are missing or damaged: {missing}; run them with crease tile, then stitch again",
            status.missing.len(),
            status.tiles
        );
        return Err(Failure::about(Exit::Incomplete, planned.workspace.path(), reason));
    }
    run(&options, words, allocations, Origin { files, planned: Some(planned) })
}
