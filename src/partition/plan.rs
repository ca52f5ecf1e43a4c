//! The plan of a run: scale, lattice, cells, and the directory of face blocks.
//!
//! In: the scan and what the user asked for. Out: everything that is fixed before the first tile is loaded. The scale
//! and the lattice are part of the result; the cells are not.

use super::cells::{Cell, cut};
use super::lattice::{CubeBox, Lattice};
use super::region::Region;
use super::scan::{BlockSummary, Bounds, Scan};
use crate::config::{ParamError, Params, method};
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

/// What every length of the method is measured in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Median side length in mesh units.
    pub h: f64,
    /// Sigma in units of 3 h.
    pub k: f64,
}

impl Scale {
    /// `lengths` (units of k h) in mesh units.
    pub fn length(&self, lengths: f64) -> f64 {
        lengths * self.k * self.h
    }

    /// `rounds` of something that spreads one ring at a time, for this sigma: distance grows with the root of the rounds.
    pub fn rounds(&self, rounds: f64) -> usize {
        (rounds * self.k * self.k).round() as usize
    }

    /// Faces with twice an area (in square mesh units) up to this are degenerate.
    pub fn degenerate(&self) -> f64 {
        method::DEGENERATE_AREA * self.h * self.h
    }
}

/// A block of faces under the range of cubes that it covers.
type DirectoryEntry = GeomWithData<Rectangle<[f64; 3]>, usize>;

/// What is fixed before the first tile is loaded.
pub struct Plan {
    /// Units of the method.
    pub scale: Scale,
    /// Cubes of levels and regions.
    pub lattice: Lattice,
    /// Bounds of the mesh.
    pub bounds: Bounds,
    /// Homes of the tiles, in tile order.
    pub cells: Vec<Cell>,
    /// Range of cubes of each block, by block index; `None` for a block without faces.
    pub block_ranges: Vec<Option<CubeBox>>,
    /// Number of faces of each block.
    pub block_faces: Vec<u32>,
    directory: RTree<DirectoryEntry>,
}

impl Plan {
    /// A plan of one cell.
    ///
    /// # Errors
    /// If a parameter is outside its range for this mesh.
    pub fn new(scan: &Scan, params: &Params) -> Result<Plan, ParamError> {
        let h = scan.median_side;
        let scale = Scale { h, k: params.scale(h)? };
        let origin = if scan.bounds.is_empty() { glam::DVec3::ZERO } else { scan.bounds.min };
        let lattice = Lattice { origin, edge: scale.length(method::LEVEL_CUBE) };
        let (bounds, cells) = (scan.bounds, vec![Cell::everything(scan.faces)]);
        let (block_ranges, block_faces, directory) = (Vec::new(), Vec::new(), RTree::new());
        let plan = Plan { scale, lattice, bounds, cells, block_ranges, block_faces, directory };
        Ok(plan.over(&scan.blocks))
    }

    /// The same plan over other blocks of the same faces.
    pub fn over(self, blocks: &[BlockSummary]) -> Plan {
        let Plan { scale, lattice, bounds, cells, .. } = self;
        let block_ranges: Vec<Option<CubeBox>> = blocks
            .iter()
            .map(|block| {
                (!block.bounds.is_empty()).then(|| CubeBox {
                    min: lattice.cube_of(block.bounds.min),
                    max: lattice.cube_of(block.bounds.max),
                })
            })
            .collect();
        let entries = block_ranges.iter().enumerate().filter_map(|(i, range)| {
            range.map(|r| GeomWithData::new(Rectangle::from_corners(as_f64(r.min), as_f64(r.max)), i))
        });
        let directory = RTree::bulk_load(entries.collect());
        let block_faces = blocks.iter().map(|b| b.faces).collect();
        Plan { scale, lattice, bounds, cells, block_ranges, block_faces, directory }
    }

    /// What it takes in memory, but for the cells.
    pub fn bytes(&self) -> u64 {
        // Inner nodes of the tree are at least half full.
        let block = size_of::<Option<CubeBox>>() + size_of::<u32>() + 2 * size_of::<DirectoryEntry>();
        (self.block_faces.len() * block) as u64
    }

    /// Cuts space anew, until each cell is `enough` or its share of the sample is a single point.
    pub fn cut(&mut self, scan: &mut Scan, enough: &dyn Fn(&Plan, &Cell) -> bool) {
        self.cells = cut(&mut scan.sample, scan.sample_stride, &|cell| enough(self, cell));
    }

    /// The region to load first for `cell`: the cell and so many cubes more on every side.
    pub fn first_region(&self, cell: &Cell, margin: i64) -> Region {
        if cell.is_everything() {
            return Region::new(CubeBox::EVERYTHING);
        }
        let core = CubeBox { min: self.lattice.cube_of(cell.min), max: self.lattice.cube_of(cell.max) };
        Region::new(core.grown(margin))
    }

    /// About how many faces meet `range`: those of a block are taken to be spread evenly over its cubes.
    pub fn faces_near(&self, range: &CubeBox) -> u64 {
        let envelope = AABB::from_corners(as_f64(range.min), as_f64(range.max));
        let met = self.directory.locate_in_envelope_intersecting(envelope);
        // The tree gives the blocks in any order, and sums of whole numbers do not mind.
        met.map(|entry| entry.data)
            .map(|block| {
                let share = self.block_ranges[block].map_or(0.0, |blocks| blocks.share_in(range));
                (share * f64::from(self.block_faces[block])).ceil() as u64
            })
            .sum()
    }

    /// Indices of the blocks that may have a face in `region`, ascending: the tree promises no order.
    pub fn blocks_in(&self, region: &Region) -> Vec<usize> {
        let mut found = vec![false; self.block_faces.len()];
        for b in region.boxes() {
            let envelope = AABB::from_corners(as_f64(b.min), as_f64(b.max));
            for entry in self.directory.locate_in_envelope_intersecting(envelope) {
                found[entry.data] = true;
            }
        }
        (0..found.len()).filter(|&block| found[block]).collect()
    }
}

/// Cube indices are exact in f64: those of points stay below 2^40, and the limits of everything are powers of two.
fn as_f64(cube: [i64; 3]) -> [f64; 3] {
    cube.map(|x| x as f64)
}
