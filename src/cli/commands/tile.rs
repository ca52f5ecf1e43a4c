//! `crease tile`: some tiles of a planned job.
//!
//! In: a workspace and tiles. Out: the results of those that are not there yet, each in a file that is whole or not there, and a
//! log of this attempt. Nothing is locked and nobody is waited for: the same tile may be worked on at the same time elsewhere.

use crate::cli::args::TileArgs;
use crate::cli::args::{DetectArgs, ProgressKind};
use crate::cli::attempt::Attempt;
use crate::cli::exit::{Exit, Failure};
use crate::cli::interrupt::Interrupts;
use crate::cli::memory::Allocations;
use crate::cli::planned::{PlannedJob, tiles};
use crate::cli::progress::Progress;
use crate::cli::text::counted;
use crate::cli::{bus_error, console};
use crate::error::Error;
use crate::input::{MeshSource, Sieve};
use crate::pipeline::{Job, TileDone};
use crate::workspace::{FoundResult, Look};
use serde_json::json;
use std::ffi::OsString;
use std::sync::Arc;

/// Does what `args` ask for, which come from the command line `words`.
///
/// # Errors
/// If anything fails; results that are there then are whole.
pub(in crate::cli) fn tile(
    args: &TileArgs,
    words: &[OsString],
    allocations: Allocations,
) -> Result<Exit, Failure> {
    console::start_log(args.show.verbose);
    let planned = PlannedJob::open(&args.directory)?;
    let options = planned.options(Some(&args.node))?;
    let missing = missing(&planned, &args.wanted().into_iter().collect::<Vec<_>>())?;
    if missing.is_empty() {
        if !args.quiet {
            console::print("done before\n")?;
        }
        return Ok(Exit::Done);
    }
    let mut attempt = Attempt::begin(&planned, &options, ("tile", "tiles"), &missing)?;
    let task = Task { planned: &planned, args, options: &options, missing: &missing };
    let done = task.work(&mut attempt, words, allocations);
    attempt.end(&done, allocations)?;
    if let Ok(Exit::Done) = done
        && !args.quiet
    {
        console::print(&format!("{} done\n", counted(missing.len() as u64, "tile", "tiles")))?;
    }
    done
}

/// Those of `wanted` whose results are not there, or damaged.
fn missing(planned: &PlannedJob, wanted: &[u32]) -> Result<Vec<u32>, Failure> {
    let cells = planned.job()?.cells.len() as u32;
    if let Some(stray) = wanted.iter().find(|tile| **tile >= cells) {
        let reason = format!("there is no tile {stray}: the job has the tiles 0 to {}", cells - 1);
        return Err(Failure::about(Exit::Usage, planned.workspace.path(), reason));
    }
    let files = planned.workspace.files()?;
    let mut missing = Vec::new();
    for &tile in wanted {
        let found = files.look(tile, Look::Bytes)?;
        if found == FoundResult::Damaged {
            tracing::warn!("{}: damaged; the tile is done again", files.path(tile).display());
        }
        if !matches!(found, FoundResult::Whole(_)) {
            missing.push(tile);
        }
    }
    Ok(missing)
}

/// What there is to do.
struct Task<'a> {
    planned: &'a PlannedJob,
    args: &'a TileArgs,
    options: &'a DetectArgs,
    missing: &'a [u32],
}

impl Task<'_> {
    fn work(
        &self,
        attempt: &mut Attempt,
        words: &[OsString],
        allocations: Allocations,
    ) -> Result<Exit, Failure> {
        let Task { planned, args, options, missing } = *self;
        let workspace = &planned.workspace;
        let files = workspace.files()?;
        let parts = missing.iter().map(|&tile| files.unfinished(tile)).collect();
        let kind = if args.quiet { ProgressKind::None } else { args.show.progress };
        bus_error::watch(&planned.record.mesh.path());
        let progress = Progress::new(kind, allocations, options.work.limits().memory);
        let interrupts = Interrupts::watch(workspace, parts, words)
            .map_err(|e| Failure::new(Exit::Resource, format!("cannot watch for signals: {e}")))?;
        workspace.count(0, missing.len() as u64);
        let done = self.compute(attempt, &progress, &interrupts);
        interrupts.claim_end();
        match done {
            Ok(()) => Ok(Exit::Done),
            Err(Error::Stopped) => Ok(interrupts.report()),
            Err(error) => Err(Failure::of_run(&planned.record.name.path(), error)),
        }
    }

    fn compute(
        &self,
        attempt: &mut Attempt,
        progress: &Progress,
        interrupts: &Interrupts,
    ) -> Result<(), Error> {
        let Task { planned, options, missing, .. } = *self;
        let mesh = planned.mesh(options)?;
        let sieve = planned.record.sieve.clone().map(|decided| Sieve::again(&mesh, Arc::new(decided)));
        let source: &dyn MeshSource = sieve.as_ref().map_or(&mesh, |sieve| sieve);
        let job = Job::new(source, options.params(), options.work.limits(), progress)?
            .with_workspace(&planned.workspace, false)
            .with_stop(interrupts.flag());
        job.run_tiles(tiles(missing), |tile: TileDone| {
            let TileDone { id, loaded_faces, owned_faces } = tile;
            let more = json!({ "loaded_faces": loaded_faces, "owned_faces": owned_faces });
            Ok(attempt.done("tile", id.0, more)?)
        })?;
        Ok(())
    }
}
