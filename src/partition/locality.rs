//! What the order of a file costs: how often it would be read if tiles were loaded from it as it is.
//!
//! In: the scan and the plan, and the corners of a few blocks. Out: three numbers of passes over the file, which can be
//! compared with what it takes to rewrite the mesh in spatial order. They decide how the work is done, never what comes out.

use super::halo::Reach;
use super::plan::Plan;
use super::scan::Scan;
use crate::input::{FaceBlock, InputError, MeshSource};

/// How often parts of the file would be read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Locality {
    /// Faces in the blocks that tiles read, over the faces of the mesh.
    pub face_reads: f64,
    /// The same if a tile read only the faces of its region, halo included: no order of the file does better.
    pub needed_reads: f64,
    /// How often a vertex is fetched in one pass over the faces, with a small cache. See [`vertex_reads`].
    pub vertex_reads: f64,
}

/// Passes over the mesh that rewriting it is worth: it reads the input twice and writes and reads two copies of twice to
/// three times its size.
const REWRITING: f64 = 8.0;
/// Reads over needed reads below which it is never worth it: blocks of a copy have corners that are read in vain too, and
/// where halos are most of what is read, votes take far longer than reading.
const WASTE: f64 = 2.0;
/// Vertices that are fetched more often than this in one pass lie in no order that helps. Rows of a grid that is wider than
/// a block come to 4, shuffled files to hundreds.
const SCATTERED: f64 = 16.0;
/// Tiles that are looked at; with more, evenly spaced ones stand for the others.
const MOST_TILES: usize = 64;
/// Samples that are looked at for each of them.
const MOST_SAMPLES: usize = 1 << 14;
/// Blocks that are looked at for the order of the vertices.
const MOST_BLOCKS: usize = 64;
/// Vertices fetched together (a page of memory or a little less), and how many of these are kept.
const PAGE: u64 = 256;
const PAGES: usize = 256;

impl Locality {
    /// Measures the order of the faces; `vertex_reads` was measured before the scan.
    pub fn new(plan: &Plan, scan: &Scan, vertex_reads: f64) -> Locality {
        let step = plan.cells.len().div_ceil(MOST_TILES).max(1);
        let sample: Vec<_> =
            scan.sample.iter().step_by(scan.sample.len().div_ceil(MOST_SAMPLES).max(1)).copied().collect();
        let margin = Reach::new(&plan.scale, 0).margin(0);
        let (mut tiles, mut read, mut needed) = (0u64, 0u64, 0u64);
        for cell in plan.cells.iter().step_by(step) {
            let region = plan.first_region(cell, margin);
            let faces = |block: usize| u64::from(plan.block_faces[block]);
            read += plan.blocks_in(&region).into_iter().map(faces).sum::<u64>();
            needed += sample.iter().filter(|p| region.contains(plan.lattice.cube_of(**p))).count() as u64;
            tiles += 1;
        }
        let all = plan.cells.len() as f64 / tiles.max(1) as f64;
        Locality {
            face_reads: all * read as f64 / scan.faces.max(1) as f64,
            needed_reads: all * needed as f64 / sample.len().max(1) as f64,
            vertex_reads,
        }
    }

    /// Whether so many reads of a vertex in one pass mean that the vertices of a face lie all over the file.
    pub fn is_scattered(vertex_reads: f64) -> bool {
        vertex_reads > SCATTERED
    }

    /// Whether tiles read so much in vain that rewriting the mesh costs less. What rewriting costs is known in passes
    /// over the file; a scattered gather is a question of memory and is decided before the scan.
    pub fn rewriting_pays(&self) -> bool {
        self.face_reads - self.needed_reads > REWRITING && self.face_reads > WASTE * self.needed_reads
    }
}

/// How often a vertex is fetched in one pass over the faces, if 256 vertices are fetched at a time and a cache keeps 256 of
/// such pages. Reads the corners of at most 64 blocks, and no position.
///
/// # Errors
/// If the file cannot be read, or a corner names a vertex that does not exist.
pub fn vertex_reads(source: &dyn MeshSource) -> Result<f64, InputError> {
    let mut block = FaceBlock::default();
    let (mut fetched, mut faces) = (0u64, 0u64);
    for index in (0..source.block_count()).step_by(source.block_count().div_ceil(MOST_BLOCKS).max(1)) {
        source.read_block(index, &mut block)?;
        let mut cache = [u64::MAX; PAGES];
        for id in block.corners.as_flattened() {
            let page = id.0 / PAGE;
            let slot = &mut cache[page as usize % PAGES];
            fetched += u64::from(*slot != page);
            *slot = page;
        }
        faces += block.corners.len() as u64;
    }
    let vertices = faces as f64 * source.vertex_count() as f64 / source.face_count().max(1) as f64;
    Ok((fetched * PAGE) as f64 / vertices.max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{NO_LIMIT, Params};
    use crate::input::MemorySource;
    use crate::partition::scan;
    use glam::DVec3;

    /// A grid of so many squares on a side; vertices and faces in an order that a multiplication makes.
    fn grid(n: u32, shuffled: bool) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let side = n + 1;
        let count = side * side;
        let name = |v: u32| if shuffled { (u64::from(v) * 7_654_321 % u64::from(count)) as u32 } else { v };
        let mut positions = vec![DVec3::ZERO; count as usize];
        let mut faces = Vec::new();
        for v in 0..count {
            positions[name(v) as usize] = DVec3::new(f64::from(v % side), f64::from(v / side), 0.0);
        }
        for y in 0..n {
            for x in 0..n {
                let a = y * side + x;
                faces.push([a, a + 1, a + side].map(name));
                faces.push([a + 1, a + side + 1, a + side].map(name));
            }
        }
        if shuffled {
            let m = faces.len();
            faces = (0..m).map(|f| faces[f * 7_654_321 % m]).collect();
        }
        (positions, faces)
    }

    #[test]
    fn shuffled_meshes_are_told_from_others() {
        let measured = |shuffled| {
            let (positions, faces) = grid(601, shuffled);
            let source = MemorySource::new(&positions, &faces).expect("a mesh");
            let mut found = scan(&source, NO_LIMIT, &|_| {}).expect("a scan");
            let mut plan = Plan::new(&found, &Params::default()).expect("a plan");
            plan.cut(&mut found, &|_, cell| cell.faces <= 80_000);
            Locality::new(&plan, &found, vertex_reads(&source).expect("blocks"))
        };
        let (rows, none) = (measured(false), measured(true));
        assert!(!Locality::is_scattered(rows.vertex_reads) && !rows.rewriting_pays(), "{rows:?}");
        assert!(Locality::is_scattered(none.vertex_reads) && none.rewriting_pays(), "{none:?}");
        assert!((rows.needed_reads - none.needed_reads).abs() < 0.3, "{rows:?} {none:?}");
        assert!(none.face_reads >= 15.0, "every tile reads everything: {none:?}");
    }
}
