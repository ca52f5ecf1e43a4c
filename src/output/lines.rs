//! Feature lines as binary PLY; `docs/FORMATS.md` says what each field means.
//!
//! Vertices, then the edges of one line after the other, then one record for each line, so that the file can be streamed
//! and a reader that knows only vertices and edges still sees the lines.

use super::OutputError;
use super::part_file::PartFile;
use crate::math::DEGREE;
use crate::stitch::{Geometry, Line, LineSet};
use std::io::{BufWriter, Write};
use std::path::Path;

/// Writes `lines` to `target`.
///
/// # Errors
/// If the file cannot be written, or there are more elements than 32 bits can index.
pub fn write_ply(target: &Path, lines: &LineSet) -> Result<(), OutputError> {
    stage_ply(target, lines)?.commit()
}

/// Writes `lines` to the part that becomes `target` when it is committed: for outputs that must appear together.
///
/// # Errors
/// If the part cannot be written, or there are more elements than 32 bits can index.
pub fn stage_ply(target: &Path, lines: &LineSet) -> Result<PartFile, OutputError> {
    let edges: u64 = lines.lines.iter().map(|l| l.vertices.len() as u64 - 1).sum();
    let counts =
        [(lines.vertices.len() as u64, "vertices"), (edges, "edges"), (lines.lines.len() as u64, "lines")];
    for (count, what) in counts {
        if count > u64::from(u32::MAX) {
            return Err(OutputError::TooLarge { path: target.to_owned(), count, what });
        }
    }
    let part = PartFile::create(target)?;
    let mut out = BufWriter::with_capacity(1 << 20, part.file());
    write_all(&mut out, lines, counts.map(|(count, _)| count))
        .and_then(|()| out.flush())
        .map_err(OutputError::io(target, "cannot write"))?;
    drop(out);
    Ok(part)
}

fn write_all(
    out: &mut impl Write,
    lines: &LineSet,
    [vertices, edges, count]: [u64; 3],
) -> std::io::Result<()> {
    // PLY has no 64-bit integers; a double holds ids up to 2^53 exactly.
    let wide = lines.vertices.last().is_some_and(|v| v.id.0 > u64::from(u32::MAX));
    let source = if wide { "double" } else { "uint" };
    let geometry = match lines.geometry {
        Geometry::Vertices => "vertices",
        Geometry::Fitted => "fitted",
    };
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment feature lines found by crease\n\
         comment geometry {geometry}\n\
         element vertex {vertices}\nproperty double x\nproperty double y\nproperty double z\n\
         property {source} source\nproperty double saliency\nproperty double angle\nproperty uchar class\n\
         property uchar bend\n\
         element edge {edges}\nproperty uint vertex1\nproperty uint vertex2\nproperty uint line\n\
         element line {count}\nproperty uint id\nproperty uchar class\nproperty uchar closed\n\
         property uint first_edge\nproperty uint edges\n\
         property double length\nproperty double strength\nproperty double angle\n\
         property uchar bend\nend_header\n"
    )?;
    for v in &lines.vertices {
        lines.point(v).to_array().iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
        if wide {
            out.write_all(&(v.id.0 as f64).to_le_bytes())?;
        } else {
            out.write_all(&(v.id.0 as u32).to_le_bytes())?;
        }
        out.write_all(&lines.saliency(v).to_le_bytes())?;
        out.write_all(&(v.fit.angle / DEGREE).to_le_bytes())?;
        out.write_all(&[v.class as u8, v.fit.bend as u8])?;
    }
    for (id, line) in lines.lines.iter().enumerate() {
        for edge in line.vertices.windows(2) {
            for x in [edge[0], edge[1], id as u32] {
                out.write_all(&x.to_le_bytes())?;
            }
        }
    }
    let mut first_edge = 0u32;
    for (id, line) in lines.lines.iter().enumerate() {
        write_line(out, id as u32, line, first_edge)?;
        first_edge += line.vertices.len() as u32 - 1;
    }
    Ok(())
}

fn write_line(out: &mut impl Write, id: u32, line: &Line, first_edge: u32) -> std::io::Result<()> {
    out.write_all(&id.to_le_bytes())?;
    out.write_all(&[line.class as u8, u8::from(line.closed)])?;
    out.write_all(&first_edge.to_le_bytes())?;
    out.write_all(&(line.vertices.len() as u32 - 1).to_le_bytes())?;
    [line.length, line.strength, line.angle].iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
    out.write_all(&[line.bend as u8])
}
