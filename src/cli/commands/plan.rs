//! `crease plan`: everything before the first tile, once, for many tasks.
//!
//! In: what `detect` takes. Out: a workspace with the plan, and with the mesh where it had to be converted or put in order, so that
//! no task has to. The same command over the same input does nothing twice.

use super::detect::{may_replace, named_outputs};
use crate::cli::args::{DetectArgs, PlanArgs};
use crate::cli::exit::{Exit, Failure};
use crate::cli::interrupt::Interrupts;
use crate::cli::memory::Allocations;
use crate::cli::outputs::Outputs;
use crate::cli::plan_json::PlanJson;
use crate::cli::planned::PlannedJob;
use crate::cli::progress::Progress;
use crate::cli::text::{bytes, counted, entry, grouped, span};
use crate::cli::{bus_error, console, input, targets};
use crate::input::ply::KnownPly;
use crate::input::{Decided, InputFiles, MeshSource, PlySource, Sieve};
use crate::pipeline::{Job, Laid, MOST_GROUPS, group_tiles};
use crate::workspace::{
    AnyPath, FileMark, Identity, PlanRecord, Workspace, WorkspaceError, count_of_groups, relative,
};
use std::ffi::OsString;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Does what `args` ask for, which come from the command line `words`.
///
/// # Errors
/// If anything fails; nothing is planned then.
pub(in crate::cli) fn plan(
    args: &PlanArgs,
    words: &[OsString],
    allocations: Allocations,
) -> Result<Exit, Failure> {
    let (args, group_tiles) = (&args.detect, args.group_tiles);
    console::start_log(args.show.verbose);
    let directory = args.work.workspace.as_deref().unwrap_or(Path::new("."));
    let files = InputFiles::find(&args.input.names)?;
    let workspace = Workspace::planned(directory);
    let planning = Planning { args, words, files, workspace, group_tiles };
    let finished = match planning.workspace.enter()? {
        true => planning.workspace.plan_record()?,
        false => None,
    };
    let written = Outputs::new(&args.output, &planning.files)?;
    let named = named_outputs(args, &written);
    // Those of a job that is done are its own.
    if finished.is_none() {
        targets::check(&planning.files.files, &named, may_replace(args, &planning.workspace))?;
        is_free(directory)?;
    }
    bus_error::watch(&planning.files.name());
    let progress = Progress::new(args.progress(), allocations, args.work.limits().memory);
    let interrupts = Interrupts::watch(&planning.workspace, Vec::new(), words)
        .map_err(|e| Failure::new(Exit::Resource, format!("cannot watch for signals: {e}")))?;
    let again = finished.is_some();
    let laid = match finished {
        Some(record) => planning.again(record, &progress, &interrupts),
        None => planning.first(&progress, &interrupts),
    };
    interrupts.claim_end();
    let laid = match laid {
        Ok(laid) => laid,
        Err(failure) => {
            // What was not planned to its end is of no use to anybody. The failure is what is worth a word.
            if !planning.workspace.is_worth_keeping()
                && let Err(error) = planning.workspace.remove()
            {
                tracing::warn!("{error}");
            }
            return match failure.exit {
                Exit::Interrupted => Ok(interrupts.report()),
                _ => Err(failure),
            };
        }
    };
    if !args.quiet {
        let groups = count_of_groups(planning.group_size(&laid)?, laid.tiles.len() as u32);
        console::print(&text(&planning, &laid, again, groups))?;
    }
    Ok(Exit::Done)
}

/// Refuses a directory in which there is something else: tasks make directories of their own there.
fn is_free(directory: &Path) -> Result<(), Failure> {
    let mut entries = match fs::read_dir(directory) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
        Err(e) => {
            return Err(Failure::about(Exit::Resource, directory, format!("cannot list the directory: {e}")));
        }
        Ok(entries) => entries,
    };
    let ours =
        |name: &str| matches!(name, "plan.json" | "tiles" | "groups" | "log") || name.starts_with("crease-");
    match entries.find_map(|e| e.ok().filter(|e| !ours(&e.file_name().to_string_lossy()))) {
        None => Ok(()),
        Some(stray) => {
            let reason = format!(
                "there is something else in it: {}; a planned workspace needs a directory of its own",
                stray.file_name().to_string_lossy()
            );
            Err(Failure::about(Exit::Usage, directory, reason))
        }
    }
}

/// What is planned.
struct Planning<'a> {
    args: &'a DetectArgs,
    words: &'a [OsString],
    files: InputFiles,
    workspace: Workspace,
    /// Tiles of a group, if somebody has said how many.
    group_tiles: Option<u32>,
}

impl Planning<'_> {
    /// From the beginning.
    fn first(&self, progress: &Progress, interrupts: &Interrupts) -> Result<Laid, Failure> {
        let Planning { args, workspace, files, .. } = self;
        workspace.begin_plan()?;
        let limits = args.work.limits();
        // Before anything is read: what is written to later is seen by whoever opens it again.
        let inputs = self.inputs()?;
        let opened = input::open(files, args.input.weld, &workspace.scratch(), &limits, progress)?;
        let (mesh, place) = match opened.keep(&workspace.mesh())? {
            Some(mesh) => {
                let place = relative(workspace.path(), mesh.path())?;
                (mesh, place)
            }
            None => {
                let mesh = PlySource::open(&workspace.mesh(), args.work.io.into())?;
                (mesh, relative(workspace.path(), &workspace.mesh())?)
            }
        };
        let sieve = args.bad.sieve(&mesh)?;
        let source: &dyn MeshSource = sieve.as_ref().map_or(&mesh, |sieve| sieve);
        let laid = self.lay_out(source, progress, interrupts)?;
        self.finish(&laid, inputs, place, mesh.known(), sieve.map(|sieve| sieve.decided()))?;
        Ok(laid)
    }

    /// Over a job that is planned already: it must be the same, but may have other outputs.
    fn again(
        &self,
        record: PlanRecord,
        progress: &Progress,
        interrupts: &Interrupts,
    ) -> Result<Laid, Failure> {
        let inputs = self.inputs()?;
        let planned = PlannedJob { workspace: self.workspace.clone(), record };
        let before = planned.options(None)?;
        let options = |args: &DetectArgs| format!("{:?}, {:?}", args.input.weld, args.bad);
        let other = |what, before, now| WorkspaceError::OtherJob {
            path: self.workspace.path().to_owned(),
            what,
            before,
            now,
        };
        if let Some(found) = planned.record.other_input(&inputs) {
            return Err(other(found.what, found.before, found.now).into());
        }
        if options(&before) != options(self.args) {
            return Err(other("--weld or --bad-faces", options(&before), options(self.args)).into());
        }
        let mesh = planned.mesh(self.args)?;
        let sieve = planned.record.sieve.clone().map(|decided| Sieve::again(&mesh, Arc::new(decided)));
        let source: &dyn MeshSource = sieve.as_ref().map_or(&mesh, |sieve| sieve);
        let laid = self.lay_out(source, progress, interrupts)?;
        let PlanRecord { mesh: place, known, sieve, .. } = planned.record;
        self.finish(&laid, inputs, place, known, sieve.map(Arc::new))?;
        Ok(laid)
    }

    /// The files, and what the system says of them.
    fn inputs(&self) -> Result<Vec<(AnyPath, FileMark)>, Failure> {
        let of = |path: &PathBuf| {
            let place = relative(self.workspace.path(), path)?;
            match FileMark::of(path) {
                Some(mark) => Ok((place, mark)),
                None => Err(Failure::about(Exit::BadInput, path, "not a regular file")),
            }
        };
        self.files.files.iter().map(of).collect()
    }

    fn lay_out(
        &self,
        source: &dyn MeshSource,
        progress: &Progress,
        interrupts: &Interrupts,
    ) -> Result<Laid, Failure> {
        let of_run = |error| Failure::of_run(&self.files.name(), error);
        let job = Job::new(source, self.args.params(), self.args.work.limits(), progress).map_err(of_run)?;
        let job = job.with_workspace(&self.workspace, self.args.output.force).with_stop(interrupts.flag());
        job.lay_out(self.args.output.has_tables()).map_err(of_run)
    }

    /// How many tiles a group has.
    fn group_size(&self, laid: &Laid) -> Result<u32, Failure> {
        let tiles = laid.tiles.len() as u32;
        let Some(size) = self.group_tiles else { return Ok(group_tiles(tiles, laid.planned.scan.faces)) };
        let (count, least) = (count_of_groups(size, tiles), tiles.div_ceil(MOST_GROUPS));
        match count > MOST_GROUPS {
            true => Err(Failure::new(
                Exit::Usage,
                format!(
                    "--group-tiles {size}: {tiles} tiles would be {count} groups, and {MOST_GROUPS} are the most; {least} tiles or more do"
                ),
            )),
            false => Ok(size),
        }
    }

    /// Writes the plan down.
    fn finish(
        &self,
        laid: &Laid,
        inputs: Vec<(AnyPath, FileMark)>,
        mesh: AnyPath,
        known: KnownPly,
        sieve: Option<Arc<Decided>>,
    ) -> Result<(), Failure> {
        let here = self.workspace.path();
        let folder = self.files.folder.as_ref().map(|folder| relative(here, folder)).transpose()?;
        let record = PlanRecord {
            version: Identity::this_version(),
            words: self.words.iter().map(AnyPath::new).collect(),
            directory: relative(here, Path::new("."))?,
            inputs,
            folder,
            name: AnyPath::new(self.files.name()),
            mesh,
            known,
            sieve: sieve.map(Arc::unwrap_or_clone),
            group_tiles: self.group_size(laid)?,
        };
        let json = PlanJson::new(self.args, &record, laid, self.workspace.job_id()).to_bytes();
        Ok(self.workspace.plan(&record, &json)?)
    }
}

fn text(planning: &Planning<'_>, laid: &Laid, again: bool, groups: u32) -> String {
    let (tiles, scan) = (&laid.tiles, &laid.planned.scan);
    let place = planning.workspace.path().display();
    let mut out = format!("{}\n", planning.files.name().display());
    let faces = counted(scan.faces, "face", "faces");
    out.push_str(&entry("mesh", &format!("{faces}, {}", counted(scan.vertices, "vertex", "vertices"))));
    if planning.workspace.mesh().exists() {
        out.push_str(&entry(
            "converted",
            &format!("once, for all tasks: {}", planning.workspace.mesh().display()),
        ));
    }
    if planning.workspace.sorted().exists() {
        let sorted = planning.workspace.sorted();
        out.push_str(&entry("put in order", &format!("once, for all tasks: {}", sorted.display())));
    }
    let largest = tiles.iter().map(|tile| tile.loaded_faces).max().unwrap_or(0);
    let memory = tiles.iter().map(|tile| tile.memory).max().unwrap_or(0);
    let seconds: f64 = tiles.iter().map(|tile| tile.cpu_seconds).sum();
    let longest = tiles.iter().map(|tile| tile.cpu_seconds).max_by(f64::total_cmp).unwrap_or(0.0);
    out.push_str(&entry(
        "tiles",
        &format!("{}, with up to {} faces and their halo", grouped(tiles.len() as u64), grouped(largest)),
    ));
    out.push_str(&entry("memory of a task", &format!("about {}", bytes(memory))));
    out.push_str(&entry(
        "time of one core",
        &format!(
            "about {} for all tiles, {} for the longest",
            span(Duration::from_secs_f64(seconds)),
            span(Duration::from_secs_f64(longest))
        ),
    ));
    out.push_str(&entry(
        "plan",
        &format!("{place}/plan.json{}", if again { ", planned before" } else { "" }),
    ));
    let last = tiles.len().saturating_sub(1);
    out.push_str(&format!("\nnext: crease tile {place} --tile N for each N from 0 to {last}, then "));
    if groups > 0 {
        out.push_str(&format!("crease stitch {place} --group N for each N from 0 to {}, then ", groups - 1));
    }
    out.push_str(&format!("crease stitch {place}\n"));
    out
}
