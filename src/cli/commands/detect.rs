//! `crease detect`: the whole job on this machine.
//!
//! In: a mesh. Out: the lines, perhaps the table of all vertices, and a summary. Either all outputs appear or none.

use crate::cli::args::DetectArgs;
use crate::cli::exit::{Exit, Failure};
use crate::cli::interrupt::Interrupts;
use crate::cli::memory::Allocations;
use crate::cli::planned::PlannedJob;
use crate::cli::progress::Progress;
use crate::cli::summary::{Outcome, Written};
use crate::cli::{bus_error, console, input, memory, targets};
use crate::error::Error;
use crate::input::{InputFiles, MeshSource, Sieve};
use crate::output::{AttributeFile, FieldSink, part_of, stage_ply};
use crate::pipeline::{Detection, Event, Job, Observer, Stage};
use crate::stitch::{LineSource, Statistics, StoredLines};
use crate::workspace::{Workspace, WorkspaceError};
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Does what `args` ask for, which come from the command line `words`.
///
/// # Errors
/// If anything fails; there is no output then.
pub(in crate::cli) fn detect(
    args: &DetectArgs,
    words: &[OsString],
    allocations: Allocations,
) -> Result<Exit, Failure> {
    console::start_log(args.show.verbose);
    let files = InputFiles::find(&args.input.names)?;
    run(args, words, allocations, Origin { files, planned: None })
}

/// What a run starts from.
pub(super) struct Origin {
    /// The input.
    pub files: InputFiles,
    /// A job whose tiles are all done; this run does the rest.
    pub planned: Option<PlannedJob>,
}

/// The outputs of a run over `files`: the lines first.
pub(super) fn named_outputs(args: &DetectArgs, files: &InputFiles) -> Vec<PathBuf> {
    let lines = args.output.lines.clone().unwrap_or_else(|| targets::default_output(files));
    [Some(lines), args.output.attributes.clone()].into_iter().flatten().collect()
}

/// Which outputs may be replaced if they exist: what a run had begun to hand over when it was killed may be handed over again.
pub(super) fn may_replace(args: &DetectArgs, workspace: &Workspace) -> impl Fn(&Path) -> bool {
    let begun = |output: &Path| targets::place(output).is_some_and(|place| workspace.has_announced(&place));
    move |output| args.output.force || begun(output)
}

/// The whole job, or what is left of it.
///
/// # Errors
/// If anything fails; there is no output then.
pub(super) fn run(
    args: &DetectArgs,
    words: &[OsString],
    allocations: Allocations,
    origin: Origin,
) -> Result<Exit, Failure> {
    let started = Instant::now();
    let (params, limits) = (args.params(), args.work.limits());
    let Origin { files, planned } = &origin;
    let outputs = named_outputs(args, files);
    let outputs: Vec<&Path> = outputs.iter().map(PathBuf::as_path).collect();
    let output = outputs[0].to_owned();
    let workspace = match (planned, &args.work.workspace) {
        (Some(planned), _) => planned.workspace.clone(),
        (None, Some(path)) => Workspace::at(path),
        (None, None) => Workspace::beside(&output),
    };
    targets::check(&files.files, &outputs, may_replace(args, &workspace))?;

    bus_error::watch(&files.name());
    let progress = Progress::new(args.progress(), args.show.verbose, allocations);
    let parts = outputs.iter().map(|output| part_of(output)).collect();
    let interrupts = Interrupts::watch(&workspace, parts, words)
        .map_err(|e| Failure::new(Exit::Resource, format!("cannot watch for signals: {e}")))?;
    let name = planned.as_ref().map_or_else(|| files.name(), |planned| planned.record.name.path());
    let run = Run { args, input: &name, output: &output, workspace: &workspace, progress: &progress };
    // Whatever is made of the input goes to the workspace as well.
    let opened = match planned {
        Some(planned) => planned.input(args),
        None => input::open(files, args.input.weld, &workspace.scratch(), &limits, &progress),
    };
    let input = match opened {
        Ok(input) => input,
        Err(failure) => {
            interrupts.claim_end();
            return Err(run.left_behind(failure, false));
        }
    };
    let sieve = input.sieve(&args.bad)?;
    let source: &dyn MeshSource = sieve.as_ref().map_or(input.mesh(), |sieve| sieve);
    let mut found = match run.all(source, &interrupts) {
        Ok(found) => found,
        Err(error) => {
            interrupts.claim_end();
            return run.gave_up(error, &interrupts);
        }
    };
    interrupts.claim_end();
    input.add_to(&mut found.work);
    let left_out = sieve.as_ref().map(Sieve::left_out).unwrap_or_default();
    // A mesh that was made of the input goes before the workspace does that it lies in.
    drop(sieve);
    drop(input);
    let concluded = match planned {
        // The tasks of a job end when their scheduler says so, and whoever runs this one again must find what it has done.
        Some(planned) => planned.note_written(&outputs).and_then(|()| workspace.conclude()),
        None if args.keep_workspace => workspace.conclude(),
        None => workspace.remove(),
    };
    if let Err(error) = concluded {
        tracing::warn!("{error}");
    }

    if !args.quiet {
        let outcome = Outcome {
            input: &name.display().to_string(),
            params: &params,
            found: &found,
            left_out,
            threads: limits.threads,
            io: args.work.io.name(),
            wall: started.elapsed(),
            cpu: memory::cpu_time(),
            peak: memory::peak(),
            anonymous: progress.anonymous(),
            allocated: progress.allocated(),
            memory: limits.memory,
            stages: progress.stages(),
            written: outputs
                .iter()
                .map(|path| Written { path, bytes: fs::metadata(path).map(|m| m.len()).ok() })
                .collect(),
        };
        console::print(&outcome.to_string())?;
    }
    Ok(Exit::Done)
}

/// What a run works with.
struct Run<'a> {
    args: &'a DetectArgs,
    input: &'a Path,
    output: &'a Path,
    workspace: &'a Workspace,
    progress: &'a Progress,
}

impl Run<'_> {
    /// Detects and writes, and sums the lines up. A file that is not finished when this fails is removed by whoever drops
    /// it.
    fn all(&self, source: &dyn MeshSource, interrupts: &Interrupts) -> Result<Detection<Statistics>, Error> {
        let Run { args, workspace, progress, .. } = *self;
        let table = args.output.attributes.as_deref();
        let mut attributes = table
            .map(|path| {
                Ok::<_, Error>(AttributeFile::create(path, source)?.with_scratch(workspace.scratch()))
            })
            .transpose()?;
        let job = Job::new(source, args.params(), args.work.limits(), progress)?
            .with_workspace(workspace, args.output.force)
            .with_stop(interrupts.flag());
        let found = job.run_stored(attributes.as_mut().map(|file| file as &mut dyn FieldSink))?;
        let (stage, total) = (Stage::Write, found.lines.counts().lines);
        let started = Instant::now();
        progress.event(Event::Started { stage, total });
        let mut found = found.try_map(|lines| {
            let lines = lines.with_geometry(args.output.geometry.into());
            let statistics = Statistics::of(&lines)?;
            write(&lines, attributes, self.output, table, workspace)?;
            Ok::<_, Error>(statistics)
        })?;
        progress.event(Event::Advanced { stage, by: total });
        let wall = started.elapsed();
        progress.event(Event::Finished { stage, wall });
        found.work.stages.push((stage, wall));
        Ok(found)
    }

    /// Says why the run ended, and what is left of it.
    fn gave_up(&self, error: Error, interrupts: &Interrupts) -> Result<Exit, Failure> {
        // One that was refused is not ours to touch.
        let refused = match &error {
            Error::Workspace(error) => !matches!(error, WorkspaceError::Io { .. }),
            _ => false,
        };
        match error {
            Error::Stopped => {
                let exit = interrupts.report();
                self.remove_if_useless();
                Ok(exit)
            }
            error => Err(self.left_behind(Failure::of_run(self.input, error), refused)),
        }
    }

    /// The failure that ended the run, with what is left of it. A workspace that was not `refused` and that another run could
    /// not go on with is removed.
    fn left_behind(&self, failure: Failure, refused: bool) -> Failure {
        if refused {
            return failure;
        }
        if self.remove_if_useless() {
            return failure;
        }
        failure.and(&format!("what is done is kept in {}", self.workspace.path().display()))
    }

    /// Removes the workspace, unless another run could go on with it.
    fn remove_if_useless(&self) -> bool {
        let useless = !self.workspace.is_worth_keeping();
        if useless && let Err(error) = self.workspace.remove() {
            tracing::warn!("{error}");
        }
        useless
    }
}

/// Writes everything before anything gets its name, because a full disk shows while writing. Two files cannot appear in
/// one instant: if the second does not get its name, the first is taken away again; and if the process dies in between,
/// the workspace says that they may be replaced.
fn write(
    found: &StoredLines,
    attributes: Option<AttributeFile>,
    output: &Path,
    table: Option<&Path>,
    workspace: &Workspace,
) -> Result<(), Error> {
    let lines = stage_ply(output, found)?;
    let outputs: Vec<PathBuf> =
        [Some(output), table].into_iter().flatten().filter_map(targets::place).collect();
    workspace.announce(&outputs)?;
    if let Some(attributes) = attributes {
        attributes.finish(found.largest_salience())?;
    }
    let committed = lines.commit().inspect_err(|_| {
        if let Some(table) = table {
            // The error to report is the one that brought us here.
            let _ = fs::remove_file(table);
        }
    });
    Ok(committed?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Limits, Params};
    use crate::input::MemorySource;
    use crate::pipeline::Silent;
    use glam::DVec3;

    #[test]
    fn both_files_appear_or_none() {
        let source = MemorySource::new(&[DVec3::ZERO, DVec3::X, DVec3::Y], &[[0, 1, 2]]).expect("a triangle");
        let job = Job::new(&source, Params::default(), Limits::default(), &Silent).expect("a job");
        let found = job.run_stored(None).expect("a result").lines;
        let directory = tempfile::tempdir().expect("a temporary directory");
        let [lines, table] = ["lines.ply", "table.ply"].map(|name| directory.path().join(name));
        let attributes = || AttributeFile::create(&table, &source).ok();

        // A directory that turned up meanwhile keeps the lines from getting their name.
        fs::create_dir(&lines).expect("create");
        write(&found, attributes(), &lines, Some(&table), &Workspace::at(&directory.path().join("work")))
            .expect_err("there is a directory in the way");
        assert_eq!(fs::read_dir(directory.path()).expect("list").count(), 1);

        fs::remove_dir(&lines).expect("remove");
        write(&found, attributes(), &lines, Some(&table), &Workspace::at(&directory.path().join("work")))
            .expect("nothing is in the way");
        assert_eq!(fs::read_dir(directory.path()).expect("list").count(), 2);
    }
}
