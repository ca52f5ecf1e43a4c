//! Measures the program on cities of growing size, in the order of the scan and shuffled, within a memory cgroup.

mod cgroup;
mod measure;
mod table;

use anyhow::{Context, Result, ensure};
use cgroup::Cgroup;
use clap::{Parser, Subcommand, ValueEnum};
use crease::input::ply::Header;
use crease::input::{ByteSource, IoMode};
use measure::{Measured, run};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::str::FromStr;
use table::{Machine, Row, allocated, parse_bytes};

/// Time, memory and disk of `crease detect` on cities of growing size.
///
/// Build first what is measured: `cargo build --release --bins --examples`.
#[derive(Parser)]
#[command(name = "scale", max_term_width = 110)]
struct Arguments {
    #[command(subcommand)]
    command: What,
}

#[derive(Subcommand)]
enum What {
    /// Generate cities, run the program on each, and print one table.
    Cities(Cities),
    /// Run a command in a memory cgroup of its own and say what it took.
    Run {
        /// Memory for the command: bytes, or 512MiB, 2GB.
        #[arg(long, value_parser = bytes)]
        limit: u64,
        /// The command and its arguments.
        #[arg(required = true, trailing_var_arg = true, allow_hyphen_values = true)]
        command: Vec<String>,
    },
}

#[derive(clap::Args)]
struct Cities {
    /// What to measure: TRIANGLES, TRIANGLES:MEMORY or TRIANGLES:MEMORY:LIMIT, as in 1e8:512MiB:1GiB. MEMORY goes to the
    /// program as --memory; LIMIT is that of the cgroup.
    #[arg(required = true)]
    cases: Vec<Case>,
    /// Order of vertices and faces.
    #[arg(long, value_enum, default_value_t = Orders::Both)]
    order: Orders,
    /// Noise of the cities in mean edge lengths.
    #[arg(long, default_value_t = 0.03)]
    noise: f64,
    /// Seed of the cities.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Where meshes, lines and temporary files go. It needs room for a mesh, 19 bytes a triangle,
    /// and for 25 more while one is shuffled.
    #[arg(long, value_name = "DIR")]
    directory: PathBuf,
    /// Keep the meshes, and use those that are there.
    #[arg(long)]
    keep: bool,
    /// Drop the mesh from the page cache before each run.
    #[arg(long)]
    cold: bool,
    /// The program; default is the one built with this tool.
    #[arg(long)]
    crease: Option<PathBuf>,
    /// Where to write the table, too.
    #[arg(long, value_name = "FILE.md")]
    markdown: Option<PathBuf>,
    /// Where to write all numbers.
    #[arg(long, value_name = "FILE.json")]
    json: Option<PathBuf>,
    /// Further options of `crease detect`. `{temporary}` in them becomes a directory whose bytes are counted.
    #[arg(last = true)]
    options: Vec<String>,
}

/// A size with its limits.
#[derive(Clone, Debug)]
struct Case {
    triangles: String,
    memory: Option<String>,
    limit: Option<u64>,
}

impl FromStr for Case {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let mut parts = word.splitn(3, ':');
        let triangles = parts.next().unwrap_or_default().to_owned();
        // The name of a file comes from it.
        if triangles.is_empty() || !triangles.chars().all(|c| c.is_ascii_digit() || "e.".contains(c)) {
            return Err(format!("{triangles:?} is not a number of triangles"));
        }
        let memory = parts.next().map(str::to_owned).filter(|memory| !memory.is_empty());
        Ok(Self { triangles, memory, limit: parts.next().map(bytes).transpose()? })
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Orders {
    Coherent,
    Shuffled,
    Both,
}

impl Orders {
    fn names(self) -> &'static [&'static str] {
        match self {
            Self::Coherent => &["coherent"],
            Self::Shuffled => &["shuffled"],
            Self::Both => &["coherent", "shuffled"],
        }
    }
}

fn bytes(word: &str) -> Result<u64, String> {
    parse_bytes(word).ok_or_else(|| format!("{word:?} is not a number of bytes, like 512MiB"))
}

fn main() -> Result<()> {
    match Arguments::parse().command {
        What::Cities(arguments) => cities(&arguments),
        What::Run { limit, command } => run_limited(limit, &command),
    }
}

fn cities(arguments: &Cities) -> Result<()> {
    fs::create_dir_all(&arguments.directory)
        .with_context(|| format!("cannot create {}", arguments.directory.display()))?;
    let machine = Machine::this();
    let mut rows = Vec::new();
    for case in &arguments.cases {
        for &order in arguments.order.names() {
            let mesh = arguments.directory.join(format!("city-{}-{order}.ply", case.triangles));
            if !(arguments.keep && mesh.exists()) {
                generate(arguments, case, order, &mesh)?;
            }
            rows.push(measure_city(arguments, case, order, &mesh)?);
            if !arguments.keep {
                fs::remove_file(&mesh).with_context(|| format!("cannot remove {}", mesh.display()))?;
            }
            // After each run: a benchmark of hours should not lose its rows to what comes later.
            if let Some(path) = &arguments.json {
                fs::write(path, table::json(&machine, &rows)?)
                    .with_context(|| format!("cannot write {}", path.display()))?;
            }
            if let Some(path) = &arguments.markdown {
                fs::write(path, table::markdown(&machine, &rows))
                    .with_context(|| format!("cannot write {}", path.display()))?;
            }
        }
    }
    print!("{}", table::markdown(&machine, &rows));
    Ok(())
}

fn generate(arguments: &Cities, case: &Case, order: &str, mesh: &Path) -> Result<()> {
    eprintln!("{} triangles, {order}: generating", case.triangles);
    let mut command = Command::new(built("examples/gen")?);
    command.args(["city", &case.triangles, "--seed", &arguments.seed.to_string()]);
    command.args(["--noise", &arguments.noise.to_string(), "-o"]).arg(mesh);
    if order == "shuffled" {
        command.arg("--shuffle");
    }
    let status = command.stdout(Stdio::null()).status().context("cannot run the generator")?;
    ensure!(status.success(), "the generator failed");
    Ok(())
}

fn measure_city(arguments: &Cities, case: &Case, order: &'static str, mesh: &Path) -> Result<Row> {
    eprintln!("{} triangles, {order}: detecting", case.triangles);
    if arguments.cold {
        drop_from_cache(mesh)?;
    }
    let program = match &arguments.crease {
        Some(program) => program.clone(),
        None => built("crease")?,
    };
    let temporary = mesh.with_extension("temporary");
    fs::create_dir_all(&temporary).with_context(|| format!("cannot create {}", temporary.display()))?;
    let lines = mesh.with_extension("lines.ply");
    let group = make_group(case.limit);
    let mut command = match &group {
        Some(group) => group.command(&program),
        None => Command::new(&program),
    };
    command.arg("detect").arg(mesh).arg("-o").arg(&lines).args(["--force", "--progress", "none"]);
    if let Some(memory) = &case.memory {
        command.args(["--memory", memory]);
    }
    let place = temporary.to_string_lossy();
    command.args(arguments.options.iter().map(|option| option.replace("{temporary}", &place)));
    if !arguments.options.iter().any(|option| option.starts_with("--workspace")) {
        command.arg("--workspace").arg(&temporary);
    }
    command.env("TMPDIR", &temporary);
    let measured = run(command, &temporary)?;
    fs::remove_dir_all(&temporary).with_context(|| format!("cannot remove {}", temporary.display()))?;
    if measured.status.success() {
        fs::remove_file(&lines).with_context(|| format!("cannot remove {}", lines.display()))?;
    }
    row(case, order, mesh, &measured, group.as_ref())
}

fn row(
    case: &Case,
    order: &'static str,
    mesh: &Path,
    measured: &Measured,
    group: Option<&Cgroup>,
) -> Result<Row> {
    let triangles = faces_of(mesh)?;
    let input_bytes = fs::metadata(mesh).with_context(|| format!("cannot read {}", mesh.display()))?.len();
    Ok(Row {
        triangles,
        order,
        input_bytes,
        memory: case.memory.clone(),
        limit_bytes: group.and(case.limit),
        wall_seconds: measured.wall,
        cpu_seconds: measured.cpu,
        mtri_per_cpu_second: triangles as f64 / 1e6 / measured.cpu.max(0.01),
        allocated_bytes: allocated(&measured.output),
        resident_bytes: measured.memory.resident,
        anonymous_bytes: measured.memory.anonymous,
        mapped_bytes: measured.memory.mapped,
        temporary_bytes: measured.temporary,
        disk_read_bytes: measured.moved.from_disk,
        disk_written_bytes: measured.moved.to_disk,
        cgroup_peak_bytes: group.and_then(Cgroup::peak),
        outcome: outcome(measured, group),
    })
}

/// How a run ended, in a few words.
fn outcome(measured: &Measured, group: Option<&Cgroup>) -> String {
    let killed = group.and_then(Cgroup::kills).is_some_and(|kills| kills > 0);
    match measured.status.code() {
        Some(0) => "done".to_owned(),
        _ if killed => "killed: out of memory".to_owned(),
        _ => {
            let said = measured.complaint.lines().last().unwrap_or("nothing").replace('|', "/");
            format!("{}: {said}", measured.status)
        }
    }
}

/// Runs a command within a limit.
fn run_limited(limit: u64, words: &[String]) -> Result<()> {
    let group = make_group(Some(limit));
    let mut command = match &group {
        Some(group) => group.command(&words[0]),
        None => Command::new(&words[0]),
    };
    command.args(&words[1..]);
    let scratch = std::env::temp_dir().join(format!("scale-{}", std::process::id()));
    let measured = run(command, &scratch)?;
    print!("{}", measured.output);
    eprint!("{}", measured.complaint);
    let peak = group.as_ref().and_then(Cgroup::peak);
    eprintln!(
        "scale: {}, wall {:.2} s, CPU {:.2} s, peak bytes: resident {}, anonymous {}, cgroup {}",
        outcome(&measured, group.as_ref()),
        measured.wall,
        measured.cpu,
        measured.memory.resident,
        measured.memory.anonymous,
        peak.map_or("unknown".to_owned(), |bytes| bytes.to_string())
    );
    ensure!(measured.status.success(), "the command failed");
    Ok(())
}

/// A group, or a message why there is none.
fn make_group(limit: Option<u64>) -> Option<Cgroup> {
    match Cgroup::create(limit) {
        Ok(group) => Some(group),
        Err(error) => {
            eprintln!("scale: without a limit on memory: {error:#}");
            None
        }
    }
}

/// A file that was built with this tool.
fn built(name: &str) -> Result<PathBuf> {
    let this = std::env::current_exe().context("this program does not know where it is")?;
    let directory =
        this.parent().and_then(Path::parent).context("this program is not in a build directory")?;
    let path = directory.join(name);
    ensure!(path.exists(), "{} is missing: cargo build --release --bins --examples", path.display());
    Ok(path)
}

/// Number of faces that the header of a mesh announces.
fn faces_of(mesh: &Path) -> Result<u64> {
    let header = Header::read(&ByteSource::open(mesh, IoMode::Read)?)?;
    let faces = header.elements.iter().find(|element| element.name == "face");
    Ok(faces.with_context(|| format!("{} has no faces", mesh.display()))?.count)
}

/// Asks the system to forget a file; written pages must be on disk first.
fn drop_from_cache(mesh: &Path) -> Result<()> {
    let mut target = std::ffi::OsString::from("of=");
    target.push(mesh);
    let status = Command::new("dd")
        .arg(target)
        .args(["oflag=nocache", "conv=notrunc,fdatasync", "count=0", "status=none"])
        .stdin(Stdio::null())
        .status()
        .context("cannot run dd")?;
    ensure!(status.success(), "dd cannot drop {} from the cache", mesh.display());
    Ok(())
}
