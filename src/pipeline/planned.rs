//! What is decided before the first tile is loaded: the cells, and what memory there is for their tiles.
//!
//! In: the scan. Out: a [`Planned`]. How wide halos are depends on the noise, which a scan without adjacency cannot see; so
//! a few places of the mesh are loaded and looked at ([`super::probe`]). Nothing of this changes the result.

use super::certify::Halo;
use super::probe::typical_rounds;
use super::run::LINE_SHARE;
use super::sizing::{Sizes, cut, faces_in, is_one_tile, sizes, tile_bytes};
use crate::config::{Limits, Params, Tiling};
use crate::error::Error;
use crate::input::MeshSource;
use crate::partition::{Plan, Scale, Scan};

/// Everything that is fixed before the first tile is loaded.
pub struct Planned {
    /// What the scan found.
    pub scan: Scan,
    /// The plan.
    pub plan: Plan,
    /// What its tiles are expected to be.
    pub sizes: Sizes,
    /// Refinement rounds that most places need at most.
    pub rounds: u32,
    /// Bytes for tiles.
    pub tile_memory: u64,
    /// Bytes for everything else.
    pub other_memory: u64,
}

/// What each thread allocates for itself while it reads: a block of faces with the positions of their corners.
const THREAD_BYTES: u64 = 1 << 20;
/// Buffers of writers, and what is too small to be counted.
const SMALL_BYTES: u64 = 3 << 20;

impl Planned {
    /// Plans a run over `source`. `halo` tells how far the steps reach at a scale.
    pub(super) fn new(
        source: &dyn MeshSource,
        mut scan: Scan,
        params: &Params,
        limits: &Limits,
        halo: impl Fn(&Scale) -> Halo,
    ) -> Result<Planned, Error> {
        let mut plan = Plan::new(&scan, params)?;
        let (tile_memory, needed) = shares(&scan, &plan, limits)?;
        let one_tile = is_one_tile(scan.faces, limits.tiling, tile_memory);
        if limits.tiling == Tiling::InCore && !one_tile {
            let (at, bytes) = (plan.bounds.min, tile_bytes(scan.faces));
            return Err(Error::NoRoom { at, faces: scan.faces, bytes, memory: tile_memory });
        }
        // One tile has no halo.
        let rounds = match one_tile {
            true => 0,
            false => typical_rounds(source, &plan, &scan, faces_in(tile_memory))?,
        };
        let margin = halo(&plan.scale).margin(&plan, rounds);
        let sizes = cut(&mut plan, &mut scan, limits.tiling, tile_memory, margin);
        Ok(Planned { scan, plan, sizes, rounds, tile_memory, other_memory: needed })
    }

    /// A plan that was made by an earlier run, with its cells. Where memory is shorter now, cells are cut as tiles are loaded.
    pub(super) fn again(
        scan: Scan,
        plan: Plan,
        rounds: u32,
        limits: &Limits,
        halo: Halo,
    ) -> Result<Planned, Error> {
        let (tile_memory, other_memory) = shares(&scan, &plan, limits)?;
        let sizes = sizes(&plan, halo.margin(&plan, rounds), 1);
        Ok(Planned { scan, plan, sizes, rounds, tile_memory, other_memory })
    }

    /// Bytes that are expected to be allocated at the peak.
    pub fn expected_memory(&self) -> u64 {
        self.other_memory + self.sizes.bytes(self.plan.cells.len() as u64)
    }
}

/// Bytes for tiles, and for everything else but lines.
fn shares(scan: &Scan, plan: &Plan, limits: &Limits) -> Result<(u64, u64), Error> {
    let small = SMALL_BYTES + THREAD_BYTES * rayon::current_num_threads() as u64;
    let needed = small + scan.bytes() + plan.bytes();
    // Whatever is left must do for tiles; a run that plans longer than it works is of no use to anybody.
    let lines = limits.memory / LINE_SHARE;
    let tile_memory = limits.memory.saturating_sub(needed).saturating_sub(lines);
    if tile_memory < needed {
        let least = 2 * needed / (LINE_SHARE - 1) * LINE_SHARE;
        return Err(Error::NoMemory { needed: least, memory: limits.memory });
    }
    Ok((tile_memory, needed))
}
