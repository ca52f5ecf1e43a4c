//! Generates meshes with known feature lines, and the test files of the project.

#[path = "mod.rs"]
mod generator;

use anyhow::{Context, Result};
use clap::{Parser, Subcommand};
use generator::adversarial::Adversary;
use generator::noise::NoiseKind;
use generator::ply::{self, Scalar};
use generator::scan::{CityScan, write};
use generator::style::Style;
use generator::{ShapeName, fixtures};
use glam::DVec3;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Seeded triangle meshes whose feature lines are known.
#[derive(Parser)]
#[command(name = "gen")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Write one shape as binary PLY.
    Shape(ShapeArguments),
    /// List the shapes with their sizes.
    Shapes {
        /// Seed of the meshes.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        #[command(flatten)]
        style: StyleArguments,
    },
    /// Write the scan of a city of any size, in constant memory.
    ///
    /// Ground, sunken streets with kerbs, houses with flat, gable and hip roofs; one open surface. Units are sample
    /// spacings. Consecutive faces lie together, unless they are shuffled. RAYON_NUM_THREADS sets the number of threads;
    /// the bytes do not depend on it.
    City(CityArguments),
    /// Write a mesh that is hard to work on in pieces.
    Adversarial(AdversarialArguments),
    /// Write all test files of the project.
    Fixtures {
        /// Where they go (`fixtures` in the project).
        directory: PathBuf,
    },
}

#[derive(clap::Args)]
struct ShapeArguments {
    #[arg(help = format!("What to generate: {}", ShapeName::FORMS))]
    name: ShapeName,
    /// Seed of the mesh and of the noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    style: StyleArguments,
    /// Amplitude of the noise, in mean edge lengths.
    #[arg(long, value_name = "A", default_value_t = 0.0)]
    noise: f64,
    #[arg(long, value_name = "KIND", default_value_t = NoiseKind::Normal)]
    #[arg(help = format!("Kind of noise: {}", NoiseKind::FORMS))]
    noise_kind: NoiseKind,
    /// The mesh.
    #[arg(short, long, value_name = "FILE.ply")]
    output: PathBuf,
    /// Store coordinates as double.
    #[arg(long)]
    double: bool,
    /// Where to write the true feature lines.
    #[arg(long, value_name = "FILE.ply")]
    truth: Option<PathBuf>,
    /// Move the mesh and the lines.
    #[arg(long, num_args = 3, value_names = ["X", "Y", "Z"], allow_negative_numbers = true)]
    offset: Option<Vec<f64>>,
    /// Shuffle the order of vertices and faces.
    #[arg(long, value_name = "SEED")]
    permute: Option<u64>,
}

#[derive(clap::Args)]
struct CityArguments {
    /// Number of triangles, from some 5000 on; the city has about as many, within a hundredth from a million on.
    #[arg(value_parser = count)]
    triangles: u64,
    /// Seed of the city, of the noise and of the order.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Standard deviation of the noise, in mean edge lengths.
    #[arg(long, value_name = "A", default_value_t = 0.0)]
    noise: f64,
    /// Kind of noise: normal or isotropic.
    #[arg(long, value_name = "KIND", default_value_t = NoiseKind::Normal)]
    noise_kind: NoiseKind,
    /// The mesh.
    #[arg(short, long, value_name = "FILE.ply")]
    output: PathBuf,
    /// Where to write the true feature lines.
    #[arg(long, value_name = "FILE.ply")]
    truth: Option<PathBuf>,
    /// Move the mesh and the lines, and store coordinates as double.
    #[arg(long, num_args = 3, value_names = ["X", "Y", "Z"], allow_negative_numbers = true)]
    offset: Option<Vec<f64>>,
    /// Vertices and faces in random order. Needs 1.3 times the disk space of the mesh for temporary files beside it.
    #[arg(long)]
    shuffle: bool,
}

#[derive(clap::Args)]
struct AdversarialArguments {
    #[arg(help = format!("What to generate: {}", Adversary::FORMS), long_help = adversaries())]
    name: Adversary,
    /// Number of triangles; the mesh has about as many.
    #[arg(long, value_name = "N", default_value = "1e6", value_parser = count)]
    faces: u64,
    /// Seed of the mesh.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The mesh.
    #[arg(short, long, value_name = "FILE.ply")]
    output: PathBuf,
    /// Store coordinates as double.
    #[arg(long)]
    double: bool,
}

#[derive(clap::Args)]
struct StyleArguments {
    /// Target edge length.
    #[arg(long, value_name = "L", default_value_t = 1.0)]
    edge: f64,
    /// Triangles this many times longer than wide, along the straight direction of the shape.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    stretch: f64,
    /// Longest over shortest edges, varying smoothly across the shape.
    #[arg(long, value_name = "RATIO", default_value_t = 1.0)]
    density: f64,
    /// Triangles as CAD programs write them: no points inside flat faces and along straight edges.
    #[arg(long)]
    cad: bool,
}

impl StyleArguments {
    fn style(&self) -> Style {
        Style { edge: self.edge, stretch: self.stretch, density: self.density, cad: self.cad }
    }
}

fn main() -> Result<()> {
    match Arguments::parse().command {
        Command::Shape(arguments) => write_shape(&arguments),
        Command::Shapes { seed, style } => list(&style.style(), seed),
        Command::City(arguments) => write_city(&arguments),
        Command::Adversarial(arguments) => write_adversarial(&arguments),
        Command::Fixtures { directory } => fixtures::write(&directory),
    }
}

fn write_shape(arguments: &ShapeArguments) -> Result<()> {
    let mut shape = arguments.name.build_in(&arguments.style.style(), arguments.seed)?;
    shape.add_noise_of(arguments.noise_kind, arguments.noise, arguments.seed)?;
    if let Some(&[x, y, z]) = arguments.offset.as_deref() {
        shape.translate(DVec3::new(x, y, z));
    }
    if let Some(seed) = arguments.permute {
        shape.permute(seed);
    }
    let scalar = if arguments.double { Scalar::Double } else { Scalar::Float };
    write_file(&arguments.output, |out| ply::write_mesh(out, &shape, scalar))?;
    if let Some(truth) = &arguments.truth {
        write_file(truth, |out| ply::write_lines(out, &shape.lines))?;
    }
    println!("{} vertices, {} triangles", shape.vertices.len(), shape.faces.len());
    Ok(())
}

fn write_city(arguments: &CityArguments) -> Result<()> {
    let city = CityScan::new(arguments.triangles, arguments.seed)?
        .with_noise(arguments.noise_kind, arguments.noise)?;
    let style = write::Style {
        mesh: &arguments.output,
        truth: arguments.truth.as_deref(),
        offset: arguments.offset.as_deref().map(DVec3::from_slice),
        shuffle: arguments.shuffle.then_some(arguments.seed),
    };
    let written = write::write(&city, &style)?;
    let [columns, rows] = city.size();
    println!("{} vertices, {} triangles, {columns} x {rows} blocks", written.vertices, written.faces);
    Ok(())
}

fn write_adversarial(arguments: &AdversarialArguments) -> Result<()> {
    let mesh = arguments.name.describe(arguments.faces, arguments.seed)?;
    mesh.write(&arguments.output, if arguments.double { Scalar::Double } else { Scalar::Float })?;
    println!("{} vertices, {} triangles", mesh.vertices, mesh.faces);
    Ok(())
}

/// What each of them is hard for.
fn adversaries() -> String {
    let rows = Adversary::ALL.map(|name| format!("{:11} {}", name.to_string(), name.purpose()));
    format!("What to generate:\n  {}", rows.join("\n  "))
}

/// A number of things: `250000` or `2.5e5`.
fn count(word: &str) -> Result<u64, String> {
    let parsed = word.parse().ok().or_else(|| {
        let number: f64 = word.parse().ok()?;
        // Below 2^53 every whole number is exact.
        (number.fract() == 0.0 && (0.0..9e15).contains(&number)).then_some(number as u64)
    });
    parsed.ok_or_else(|| "not a whole number, like 250000 or 2.5e5".to_owned())
}

/// Prints a row for each shape. Shapes that do not come in the style say so in theirs.
fn list(style: &Style, seed: u64) -> Result<()> {
    style.check()?;
    println!(
        "{:10} {:>9} {:>9} {:>9} {:>7} {:>8}",
        "shape", "vertices", "triangles", "mean edge", "lines", "corners"
    );
    for name in ShapeName::ALL {
        let name_text = name.to_string();
        match name.build_in(style, seed) {
            Ok(shape) => println!(
                "{name_text:10} {:9} {:9} {:9.3} {:7.0} {:8}",
                shape.vertices.len(),
                shape.faces.len(),
                shape.mean_edge_length(),
                shape.line_length(),
                shape.corners.len()
            ),
            Err(error) => println!("{name_text:10} {error:#}"),
        }
    }
    Ok(())
}

fn write_file(path: &Path, content: impl Fn(&mut BufWriter<File>) -> std::io::Result<()>) -> Result<()> {
    File::create(path)
        .map(BufWriter::new)
        .and_then(|mut out| {
            content(&mut out)?;
            out.flush()
        })
        .with_context(|| format!("cannot write {}", path.display()))
}
