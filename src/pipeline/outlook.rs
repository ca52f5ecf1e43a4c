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

/// Processor time for a face that is loaded, measured on one core on a city with noise: 2.3 us (`docs/CLUSTER.md`, section 9).
const SECONDS_PER_FACE: f64 = 2.5e-6;

/// Processor time of stitching for a face of the mesh, and what of it stays with the last step if groups of tiles were stitched
/// before (`docs/CLUSTER.md`, section 9).
pub const STITCH_SECONDS_PER_FACE: f64 = 1.2e-7;
const LAST_SECONDS_PER_FACE: f64 = 6.5e-8;
/// Groups are worth a step of their own where they save so many seconds: a scheduler takes some to see that a step is over and
/// to start the next, tasks a second to begin.
const LEAST_SAVED: f64 = 60.0;
/// Tiles of a group, unless there would be too many groups: a power of two, so that groups are boxes where cells are cut in
/// halves. With tiles of two million faces such a group takes some 8 seconds, long beside the second in which a task starts.
const GROUP_TILES: u32 = 64;
/// Groups of a job at most: the last step has a file open for each, and systems allow 1,024.
pub const MOST_GROUPS: u32 = 500;

/// How many tiles a group has, of `tiles` that own `faces` faces; 0 where groups are not worth it.
pub fn group_tiles(tiles: u32, faces: u64) -> u32 {
    let saved = (STITCH_SECONDS_PER_FACE - LAST_SECONDS_PER_FACE) * faces as f64;
    if saved < LEAST_SAVED || tiles <= GROUP_TILES {
        return 0;
    }
    let mut size = GROUP_TILES;
    while tiles.div_ceil(size) > MOST_GROUPS {
        size *= 2;
    }
    size
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_for_large_meshes() {
        assert_eq!([group_tiles(1, 2_000_000), group_tiles(400, 800_000_000)], [0, 0]);
        assert_eq!(group_tiles(1000, 2_000_000_000), GROUP_TILES);
        // As large a mesh in a few tiles has nothing to group.
        assert_eq!(group_tiles(60, 2_000_000_000), 0);
        for tiles in [5_000, 50_000, 5_000_000, u32::MAX] {
            let size = group_tiles(tiles, 2_000_000 * u64::from(tiles));
            assert!(
                tiles.div_ceil(size) <= MOST_GROUPS && size.is_power_of_two(),
                "{tiles} in groups of {size}"
            );
        }
    }
}
