//! A PLY file of a mesh that is never in memory as a whole.
//!
//! In: exact numbers of vertices and faces first, then records at any place, in any order; out: a binary little-endian
//! file. The header says `int` for indices, and `uint` where the last vertex needs it; PLY has no wider integer.

use super::ply::{Scalar, write_header};
use anyhow::{Context, Result, ensure};
use glam::DVec3;
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// Vertices that indices of PLY can name.
const MOST_VERTICES: u64 = 1 << 32;

/// What the second element of a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Links {
    /// Triangles, as lists with a count of type `uchar`.
    Faces,
    /// Edges, as pairs of vertices.
    Edges,
}

impl Links {
    /// Bytes of a record.
    pub fn bytes(self) -> u64 {
        match self {
            Self::Faces => 13,
            Self::Edges => 8,
        }
    }
}

/// A file that was begun.
#[derive(Debug)]
pub struct StreamedPly {
    path: PathBuf,
    file: File,
    scalar: Scalar,
    /// Byte of the first vertex and of the first record behind the vertices.
    starts: [u64; 2],
    links: Links,
}

impl StreamedPly {
    /// Begins a file: vertices, and faces or edges between them.
    ///
    /// # Errors
    /// If there are more vertices than PLY can index, or the file cannot be written.
    pub fn create(path: &Path, scalar: Scalar, vertices: u64, links: Links, count: u64) -> Result<Self> {
        ensure!(
            vertices <= MOST_VERTICES,
            "{vertices} vertices are more than the 2^32 that the integers of PLY can name: ask for fewer triangles"
        );
        let word = if vertices > 1 << 31 { "uint" } else { "int" };
        let (element, properties) = match links {
            Links::Faces => (format!("face {count}"), vec![format!("list uchar {word} vertex_indices")]),
            Links::Edges => {
                (format!("edge {count}"), vec![format!("{word} vertex1"), format!("{word} vertex2")])
            }
        };
        let properties: Vec<&str> = properties.iter().map(String::as_str).collect();
        let coordinate = match scalar {
            Scalar::Float => "float",
            Scalar::Double => "double",
        };
        let mut header = Vec::new();
        write_header(&mut header, usize::try_from(vertices)?, coordinate, &element, &properties)?;
        let file = File::create(path).with_context(|| format!("cannot write {}", path.display()))?;
        let start = header.len() as u64;
        let starts = [start, start + vertices * vertex_bytes(scalar)];
        let ply = Self { path: path.to_owned(), file, scalar, starts, links };
        ply.write_at(&header, 0)?;
        Ok(ply)
    }

    /// Bytes of a vertex.
    pub fn vertex_bytes(&self) -> u64 {
        vertex_bytes(self.scalar)
    }

    /// Bytes of a face or edge.
    pub fn link_bytes(&self) -> u64 {
        self.links.bytes()
    }

    /// Appends the bytes of vertices to `bytes`.
    pub fn put_vertices(&self, positions: &[DVec3], bytes: &mut Vec<u8>) {
        for coordinate in positions.iter().flat_map(|position| position.to_array()) {
            match self.scalar {
                Scalar::Float => bytes.extend((coordinate as f32).to_le_bytes()),
                Scalar::Double => bytes.extend(coordinate.to_le_bytes()),
            }
        }
    }

    /// Writes vertices from vertex `first` on, as bytes.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write_vertices(&self, first: u64, bytes: &[u8]) -> Result<()> {
        self.write_at(bytes, self.starts[0] + first * self.vertex_bytes())
    }

    /// Writes faces or edges from number `first` on, as bytes.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write_links(&self, first: u64, bytes: &[u8]) -> Result<()> {
        self.write_at(bytes, self.starts[1] + first * self.link_bytes())
    }

    fn write_at(&self, bytes: &[u8], at: u64) -> Result<()> {
        self.file.write_all_at(bytes, at).with_context(|| format!("cannot write {}", self.path.display()))
    }
}

/// Appends the bytes of a face.
pub fn put_face(corners: [u64; 3], bytes: &mut Vec<u8>) {
    bytes.push(3);
    corners.into_iter().for_each(|corner| bytes.extend((corner as u32).to_le_bytes()));
}

/// Appends the bytes of an edge.
pub fn put_edge(ends: [u64; 2], bytes: &mut Vec<u8>) {
    ends.into_iter().for_each(|end| bytes.extend((end as u32).to_le_bytes()));
}

fn vertex_bytes(scalar: Scalar) -> u64 {
    match scalar {
        Scalar::Float => 12,
        Scalar::Double => 24,
    }
}
