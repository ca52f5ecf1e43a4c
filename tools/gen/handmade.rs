//! Small meshes made by hand. In: nothing; out: the bytes of files with defects, with polygons, and broken files.

use super::ply::{Scalar, mesh_bytes};
use super::shape::Shape;
use glam::DVec3;
use std::fmt::Write as _;
use std::io::{Result, Write};

/// Cells along a side of the grid with the defects.
const CELLS: u32 = 8;

/// An open grid in the plane `z = 0` with one defect of each kind.
pub fn defects() -> Shape {
    let mut shape = Shape::default();
    for y in 0..=CELLS {
        for x in 0..=CELLS {
            shape.vertices.push(DVec3::new(f64::from(x), f64::from(y), 0.0));
        }
    }
    let at = |x: u32, y: u32| y * (CELLS + 1) + x;
    for y in 0..CELLS {
        for x in 0..CELLS {
            // A block of 3 x 2 cells winds the other way.
            let flipped = (4..7).contains(&x) && (4..6).contains(&y);
            let halves =
                [[at(x, y), at(x + 1, y), at(x + 1, y + 1)], [at(x, y), at(x + 1, y + 1), at(x, y + 1)]];
            shape.faces.extend(halves.map(|[a, b, c]| if flipped { [a, c, b] } else { [a, b, c] }));
        }
    }
    // The first face once more.
    shape.faces.push(shape.faces[0]);
    // A repeated index.
    shape.faces.push([at(3, 3), at(4, 3), at(4, 3)]);
    // Three vertices in a row: no area.
    shape.faces.push([at(5, 0), at(6, 0), at(7, 0)]);
    // A fin on an inner edge, which then has three faces.
    let mut add = |x: f64, y: f64, z: f64| {
        shape.vertices.push(DVec3::new(x, y, z));
        shape.vertices.len() as u32 - 1
    };
    let fin = add(1.5, 3.0, 1.0);
    // A vertex without face.
    add(-2.0, -2.0, 0.0);
    // A triangle on its own.
    let alone = [add(20.0, 0.0, 0.0), add(21.0, 0.0, 0.0), add(20.0, 1.0, 0.0)];
    shape.faces.push([at(1, 3), at(2, 3), fin]);
    shape.faces.push(alone);
    shape
}

/// Corners of a house: 0 to 4 around the front gable, 5 to 9 around the one behind.
const HOUSE: [[f64; 2]; 5] = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [2.0, 4.5], [0.0, 3.0]];

/// A prism over a pentagon: pentagons and quads, lists counted in 16 bits, further properties around all that matters.
pub fn polygons() -> Result<Vec<u8>> {
    let mut out = Vec::new();
    out.write_all(
        b"ply\nformat binary_little_endian 1.0\ncomment quads and pentagons with properties in between\n\
          element vertex 10\nproperty uchar red\nproperty double x\nproperty float quality\nproperty double y\n\
          property double z\nproperty ushort scan\nelement face 7\nproperty float weight\n\
          property list uchar float texcoord\nproperty list ushort int vertex_indices\nproperty uchar label\n\
          end_header\n",
    )?;
    for i in 0..10_u16 {
        let [x, z] = HOUSE[usize::from(i % 5)];
        let y = if i < 5 { 0.0 } else { 6.0 };
        out.write_all(&[20 * i as u8])?;
        out.write_all(&x.to_le_bytes())?;
        out.write_all(&(f32::from(i) * 0.125).to_le_bytes())?;
        out.write_all(&f64::to_le_bytes(y))?;
        out.write_all(&z.to_le_bytes())?;
        out.write_all(&(1000 + i).to_le_bytes())?;
    }
    let mut faces: Vec<Vec<i32>> = vec![vec![0, 1, 2, 3, 4], vec![9, 8, 7, 6, 5]];
    faces.extend((0..5).map(|i| vec![i, i + 5, (i + 1) % 5 + 5, (i + 1) % 5]));
    for (label, corners) in (0_u8..).zip(&faces) {
        out.write_all(&(1.0 + f32::from(label)).to_le_bytes())?;
        // The length of the list to be skipped differs from face to face.
        out.write_all(&[label])?;
        for _ in 0..label {
            out.write_all(&0.5_f32.to_le_bytes())?;
        }
        out.write_all(&(corners.len() as u16).to_le_bytes())?;
        for corner in corners {
            out.write_all(&corner.to_le_bytes())?;
        }
        out.write_all(&[label])?;
    }
    Ok(out)
}

/// A cube of 12 triangles, seen right from outside.
fn cube() -> Shape {
    let bit = |i: u32, axis: u32| f64::from((i >> axis) & 1);
    let vertices = (0..8).map(|i| DVec3::new(bit(i, 0), bit(i, 1), bit(i, 2))).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Shape { vertices, faces, ..Shape::default() }
}

/// A cube that ends in the middle of the faces.
pub fn truncated() -> Result<Vec<u8>> {
    let mut bytes = mesh_bytes(&cube(), Scalar::Float)?;
    bytes.truncate(bytes.len() - 50);
    Ok(bytes)
}

/// A cube whose face 7 names a vertex that does not exist.
pub fn index_out_of_range() -> Result<Vec<u8>> {
    let mut shape = cube();
    shape.faces[7][1] = 8;
    mesh_bytes(&shape, Scalar::Float)
}

/// A cube whose vertex 3 has no `y`.
pub fn nan_vertex() -> Result<Vec<u8>> {
    let mut shape = cube();
    shape.vertices[3].y = f64::NAN;
    mesh_bytes(&shape, Scalar::Float)
}

/// A right header that announces nothing.
pub fn empty() -> Result<Vec<u8>> {
    mesh_bytes(&Shape::default(), Scalar::Float)
}

/// Points only; there is no element `face`.
pub fn no_faces() -> Result<Vec<u8>> {
    let mut out = Vec::new();
    out.write_all(
        b"ply\nformat binary_little_endian 1.0\nelement vertex 8\nproperty float x\nproperty float y\n\
          property float z\nend_header\n",
    )?;
    for coordinate in cube().vertices.iter().flat_map(|vertex| vertex.to_array()) {
        out.write_all(&(coordinate as f32).to_le_bytes())?;
    }
    Ok(out)
}

/// A right cube, as text.
pub fn ascii() -> Vec<u8> {
    let mut text = String::from(
        "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n\
         element face 12\nproperty list uchar int vertex_indices\nend_header\n",
    );
    let shape = cube();
    for DVec3 { x, y, z } in &shape.vertices {
        let _ = writeln!(text, "{x} {y} {z}");
    }
    for [a, b, c] in &shape.faces {
        let _ = writeln!(text, "3 {a} {b} {c}");
    }
    text.into_bytes()
}

/// Not a mesh at all.
pub fn text() -> Vec<u8> {
    b"This is a text file. It is not a mesh, whatever its name may be.\n".to_vec()
}
