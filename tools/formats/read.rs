//! Reads an input as `crease` does, and writes out what it is: for comparison with other readers.
//!
//! In: names of files or folders. Out: on standard output a line with the numbers of vertices and triangles, then the
//! positions (three little-endian f64 each) and the corners (three u64 each). An input that is refused is one line on
//! standard error and exit code 3.

use crease::input::{FaceBlock, InputFiles, IoMode, MeshSource, OpenOptions, Progress, open_input};
use crease::mesh::VertexId;
use std::io::{BufWriter, Write};
use std::path::PathBuf;
use std::process::ExitCode;

struct Nobody;

impl Progress for Nobody {
    fn advanced(&self, _: u64) {}
    fn grown(&self, _: u64) {}
}

/// Vertices written at a time.
const CHUNK: u64 = 1 << 16;

fn main() -> ExitCode {
    let names: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    match write(&names) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error:#}");
            ExitCode::from(3)
        }
    }
}

fn write(names: &[PathBuf]) -> anyhow::Result<()> {
    let workspace = std::env::temp_dir();
    let options = OpenOptions {
        scratch: &workspace.as_path().into(),
        weld: None,
        memory: 256 << 20,
        io: IoMode::Auto,
        progress: &Nobody,
    };
    let input = open_input(&InputFiles::find(names)?, &options)?;
    let mesh = input.mesh();
    let mut out = BufWriter::new(std::io::stdout().lock());
    writeln!(out, "{} {}", mesh.vertex_count(), mesh.face_count())?;
    let mut positions = Vec::new();
    for first in (0..mesh.vertex_count()).step_by(CHUNK as usize) {
        positions.clear();
        let count = CHUNK.min(mesh.vertex_count() - first) as usize;
        mesh.read_positions(VertexId(first), count, &mut positions)?;
        positions.iter().flat_map(|p| p.to_array()).try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
    }
    let mut block = FaceBlock::default();
    for index in 0..mesh.block_count() {
        mesh.read_block(index, &mut block)?;
        block.corners.iter().flatten().try_for_each(|corner| out.write_all(&corner.0.to_le_bytes()))?;
    }
    Ok(out.flush()?)
}
