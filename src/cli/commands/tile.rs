//! `crease tile`: some tiles of a planned job.
//!
//! In: a workspace and tiles. Out: the results of those that are not there yet, each in a file that is whole or not there, and a
//! log of this attempt. Nothing is locked and nobody is waited for: the same tile may be worked on at the same time elsewhere.

use crate::cli::args::TileArgs;
use crate::cli::args::{DetectArgs, ProgressKind};
use crate::cli::exit::{Exit, Failure};
use crate::cli::interrupt::Interrupts;
use crate::cli::memory::{Allocations, cpu_time, peak};
use crate::cli::planned::{PlannedJob, array, tiles};
use crate::cli::progress::Progress;
use crate::cli::text::counted;
use crate::cli::{bus_error, console};
use crate::error::Error;
use crate::input::{MeshSource, Sieve};
use crate::pipeline::{Job, TileDone};
use crate::workspace::{AttemptLog, FoundResult, Look};
use serde_json::json;
use std::ffi::OsString;
use std::sync::Arc;
use std::time::Instant;

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
    let mut attempt = Attempt::begin(&planned, &options, &missing)?;
    let done = attempt.work(&planned, args, &options, words, allocations);
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

/// This process at work.
struct Attempt<'a> {
    log: AttemptLog,
    missing: &'a [u32],
    started: Instant,
}

impl<'a> Attempt<'a> {
    fn begin(planned: &PlannedJob, options: &DetectArgs, missing: &'a [u32]) -> Result<Attempt<'a>, Failure> {
        let attempt = planned.workspace.attempt().unwrap_or_default();
        let what = match missing {
            [only] => format!("tile-{only:06}"),
            [first, .., last] => format!("tile-{first:06}-{last:06}"),
            [] => "tile-none".to_owned(),
        };
        let mut log = AttemptLog::begin(planned.workspace.path(), &what, attempt)?;
        let limits = options.work.limits();
        log.say(&json!({
            "event": "started", "attempt": attempt, "host": attempt.split('-').next(), "pid": std::process::id(),
            "tiles": array(missing.iter().copied()), "threads": limits.threads, "memory_bytes": limits.memory,
        }))?;
        Ok(Attempt { log, missing, started: Instant::now() })
    }

    fn work(
        &mut self,
        planned: &PlannedJob,
        args: &TileArgs,
        options: &DetectArgs,
        words: &[OsString],
        allocations: Allocations,
    ) -> Result<Exit, Failure> {
        let workspace = &planned.workspace;
        let files = workspace.files()?;
        let parts = self.missing.iter().map(|&tile| files.unfinished(tile)).collect();
        let kind = if args.quiet { ProgressKind::None } else { args.show.progress };
        bus_error::watch(&planned.record.mesh.path());
        let progress = Progress::new(kind, allocations, options.work.limits().memory);
        let interrupts = Interrupts::watch(workspace, parts, words)
            .map_err(|e| Failure::new(Exit::Resource, format!("cannot watch for signals: {e}")))?;
        workspace.count(0, self.missing.len() as u64);
        let done = self.compute(planned, options, &progress, &interrupts);
        interrupts.claim_end();
        match done {
            Ok(()) => Ok(Exit::Done),
            Err(Error::Stopped) => Ok(interrupts.report()),
            Err(error) => Err(Failure::of_run(&planned.record.name.path(), error)),
        }
    }

    fn compute(
        &mut self,
        planned: &PlannedJob,
        options: &DetectArgs,
        progress: &Progress,
        interrupts: &Interrupts,
    ) -> Result<(), Error> {
        let mesh = planned.mesh(options)?;
        let sieve = planned.record.sieve.clone().map(|decided| Sieve::again(&mesh, Arc::new(decided)));
        let source: &dyn MeshSource = sieve.as_ref().map_or(&mesh, |sieve| sieve);
        let job = Job::new(source, options.params(), options.work.limits(), progress)?
            .with_workspace(&planned.workspace, false)
            .with_stop(interrupts.flag());
        let (log, mut since) = (&mut self.log, self.started);
        job.run_tiles(tiles(self.missing), |tile: TileDone| {
            let seconds = since.elapsed().as_secs_f64();
            since = Instant::now();
            log.say(&json!({
                "event": "tile", "tile": tile.id.0, "seconds": seconds,
                "loaded_faces": tile.loaded_faces, "owned_faces": tile.owned_faces,
            }))?;
            Ok(())
        })?;
        Ok(())
    }

    fn end(&mut self, outcome: &Result<Exit, Failure>, allocations: Allocations) -> Result<(), Failure> {
        let (exit, message) = match outcome {
            Ok(exit) => (*exit, None),
            Err(failure) => (failure.exit, Some(&failure.message)),
        };
        let ended = self.log.say(&json!({
            "event": "ended", "exit": exit.code(), "message": message, "seconds": self.started.elapsed().as_secs_f64(),
            "cpu_seconds": cpu_time().map(|time| time.as_secs_f64()),
            "peak_allocated_bytes": (allocations.peak)() as u64, "peak_resident_bytes": peak(),
        }));
        // That the log is not complete hides no failure.
        if outcome.is_ok() { Ok(ended?) } else { Ok(()) }
    }
}
