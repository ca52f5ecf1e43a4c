//! Feature lines as binary PLY; `docs/FORMATS.md` says what each field means.
//!
//! Vertices, then the edges of one line after the other, then one record for each line, so that the file can be streamed
//! and a reader that knows only vertices and edges still sees the lines. One vertex or line is in memory at a time.

use super::text::geometry_word;
use crate::math::DEGREE;
use crate::output::{OutputError, PartFile};
use crate::stitch::{LineSource, LineVertex, Measures};
use std::io::{BufWriter, Write};

pub(super) fn write(part: &PartFile, lines: &dyn LineSource) -> Result<(), OutputError> {
    let target = part.target();
    let counts = lines.counts();
    for (count, what) in [(counts.vertices, "vertices"), (counts.edges, "edges"), (counts.lines, "lines")] {
        if count > u64::from(u32::MAX) {
            return Err(OutputError::TooLarge { path: target.to_owned(), count, what });
        }
    }
    let mut out = BufWriter::with_capacity(1 << 20, part.file());
    let failed = OutputError::io(target, "cannot write");
    // PLY has no 64-bit integers; a double holds ids up to 2^53 exactly.
    let wide = counts.largest_id.is_some_and(|id| id.0 > u64::from(u32::MAX));
    write_header(&mut out, lines, wide).map_err(&failed)?;
    for vertex in lines.vertices() {
        write_vertex(&mut out, lines, &vertex?, wide).map_err(&failed)?;
    }
    for (id, line) in (0u32..).zip(lines.lines()) {
        for edge in line?.vertices.windows(2) {
            for x in [edge[0] as u32, edge[1] as u32, id] {
                out.write_all(&x.to_le_bytes()).map_err(&failed)?;
            }
        }
    }
    let mut first_edge = 0u32;
    for (id, line) in (0u32..).zip(lines.measures()) {
        let (measures, edges) = line?;
        write_line(&mut out, id, &measures, [first_edge, edges as u32]).map_err(&failed)?;
        first_edge += edges as u32;
    }
    out.flush().map_err(&failed)
}

fn write_header(out: &mut impl Write, lines: &dyn LineSource, wide: bool) -> std::io::Result<()> {
    let counts = lines.counts();
    let (vertices, edges, count) = (counts.vertices, counts.edges, counts.lines);
    let source = if wide { "double" } else { "uint" };
    let geometry = geometry_word(lines.geometry());
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
    )
}

fn write_vertex(
    out: &mut impl Write,
    lines: &dyn LineSource,
    v: &LineVertex,
    wide: bool,
) -> std::io::Result<()> {
    let point = v.point(lines.geometry());
    point.to_array().iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
    if wide {
        out.write_all(&(v.id.0 as f64).to_le_bytes())?;
    } else {
        out.write_all(&(v.id.0 as u32).to_le_bytes())?;
    }
    out.write_all(&lines.saliency(v).to_le_bytes())?;
    out.write_all(&(v.angle / DEGREE).to_le_bytes())?;
    out.write_all(&[v.class as u8, v.bend as u8])
}

fn write_line(out: &mut impl Write, id: u32, line: &Measures, edges: [u32; 2]) -> std::io::Result<()> {
    out.write_all(&id.to_le_bytes())?;
    out.write_all(&[line.class as u8, u8::from(line.closed)])?;
    edges.iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
    [line.length, line.strength, line.angle].iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
    out.write_all(&[line.bend as u8])
}
