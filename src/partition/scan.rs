//! One pass over the input: what must be known of the whole mesh before any part of it can be worked on.
//!
//! In: a [`MeshSource`]. Out: bounds, the median side length h, a box for each block of faces, a strided sample of
//! barycentres to cut space by, and the defects that can be seen without adjacency. Everything is an integer count or a
//! minimum or maximum, so that the result does not depend on how the pass was cut up.
//!
//! Positions are checked first: a coordinate that is not finite ends the run before anything is computed from it.

use super::content;
use crate::input::{FaceBlock, InputError, MeshSource, is_usable};
use crate::mesh::{VertexId, concat};
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicU64, Ordering};

/// Axis-aligned bounds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    /// Minimum corner.
    pub min: DVec3,
    /// Maximum corner.
    pub max: DVec3,
}

impl Bounds {
    /// The bounds of nothing.
    pub const EMPTY: Bounds = Bounds { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// Makes room for `p`.
    pub fn add(&mut self, p: DVec3) {
        self.min = self.min.min(p);
        self.max = self.max.max(p);
    }

    /// Makes room for `other`.
    pub fn join(&mut self, other: &Bounds) {
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
    }

    /// Whether anything was added.
    pub fn is_empty(&self) -> bool {
        self.min.x > self.max.x
    }
}

/// One block of consecutive faces.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BlockSummary {
    /// Bounds of its faces.
    pub bounds: Bounds,
    /// How many faces it has.
    pub faces: u32,
}

/// What the scan found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// Vertices in the file.
    pub vertices: u64,
    /// Faces, after polygons were cut into fans.
    pub faces: u64,
    /// Bounds of the vertices that faces use.
    pub bounds: Bounds,
    /// Median side length in mesh units, rounded down to a histogram bin; 0 if no side has a length.
    pub median_side: f64,
    /// Mean side length in mesh units, good to a percent. On irregular scans it is several times the median.
    pub mean_side: f64,
    /// Shortest and longest side in mesh units, rounded like the median.
    pub side_range: (f64, f64),
    /// Faces that name a vertex twice; they take no part.
    pub repeated_corner: u64,
    /// Vertices that no face uses.
    pub unreferenced: u64,
    /// The blocks of the source, in order.
    pub blocks: Vec<BlockSummary>,
    /// Barycentre of every `sample_stride`-th face.
    pub sample: Vec<DVec3>,
    /// How many faces a sample stands for.
    pub sample_stride: u64,
    /// What the mesh is, in a number: see [`super::content()`].
    pub content: u128,
}

impl Scan {
    /// What it takes in memory, but for the sample, which is used up by planning.
    pub fn bytes(&self) -> u64 {
        (self.blocks.len() * size_of::<BlockSummary>()) as u64
    }
}

/// Samples kept for cutting space: 24 MB at the most, and a few hundred for each tile of any sensible size. Where memory is
/// short, they may take this share of it.
const MOST_SAMPLES: u64 = 1 << 20;
const SAMPLE_SHARE: u64 = 32;
/// Share of the memory for marks of vertices that faces use. Where it is not enough for all vertices, the faces are read
/// once for each part of them.
const MARK_SHARE: u64 = 4;
/// Share of the memory for the histograms of all threads.
const HISTOGRAM_SHARE: u64 = 8;
/// Positions checked by one task.
pub(super) const VERTEX_CHUNK: u64 = 1 << 16;

/// Scans `source` within `memory` bytes, using the current thread pool.
///
/// # Errors
/// If the file cannot be read, names vertices that do not exist, or holds coordinates that are not finite. The first
/// offender in file order is reported.
pub fn scan(
    source: &dyn MeshSource,
    memory: u64,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Scan, InputError> {
    let positions = check_positions(source)?;
    let faces = source.face_count();
    let most_samples = (memory / SAMPLE_SHARE / size_of::<DVec3>() as u64).clamp(1, MOST_SAMPLES);
    let stride = faces.div_ceil(most_samples).max(1);
    let referenced =
        Referenced::new(0, source.vertex_count().min((memory / MARK_SHARE).max(8).saturating_mul(8)));
    let blocks: Vec<usize> = (0..source.block_count()).collect();
    // A histogram is a megabyte: one for each of a few long runs of blocks, not one for each block.
    let histograms = (memory / HISTOGRAM_SHARE / SideHistogram::BYTES).max(1);
    let runs = (4 * rayon::current_num_threads()).min(histograms.try_into().unwrap_or(usize::MAX));
    let run = blocks.len().div_ceil(runs).max(1);
    let parts: Vec<Result<Part, InputError>> =
        blocks.par_chunks(run).map(|run| scan_run(source, run, stride, &referenced, progress)).collect();
    let (mut total, mut samples) = (Part::new(), Vec::new());
    for part in parts {
        let mut part = part?;
        samples.push(std::mem::take(&mut part.sample));
        total.append(part);
    }
    Ok(Scan {
        vertices: source.vertex_count(),
        faces,
        bounds: total.bounds,
        median_side: total.sides.quantile(|n| (n - 1) / 2),
        mean_side: total.sides.mean(),
        side_range: (total.sides.quantile(|_| 0), total.sides.quantile(|n| n - 1)),
        repeated_corner: total.repeated_corner,
        unreferenced: unreferenced(source, referenced)?,
        blocks: total.blocks,
        sample: concat(&samples),
        sample_stride: stride,
        content: content::joined(source.vertex_count(), &positions, &total.contents),
    })
}

/// Refuses coordinates that are not finite or too large to calculate with, unless the source hides those faces. Returns the
/// digest of each chunk.
fn check_positions(source: &dyn MeshSource) -> Result<Vec<u128>, InputError> {
    let n = source.vertex_count();
    let hidden = source.only_usable();
    let chunks: Vec<u64> = (0..n.div_ceil(VERTEX_CHUNK)).collect();
    let checked: Vec<Result<u128, InputError>> = chunks
        .par_iter()
        .map(|chunk| {
            let first = chunk * VERTEX_CHUNK;
            let mut positions = Vec::new();
            source.read_positions(VertexId(first), (n - first).min(VERTEX_CHUNK) as usize, &mut positions)?;
            match positions.iter().position(|&p| !hidden && !is_usable(p)) {
                None => Ok(content::of_positions(&positions)),
                Some(i) => Err(InputError::BadCoordinate {
                    path: source.name().into(),
                    vertex: first + i as u64,
                    offset: source.vertex_offset(VertexId(first + i as u64)).unwrap_or(0),
                    x: positions[i].x,
                    y: positions[i].y,
                    z: positions[i].z,
                }),
            }
        })
        .collect();
    checked.into_iter().collect()
}

/// What one run of blocks adds to the scan.
struct Part {
    bounds: Bounds,
    sides: SideHistogram,
    repeated_corner: u64,
    blocks: Vec<BlockSummary>,
    sample: Vec<DVec3>,
    contents: Vec<u128>,
}

impl Part {
    fn new() -> Part {
        Part {
            bounds: Bounds::EMPTY,
            sides: SideHistogram::new(),
            repeated_corner: 0,
            blocks: Vec::new(),
            sample: Vec::new(),
            contents: Vec::new(),
        }
    }

    fn append(&mut self, other: Part) {
        self.bounds.join(&other.bounds);
        self.sides.add_all(&other.sides);
        self.repeated_corner += other.repeated_corner;
        self.blocks.extend(other.blocks);
        self.contents.extend(other.contents);
    }
}

fn scan_run(
    source: &dyn MeshSource,
    run: &[usize],
    stride: u64,
    referenced: &Referenced,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Part, InputError> {
    let mut part = Part::new();
    let (mut block, mut positions) = (FaceBlock::default(), Vec::new());
    for &index in run {
        source.read_placed(index, &mut block, &mut positions)?;
        let mut bounds = Bounds::EMPTY;
        for (i, (ids, [a, b, c])) in block.corners.iter().zip(&positions).enumerate() {
            ids.iter().for_each(|&id| referenced.mark(id));
            [*a, *b, *c].into_iter().for_each(|p| bounds.add(p));
            [*a - *b, *b - *c, *c - *a].into_iter().for_each(|side| part.sides.add(side.dot(side)));
            let repeated = ids[0] == ids[1] || ids[1] == ids[2] || ids[2] == ids[0];
            part.repeated_corner += u64::from(repeated);
            if block.id(i).0.is_multiple_of(stride) {
                part.sample.push((*a + *b + *c) / 3.0);
            }
        }
        part.bounds.join(&bounds);
        part.contents.push(content::of_faces(&block));
        part.blocks.push(BlockSummary { bounds, faces: block.corners.len() as u32 });
        progress(block.corners.len() as u64);
    }
    Ok(part)
}

/// How many vertices no face uses. `first` has the marks of the vertices from 0 on; where these are not all, the faces are
/// read again for as many more at a time.
fn unreferenced(source: &dyn MeshSource, mut marks: Referenced) -> Result<u64, InputError> {
    let n = source.vertex_count();
    let mut unused = marks.unused();
    while marks.end() < n {
        let (from, to) = (marks.end(), (marks.end() + marks.count).min(n));
        drop(marks);
        marks = Referenced::new(from, to - from);
        let blocks: Vec<usize> = (0..source.block_count()).collect();
        let read: Vec<Result<(), InputError>> = blocks
            .par_chunks(64)
            .map(|run| {
                let mut block = FaceBlock::default();
                run.iter().try_for_each(|&index| {
                    source.read_block(index, &mut block)?;
                    block.corners.iter().flatten().for_each(|&id| marks.mark(id));
                    Ok(())
                })
            })
            .collect();
        read.into_iter().collect::<Result<(), _>>()?;
        unused += marks.unused();
    }
    Ok(unused)
}

/// Histogram of squared lengths by the upper bits of the f64: 64 bins an octave. Integers, so that the median does not
/// depend on the order of the faces.
struct SideHistogram {
    bins: Vec<u64>,
}

/// Low mantissa bits that a bin ignores.
const BIN_SHIFT: u32 = 46;

impl SideHistogram {
    /// What one takes.
    const BYTES: u64 = 8 << (63 - BIN_SHIFT);

    fn new() -> SideHistogram {
        SideHistogram { bins: vec![0; 1 << (63 - BIN_SHIFT)] }
    }

    /// Squared lengths below the first bin count as no length at all.
    fn add(&mut self, squared: f64) {
        let bin = (squared.to_bits() >> BIN_SHIFT) as usize;
        if bin > 0 {
            self.bins[bin] += 1;
        }
    }

    fn add_all(&mut self, other: &SideHistogram) {
        self.bins.iter_mut().zip(&other.bins).for_each(|(a, b)| *a += b);
    }

    /// Mean of the lower bounds of the bins.
    fn mean(&self) -> f64 {
        let (mut count, mut sum) = (0u64, 0.0);
        for (bin, &n) in self.bins.iter().enumerate().filter(|(_, n)| **n > 0) {
            count += n;
            sum += n as f64 * length_of(bin);
        }
        sum / count.max(1) as f64
    }

    /// Lower bound of the bin that holds the element of the rank that `rank` makes of the count, as a length.
    fn quantile(&self, rank: impl Fn(u64) -> u64) -> f64 {
        let count: u64 = self.bins.iter().sum();
        if count == 0 {
            return 0.0;
        }
        let rank = rank(count);
        let mut below = 0;
        let bin = self.bins.iter().position(|n| {
            below += n;
            below > rank
        });
        bin.map_or(0.0, length_of)
    }
}

/// Lower bound of a bin, as a length.
fn length_of(bin: usize) -> f64 {
    f64::from_bits((bin as u64) << BIN_SHIFT).sqrt()
}

/// One bit for each vertex of a range of ids.
struct Referenced {
    first: u64,
    count: u64,
    words: Vec<AtomicU64>,
}

impl Referenced {
    fn new(first: u64, count: u64) -> Referenced {
        let words = (0..count.div_ceil(64)).map(|_| AtomicU64::new(0)).collect();
        Referenced { first, count, words }
    }

    /// The first vertex behind the range.
    fn end(&self) -> u64 {
        self.first + self.count
    }

    fn mark(&self, id: VertexId) {
        let place = id.0.wrapping_sub(self.first);
        if place >= self.count {
            return;
        }
        let (word, bit) = (&self.words[(place / 64) as usize], 1 << (place % 64));
        // Most corners were seen before: a read does not take the cache line away from the other threads.
        if word.load(Ordering::Relaxed) & bit == 0 {
            word.fetch_or(bit, Ordering::Relaxed);
        }
    }

    fn unused(&self) -> u64 {
        let marks = self.words.iter().map(|word| u64::from(word.load(Ordering::Relaxed).count_ones()));
        self.count - marks.sum::<u64>()
    }
}
