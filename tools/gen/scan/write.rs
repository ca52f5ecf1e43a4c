//! Writing a city to a file, and its true lines to another.
//!
//! In: a city; out: binary PLY. Blocks are made in batches by the threads of the pool while the batch before is written.
//! What is in memory: a batch, and the numbers of the blocks of two rows of the city. The bytes do not depend on the
//! threads.

use super::super::ply::Scalar;
use super::super::shuffle::{Buckets, Permutation};
use super::super::stream::{Links, StreamedPly, put_edge, put_face};
use super::{CityScan, Counts};
use anyhow::Result;
use glam::DVec3;
use rayon::prelude::*;
use std::path::Path;

/// Blocks of a batch: some ten megabytes.
const BATCH: usize = 64;

/// How a city is written.
#[derive(Clone, Copy, Debug)]
pub struct Style<'a> {
    /// The mesh.
    pub mesh: &'a Path,
    /// The true lines.
    pub truth: Option<&'a Path>,
    /// Moves everything; coordinates are then stored as `double`.
    pub offset: Option<DVec3>,
    /// Vertices and faces in random order, by this seed.
    pub shuffle: Option<u64>,
}

/// Numbers of the blocks of a row of the city.
struct Row {
    /// What comes before each block; behind the last, what comes before the next row.
    before: Vec<Counts>,
}

impl Row {
    fn new(city: &CityScan, row: u64, start: Counts) -> Self {
        let columns: Vec<u64> = (0..city.columns).collect();
        let counts: Vec<Counts> = columns.par_iter().map(|&column| city.counts([column, row])).collect();
        let mut before = vec![start];
        let mut sum = start;
        for block in counts {
            sum += block;
            before.push(sum);
        }
        Self { before }
    }

    fn end(&self) -> Counts {
        self.before[self.before.len() - 1]
    }
}

/// The records of one block as bytes, and where they begin.
#[derive(Default)]
struct Encoded {
    first: Counts,
    vertices: Vec<u8>,
    faces: Vec<u8>,
    /// Places of vertices and faces, if they are shuffled.
    places: [Vec<u64>; 2],
    line_points: Vec<u8>,
    line_edges: Vec<u8>,
}

/// Writes a city. Returns what there is in it.
///
/// # Errors
/// If there are more vertices than PLY can index, or a file cannot be written.
pub fn write(city: &CityScan, style: &Style) -> Result<Counts> {
    let mut total = Counts::default();
    for row in 0..city.rows {
        total = Row::new(city, row, total).end();
    }
    let target = Target::create(style, total)?;
    let mut buckets = target.buckets(style, total)?;
    let columns: Vec<u64> = (0..city.columns).collect();
    let mut row = Row::new(city, 0, Counts::default());
    let mut made: Vec<Encoded> = Vec::new();
    for y in 0..city.rows {
        let next = Row::new(city, y + 1, row.end());
        for batch in columns.chunks(BATCH) {
            let make = || batch.par_iter().map(|&x| target.encode(city, [x, y], &row, &next)).collect();
            let (batch, written) = rayon::join(make, || target.write(&made, &mut buckets));
            written?;
            made = batch;
        }
        row = next;
    }
    target.write(&made, &mut buckets)?;
    if let Some([vertices, faces]) = buckets {
        vertices.finish(|first, bytes| target.mesh.write_vertices(first, bytes))?;
        faces.finish(|first, bytes| target.mesh.write_links(first, bytes))?;
    }
    Ok(total)
}

/// Where the records go.
struct Target {
    mesh: StreamedPly,
    truth: Option<StreamedPly>,
    offset: DVec3,
    /// Of vertices and of faces.
    permutations: Option<[Permutation; 2]>,
}

impl Target {
    fn create(style: &Style, total: Counts) -> Result<Self> {
        let scalar = if style.offset.is_some() { Scalar::Double } else { Scalar::Float };
        let mesh = StreamedPly::create(style.mesh, scalar, total.vertices, Links::Faces, total.faces)?;
        let lines = |path| {
            StreamedPly::create(path, Scalar::Double, total.line_points, Links::Edges, total.line_edges)
        };
        let permutations = style.shuffle.map(|seed| {
            [Permutation::new(total.vertices, seed, "vertices"), Permutation::new(total.faces, seed, "faces")]
        });
        Ok(Self {
            mesh,
            truth: style.truth.map(lines).transpose()?,
            offset: style.offset.unwrap_or_default(),
            permutations,
        })
    }

    fn buckets(&self, style: &Style, total: Counts) -> Result<Option<[Buckets; 2]>> {
        if self.permutations.is_none() {
            return Ok(None);
        }
        let directory = match style.mesh.parent() {
            Some(parent) if parent != Path::new("") => parent,
            _ => Path::new("."),
        };
        Ok(Some([
            Buckets::new(directory, total.vertices, self.mesh.vertex_bytes())?,
            Buckets::new(directory, total.faces, self.mesh.link_bytes())?,
        ]))
    }

    /// Makes a block and its bytes; `rows` are its row and the next.
    fn encode(&self, city: &CityScan, place: [u64; 2], row: &Row, next: &Row) -> Encoded {
        let block = city.block(place);
        let first = row.before[place[0] as usize];
        debug_assert_eq!(block.counts(), city.counts(place), "block {place:?}");
        let mut ids: Vec<u64> = (first.vertices..).take(block.positions.len()).collect();
        ids.extend(block.ghosts.iter().map(|ghost| {
            let row = if ghost.step[1] == 0 { row } else { next };
            row.before[(place[0] + ghost.step[0]) as usize].vertices + u64::from(ghost.index)
        }));
        let mut places = [Vec::new(), Vec::new()];
        if let Some([vertices, faces]) = &self.permutations {
            ids.iter_mut().for_each(|id| *id = vertices.at(*id));
            places[0].extend_from_slice(&ids[..block.positions.len()]);
            places[1].extend((first.faces..).take(block.faces.len()).map(|face| faces.at(face)));
        }
        let mut encoded = Encoded { first, places, ..Encoded::default() };
        let moved: Vec<DVec3> = block.positions.iter().map(|&position| position + self.offset).collect();
        self.mesh.put_vertices(&moved, &mut encoded.vertices);
        for face in &block.faces {
            put_face(face.map(|corner| ids[corner as usize]), &mut encoded.faces);
        }
        if let Some(truth) = &self.truth {
            let mut point = first.line_points;
            for line in &block.lines {
                let moved: Vec<DVec3> = line.iter().map(|&position| position + self.offset).collect();
                truth.put_vertices(&moved, &mut encoded.line_points);
                let edges = point..point + line.len() as u64 - 1;
                edges.for_each(|end| put_edge([end, end + 1], &mut encoded.line_edges));
                point += line.len() as u64;
            }
        }
        encoded
    }

    /// Writes blocks that follow one another, or hands them to the buckets.
    fn write(&self, blocks: &[Encoded], buckets: &mut Option<[Buckets; 2]>) -> Result<()> {
        for block in blocks {
            match buckets {
                Some([vertices, faces]) => {
                    vertices.take(&block.places[0], &block.vertices)?;
                    faces.take(&block.places[1], &block.faces)?;
                }
                None => {
                    self.mesh.write_vertices(block.first.vertices, &block.vertices)?;
                    self.mesh.write_links(block.first.faces, &block.faces)?;
                }
            }
            if let Some(truth) = &self.truth {
                truth.write_vertices(block.first.line_points, &block.line_points)?;
                truth.write_links(block.first.line_edges, &block.line_edges)?;
            }
        }
        Ok(())
    }
}
