//! The command line as types, with the help texts.

use super::sets::Set;
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

/// Scores feature lines against known ones.
#[derive(Parser)]
#[command(name = "quality", max_term_width = 110)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Subcommand)]
pub enum Command {
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
    /// Measure everything with the seeds that are reported, and rewrite the tables and the sheet in the documentation.
    Report(ReportArguments),
}

#[derive(Args)]
pub struct RunArguments {
    /// What to run on; may be given several times.
    #[arg(long, value_enum, default_value = "reference")]
    pub set: Vec<Set>,
    /// `tuning`, `report`, or numbers separated by commas.
    #[arg(long, default_value = "tuning")]
    pub seeds: String,
    /// Amounts of noise in mean edge lengths, separated by commas, instead of those of the set.
    #[arg(long, value_name = "LIST")]
    pub noise: Option<String>,
    /// Only meshes whose name contains this.
    #[arg(long, value_name = "TEXT")]
    pub filter: Option<String>,
    #[command(flatten)]
    pub work: WorkArguments,
}

impl RunArguments {
    /// All real pairs.
    pub fn pairs(work: WorkArguments) -> RunArguments {
        RunArguments { set: vec![Set::Pairs], seeds: "tuning".to_owned(), noise: None, filter: None, work }
    }
}

#[derive(Args)]
pub struct WorkArguments {
    #[command(flatten)]
    pub program: ProgramArguments,
    /// Ways to run the program, separated by commas: robust, paper, fitted.
    #[arg(long, value_name = "LIST", default_value = "robust")]
    pub methods: String,
    /// Run the baselines too, which choose their parameters with the truth. Takes longer than the program.
    #[arg(long)]
    pub baselines: bool,
    /// Write the results.
    #[arg(long, value_name = "FILE.json")]
    pub json: Option<PathBuf>,
    /// Write the tables.
    #[arg(long, value_name = "FILE.md")]
    pub markdown: Option<PathBuf>,
    /// Draw the first seed of all meshes with their lines.
    #[arg(long, value_name = "FILE.png")]
    pub sheet: Option<PathBuf>,
    /// Compare with earlier results.
    #[arg(long, value_name = "FILE.json")]
    pub against: Option<PathBuf>,
    /// Keep meshes, true lines and found lines as files.
    #[arg(long, value_name = "DIRECTORY")]
    pub keep: Option<PathBuf>,
}

#[derive(Args)]
pub struct ReportArguments {
    #[command(flatten)]
    pub program: ProgramArguments,
    /// Only the parts of these sets; may be given several times.
    #[arg(long, value_enum)]
    pub set: Vec<Set>,
    /// Write the results.
    #[arg(long, value_name = "FILE.json")]
    pub json: Option<PathBuf>,
    /// Measure nothing: take the results of `report --json`; may be given several times, for different sets. The sheet
    /// stays as it is.
    #[arg(long, value_name = "FILE.json", conflicts_with_all = ["json", "set"])]
    pub from: Vec<PathBuf>,
}

#[derive(Args)]
pub struct ProgramArguments {
    /// The program. Default: the one in the target directory that this program lies in.
    #[arg(long, value_name = "PATH")]
    pub crease: Option<PathBuf>,
    /// Further arguments for every run of the program, separated by blanks.
    #[arg(long, value_name = "ARGUMENTS", default_value = "", allow_hyphen_values = true)]
    pub extra: String,
    /// Cases that are worked on at the same time.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..))]
    pub jobs: u8,
}
