//! What readers of all formats hand over, kept in temporary files.
//!
//! In: vertices and polygons of one file after the other, in any order within a file. Out: the same, to be read back in
//! order, and what must be known of all of them: whether `f32` is enough, and how long the longest polygon is. Memory: two
//! blocks and a few numbers for each file.
//!
//! A vertex is three `f64`. A polygon is its number of corners and the place of each vertex within its own file, all `u32`:
//! no PLY file could hold others. Triangles that bring their own vertices (STL) are not written at all.

use crate::input::text::{is_printed_float, real};
use crate::input::{InputError, InputPlace, LARGEST_COORDINATE, text};
use crate::spill::{ScratchDir, SpillFile, SpillWriter};
use std::path::{Path, PathBuf};

/// How the polygons of a file are known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Faces {
    /// By lists of vertices.
    Listed,
    /// Three vertices in a row are a triangle.
    Soup,
}

/// What one file contributed.
#[derive(Clone, Debug)]
pub struct Part {
    /// The file.
    pub path: PathBuf,
    /// Vertices of the files before it.
    pub first_vertex: u64,
    /// Number of its vertices.
    pub vertices: u64,
    /// Number of its polygons.
    pub polygons: u64,
    /// How these are known.
    pub faces: Faces,
    /// Whether its coordinates were printed from numbers of a width that it does not tell.
    pub printed: bool,
    /// The vertex with the largest number that a polygon names, and where.
    largest: Option<(u64, InputPlace)>,
}

/// Takes what readers find.
pub struct Gather {
    vertices: SpillWriter,
    polygons: SpillWriter,
    parts: Vec<Part>,
    /// Whether all coordinates of known width are `f32`, and all printed ones can have been printed from `f32`.
    exact_floats: bool,
    printed_floats: bool,
    /// Most corners of a polygon.
    widest: u64,
    /// Corners that a polygon may have.
    most_corners: usize,
    bytes: Vec<u8>,
}

/// All that was found.
pub struct Gathered {
    /// Positions of all files, one after the other.
    pub vertices: SpillFile,
    /// Polygons of all files with lists.
    pub polygons: SpillFile,
    /// What they come from.
    pub parts: Vec<Part>,
    /// Whether printed coordinates are those of the nearest `f32`.
    pub narrow: bool,
    /// Whether all coordinates are `f32` then.
    pub floats: bool,
    /// Most corners of a polygon.
    pub widest: u64,
}

impl Gather {
    /// Keeps everything in `scratch`, and holds `memory` bytes at the most.
    pub fn new(scratch: &ScratchDir, memory: u64) -> Gather {
        let block = usize::try_from(memory / 8).unwrap_or(usize::MAX);
        Gather {
            vertices: SpillWriter::create(scratch, "vertices", block),
            polygons: SpillWriter::create(scratch, "polygons", block),
            parts: Vec::new(),
            exact_floats: true,
            printed_floats: true,
            widest: 3,
            most_corners: (memory / 64).clamp(1 << 10, u64::from(u32::MAX)) as usize,
            bytes: Vec::new(),
        }
    }

    /// Begins a file.
    pub fn begin(&mut self, path: &Path, faces: Faces) {
        let first_vertex = self.parts.last().map_or(0, |part| part.first_vertex + part.vertices);
        let path = path.to_owned();
        self.parts.push(Part {
            path,
            first_vertex,
            vertices: 0,
            polygons: 0,
            faces,
            printed: false,
            largest: None,
        });
    }

    /// Number of vertices of this file so far.
    pub fn vertex_count(&self) -> u64 {
        self.parts.last().map_or(0, |part| part.vertices)
    }

    /// An error about a place in this file.
    pub fn error(&self, place: InputPlace, reason: String) -> InputError {
        let path = self.parts.last().map_or_else(PathBuf::new, |part| part.path.clone());
        InputError::Damaged { path, place, reason }
    }

    /// Takes a vertex whose coordinates are exactly these numbers.
    pub fn vertex(&mut self, place: InputPlace, position: [f64; 3]) -> Result<(), InputError> {
        self.exact_floats &= position.iter().all(|x| f64::from(*x as f32) == *x);
        self.put(place, position)
    }

    /// Takes a vertex whose coordinates were printed from numbers of unknown width.
    pub fn printed_vertex(&mut self, place: InputPlace, words: [&[u8]; 3]) -> Result<(), InputError> {
        let position = self.reals(place, words)?;
        // Once one of them needs more, all are taken as they are.
        self.printed_floats = self.printed_floats
            && words.iter().zip(position).all(|(word, value)| is_printed_float(word, value));
        if let Some(part) = self.parts.last_mut() {
            part.printed = true;
        }
        self.put(place, position)
    }

    /// The numbers that three words say.
    pub fn reals(&self, place: InputPlace, words: [&[u8]; 3]) -> Result<[f64; 3], InputError> {
        let mut position = [0.0; 3];
        for (x, word) in position.iter_mut().zip(words) {
            *x = real(word).ok_or_else(|| {
                let comma = if word.contains(&b',') { "; numbers must have a decimal point" } else { "" };
                self.error(place, format!("{} is no coordinate{comma}", text::excerpt(word)))
            })?;
        }
        Ok(position)
    }

    fn put(&mut self, place: InputPlace, position: [f64; 3]) -> Result<(), InputError> {
        // `all` with `<` is false for NaN too.
        if !position.iter().all(|x| x.abs() < LARGEST_COORDINATE) {
            let [x, y, z] = position;
            let reason = format!(
                "vertex {} has the position ({x}, {y}, {z}): coordinates must be finite and below 1e75 in magnitude",
                self.vertex_count()
            );
            return Err(self.error(place, reason));
        }
        self.bytes.clear();
        position.iter().for_each(|x| self.bytes.extend(x.to_le_bytes()));
        self.vertices.write(&self.bytes)?;
        if let Some(part) = self.parts.last_mut() {
            part.vertices += 1;
        }
        Ok(())
    }

    /// Takes a polygon with these vertices of this file, counted from 0. They may come later.
    pub fn polygon(&mut self, place: InputPlace, corners: &[u64]) -> Result<(), InputError> {
        if corners.len() > self.most_corners {
            return Err(self.too_many_corners(place, corners.len() as u64));
        }
        let Some(part) = self.parts.last_mut() else { return Ok(()) };
        self.bytes.clear();
        self.bytes.extend((corners.len() as u32).to_le_bytes());
        for &corner in corners {
            if part.largest.is_none_or(|(largest, _)| corner > largest) {
                part.largest = Some((corner, place));
            }
            // What is cut off here is refused when the file ends.
            self.bytes.extend((corner as u32).to_le_bytes());
        }
        part.polygons += 1;
        self.widest = self.widest.max(corners.len() as u64);
        Ok(self.polygons.write(&self.bytes)?)
    }

    /// The error for a polygon that memory has no room for.
    pub fn too_many_corners(&self, place: InputPlace, corners: u64) -> InputError {
        let most = self.most_corners;
        self.error(
            place,
            format!("a polygon has {corners} corners, and there is memory for {most}; allow more with --memory, or cut it into triangles"),
        )
    }

    /// Ends a file.
    pub fn end(&mut self) -> Result<(), InputError> {
        let Some(part) = self.parts.last_mut() else { return Ok(()) };
        if part.faces == Faces::Soup {
            part.polygons = part.vertices / 3;
        }
        match part.largest {
            Some((index, place)) if index >= part.vertices => {
                let vertices = part.vertices;
                let reason = format!(
                    "a face names vertex {index}, counted from 0, but the file has {vertices} vertices"
                );
                Err(self.error(place, reason))
            }
            Some((index, place)) if index > u64::from(u32::MAX) => Err(self.error(
                place,
                format!("a face names vertex {index}; cut the mesh into files with less than 2^32 vertices"),
            )),
            _ => Ok(()),
        }
    }

    /// What the file that was read last contributed.
    pub fn last(&self) -> Option<&Part> {
        self.parts.last()
    }

    /// Ends the reading.
    pub fn finish(self) -> Result<Gathered, InputError> {
        let Gather { vertices, polygons, parts, exact_floats, printed_floats, widest, .. } = self;
        Ok(Gathered {
            vertices: vertices.finish()?,
            polygons: polygons.finish()?,
            parts,
            narrow: printed_floats,
            floats: exact_floats && printed_floats,
            widest,
        })
    }
}

impl Gathered {
    /// Number of vertices of all files.
    pub fn vertex_count(&self) -> u64 {
        self.parts.last().map_or(0, |part| part.first_vertex + part.vertices)
    }

    /// Number of polygons of all files.
    pub fn polygon_count(&self) -> u64 {
        self.parts.iter().map(|part| part.polygons).sum()
    }

    /// Calls `visit` with each vertex, in order.
    pub fn for_each_vertex(
        &self,
        mut visit: impl FnMut([f64; 3]) -> Result<(), InputError>,
    ) -> Result<(), InputError> {
        let mut reader = self.vertices.reader()?;
        let mut parts = self.parts.iter().filter(|part| part.vertices > 0);
        let (mut left, mut narrow) = (0, false);
        // Records are never cut by the end of a block.
        while let Some(block) = reader.next_block()? {
            for record in block.chunks_exact(24) {
                while left == 0 {
                    let Some(part) = parts.next() else { return Ok(()) };
                    (left, narrow) = (part.vertices, part.printed && self.narrow);
                }
                left -= 1;
                let mut position = [0.0; 3];
                for (x, bytes) in position.iter_mut().zip(record.chunks_exact(8)) {
                    let mut raw = [0; 8];
                    raw.copy_from_slice(bytes);
                    let exact = f64::from_le_bytes(raw);
                    *x = if narrow { f64::from(exact as f32) } else { exact };
                }
                visit(position)?;
            }
        }
        Ok(())
    }
}
