//! The command line as types, with the help texts.
//!
//! In: words. Out: [`Params`], [`Limits`] and paths whose values are possible ones on their own; whether they suit a mesh
//! is found out when it has been scanned.

use super::input_args::{BadFacesArgs, InputArgs};
use super::memory_limit::default_memory;
use super::method::{MethodArgs, refusal};
use crate::config::{Limits, Order, Params, Sigma, Tiling, method};
use crate::input::IoMode;
use crate::stitch::Geometry;
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::ffi::OsString;
use std::path::PathBuf;

/// Headings of the help.
pub(super) const WHAT: &str = "What is detected";
const HOW: &str = "How the work is done (none of this changes the result)";
const OUTPUT: &str = "Output";

/// Finds feature lines (sharp edges, weak creases, corners) in triangle meshes that may be larger than memory.
#[derive(Debug, Parser)]
#[command(name = "crease", version, arg_required_else_help = true, max_term_width = 110, after_help = EXIT_CODES)]
pub(super) struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

impl Cli {
    /// Parses `arguments`, of which the first is the name of the program.
    ///
    /// # Errors
    /// If they ask for help or for something that makes no sense.
    pub fn parse_words(arguments: impl IntoIterator<Item = OsString>) -> Result<Cli, clap::Error> {
        let cli = Cli::try_parse_from(arguments)?;
        match &cli.command {
            Command::Detect(args) => args.method.check(args.sigma.sigma(), args.min_angle)?,
            Command::Info(args) if args.sigma.sigma().is_zero() => {
                return Err(refusal("a sigma of 0 needs detect --method paper"));
            }
            Command::Info(_) | Command::Diff(_) | Command::Clean(_) => {}
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
  130  interrupted; the same command goes on";

/// What to do.
#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Finds the feature lines of a mesh and writes them to a file.
    #[command(after_help = DETECT_EXAMPLES)]
    Detect(DetectArgs),
    /// Describes a mesh and how it would be worked on, without doing the work.
    ///
    /// Reads the file once. Open borders and non-manifold edges are counted by `detect`, because they show only when
    /// neighbouring faces are joined.
    Info(InfoArgs),
    /// Compares two result files record by record.
    ///
    /// Prints `identical` and ends with exit code 0, or prints the first difference and a table of all that differs, and
    /// ends with exit code 1. Any two binary little-endian PLY files can be compared, of any size.
    Diff(DiffArgs),
    /// Removes what an interrupted `detect` has kept, if nobody wants to go on with it.
    ///
    /// Only files that crease wrote are removed, and the directory if nothing else is in it. A directory without a workspace
    /// is refused.
    Clean(CleanArgs),
}

const DETECT_EXAMPLES: &str = "\
Examples:
  crease detect scan.ply
      writes scan.creases.ply into the current directory
  crease detect scan.ply -o lines.ply --sigma 0.15 --min-angle 10
      in a scan in metres: averages over 15 cm, and reports creases of 10 degrees or more
  crease detect tiles/
      takes all meshes in a folder as one, and writes tiles.creases.ply into the current directory
  crease detect city.ply --attributes city.fields.ply --threads 8 --tile-faces 1000000
      writes a table of all vertices too; works with 8 threads on tiles of a million faces

A run that was interrupted or killed goes on where it stopped when the same command is given again. `crease clean` removes
what it has kept.";

/// Arguments of `detect`.
#[derive(Debug, Args)]
pub(super) struct DetectArgs {
    #[command(flatten)]
    pub input: InputArgs,

    #[command(flatten)]
    pub method: MethodArgs,

    #[command(flatten)]
    pub sigma: SigmaArgs,

    /// The weakest crease to report, as the mean angle of a line in degrees: 0 is flat, 90 is the edge of a box, 180 is
    /// folded back. Default: 0, which leaves the decision to the noise and the curvature around each place. With
    /// `--method robust` only.
    #[arg(long, value_name = "DEG", help_heading = WHAT, value_parser = angle, allow_negative_numbers = true)]
    pub min_angle: Option<f64>,

    /// The shortest line to report, in sigmas: connected lines that are shorter together are dropped. Default: 2.67.
    #[arg(long, value_name = "SIGMAS", help_heading = WHAT, value_parser = length, allow_negative_numbers = true)]
    pub min_length: Option<f64>,

    /// Report the open borders of the mesh and its non-manifold edges too, each as a class of its own.
    #[arg(long, help_heading = WHAT)]
    pub boundaries: bool,

    #[command(flatten)]
    pub bad: BadFacesArgs,

    #[command(flatten)]
    pub work: WorkArgs,

    /// Where the lines run: `vertices`, the default, along edges of the mesh, from vertex to vertex; `fitted`, where the
    /// surfaces on both sides meet, smoothed along the line, as a person would draw them.
    #[arg(long, value_enum, value_name = "KIND", help_heading = OUTPUT, default_value = "vertices",
          hide_default_value = true, hide_possible_values = true)]
    pub geometry: GeometryArg,

    /// Where to write the lines. Default: the name of the input with `.creases.ply` for its extension, in the current
    /// directory.
    #[arg(short, long, value_name = "FILE.ply", help_heading = OUTPUT)]
    pub output: Option<PathBuf>,

    /// Also write a table of all vertices in the order of the input: position, eigenvalues of the voting tensor, omega,
    /// saliency, class. 65 bytes for each vertex.
    #[arg(long, value_name = "FILE.ply", help_heading = OUTPUT)]
    pub attributes: Option<PathBuf>,

    /// Replace outputs that exist already.
    #[arg(long, help_heading = OUTPUT)]
    pub force: bool,

    /// Leave the workspace when the outputs are there: with --force, or other names, the same command writes them again without
    /// doing the work again.
    #[arg(long, help_heading = HOW)]
    pub keep_workspace: bool,

    /// Say nothing unless something goes wrong: no progress, no summary.
    #[arg(short, long, help_heading = OUTPUT, conflicts_with = "verbose")]
    pub quiet: bool,

    #[command(flatten)]
    pub report: ReportArgs,
}

impl DetectArgs {
    /// How progress is shown.
    pub fn progress(&self) -> ProgressKind {
        if self.quiet { ProgressKind::None } else { self.report.progress }
    }

    /// What changes the result.
    pub fn params(&self) -> Params {
        let default = Params::default();
        Params {
            method: self.method.method(),
            sigma: self.sigma.sigma(),
            min_angle_deg: self.min_angle.unwrap_or(default.min_angle_deg),
            min_length_sigmas: self.min_length.unwrap_or(default.min_length_sigmas),
            boundaries: self.boundaries,
        }
    }
}

/// Arguments of `info`.
#[derive(Debug, Args)]
pub(super) struct InfoArgs {
    #[command(flatten)]
    pub input: InputArgs,

    #[command(flatten)]
    pub sigma: SigmaArgs,

    #[command(flatten)]
    pub bad: BadFacesArgs,

    #[command(flatten)]
    pub work: WorkArgs,

    #[command(flatten)]
    pub report: ReportArgs,
}

/// Arguments of `diff`.
#[derive(Debug, Args)]
pub(super) struct DiffArgs {
    /// The first file.
    pub a: PathBuf,
    /// The second file.
    pub b: PathBuf,
}

/// Arguments of `clean`.
#[derive(Debug, Args)]
pub(super) struct CleanArgs {
    /// The workspace: what was given as `--workspace`, or the directory with the name of the output and `.crease-work`.
    #[arg(value_name = "DIR")]
    pub directory: PathBuf,
}

/// The voting scale.
#[derive(Debug, Args)]
pub(super) struct SigmaArgs {
    /// Radius over which the surface is averaged, in the units of the mesh (metres, if the mesh is in metres). Larger
    /// suppresses more noise; features closer together than this merge. With `--method paper` it is the edge of the cube
    /// around a vertex whose faces vote, and may be 0: then only the faces at the vertex do.
    #[arg(long, value_name = "LENGTH", help_heading = WHAT, conflicts_with = "sigma_edges",
          value_parser = sigma, allow_negative_numbers = true)]
    sigma: Option<f64>,

    /// The same in median edge lengths of the mesh, from 1 to 30. Default: 3.
    #[arg(long, value_name = "K", help_heading = WHAT, value_parser = edges, allow_negative_numbers = true)]
    sigma_edges: Option<f64>,
}

impl SigmaArgs {
    /// The scale that was asked for.
    pub fn sigma(&self) -> Sigma {
        match (self.sigma, self.sigma_edges) {
            (Some(length), _) => Sigma::Length(length),
            (None, Some(edges)) => Sigma::Edges(edges),
            (None, None) => Params::default().sigma,
        }
    }
}

/// How the work is cut up.
#[derive(Debug, Args)]
pub(super) struct WorkArgs {
    /// Threads that compute, at most 1024. 0, the default, is one for each processor.
    #[arg(long, value_name = "N", help_heading = HOW, default_value_t = 0, hide_default_value = true,
          value_parser = clap::value_parser!(u16).range(..=1024))]
    threads: u16,

    /// Memory that may be allocated at a time: a number of bytes, or with a unit as in 512MiB, 2GiB, 2GB. Tiles are made to
    /// fit. Default: three quarters of what the machine or the control group of the process has.
    #[arg(long, value_name = "SIZE", help_heading = HOW, value_parser = memory)]
    memory: Option<u64>,

    /// Faces of a tile, the piece of the mesh that is worked on at a time. Default: as many as the memory allows, and no more
    /// than 2000000.
    #[arg(long, value_name = "N", help_heading = HOW, value_parser = clap::value_parser!(u64).range(1..))]
    tile_faces: Option<u64>,

    /// Work on the whole mesh at once: fastest if it fits into memory (about 350 bytes for each face).
    #[arg(long, help_heading = HOW, conflicts_with = "tile_faces")]
    in_core: bool,

    /// How the file is read. `map` lets the system keep what fits into memory; `read` asks for each piece, which suits
    /// network drives; `auto` maps if the system can.
    #[arg(long, value_enum, value_name = "MODE", help_heading = HOW, default_value = "auto", hide_possible_values = true)]
    pub io: Io,

    /// Whether a mesh without spatial order is rewritten, for those who measure: `auto`, `keep`, `rewrite`.
    #[arg(long, value_enum, value_name = "ORDER", help_heading = HOW, default_value = "auto", hide = true)]
    order: OrderArg,

    /// The directory for what is done, so that an interrupted run goes on where it stopped, and for temporary files, which
    /// are needed to convert the input, and if faces that are neighbours in space are far apart in the file: up to three times
    /// its size. Made when it is needed, and removed when the outputs are there. Default: the name of the output with
    /// `.crease-work` for its extension, beside it.
    #[arg(long, value_name = "DIR", help_heading = HOW)]
    pub workspace: Option<PathBuf>,
}

impl WorkArgs {
    /// The limits of the run. The number of threads is resolved here, so that the summary can name it.
    pub fn limits(&self) -> Limits {
        let processors = || std::thread::available_parallelism().map_or(1, usize::from);
        let tiling = match (self.in_core, self.tile_faces) {
            (true, _) => Tiling::InCore,
            (false, Some(faces)) => Tiling::Faces(faces),
            (false, None) => Tiling::Auto,
        };
        let memory = self.memory.unwrap_or_else(default_memory);
        let threads = if self.threads == 0 { processors() } else { self.threads.into() };
        Limits { threads, tiling, io: self.io.into(), memory, order: self.order.into() }
    }
}

/// What is said while the work is done.
#[derive(Debug, Args)]
pub(super) struct ReportArgs {
    /// How progress is shown on standard error: `bar`, `plain` lines, `json` (one object on each line), or `none`. `auto`
    /// shows a bar on a terminal and lines elsewhere.
    #[arg(long, value_enum, value_name = "KIND", help_heading = OUTPUT, default_value = "auto", hide_possible_values = true)]
    pub progress: ProgressKind,

    /// Log details of the work to standard error. The environment variable RUST_LOG chooses more finely.
    #[arg(short, long, help_heading = OUTPUT)]
    pub verbose: bool,
}

/// How the input is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Io {
    Auto,
    Map,
    Read,
}

impl Io {
    /// The word of the command line.
    pub fn name(self) -> &'static str {
        match self {
            Io::Auto => "auto",
            Io::Map => "map",
            Io::Read => "read",
        }
    }
}

impl From<Io> for IoMode {
    fn from(io: Io) -> IoMode {
        match io {
            Io::Auto => IoMode::Auto,
            Io::Map => IoMode::Map,
            Io::Read => IoMode::Read,
        }
    }
}

/// What is done about a file without spatial order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum OrderArg {
    Auto,
    Keep,
    Rewrite,
}

impl From<OrderArg> for Order {
    fn from(order: OrderArg) -> Order {
        match order {
            OrderArg::Auto => Order::Auto,
            OrderArg::Keep => Order::Keep,
            OrderArg::Rewrite => Order::Rewrite,
        }
    }
}

/// Where lines run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum GeometryArg {
    Vertices,
    Fitted,
}

impl From<GeometryArg> for Geometry {
    fn from(geometry: GeometryArg) -> Geometry {
        match geometry {
            GeometryArg::Vertices => Geometry::Vertices,
            GeometryArg::Fitted => Geometry::Fitted,
        }
    }
}

/// How progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum ProgressKind {
    Auto,
    Bar,
    Plain,
    Json,
    None,
}

pub(super) fn number(text: &str) -> Result<f64, String> {
    text.parse::<f64>().map_err(|_| "not a number".to_owned())
}

fn sigma(text: &str) -> Result<f64, String> {
    let x = number(text)?;
    if x >= 0.0 && x.is_finite() {
        Ok(x)
    } else {
        Err("it must be a length above 0, or 0 with --method paper".to_owned())
    }
}

/// A number from 0 to 1.
pub(super) fn share(text: &str) -> Result<f64, String> {
    let x = number(text)?;
    if (0.0..=1.0).contains(&x) { Ok(x) } else { Err("it must lie between 0 and 1".to_owned()) }
}

fn length(text: &str) -> Result<f64, String> {
    let x = number(text)?;
    if x >= 0.0 && x.is_finite() { Ok(x) } else { Err("it must be 0 or more".to_owned()) }
}

/// Anything that leaves room for the code that would say that it is too little.
const LEAST_MEMORY: u64 = 8 << 20;

fn memory(text: &str) -> Result<u64, String> {
    let size: bytesize::ByteSize = text.parse()?;
    if size.as_u64() >= LEAST_MEMORY { Ok(size.as_u64()) } else { Err("it must be 8 MiB or more".to_owned()) }
}

fn angle(text: &str) -> Result<f64, String> {
    let x = number(text)?;
    if (0.0..=180.0).contains(&x) { Ok(x) } else { Err("it must lie between 0 and 180 degrees".to_owned()) }
}

fn edges(text: &str) -> Result<f64, String> {
    let (min, max) = method::SIGMA_EDGES_RANGE;
    let x = number(text)?;
    if (min..=max).contains(&x) || x == 0.0 {
        Ok(x)
    } else {
        Err(format!("it must lie between {min} and {max} median edge lengths, or be 0 with --method paper"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Method, PaperThresholds};
    use clap::CommandFactory;

    fn detect(words: &str) -> Result<DetectArgs, clap::Error> {
        let all = ["crease", "detect", "in.ply"].into_iter().chain(words.split_whitespace());
        Cli::parse_words(all.map(OsString::from)).map(|cli| match cli.command {
            Command::Detect(args) => args,
            other => panic!("{other:?}"),
        })
    }

    #[test]
    fn the_definition_is_sound() {
        Cli::command().debug_assert();
    }

    #[test]
    fn nothing_said_is_the_default() {
        let args = detect("").expect("no options");
        assert_eq!(args.params(), Params::default());
        assert_eq!(args.work.limits().tiling, Limits::default().tiling);
        assert!(args.work.limits().threads > 0);
    }

    #[test]
    fn the_help_names_the_defaults_that_are() {
        let help =
            Cli::command().find_subcommand_mut("detect").expect("detect").render_long_help().to_string();
        let default = Params::default();
        for text in [
            format!("Default: {}", method::SIGMA_EDGES),
            format!("from {} to {}", method::SIGMA_EDGES_RANGE.0, method::SIGMA_EDGES_RANGE.1),
            format!("Default: {:.2}", default.min_length_sigmas),
            format!("Default: {}", default.min_angle_deg),
            format!("than {}", crate::config::DEFAULT_TILE_FACES),
            format!("Default: {}", PaperThresholds::default().salience),
            format!("Default: {}", PaperThresholds::default().edge_l2),
            format!("Default: {}", PaperThresholds::default().corner_l3),
        ] {
            let flat = help.split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(flat.contains(&text), "{text} is not in {flat}");
        }
    }

    #[test]
    fn options_arrive() {
        let args = detect("--sigma 0.5 --min-angle 10 --min-length 0 --boundaries --in-core --io read")
            .expect("parse");
        let expected = Params {
            method: Method::Robust,
            sigma: Sigma::Length(0.5),
            min_angle_deg: 10.0,
            min_length_sigmas: 0.0,
            boundaries: true,
        };
        assert_eq!(args.params(), expected);
        assert_eq!((args.work.limits().tiling, args.work.limits().io), (Tiling::InCore, IoMode::Read));
    }

    #[test]
    fn impossible_values_are_refused() {
        for words in [
            "--sigma 0",
            "--sigma -1",
            "--sigma nan",
            "--sigma inf",
            "--sigma-edges 0.5",
            "--sigma-edges 31",
            "--sigma 1 --sigma-edges 3",
            "--min-angle 181",
            "--min-angle -1",
            "--min-length -1",
            "--tile-faces 0",
            "--tile-faces 5 --in-core",
            "--threads -1",
            "--threads 1025",
            "--io pipe",
            "--quiet --verbose",
            "--method both",
            "--method paper --salience 1.1",
            "--method paper --edge-l2 0",
            "--method paper --corner-l3 2",
            "--method paper --sigma -1",
            "--method paper --sigma-edges 0.5",
        ] {
            assert!(detect(words).is_err(), "{words}");
        }
    }

    #[test]
    fn the_paper_method_has_its_own_options() {
        let published = PaperThresholds { corner_l3: 0.065, edge_l2: 0.02, salience: 0.1 };
        let args = detect("--method paper").expect("parse");
        assert_eq!(args.params(), Params { method: Method::Paper(published), ..Params::default() });
        let args =
            detect("--method paper --sigma 0 --salience 0.2 --edge-l2 0.03 --corner-l3 0.07").expect("parse");
        let thresholds = PaperThresholds { corner_l3: 0.07, edge_l2: 0.03, salience: 0.2 };
        let expected =
            Params { method: Method::Paper(thresholds), sigma: Sigma::Length(0.0), ..Params::default() };
        assert_eq!(args.params(), expected);
    }

    #[test]
    fn options_of_the_other_method_are_refused_by_name() {
        for (words, message) in [
            ("--salience 0.2", "--salience needs --method paper"),
            ("--method robust --edge-l2 0.02", "--edge-l2 needs --method paper"),
            ("--corner-l3 0.1", "--corner-l3 needs --method paper"),
            ("--sigma 0", "a sigma of 0 needs --method paper"),
            ("--sigma-edges 0", "a sigma of 0 needs --method paper"),
            ("--method paper --min-angle 10", "--min-angle needs --method robust"),
            ("--method paper --min-angle 0", "--min-angle needs --method robust"),
        ] {
            let refusal = detect(words).expect_err(words).to_string();
            assert!(refusal.contains(message), "{words}: {refusal}");
        }
    }
}
