//! The plan of a run: scale, lattice, cells, and the directory of face blocks.
//!
//! In: the scan and what the user asked for. Out: everything that is fixed before the first tile is loaded. The scale
//! and the lattice are part of the result; the cells are not.

use super::cells::{Cell, cut};
use super::lattice::{CubeBox, Lattice};
use super::region::Region;
use super::scan::{BlockSummary, Scan};
use crate::config::{ParamError, Params, Tiling, method};
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
    /// Homes of the tiles, in tile order.
    pub cells: Vec<Cell>,
    /// Range of cubes of each block, by block index; `None` for a block without faces.
    pub block_ranges: Vec<Option<CubeBox>>,
    /// Number of faces of each block.
    pub block_faces: Vec<u32>,
    directory: RTree<DirectoryEntry>,
}

impl Plan {
    /// Makes the plan. The sample of the scan changes its order.
    ///
    /// # Errors
    /// If a parameter is outside its range for this mesh.
    pub fn new(scan: &mut Scan, params: &Params, tiling: Tiling) -> Result<Plan, ParamError> {
        let h = scan.median_side;
        let scale = Scale { h, k: params.scale(h)? };
        let origin = if scan.bounds.is_empty() { glam::DVec3::ZERO } else { scan.bounds.min };
        let lattice = Lattice { origin, edge: scale.length(method::LEVEL_CUBE) };
        let cells = match tiling {
            Tiling::InCore => vec![Cell::everything(scan.faces)],
            Tiling::Faces(target) => cut(&mut scan.sample, scan.sample_stride, target),
        };
        let empty = (Vec::new(), Vec::new(), RTree::new());
        let (block_ranges, block_faces, directory) = empty;
        let plan = Plan { scale, lattice, cells, block_ranges, block_faces, directory };
        Ok(plan.over(&scan.blocks))
    }

    /// The same plan over other blocks of the same faces.
    pub fn over(self, blocks: &[BlockSummary]) -> Plan {
        let Plan { scale, lattice, cells, .. } = self;
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
        Plan { scale, lattice, cells, block_ranges, block_faces, directory }
    }

    /// Whether one tile holds the whole mesh, so that nothing lies outside any region.
    pub fn is_in_core(&self) -> bool {
        self.cells.len() == 1
    }

    /// The region to load first for `cell`: the cell and so many cubes more on every side.
    pub fn first_region(&self, cell: &Cell, margin: i64) -> Region {
        if self.is_in_core() {
            return Region::new(CubeBox::EVERYTHING);
        }
        let core = CubeBox { min: self.lattice.cube_of(cell.min), max: self.lattice.cube_of(cell.max) };
        Region::new(core.grown(margin))
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
