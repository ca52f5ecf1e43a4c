//! `crease stitch`: the last step of a planned job, from the results of all tiles to the outputs.
//!
//! In: a workspace. Out: what `detect` writes, byte for byte, because it is the same code: a run that goes on where all tiles are
//! done. What groups of tiles have left is taken in the place of their results, where it is there and right.

use super::detect::{Origin, named_outputs, run};
use super::group::{GroupStatus, groups};
use crate::cli::args::StitchArgs;
use crate::cli::console;
use crate::cli::exit::{Exit, Failure};
use crate::cli::memory::Allocations;
use crate::cli::outputs::Outputs;
use crate::cli::planned::{PlannedJob, array};
use crate::pipeline::StitchedGroup;
use crate::workspace::{FoundResult, Look};
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
    if let Some(wanted) = args.wanted() {
        return groups(&args, &wanted, &planned, words, allocations);
    }
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
    let groups = found(&planned, options.output.has_tables(), options.quiet)?;
    run(&options, words, allocations, Origin { files, planned: Some(planned), groups })
}

/// The groups that are taken in the place of their tiles; all other tiles are there, and with `fields` all tiles.
fn found(planned: &PlannedJob, fields: bool, quiet: bool) -> Result<Vec<StitchedGroup>, Failure> {
    let tiles = planned.job()?.cells.len() as u32;
    let groups = GroupStatus::of(planned, tiles, Look::Bytes)?;
    for group in &groups.damaged {
        tracing::warn!("group {group} is damaged; the results of its tiles are taken");
    }
    let needed: Vec<u32> = (0..tiles).filter(|tile| fields || !groups.covers(*tile)).collect();
    let found = planned.workspace.files()?.look_at_all(&needed, Look::Bytes)?;
    let is_missing =
        |(tile, found): (&u32, &FoundResult)| (!matches!(found, FoundResult::Whole(_))).then_some(*tile);
    let missing: Vec<u32> = needed.iter().zip(&found).filter_map(is_missing).collect();
    if !missing.is_empty() {
        let reason = format!(
            "{} of {tiles} tiles are missing or damaged: {}; run them with crease tile, then stitch again",
            missing.len(),
            array(missing.iter().copied())
        );
        return Err(Failure::about(Exit::Incomplete, planned.workspace.path(), reason));
    }
    if groups.count > 0 && !quiet {
        let alone = (0..tiles).filter(|tile| !groups.covers(*tile));
        let rest = match array(alone) {
            none if none.is_empty() => "no tile by itself".to_owned(),
            some => format!("tiles by themselves: {some}"),
        };
        console::print(&format!(
            "stitched from {} of {} groups; {rest}\n",
            groups.whole.len(),
            groups.count
        ))?;
    }
    Ok(groups.whole)
}
