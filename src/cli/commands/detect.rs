//! `crease detect`: the whole job on this machine.
//!
//! In: a mesh. Out: the lines, perhaps the table of all vertices, reports, and a summary. Either all outputs appear or none.

use crate::cli::args::DetectArgs;
use crate::cli::exit::{Exit, Failure};
use crate::cli::input::Input;
use crate::cli::interrupt::Interrupts;
use crate::cli::memory::Allocations;
use crate::cli::outcome::{Outcome, Used, output};
use crate::cli::outputs::{Outputs, commit};
use crate::cli::planned::PlannedJob;
use crate::cli::progress::Progress;
use crate::cli::summary::Summary;
use crate::cli::{bus_error, console, input, memory, targets};
use crate::config::Limits;
use crate::error::Error;
use crate::input::{InputError, InputFiles, MeshSource, Sieve};
use crate::output::{PartFile, part_of};
use crate::pipeline::{Detection, Event, Job, Observer, Stage, StitchedGroup};
use crate::report::{Detail, Findings, Ground, Kind, Report, Scene, stage_json, stage_page};
use crate::stitch::LineSource;
use crate::workspace::{Workspace, WorkspaceError};
use std::ffi::OsString;
use std::fs;
use std::path::Path;
use std::sync::atomic::Ordering;
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
    run(args, words, allocations, Origin { files, planned: None, groups: Vec::new() })
}

/// What a run starts from.
pub(super) struct Origin {
    /// The input.
    pub files: InputFiles,
    /// A job whose tiles are all done; this run does the rest.
    pub planned: Option<PlannedJob>,
    /// Groups of its tiles that are stitched already.
    pub groups: Vec<StitchedGroup>,
}

/// All outputs of a run: what is `written` of the mesh, the lines first, and reports.
pub(super) fn named_outputs<'a>(args: &'a DetectArgs, written: &'a Outputs) -> Vec<&'a Path> {
    let reports = args.report.reports.iter().map(|report| report.path.as_path());
    written.paths().into_iter().chain(reports).collect()
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
    let limits = args.work.limits();
    let Origin { files, planned, groups } = &origin;
    let writing = Outputs::new(&args.output, files)?;
    let outputs = named_outputs(args, &writing);
    let workspace = match (planned, &args.work.workspace) {
        (Some(planned), _) => planned.workspace.clone(),
        (None, Some(path)) => Workspace::at(path),
        (None, None) => Workspace::beside(writing.main()),
    };
    targets::check(&files.files, &outputs, may_replace(args, &workspace))?;

    bus_error::watch(&files.name());
    let progress = Progress::new(args.progress(), allocations, limits.memory);
    let parts = outputs.iter().map(|output| part_of(output)).collect();
    let interrupts = Interrupts::watch(&workspace, parts, words)
        .map_err(|e| Failure::new(Exit::Resource, format!("cannot watch for signals: {e}")))?;
    let name = planned.as_ref().map_or_else(|| files.name(), |planned| planned.record.name.path());
    let run = Run {
        args,
        words,
        started,
        limits: &limits,
        input: &name,
        files,
        writing: &writing,
        outputs: &outputs,
        workspace: &workspace,
        groups,
        progress: &progress,
    };
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
    let sieve = match input.sieve(&args.bad) {
        Ok(sieve) => sieve,
        Err(error) => {
            interrupts.claim_end();
            return run.gave_up(error.into(), &interrupts);
        }
    };
    let report = match run.all(&input, sieve.as_ref(), &interrupts) {
        Ok(report) => report,
        Err(error) => {
            interrupts.claim_end();
            return run.gave_up(error, &interrupts);
        }
    };
    interrupts.claim_end();
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
        console::print(&Summary(&report).to_string())?;
    }
    Ok(Exit::Done)
}

/// What a run works with.
struct Run<'a> {
    args: &'a DetectArgs,
    words: &'a [OsString],
    started: Instant,
    limits: &'a Limits,
    input: &'a Path,
    files: &'a InputFiles,
    /// What is written of the mesh.
    writing: &'a Outputs,
    /// All outputs: what is written of the mesh, and reports.
    outputs: &'a [&'a Path],
    workspace: &'a Workspace,
    groups: &'a [StitchedGroup],
    progress: &'a Progress,
}

impl Run<'_> {
    /// Detects and writes, and sums it up. A file that is not finished when this fails is removed by whoever drops it.
    fn all(&self, input: &Input, sieve: Option<&Sieve>, interrupts: &Interrupts) -> Result<Report, Error> {
        let Run { args, writing, workspace, progress, .. } = *self;
        let source: &dyn MeshSource = sieve.map_or(input.mesh(), |sieve| sieve);
        let mut limits = *self.limits;
        let mut tables = writing.begin(input.mesh(), source, &workspace.scratch(), limits.memory)?;
        // What tables hold, tiles cannot.
        limits.memory -= writing.memory(limits.memory);
        let job = Job::new(source, args.params(), limits, progress)?
            .with_workspace(workspace, args.output.force)
            .with_groups(self.groups.to_vec())
            .with_stop(interrupts.flag());
        let found = job.run_stored(tables.sink())?;
        let (stage, total) = (Stage::Write, found.lines.counts().lines);
        let started = Instant::now();
        progress.event(Event::Started { stage, total });
        let Detection { lines, scan, defects, mut work } = found;
        let lines = lines.with_geometry(args.geometry());
        let detail = self.detail();
        let Findings { statistics, histograms, edges, chosen } =
            Findings::of(&lines, scan.median_side, detail.segments)?;
        let parts = writing.stage(&lines, tables).map_err(|error| match error {
            Error::Input(error @ InputError::Changed { .. }) => Error::Changed { stage: stage.name(), error },
            other => other,
        })?;
        // That is what takes its time.
        parts.iter().try_for_each(PartFile::sync)?;
        let scattered = work.stages.iter().any(|(stage, _)| *stage == Stage::Order);
        let scene = match detail {
            Detail::NOTHING => None,
            detail => {
                let ended = || interrupts.flag().load(Ordering::Relaxed);
                let ground = Ground { source, scan: &scan, scattered };
                Some(Scene::of(&lines, &chosen, &ground, detail, ended)?)
            }
        };
        progress.event(Event::Advanced { stage, by: total });
        let wall = started.elapsed();
        progress.event(Event::Finished { stage, wall });
        work.stages.push((stage, wall));
        input.add_to(&mut work);
        let found = Detection { lines: statistics, scan, defects, work };
        let outcome = Outcome {
            words: self.words,
            input: self.input,
            files: &self.files.files,
            converted: input.is_converted(),
            params: &args.params(),
            preset: args.preset_line(),
            geometry: args.geometry(),
            limits: self.limits,
            io: args.work.io.name(),
            found: &found,
            histograms: &histograms,
            edges,
            left_out: sieve.map(Sieve::left_out).unwrap_or_default(),
            used: self.used(),
            outputs: self.outputs.iter().map(|path| output(path, &part_of(path))).collect(),
        };
        self.hand_over(outcome.report(), scene.as_ref(), parts)
    }

    /// How much of the lines and of the mesh a page may show, if there will be one.
    fn detail(&self) -> Detail {
        match self.args.report.reports.iter().any(|report| report.kind == Kind::Html) {
            true => Detail::within(self.limits.memory),
            false => Detail::NOTHING,
        }
    }

    fn used(&self) -> Used {
        Used {
            wall: self.started.elapsed(),
            cpu: memory::cpu_time(),
            peak: memory::peak(),
            anonymous: self.progress.anonymous(),
            allocated: self.progress.allocated(),
            stages: self.progress.stages(),
        }
    }

    /// Writes the reports, and gives everything its name. Returns the report with the sizes that it cannot know of itself.
    fn hand_over(
        &self,
        mut report: Report,
        scene: Option<&Scene>,
        mut parts: Vec<PartFile>,
    ) -> Result<Report, Error> {
        for file in &self.args.report.reports {
            parts.push(match (file.kind, scene) {
                (Kind::Html, Some(scene)) => stage_page(&file.path, &report, scene)?,
                _ => stage_json(&file.path, &report)?,
            });
        }
        commit(parts, self.outputs, self.workspace)?;
        for (output, path) in report.outputs.iter_mut().zip(self.outputs) {
            output.bytes = output.bytes.or_else(|| fs::metadata(path).map(|found| found.len()).ok());
        }
        Ok(report)
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
        if refused || self.remove_if_useless() {
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
