//! The command line as types, with the help texts.
//!
//! In: words. Out: [`Params`](crate::config::Params), [`Limits`](crate::config::Limits) and paths whose values are possible ones
//! on their own; whether they suit a mesh is found out when it has been scanned. Commands are here; groups of options that
//! belong together have a file each.

mod cluster;
mod detect;
mod input;
mod method;
mod output;
mod preset;
mod report;
mod show;
mod sigma;
#[cfg(test)]
mod tests;
mod values;
mod work;

pub(super) use cluster::{NodeArgs, PlanArgs, StatusArgs, StatusStep, StitchArgs, TileArgs};
pub(super) use detect::DetectArgs;
pub(super) use input::BadFacesArgs;
pub(super) use output::OutputArgs;
pub(super) use preset::Preset;
pub(super) use show::ProgressKind;

use clap::{Args, ColorChoice, Parser, Subcommand};
use clap_complete::Shell;
use input::InputArgs;
use method::refusal;
use preset::PresetArgs;
use show::ShowArgs;
use sigma::SigmaArgs;
use std::ffi::OsString;
use std::path::PathBuf;
use work::WorkArgs;

/// Headings of the help.
const WHAT: &str = "What is detected";
const HOW: &str = "How the work is done (none of this changes the result)";
const OUTPUT: &str = "Output";

/// Finds feature lines (sharp edges, weak creases, corners) in triangle meshes that may be larger than memory.
#[derive(Debug, Parser)]
#[command(name = "crease", version, arg_required_else_help = true, max_term_width = 110, after_help = EXIT_CODES)]
pub(super) struct Cli {
    #[command(subcommand)]
    pub command: Command,

    // Looked for before anything else (`colour.rs`), so that what is wrong with the words is said in colours, too.
    /// When to use colours: `auto`, on a terminal unless the environment variable NO_COLOR is set; `always`; `never`.
    #[arg(long, global = true, value_enum, value_name = "WHEN", help_heading = OUTPUT, default_value = "auto",
          hide_default_value = true, hide_possible_values = true)]
    pub color: ColorChoice,
}

impl Cli {
    /// Parses `arguments`, of which the first is the name of the program.
    ///
    /// # Errors
    /// If they ask for help or for something that makes no sense.
    pub fn parse_words(arguments: impl IntoIterator<Item = OsString>) -> Result<Cli, clap::Error> {
        let cli = Cli::try_parse_from(arguments)?;
        match &cli.command {
            Command::Detect(args) => args.method.check(&args.sigma, args.min_angle)?,
            Command::Info(args) if args.sigma.is_zero() => {
                return Err(refusal("a sigma of 0 needs detect --method paper"));
            }
            Command::Plan(args) => {
                args.check()?;
                args.detect.method.check(&args.detect.sigma, args.detect.min_angle)?;
            }
            Command::Info(_) | Command::Diff(_) | Command::Clean(_) => {}
            Command::Tile(_) | Command::Stitch(_) | Command::Status(_) => {}
            Command::Completions(_) | Command::Man(_) => {}
        }
        Ok(cli)
    }
}

const EXIT_CODES: &str = "\
Exit codes:
  0    done (diff: the files are identical)
  1    internal error (diff: the files differ)
  2    usage: an option, a parameter that does not suit the mesh, an output that exists already
  3    bad input: the file cannot be read or is not a mesh
  4    out of a resource: disk, memory, threads, or an output that cannot be written
  5    the workspace is damaged, in use, or belongs to another job
  6    stitch, status: tiles or outputs are missing
  130  interrupted; the same command goes on";

/// What to do.
#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Finds the feature lines of a mesh and writes them to a file.
    #[command(after_help = DETECT_EXAMPLES)]
    Detect(DetectArgs),
    /// Describes a mesh, how it would be worked on, and about how long that would take.
    ///
    /// Reads the file once, and works on a few pieces of it to see how long they take. Open borders and non-manifold edges are
    /// counted by `detect`, because they show only when neighbouring faces are joined.
    Info(InfoArgs),
    /// Compares two result files record by record.
    ///
    /// Prints `identical` and ends with exit code 0, or prints the first difference and a table of all that differs, and
    /// ends with exit code 1. Any two binary little-endian PLY files can be compared, of any size.
    Diff(DiffArgs),
    /// Plans the work of `detect` as many tasks, for a scheduler and many machines (docs/CLUSTER.md).
    ///
    /// Reads the mesh, cuts it into tiles, and writes the plan into a workspace that all machines see. A mesh that must be converted
    /// or put in order is, once, into the workspace. Takes the options of `detect`; `--memory` is that of a task. Prints what
    /// comes next. The same command again does nothing twice.
    #[command(after_help = PLAN_EXAMPLES)]
    Plan(PlanArgs),
    /// Works on tiles of a planned job, as one task of many.
    ///
    /// Each result appears in the workspace when it is whole. A tile whose result is there and right is not done again. The same
    /// tile may be worked on twice at the same time.
    Tile(TileArgs),
    /// Makes the outputs from the tiles of a planned job: those of `detect`, byte for byte.
    ///
    /// Refuses with exit code 6 while tiles are missing, and says which. With `--group` or `--groups`, stitches groups of tiles
    /// only, as tasks of many; what they leave is taken in the place of their tiles later, where it is there and right. The
    /// workspace stays; `crease clean` removes it.
    Stitch(StitchArgs),
    /// Says what is missing of a planned job. Ends with exit code 0 if nothing is, with 6 otherwise.
    Status(StatusArgs),
    /// Removes what an interrupted `detect` has kept, if nobody wants to go on with it.
    ///
    /// Only files that crease wrote are removed, and the directory if nothing else is in it. A directory without a workspace
    /// is refused.
    Clean(CleanArgs),
    /// Prints a script that has a shell complete commands, options and values.
    #[command(after_help = COMPLETIONS_EXAMPLES)]
    Completions(CompletionsArgs),
    /// Prints the manual page, or writes the pages of all commands into a directory.
    #[command(after_help = MAN_EXAMPLES)]
    Man(ManArgs),
}

const DETECT_EXAMPLES: &str = "\
Examples:
  crease detect scan.ply
      writes scan.creases.ply into the current directory
  crease detect scan.ply -o lines.ply --sigma 0.15 --min-angle 10
      in a scan in metres: averages over 15 cm, and reports creases of 10 degrees or more
  crease detect tiles/
      takes all meshes in a folder as one, and writes tiles.creases.ply into the current directory
  crease detect city.ply -o city.gpkg -o city.dxf --crs EPSG:28992
      the lines as a GeoPackage that knows its system of coordinates, and as DXF with a layer for each class
  crease detect part.ply -o part.vtp --annotate part.annotated.ply
      the lines for ParaView, and the mesh itself with the saliency, the class and the line of each vertex
  crease detect city.ply --attributes city.fields.ply --threads 8 --tile-faces 1000000
      writes a table of all vertices too; works with 8 threads on tiles of a million faces

A run that was interrupted or killed goes on where it stopped when the same command is given again. `crease clean` removes
what it has kept.";

const COMPLETIONS_EXAMPLES: &str = "\
Examples:
  crease completions bash > ~/.local/share/bash-completion/completions/crease
  crease completions zsh > ~/.zfunc/_crease
  crease completions fish > ~/.config/fish/completions/crease.fish";

const MAN_EXAMPLES: &str = "\
Examples:
  crease man --out ~/.local/share/man/man1
      man crease and man crease-detect work from now on
  crease man | man -l -
      shows the page at once";

const PLAN_EXAMPLES: &str = "\
Examples:
  crease plan city.ply -o city.creases.ply --workspace /shared/work --memory 8GiB
      plans tiles for tasks of 8 GiB each
  crease tile /shared/work --tile 17
      works on one of them, anywhere
  crease tile /shared/work --tiles $(crease status /shared/work --array)
      works on all that are missing
  crease stitch /shared/work
      writes city.creases.ply when all tiles are there";

/// Arguments of `info`.
#[derive(Debug, Args)]
pub(super) struct InfoArgs {
    #[command(flatten)]
    pub input: InputArgs,
    #[command(flatten)]
    pub preset: PresetArgs,
    /// Print one JSON object instead, for programs; docs/FORMATS.md has its fields.
    #[arg(long, help_heading = OUTPUT)]
    pub json: bool,

    #[command(flatten)]
    pub sigma: SigmaArgs,

    #[command(flatten)]
    pub bad: BadFacesArgs,

    #[command(flatten)]
    pub work: WorkArgs,

    #[command(flatten)]
    pub show: ShowArgs,
}

/// Arguments of `diff`.
#[derive(Debug, Args)]
pub(super) struct DiffArgs {
    /// The first file.
    pub a: PathBuf,
    /// The second file.
    pub b: PathBuf,
}

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub(super) struct CompletionsArgs {
    /// bash, elvish, fish, powershell or zsh.
    #[arg(value_enum, hide_possible_values = true)]
    pub shell: Shell,
}

/// Arguments of `man`.
#[derive(Debug, Args)]
pub(super) struct ManArgs {
    /// Write crease.1 and a page for each command, such as crease-detect.1, into this directory, which is made if need be.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Arguments of `clean`.
#[derive(Debug, Args)]
pub(super) struct CleanArgs {
    /// The workspace: what was given as `--workspace`, or the directory with the name of the output and `.crease-work`.
    #[arg(value_name = "DIR")]
    pub directory: PathBuf,
}
