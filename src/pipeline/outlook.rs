//! What the tiles of a plan are expected to be, for a scheduler that runs each on another machine.
//!
//! In: the plan. Out: for each tile its faces, memory and time, and the tiles beside it. None of this decides anything about the
//! result, and none of it is promised: a tile that turns out larger is cut while it is loaded, as in any run.

use super::certify::Halo;
use super::planned::Planned;
use super::run::{LINE_SHARE, Work};
use super::sizing::{expected_faces, tile_bytes};
use crate::mesh::TileId;
use crate::partition::Cell;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

/// Processor time for a face that is loaded, measured on one core on cities with noise (`docs/BENCHMARKS.md`).
const SECONDS_PER_FACE: f64 = 4e-6;

/// What was planned.
pub struct Laid {
    /// The plan.
    pub planned: Planned,
    /// Its tiles.
    pub tiles: Vec<TileOutlook>,
    /// How the work went.
    pub work: Work,
}

/// What a tile is expected to be.
#[derive(Clone, Debug, PartialEq)]
pub struct TileOutlook {
    /// Which one.
    pub id: TileId,
    /// Faces that it owns, estimated from the sample.
    pub faces: u64,
    /// Faces that it loads, halo included, estimated from the boxes of the blocks.
    pub loaded_faces: u64,
    /// Bytes that a process must be allowed to load it in one piece.
    pub memory: u64,
    /// Seconds of one core.
    pub cpu_seconds: f64,
    /// Tiles whose cells touch its cell, ascending.
    pub neighbours: Vec<TileId>,
}

/// The tiles of `planned`, whose halos are those of `halo`.
pub(super) fn outlooks(planned: &Planned, halo: &Halo) -> Vec<TileOutlook> {
    let plan = &planned.plan;
    let margin = halo.margin(plan, planned.rounds);
    let neighbours = neighbours(planned);
    (0..)
        .map(TileId)
        .zip(&plan.cells)
        .zip(neighbours)
        .map(|((id, cell), neighbours)| {
            let loaded_faces = expected_faces(plan, cell, margin);
            // As much more as a tile is admitted with.
            let memory = memory_for(planned, tile_bytes(loaded_faces + loaded_faces / 8));
            let cpu_seconds = SECONDS_PER_FACE * loaded_faces as f64;
            TileOutlook { id, faces: cell.faces, loaded_faces, memory, cpu_seconds, neighbours }
        })
        .collect()
}

/// The memory of a process of which tiles get so many bytes; the plan itself may take no more than they do.
fn memory_for(planned: &Planned, tile: u64) -> u64 {
    let shared = planned.other_memory.saturating_add(tile.max(planned.other_memory));
    // What is left when lines have their share, rounded up.
    (shared / (LINE_SHARE - 1) + 1).saturating_mul(LINE_SHARE)
}

/// The tiles beside each tile.
fn neighbours(planned: &Planned) -> Vec<Vec<TileId>> {
    let plan = &planned.plan;
    // Outer cells reach to infinity.
    let clipped = |cell: &Cell| {
        let (lo, hi) = (cell.min.max(plan.bounds.min), cell.max.min(plan.bounds.max));
        (lo.min(hi).to_array(), lo.max(hi).to_array())
    };
    let entries = plan.cells.iter().enumerate().map(|(i, cell)| {
        let (lo, hi) = clipped(cell);
        GeomWithData::new(Rectangle::from_corners(lo, hi), i)
    });
    let tree = RTree::bulk_load(entries.collect());
    let beside = |(i, cell): (usize, &Cell)| {
        let (lo, hi) = clipped(cell);
        let met = tree.locate_in_envelope_intersecting(AABB::from_corners(lo, hi));
        let mut found: Vec<TileId> =
            met.map(|entry| entry.data).filter(|&j| j != i).map(|j| TileId(j as u32)).collect();
        found.sort_unstable();
        found
    };
    plan.cells.iter().enumerate().map(beside).collect()
}
