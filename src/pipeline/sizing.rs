//! How large tiles may be, and how many of them may exist at a time.
//!
//! In: the memory for tiles, and a plan of one cell. Out: the cells. A tile costs as many bytes as it loads faces, halo
//! included, and how many these are is estimated from the boxes of the blocks. Tiles side by side keep all cores busy,
//! also while one of them is loaded; but the smaller the tiles, the more of the work is halo. So where memory is short,
//! fewer and larger tiles are worked on at a time. An estimate that is wrong costs time and not memory: who loads more
//! faces than the tile has bytes for, stops ([`super::admit`]).

use crate::config::{DEFAULT_TILE_FACES, Tiling};
use crate::partition::{Cell, MOST_FACES, Plan, Scan};

/// Bytes for each loaded face when a tile needs most: while normals are refined, or if the fields of all vertices are asked
/// for. Measured: 240 to 250 allocated on cities and scans, 280 with fields; a sixth more for pieces that were given back to
/// the allocator and are still resident.
const FACE_BYTES: u64 = 320;
/// What a tile needs however small it is: buffers of blocks for each thread.
const TILE_BYTES: u64 = 1 << 20;
/// Tiles that may exist at a time: one is loaded, two are worked on.
const IN_FLIGHT: u64 = 3;
/// Share of the work on a tile that only one thread does. Measured: 0.06 to 0.07, with halos.
const SERIAL: f64 = 0.07;
/// How much longer it takes if nothing is done while the only tile is read.
const READING: f64 = 0.05;
/// A cell is not made smaller than this share of its halo, on the longest side: what is loaded would hardly become less.
const LEAST_OF_HALO: f64 = 0.25;

/// Tiles that may exist at a time where so many threads work on them. With two threads, a third tile would not make them
/// faster; and with a single one, the next tile is read while this one is worked on.
pub fn tiles_at_a_time(threads: usize) -> u64 {
    IN_FLIGHT.min(threads as u64).max(2)
}

/// Bytes for a tile of so many loaded faces.
pub fn tile_bytes(faces: u64) -> u64 {
    faces.saturating_mul(FACE_BYTES).saturating_add(TILE_BYTES)
}

/// Faces that a tile of so many bytes may load.
pub fn faces_in(bytes: u64) -> u64 {
    (bytes.saturating_sub(TILE_BYTES) / FACE_BYTES).min(MOST_FACES)
}

/// About how many faces the tile of `cell` loads, with `margin` cubes around it.
pub fn expected_faces(plan: &Plan, cell: &Cell, margin: i64) -> u64 {
    plan.faces_near(plan.first_region(cell, margin).main())
}

/// How much longer the same faces take on so many threads because no more tiles than `in_flight` exist at a time: serial
/// parts of one tile go with parallel parts of others, if there are others.
fn slowdown(in_flight: u64, threads: usize) -> f64 {
    let waiting = SERIAL * (threads as f64 / in_flight as f64 - 1.0).max(0.0);
    1.0 + waiting + if in_flight == 1 { READING } else { 0.0 }
}

/// What was decided about the tiles, besides the cells themselves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sizes {
    /// Tiles that may exist at a time.
    pub in_flight: u64,
    /// Faces that the largest tile is expected to load.
    pub largest: u64,
    /// Faces that all tiles together are expected to load.
    pub loaded: u64,
}

impl Sizes {
    /// Bytes that are expected to be held by tiles at a time.
    pub fn bytes(&self, tiles: u64) -> u64 {
        self.in_flight.min(tiles).saturating_mul(tile_bytes(self.largest))
    }
}

/// Most faces of a cell, halo not counted.
fn target(tiling: Tiling) -> u64 {
    match tiling {
        Tiling::InCore => u64::MAX,
        Tiling::Faces(target) => target,
        Tiling::Auto => DEFAULT_TILE_FACES,
    }
}

/// Whether a mesh of so many faces is worked on as a whole.
pub fn is_one_tile(faces: u64, tiling: Tiling, memory: u64) -> bool {
    faces <= target(tiling) && faces <= faces_in(memory)
}

/// Cuts `plan` so that its tiles fit into `memory` bytes, with a halo of `margin` cubes.
pub fn cut(plan: &mut Plan, scan: &mut Scan, tiling: Tiling, memory: u64, margin: i64) -> Sizes {
    if is_one_tile(scan.faces, tiling, memory) {
        return sizes(plan, margin, 1);
    }
    let target = target(tiling);
    let least = LEAST_OF_HALO * margin as f64 * plan.lattice.edge;
    let mut best: Option<(f64, Vec<Cell>, Sizes)> = None;
    let threads = rayon::current_num_threads();
    for in_flight in (1..=tiles_at_a_time(threads)).rev() {
        let most = faces_in(memory / in_flight);
        let memory_is_short = std::cell::Cell::new(false);
        plan.cut(scan, &|plan, cell| {
            let is_small = cell.faces <= target;
            let fits =
                is_small && (expected_faces(plan, cell, margin) <= most || longest_side(plan, cell) <= least);
            memory_is_short.set(memory_is_short.get() || (is_small && !fits));
            fits
        });
        let found = sizes(plan, margin, in_flight);
        let time = slowdown(in_flight, threads) * found.loaded as f64;
        if best.as_ref().is_none_or(|(least, ..)| time < *least) {
            best = Some((time, std::mem::take(&mut plan.cells), found));
        }
        if !memory_is_short.get() {
            // Fewer tiles at a time would be the same tiles.
            break;
        }
    }
    // There is a best of them.
    let Some((_, cells, found)) = best else { return sizes(plan, margin, 1) };
    plan.cells = cells;
    found
}

/// What the tiles of `plan` are expected to be, with so many of them at a time.
pub fn sizes(plan: &Plan, margin: i64, in_flight: u64) -> Sizes {
    let expected = plan.cells.iter().map(|cell| expected_faces(plan, cell, margin));
    let (largest, loaded) = expected.fold((0, 0), |(largest, sum), n| (n.max(largest), sum + n));
    Sizes { in_flight, largest, loaded }
}

/// Longest side of the part of the cell that is within the bounds of the mesh, in mesh units.
fn longest_side(plan: &Plan, cell: &Cell) -> f64 {
    (cell.max.min(plan.bounds.max) - cell.min.max(plan.bounds.min)).max_element()
}
