//! How good the lines are that the program finds: runs it on meshes whose lines are known, and scores what it finds.
//!
//! `docs/QUALITY.md` says what is measured and what came out.

#[path = "mod.rs"]
mod quality;

use anyhow::{Context, Result, ensure};
use clap::Parser;
use quality::arguments::{Arguments, Command, ProgramArguments, ReportArguments, RunArguments};
use quality::case::{Case, Problem};
use quality::methods::{METHODS, Method};
use quality::metric::Truth;
use quality::program::Program;
use quality::results::Results;
use quality::run::Bench;
use quality::sets::{REPORT_SEEDS, Set};
use quality::{compare, lines_file, markdown, mesh, methods, metric, report, sets, sheet, tables, targets};
use std::fs;
use std::path::{Path, PathBuf};

/// The document whose tables are generated, below the root of the project.
const DOCUMENT: &str = "docs/QUALITY.md";
/// The generated part of the document that holds all sets against what was asked for.
const TARGETS: &str = "targets";
/// The sheet of the reference set, below the root of the project.
const SHEET: &str = "docs/pictures/quality.png";

fn main() -> Result<()> {
    match Arguments::parse().command {
        Command::Run(arguments) => run(arguments),
        Command::Pairs(arguments) => run(RunArguments::pairs(arguments)),
        Command::Score { mesh, lines, truth } => score(mesh, &lines, &truth),
        Command::Compare { before, after } => {
            print!("{}", compare::differences(&Results::read(&before)?, &Results::read(&after)?));
            Ok(())
        }
        Command::Report(arguments) => report(&arguments),
    }
}

fn run(arguments: RunArguments) -> Result<()> {
    let seeds = sets::parse_seeds(&arguments.seeds)?;
    let amounts = arguments.noise.as_deref().map(sets::parse_amounts).transpose()?;
    let mut cases = Vec::new();
    for set in arguments.set.iter().flat_map(|set| set.members()) {
        cases.extend(set.cases(&seeds, amounts.as_deref())?);
    }
    if let Some(part) = &arguments.filter {
        cases.retain(|case| case.mesh.contains(part));
    }
    ensure!(!cases.is_empty(), "no case is left");

    let work = arguments.work;
    let scratch = tempfile::tempdir()?;
    let keep = match (&work.keep, &work.sheet) {
        (Some(directory), _) => {
            fs::create_dir_all(directory).with_context(|| format!("cannot make {}", directory.display()))?;
            Some(directory.as_path())
        }
        (None, Some(_)) => Some(scratch.path()),
        (None, None) => None,
    };
    let results = measure(&work.program, &cases, &methods::parse(&work.methods)?, work.baselines, keep)?;
    println!("{}\n{}", tables::cases(&results), tables::means(&results));
    if let Some(path) = &work.json {
        results.write(path)?;
    }
    if let Some(path) = &work.markdown {
        let part = |set: Results| format!("## {}\n\n{}", set.records[0].set, markdown::tables(&set));
        let text: Vec<String> = results.by_set().into_iter().map(part).collect();
        fs::write(path, text.join("\n")).with_context(|| format!("cannot write {}", path.display()))?;
    }
    if let (Some(path), Some(directory)) = (&work.sheet, keep) {
        sheet::draw(&cases, &results, directory, path)?;
    }
    if let Some(path) = &work.against {
        println!("{}", compare::differences(&Results::read(path)?, &results));
    }
    Ok(())
}

/// Runs methods, and the baselines if they are wanted, on all cases.
fn measure(
    arguments: &ProgramArguments,
    cases: &[Case],
    methods: &[Method],
    baselines: bool,
    keep: Option<&Path>,
) -> Result<Results> {
    let program = Program::find(arguments.crease.as_deref(), &arguments.extra)?;
    let bench = Bench { program: &program, methods, baselines, jobs: arguments.jobs.into(), keep };
    bench.run(cases, &|done, case| eprintln!("{done}/{} {}", cases.len(), case.stem()))
}

fn report(arguments: &ReportArguments) -> Result<()> {
    let document = Path::new(env!("CARGO_MANIFEST_DIR")).join(DOCUMENT);
    let rewrite = |set: &Results| report::replace(&document, &set.records[0].set, &markdown::tables(set));
    let conclude = |all: &Results| match targets::tables(all) {
        Some(text) => report::replace(&document, TARGETS, &text),
        None => {
            eprintln!("not all sets are there: the targets stay as they are");
            Ok(())
        }
    };
    let earlier = arguments.from.iter().map(|path| Results::read(path)).collect::<Result<_>>()?;
    if let Some(all) = Results::joined(earlier) {
        all.by_set().iter().try_for_each(rewrite)?;
        return conclude(&all);
    }
    let all = [Set::All];
    let wanted = if arguments.set.is_empty() { &all[..] } else { &arguments.set };
    let mut parts = Vec::new();
    for set in wanted.iter().flat_map(|set| set.members()) {
        let cases = set.cases(&REPORT_SEEDS, None)?;
        let scratch = tempfile::tempdir()?;
        let drawn = set == Set::Reference;
        let keep = drawn.then_some(scratch.path());
        let results = measure(&arguments.program, &cases, &METHODS, true, keep)?;
        rewrite(&results)?;
        if drawn {
            let sheet = Path::new(env!("CARGO_MANIFEST_DIR")).join(SHEET);
            sheet::draw(&cases, &results, scratch.path(), &sheet)?;
        }
        parts.push(results);
    }
    let Some(all) = Results::joined(parts) else { return Ok(()) };
    if let Some(path) = &arguments.json {
        all.write(path)?;
    }
    conclude(&all)
}

fn score(mesh: PathBuf, lines: &Path, truth: &Path) -> Result<()> {
    let truth = Truth::of_lines(lines_file::read(truth)?);
    let found = lines_file::read(lines)?;
    let positions = mesh::Mesh::read(&mesh)?;
    let problem = Problem::new(mesh, positions, truth)?;
    let score = metric::score(&found, &problem.truth, problem.h);
    println!("{}", serde_json::to_string_pretty(&score)?);
    Ok(())
}
