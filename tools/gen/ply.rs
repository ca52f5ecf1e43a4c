//! Writers of PLY files. In: shapes and polylines; out: bytes, binary little-endian.

use super::shape::Shape;
use glam::DVec3;
use std::io::{Result, Write};

/// How coordinates are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    /// 32 bits, as most scanners write.
    Float,
    /// 64 bits.
    Double,
}

/// Writes the mesh: `x y z`, and faces as lists of `int` with a count of type `uchar`.
///
/// # Errors
/// What the writer says.
pub fn write_mesh(out: &mut impl Write, shape: &Shape, scalar: Scalar) -> Result<()> {
    let word = match scalar {
        Scalar::Float => "float",
        Scalar::Double => "double",
    };
    write_header(
        out,
        shape.vertices.len(),
        word,
        &format!("face {}", shape.faces.len()),
        &["list uchar int vertex_indices"],
    )?;
    write_positions(out, &shape.vertices, scalar)?;
    for face in &shape.faces {
        out.write_all(&[3])?;
        for corner in face {
            out.write_all(&corner.to_le_bytes())?;
        }
    }
    Ok(())
}

/// Writes polylines as a graph: `x y z` as `double`, and edges as pairs of vertices.
///
/// # Errors
/// What the writer says.
pub fn write_lines(out: &mut impl Write, lines: &[Vec<DVec3>]) -> Result<()> {
    let points: Vec<DVec3> = lines.iter().flatten().copied().collect();
    let edges: usize = lines.iter().map(|line| line.len().saturating_sub(1)).sum();
    write_header(out, points.len(), "double", &format!("edge {edges}"), &["int vertex1", "int vertex2"])?;
    write_positions(out, &points, Scalar::Double)?;
    let mut first = 0_i32;
    for line in lines {
        for (step, _) in (first..).zip(line.windows(2)) {
            out.write_all(&step.to_le_bytes())?;
            out.write_all(&(step + 1).to_le_bytes())?;
        }
        first += line.len() as i32;
    }
    Ok(())
}

/// The mesh as the bytes of a file.
pub fn mesh_bytes(shape: &Shape, scalar: Scalar) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    write_mesh(&mut bytes, shape, scalar)?;
    Ok(bytes)
}

/// The true lines as the bytes of a file.
pub fn line_bytes(lines: &[Vec<DVec3>]) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    write_lines(&mut bytes, lines)?;
    Ok(bytes)
}

/// Writes a header: positions, and one more element.
///
/// # Errors
/// What the writer says.
pub fn write_header(
    out: &mut impl Write,
    vertices: usize,
    scalar: &str,
    element: &str,
    properties: &[&str],
) -> Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}")?;
    for axis in ["x", "y", "z"] {
        writeln!(out, "property {scalar} {axis}")?;
    }
    writeln!(out, "element {element}")?;
    for property in properties {
        writeln!(out, "property {property}")?;
    }
    writeln!(out, "end_header")
}

fn write_positions(out: &mut impl Write, positions: &[DVec3], scalar: Scalar) -> Result<()> {
    for coordinate in positions.iter().flat_map(|position| position.to_array()) {
        match scalar {
            Scalar::Float => out.write_all(&(coordinate as f32).to_le_bytes())?,
            Scalar::Double => out.write_all(&coordinate.to_le_bytes())?,
        }
    }
    Ok(())
}
