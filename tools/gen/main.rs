//! Generates meshes with known feature lines, and the test files of the project.

#[path = "mod.rs"]
mod generator;

use anyhow::{Context, Result};
use clap::{Parser, Subcommand};
use generator::ply::{self, Scalar};
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
    /// Noise along the vertex normals: standard deviation in mean edge lengths.
    #[arg(long, value_name = "A", default_value_t = 0.0)]
    noise: f64,
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

fn main() -> Result<()> {
    match Arguments::parse().command {
        Command::Shape(arguments) => write_shape(&arguments),
        Command::Fixtures { directory } => fixtures::write(&directory),
    }
}

fn write_shape(arguments: &ShapeArguments) -> Result<()> {
    let mut shape = arguments.name.build(arguments.seed)?;
    shape.add_noise(arguments.noise, arguments.seed);
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

fn write_file(path: &Path, content: impl Fn(&mut BufWriter<File>) -> std::io::Result<()>) -> Result<()> {
    File::create(path)
        .map(BufWriter::new)
        .and_then(|mut out| {
            content(&mut out)?;
            out.flush()
        })
        .with_context(|| format!("cannot write {}", path.display()))
}
