//! How good the lines are that the program finds: runs it on meshes whose lines are known, and scores what it finds.
//!
//! `docs/QUALITY.md` says what is measured and what came out.

#[path = "../gen/mod.rs"]
#[allow(dead_code, reason = "the generator also writes fixtures")]
mod generator;

mod baselines;
mod case;
mod compare;
mod lines_file;
mod mesh;
mod methods;
mod metric;
mod pairs;
mod program;
mod results;
mod run;
mod sets;
mod tables;

use anyhow::{Context, Result, ensure};
use case::{Case, Problem};
use clap::{Parser, Subcommand};
use metric::Truth;
use program::Program;
use results::Results;
use run::Bench;
use sets::Set;
use std::path::PathBuf;

/// Scores feature lines against known ones.
#[derive(Parser)]
#[command(name = "quality", max_term_width = 110)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run the program on sets of meshes and score its lines.
    Run(RunArguments),
    /// Run it on real meshes of which a clean and a noisy version exist: the same as `run --set pairs`.
    Pairs(WorkArguments),
    /// Score one file of lines.
    Score {
        /// The mesh, for its median side.
        #[arg(long, value_name = "FILE.ply")]
        mesh: PathBuf,
        /// The lines to be scored.
        #[arg(long, value_name = "FILE.ply")]
        lines: PathBuf,
        /// The true lines.
        #[arg(long, value_name = "FILE.ply")]
        truth: PathBuf,
    },
    /// Say what is different between two runs: by case, and in the mean.
    Compare {
        /// Results of `run --json`.
        before: PathBuf,
        /// Results of `run --json` after a change.
        after: PathBuf,
    },
}

#[derive(clap::Args)]
struct RunArguments {
    /// What to run on.
    #[arg(long, value_enum, default_value = "reference")]
    set: Vec<Set>,
    /// `tuning`, `report`, or numbers separated by commas.
    #[arg(long, default_value = "tuning")]
    seeds: String,
    /// Amounts of noise in mean edge lengths, separated by commas, instead of those of the set.
    #[arg(long, value_name = "LIST")]
    noise: Option<String>,
    /// Only meshes whose name contains this.
    #[arg(long, value_name = "TEXT")]
    filter: Option<String>,
    #[command(flatten)]
    work: WorkArguments,
}

impl RunArguments {
    fn pairs(work: WorkArguments) -> RunArguments {
        RunArguments { set: vec![Set::Pairs], seeds: "tuning".to_owned(), noise: None, filter: None, work }
    }
}

#[derive(clap::Args)]
struct WorkArguments {
    /// The program. Default: the one in the target directory that this program lies in.
    #[arg(long, value_name = "PATH")]
    crease: Option<PathBuf>,
    /// Ways to run the program, separated by commas: robust, paper, fitted.
    #[arg(long, value_name = "LIST", default_value = "robust")]
    methods: String,
    /// Further arguments for every run of the program, separated by blanks.
    #[arg(long, value_name = "ARGUMENTS", default_value = "", allow_hyphen_values = true)]
    extra: String,
    /// Run the baselines too, which choose their parameters with the truth. Takes longer than the program.
    #[arg(long)]
    baselines: bool,
    /// Write the results.
    #[arg(long, value_name = "FILE.json")]
    json: Option<PathBuf>,
    /// Compare with earlier results.
    #[arg(long, value_name = "FILE.json")]
    against: Option<PathBuf>,
    /// Keep meshes, true lines and found lines as files.
    #[arg(long, value_name = "DIRECTORY")]
    keep: Option<PathBuf>,
    /// Cases that are worked on at the same time.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..))]
    jobs: u8,
}

fn main() -> Result<()> {
    match Arguments::parse().command {
        Command::Run(arguments) => run(arguments),
        Command::Pairs(arguments) => run(RunArguments::pairs(arguments)),
        Command::Score { mesh, lines, truth } => score(mesh, &lines, &truth),
        Command::Compare { before, after } => {
            print!("{}", compare::differences(&Results::read(&before)?, &Results::read(&after)?));
            Ok(())
        }
    }
}

fn run(arguments: RunArguments) -> Result<()> {
    let seeds = sets::parse_seeds(&arguments.seeds)?;
    let amounts = arguments.noise.as_deref().map(sets::parse_amounts).transpose()?;
    let mut cases = Vec::new();
    for set in &arguments.set {
        cases.extend(set.cases(&seeds, amounts.as_deref())?);
    }
    if let Some(part) = &arguments.filter {
        cases.retain(|case| case.mesh.contains(part));
    }
    ensure!(!cases.is_empty(), "no case is left");
    let results = work(&arguments.work, &cases)?;
    println!("{}\n{}", tables::cases(&results), tables::means(&results));
    if let Some(path) = &arguments.work.json {
        results.write(path)?;
    }
    if let Some(path) = &arguments.work.against {
        println!("{}", compare::differences(&Results::read(path)?, &results));
    }
    Ok(())
}

fn work(arguments: &WorkArguments, cases: &[Case]) -> Result<Results> {
    let program = Program::find(arguments.crease.as_deref(), &arguments.extra)?;
    if let Some(directory) = &arguments.keep {
        std::fs::create_dir_all(directory).with_context(|| format!("cannot make {}", directory.display()))?;
    }
    let bench = Bench {
        program: &program,
        methods: &methods::parse(&arguments.methods)?,
        baselines: arguments.baselines,
        jobs: arguments.jobs.into(),
        keep: arguments.keep.as_deref(),
    };
    bench.run(cases, &|done, case| eprintln!("{done}/{} {}", cases.len(), case.stem()))
}

fn score(mesh: PathBuf, lines: &std::path::Path, truth: &std::path::Path) -> Result<()> {
    let truth = Truth::of_lines(lines_file::read(truth)?);
    let found = lines_file::read(lines)?;
    let positions = mesh::Mesh::read(&mesh)?;
    let problem = Problem::new(mesh, positions, truth)?;
    let score = metric::score(&found, &problem.truth, problem.h);
    println!("{}", serde_json::to_string_pretty(&score)?);
    Ok(())
}
