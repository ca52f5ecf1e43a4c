//! `crease info`: what a file holds, how it would be worked on, and how long that would take.
//!
//! In: a mesh. Out: text or JSON. The file is scanned and the plan is made; a few pieces of the mesh are worked on to see how
//! long it takes. Nothing is left on the disk.

use crate::cli::args::InfoArgs;
use crate::cli::description::{Known, describe, text};
use crate::cli::exit::{Exit, Failure};
use crate::cli::interrupt::Interrupts;
use crate::cli::memory::Allocations;
use crate::cli::progress::Progress;
use crate::cli::{bus_error, console, input};
use crate::config::{Limits, Params};
use crate::error::Error;
use crate::input::{InputFiles, MeshSource, Sieve};
use crate::partition::{Locality, vertex_reads};
use crate::pipeline::{Calibration, Event, Job, Observer, Planned, Stage};
use crate::workspace::Workspace;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Does what `args` ask for, which come from the command line `words`.
///
/// # Errors
/// If the file cannot be read, is not a mesh, or sigma does not suit it.
pub(in crate::cli) fn info(
    args: &InfoArgs,
    words: &[OsString],
    allocations: Allocations,
) -> Result<Exit, Failure> {
    console::start_log(args.show.verbose);
    let limits = args.work.limits();
    let files = InputFiles::find(&args.input.names)?;
    bus_error::watch(&files.name());
    let progress = Progress::new(args.show.progress, allocations, limits.memory);
    let place = place(&files, args.work.workspace.as_deref());
    let interrupts = Interrupts::watch(&place, Vec::new(), words)
        .map_err(|e| Failure::new(Exit::Resource, format!("cannot watch for signals: {e}")))?;
    let found = look(args, &files, &limits, &place, &progress);
    interrupts.claim_end();
    // Made for the conversion; what an interrupted `detect` keeps is never in it.
    if let Err(error) = place.remove() {
        tracing::warn!("{error}");
    }
    console::print(&found?).map(|()| Exit::Done)
}

/// Where a conversion goes: a directory beside the output that `detect` would write, with a name of its own for each process,
/// so that neither what an interrupted run keeps nor a run that works now is in the way.
fn place(files: &InputFiles, workspace: Option<&Path>) -> Workspace {
    let mut name = files.stem();
    name.push(format!(".crease-info-{}", std::process::id()));
    Workspace::at(&workspace.map_or_else(|| PathBuf::from(&name), |directory| directory.join(&name)))
}

/// All there is to say.
fn look(
    args: &InfoArgs,
    files: &InputFiles,
    limits: &Limits,
    place: &Workspace,
    progress: &Progress,
) -> Result<String, Failure> {
    let input = input::open(files, args.input.weld, &place.scratch(), limits, progress)?;
    let sigma = args.preset.preset.values().sigma(args.sigma.given());
    let params = Params { sigma, ..Params::default() };
    let sieve = args.bad.sieve(input.mesh())?;
    let source: &dyn MeshSource = sieve.as_ref().map_or(input.mesh(), |sieve| sieve);
    let (planned, scan, calibration) =
        planned(source, params, *limits, progress).map_err(|e| Failure::of_run(input.mesh().path(), e))?;
    let known = Known {
        input: &input,
        source,
        planned: &planned,
        locality: Locality::new(&planned.plan, &planned.scan, vertex_reads(source)?),
        left_out: sieve.as_ref().map(Sieve::left_out).unwrap_or_default(),
        limits,
        preset: args.preset.preset,
        scan,
        calibration,
    };
    let description = describe(&known);
    match args.json {
        false => Ok(text(&description)),
        true => serde_json::to_string_pretty(&description)
            .map(|json| json + "\n")
            .map_err(|e| Failure::new(Exit::Internal, format!("the description cannot be written: {e}"))),
    }
}

/// The plan, how long the scan took, and how long some pieces of the mesh take.
fn planned(
    source: &dyn MeshSource,
    params: Params,
    limits: Limits,
    progress: &Progress,
) -> Result<(Planned, Duration, Option<Calibration>), Error> {
    let started = Instant::now();
    let job = Job::new(source, params, limits, progress)?;
    let planned = job.plan()?;
    let wall = started.elapsed();
    let calibration = job.calibrate(&planned)?;
    progress.event(Event::Finished { stage: Stage::Scan, wall: started.elapsed() });
    Ok((planned, wall, calibration))
}
