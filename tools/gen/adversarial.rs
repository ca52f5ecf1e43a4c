//! Meshes that are hard to work on in pieces. In: a name and a number of triangles; out: a mesh as functions of the
//! index, so that any part of it can be made without the rest and files of any size are written in constant memory.

use super::ply::Scalar;
use super::random::Random;
use super::stream::{Links, StreamedPly, put_face};
use anyhow::{Context, Result, ensure};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::fmt;
use std::ops::Range;
use std::path::Path;
use std::str::FromStr;

/// A mesh that is hard for one reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Adversary {
    /// Every vertex at the same place.
    Coincident,
    /// All triangles around one vertex.
    Fan,
    /// Slivers across the whole of a common mesh, between its vertices.
    Needles,
    /// All but eight triangles in a millionth of the extent.
    Pile,
    /// Two dozen triangles as large as the scene, over a fine mesh.
    Giants,
    /// Consecutive vertices and faces at opposite corners of the scene.
    Corners,
}

/// A mesh as functions of the index.
pub struct Described {
    /// Number of vertices.
    pub vertices: u64,
    /// Number of triangles.
    pub faces: u64,
    /// Position of a vertex.
    pub position: Box<dyn Fn(u64) -> DVec3 + Sync>,
    /// Corners of a triangle.
    pub corners: Box<dyn Fn(u64) -> [u64; 3] + Sync>,
}

/// Triangles of the mesh under needles, for each needle.
const FACES_PER_NEEDLE: u64 = 64;
/// Coarse cells along a side of the layer of giants.
const GIANT_CELLS: u64 = 3;
/// Records that a thread makes at a time.
const CHUNK: u64 = 1 << 16;
/// Keeps what is drawn here apart from other streams.
const STREAM: u64 = 0x6861_7264;

impl Adversary {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Coincident, Self::Fan, Self::Needles, Self::Pile, Self::Giants, Self::Corners];

    /// How they are written, for help texts.
    pub const FORMS: &'static str = "coincident, fan, needles, pile, giants, corners";

    /// What it is hard for, in a line.
    pub fn purpose(self) -> &'static str {
        match self {
            Self::Coincident => {
                "all vertices at one place: no length to measure by, a cell that cannot be cut"
            }
            Self::Fan => "all triangles around one vertex: a one-ring of that size, in whatever tile it lies",
            Self::Needles => {
                "slivers from border to border of a grid: regions that reach across the whole scene"
            }
            Self::Pile => {
                "all but a few triangles in a millionth of the extent: a lattice that cannot resolve them"
            }
            Self::Giants => {
                "triangles larger than a tile over a fine grid: blocks and faces that meet every tile"
            }
            Self::Corners => {
                "neighbours in the file at opposite ends of the scene: boxes of blocks that say nothing"
            }
        }
    }

    /// The mesh with about `faces` triangles.
    ///
    /// # Errors
    /// If there are too few for the shape to be one.
    pub fn describe(self, faces: u64, seed: u64) -> Result<Described> {
        ensure!((64..1 << 40).contains(&faces), "{self} cannot have {faces} triangles: from 64 to 2^40");
        Ok(match self {
            Self::Coincident => {
                let grid = Grid::of(faces);
                grid.described(|_| DVec3::new(1.0, 2.0, 3.0))
            }
            Self::Fan => fan(faces, seed),
            Self::Needles => needles(faces, seed),
            Self::Pile => pile(faces, seed),
            Self::Giants => giants(faces, seed),
            Self::Corners => corners(faces, seed),
        })
    }
}

impl fmt::Display for Adversary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Coincident => "coincident",
            Self::Fan => "fan",
            Self::Needles => "needles",
            Self::Pile => "pile",
            Self::Giants => "giants",
            Self::Corners => "corners",
        })
    }
}

impl FromStr for Adversary {
    type Err = anyhow::Error;

    fn from_str(word: &str) -> Result<Self> {
        let known = Self::ALL.into_iter().find(|name| name.to_string() == word);
        known.with_context(|| format!("no mesh of this name; there are {}", Self::FORMS))
    }
}

/// A square grid with two triangles in each cell.
#[derive(Clone, Copy, Debug)]
struct Grid {
    side: u64,
}

impl Grid {
    /// The one with about so many triangles.
    fn of(faces: u64) -> Self {
        Self { side: ((faces as f64 / 2.0).sqrt().round() as u64).max(1) }
    }

    fn vertices(self) -> u64 {
        (self.side + 1) * (self.side + 1)
    }

    fn faces(self) -> u64 {
        2 * self.side * self.side
    }

    /// Column and row of a vertex.
    fn place(self, vertex: u64) -> [u64; 2] {
        [vertex % (self.side + 1), vertex / (self.side + 1)]
    }

    fn corners(self, face: u64) -> [u64; 3] {
        let (cell, upper) = (face / 2, face % 2 == 1);
        let a = cell / self.side * (self.side + 1) + cell % self.side;
        let above = a + self.side + 1;
        if upper { [a + 1, above + 1, above] } else { [a, a + 1, above] }
    }

    /// A jittered position on a surface with a fold every twenty cells.
    fn folded(self, vertex: u64, seed: u64) -> DVec3 {
        let mut random = Random::at(seed, [STREAM, vertex, 0, 0]);
        let [x, y] = self.place(vertex);
        // Columns stay where they are, so that folds are straight.
        let along = y as f64 + random.between(-0.3, 0.3);
        let phase = x % 40;
        DVec3::new(x as f64, along, 0.5 * phase.min(40 - phase) as f64)
    }

    fn described(self, position: impl Fn(u64) -> DVec3 + Sync + 'static) -> Described {
        Described {
            vertices: self.vertices(),
            faces: self.faces(),
            position: Box::new(position),
            corners: Box::new(move |face| self.corners(face)),
        }
    }
}

/// A shallow cone with a scalloped border. Its rim has edges of length 1, so that its spokes are far longer.
fn fan(faces: u64, seed: u64) -> Described {
    let radius = faces as f64 / TAU;
    let position = move |vertex: u64| {
        if vertex == 0 {
            return DVec3::new(0.0, 0.0, 0.1 * radius);
        }
        let jitter = Random::at(seed, [STREAM, vertex, 0, 0]).between(-0.3, 0.3);
        let angle = TAU * (vertex as f64 + jitter) / faces as f64;
        let height = 0.02 * radius * libm::sin(7.0 * angle);
        DVec3::new(radius * libm::cos(angle), radius * libm::sin(angle), height)
    };
    let corners = move |face: u64| [0, 1 + face, 1 + (face + 1) % faces];
    Described { vertices: faces + 1, faces, position: Box::new(position), corners: Box::new(corners) }
}

/// A folded grid, and needles from two neighbouring vertices of its left border to one of its right.
fn needles(faces: u64, seed: u64) -> Described {
    let grid = Grid::of(faces - faces / FACES_PER_NEEDLE);
    let needles = (faces / FACES_PER_NEEDLE).min(grid.side);
    let row = grid.side + 1;
    let corners = move |face: u64| match face.checked_sub(grid.faces()) {
        None => grid.corners(face),
        Some(needle) => {
            let from = needle * grid.side / needles;
            let to = Random::at(seed, [STREAM, needle, 1, 0]).below(row as usize) as u64;
            [from * row, to * row + grid.side, (from + 1) * row]
        }
    };
    Described {
        vertices: grid.vertices(),
        faces: grid.faces() + needles,
        position: Box::new(move |vertex| grid.folded(vertex, seed)),
        corners: Box::new(corners),
    }
}

/// A folded grid, and eight triangles a million times its extent away.
fn pile(faces: u64, seed: u64) -> Described {
    let grid = Grid::of(faces);
    let far = 1e6 * grid.side as f64;
    let position = move |vertex: u64| match vertex.checked_sub(grid.vertices()) {
        None => grid.folded(vertex, seed),
        Some(outlier) => {
            let (corner, point) = (cube_corner(outlier / 3), outlier % 3);
            // As large as the grid: at this distance a float does not see less.
            let aside = [DVec3::ZERO, DVec3::X, DVec3::Y][point as usize] * grid.side as f64;
            (corner - 0.5) * far + aside
        }
    };
    let corners = move |face: u64| match face.checked_sub(grid.faces()) {
        None => grid.corners(face),
        Some(outlier) => [0, 1, 2].map(|corner| grid.vertices() + 3 * outlier + corner),
    };
    Described {
        vertices: grid.vertices() + 24,
        faces: grid.faces() + 8,
        position: Box::new(position),
        corners: Box::new(corners),
    }
}

/// A folded grid under a coarse one of the same extent. The coarse one comes first in the file.
fn giants(faces: u64, seed: u64) -> Described {
    let (coarse, fine) = (Grid { side: GIANT_CELLS }, Grid::of(faces));
    let position = move |vertex: u64| match vertex.checked_sub(coarse.vertices()) {
        Some(vertex) => fine.folded(vertex, seed),
        None => {
            let [x, y] = coarse.place(vertex).map(|cell| cell as f64 / GIANT_CELLS as f64);
            DVec3::new(x, y, 0.0) * fine.side as f64 + DVec3::Z * (15.0 + 3.0 * ((vertex % 3) as f64))
        }
    };
    let corners = move |face: u64| match face.checked_sub(coarse.faces()) {
        None => coarse.corners(face),
        Some(face) => fine.corners(face).map(|corner| corner + coarse.vertices()),
    };
    Described {
        vertices: coarse.vertices() + fine.vertices(),
        faces: coarse.faces() + fine.faces(),
        position: Box::new(position),
        corners: Box::new(corners),
    }
}

/// Eight folded grids in the corners of a cube; vertices and faces take turns.
fn corners(faces: u64, seed: u64) -> Described {
    let grid = Grid::of(faces / 8);
    let extent = 20.0 * grid.side as f64;
    // A corner and the one opposite follow each other.
    let turn = |index: u64| if index.is_multiple_of(2) { index / 2 } else { 7 - index / 2 };
    let position = move |vertex: u64| {
        cube_corner(turn(vertex % 8)) * extent + grid.folded(vertex / 8, seed.wrapping_add(vertex % 8))
    };
    let corners = move |face: u64| grid.corners(face / 8).map(|corner| 8 * corner + face % 8);
    Described {
        vertices: 8 * grid.vertices(),
        faces: 8 * grid.faces(),
        position: Box::new(position),
        corners: Box::new(corners),
    }
}

/// Corner `index` of the unit cube.
fn cube_corner(index: u64) -> DVec3 {
    let bit = |axis: u64| (index >> axis & 1) as f64;
    DVec3::new(bit(0), bit(1), bit(2))
}

impl Described {
    /// Writes the mesh as binary PLY, coordinates as `double` if they need it or not.
    ///
    /// # Errors
    /// If there are more vertices than PLY can index, or the file cannot be written.
    pub fn write(&self, path: &Path, scalar: Scalar) -> Result<()> {
        let ply = StreamedPly::create(path, scalar, self.vertices, Links::Faces, self.faces)?;
        let vertices = |range: Range<u64>| {
            let positions: Vec<DVec3> = range.map(&self.position).collect();
            let mut bytes = Vec::new();
            ply.put_vertices(&positions, &mut bytes);
            bytes
        };
        in_chunks(self.vertices, vertices, |first, bytes| ply.write_vertices(first, bytes))?;
        let faces = |range: Range<u64>| {
            let mut bytes = Vec::new();
            range.for_each(|face| put_face((self.corners)(face), &mut bytes));
            bytes
        };
        in_chunks(self.faces, faces, |first, bytes| ply.write_links(first, bytes))
    }
}

/// Makes the bytes of `count` records, a few chunks at a time, and writes them in order.
fn in_chunks(
    count: u64,
    make: impl Fn(Range<u64>) -> Vec<u8> + Sync,
    write: impl Fn(u64, &[u8]) -> Result<()>,
) -> Result<()> {
    let firsts: Vec<u64> = (0..count).step_by(CHUNK as usize).collect();
    for batch in firsts.chunks(16) {
        let made: Vec<Vec<u8>> =
            batch.par_iter().map(|&first| make(first..(first + CHUNK).min(count))).collect();
        for (&first, bytes) in batch.iter().zip(&made) {
            write(first, bytes)?;
        }
    }
    Ok(())
}
