//! `crease detect`: the whole job on this machine.
//!
//! In: a mesh. Out: the lines, perhaps the table of all vertices, and a summary. Either all outputs appear or none.

use crate::cli::args::DetectArgs;
use crate::cli::exit::{Exit, Failure};
use crate::cli::memory::Allocations;
use crate::cli::progress::Progress;
use crate::cli::summary::{Outcome, Written};
use crate::cli::{console, input, memory, targets};
use crate::error::Error;
use crate::input::{InputFiles, MeshSource};
use crate::output::{AttributeFile, FieldSink, OutputError, directory_of, stage_ply};
use crate::pipeline::{Detection, Event, Job, Observer, Stage};
use crate::stitch::{Geometry, LineSource, Statistics, StoredLines};
use std::fs;
use std::path::Path;
use std::time::Instant;

/// Does what `args` ask for.
///
/// # Errors
/// If anything fails; there is no output then.
pub(in crate::cli) fn detect(args: &DetectArgs, allocations: Allocations) -> Result<Exit, Failure> {
    console::start_log(args.report.verbose);
    let started = Instant::now();
    let (params, limits) = (args.params(), args.work.limits());
    let files = InputFiles::find(&args.input.names)?;
    let output = args.output.clone().unwrap_or_else(|| targets::default_output(&files));
    let outputs: Vec<&Path> =
        [Some(output.as_path()), args.attributes.as_deref()].into_iter().flatten().collect();
    targets::check(&files.files, &outputs, args.force)?;

    let progress = Progress::new(args.progress(), args.report.verbose, allocations);
    let workspace = args.work.workspace.as_deref().unwrap_or_else(|| directory_of(&output));
    let input = input::open(&files, args.input.weld, workspace, &limits, &progress)?;
    let source = input.mesh();
    let of_run = |error| Failure::of_run(source.path(), error);
    let job =
        Job::new(source, params, limits, &progress).map_err(of_run)?.with_workspace(workspace, args.force);
    let attributes = args
        .attributes
        .as_deref()
        .map(|path| Ok(AttributeFile::create(path, source)?.with_workspace(workspace)))
        .transpose()
        .map_err(of_run)?;
    let outputs_of = (output.as_path(), args.attributes.as_deref());
    let mut found = run(&job, attributes, outputs_of, args.geometry.into(), &progress).map_err(of_run)?;
    input.add_to(&mut found.work);

    if !args.quiet {
        let outcome = Outcome {
            input: &source.name(),
            params: &params,
            found: &found,
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

/// Detects and writes, and sums the lines up. A file that is not finished when this fails is removed by whoever drops it.
fn run(
    job: &Job,
    mut attributes: Option<AttributeFile>,
    (output, table): (&Path, Option<&Path>),
    geometry: Geometry,
    progress: &Progress,
) -> Result<Detection<Statistics>, Error> {
    let found = job.run_stored(attributes.as_mut().map(|file| file as &mut dyn FieldSink))?;
    let (stage, total) = (Stage::Write, found.lines.counts().lines);
    let started = Instant::now();
    progress.event(Event::Started { stage, total });
    let mut found = found.try_map(|lines| {
        let lines = lines.with_geometry(geometry);
        let statistics = Statistics::of(&lines)?;
        write(&lines, attributes, output, table)?;
        Ok::<_, Error>(statistics)
    })?;
    progress.event(Event::Advanced { stage, by: total });
    let wall = started.elapsed();
    progress.event(Event::Finished { stage, wall });
    found.work.stages.push((stage, wall));
    Ok(found)
}

/// Writes everything before anything gets its name, because a full disk shows while writing. Two files cannot appear in
/// one instant: if the second does not get its name, the first is taken away again.
fn write(
    found: &StoredLines,
    attributes: Option<AttributeFile>,
    output: &Path,
    table: Option<&Path>,
) -> Result<(), OutputError> {
    let lines = stage_ply(output, found)?;
    if let Some(attributes) = attributes {
        attributes.finish(found.largest_salience())?;
    }
    lines.commit().inspect_err(|_| {
        if let Some(table) = table {
            // The error to report is the one that brought us here.
            let _ = fs::remove_file(table);
        }
    })
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
        write(&found, attributes(), &lines, Some(&table)).expect_err("there is a directory in the way");
        assert_eq!(fs::read_dir(directory.path()).expect("list").count(), 1);

        fs::remove_dir(&lines).expect("remove");
        write(&found, attributes(), &lines, Some(&table)).expect("nothing is in the way");
        assert_eq!(fs::read_dir(directory.path()).expect("list").count(), 2);
    }
}
