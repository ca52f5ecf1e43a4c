//! Which other tiles may name a vertex in their fragments.
//!
//! In: a certified tile and the vertices it names. Out: a [`Seam`] for each of them with a vertex of another tile within
//! [`method::LINK_STEPS`] rings; `stitch/close.rs` says what for. All one-rings that are read are complete: support is
//! certified farther around links than that.

use super::certify::Certified;
use crate::config::method;
use crate::mesh::{TileId, TileMesh};
use crate::partition::{Cell, Plan};
use crate::stitch::Seam;
use glam::DVec3;
use rayon::prelude::*;

/// Links end that many rings around owned vertices, and the rings around their ends are read; complete is what lies within
/// a trace of where links end.
const _: () = assert!(method::LINK_STEPS <= method::TRACE_STEPS);

/// The seams among `named` (local indices, by ascending ids).
pub fn seams(tile: &Certified, plan: &Plan, named: &[u32]) -> Vec<Seam> {
    if tile.cell.is_everything() {
        return Vec::new();
    }
    let foreign_around = |neighbourhood: &mut Neighbourhood, &v: &u32| {
        let around: Vec<u32> = neighbourhood.of(v).iter().copied().filter(|&u| !tile.owns(u)).collect();
        (!around.is_empty()).then_some((v, around))
    };
    let foreign: Vec<(u32, Vec<u32>)> = named
        .par_iter()
        .with_min_len(NEIGHBOURHOODS.max(named.len().div_ceil(TASKS)))
        .map_init(|| Neighbourhood::new(&tile.mesh), foreign_around)
        .flatten()
        .collect();
    let owners =
        Owners::new(plan, foreign.iter().flat_map(|(_, around)| around).map(|&u| tile.mesh.position(u)));
    let seam = |(v, around): (u32, Vec<u32>)| {
        let mut tiles: Vec<TileId> = around.iter().map(|&u| owners.of(tile.mesh.position(u))).collect();
        tiles.sort_unstable();
        tiles.dedup();
        Seam { vertex: tile.mesh.id(v), tiles }
    };
    foreign.into_iter().map(seam).collect()
}

/// Vertices that one parallel task looks around.
const NEIGHBOURHOODS: usize = 4096;
/// Tasks at most, however many threads there are: each has 4 bytes for each vertex of the tile.
const TASKS: usize = 8;

/// A few rings around one vertex after the other.
struct Neighbourhood<'a> {
    mesh: &'a TileMesh,
    /// For which vertex each was met last, counted from 1.
    met: Vec<u32>,
    now: u32,
    found: Vec<u32>,
}

impl<'a> Neighbourhood<'a> {
    fn new(mesh: &'a TileMesh) -> Neighbourhood<'a> {
        Neighbourhood { mesh, met: vec![0; mesh.vertex_count()], now: 0, found: Vec::new() }
    }

    /// The vertices within [`method::LINK_STEPS`] rings of `v`, and `v` itself. To be called once for a vertex at most.
    fn of(&mut self, v: u32) -> &[u32] {
        self.now += 1;
        self.found.clear();
        self.found.push(v);
        self.met[v as usize] = self.now;
        let mut ring = 0..1;
        for _ in 0..method::LINK_STEPS {
            for i in ring.clone() {
                // No link leads through a hub, though one may start there.
                if self.found[i] != v && self.mesh.is_hub(self.found[i]) {
                    continue;
                }
                for &u in self.mesh.ring_of(self.found[i]) {
                    if std::mem::replace(&mut self.met[u as usize], self.now) != self.now {
                        self.found.push(u);
                    }
                }
            }
            ring = ring.end..self.found.len();
        }
        &self.found
    }
}

/// The cells that may own some vertices.
struct Owners<'a> {
    cells: Vec<(TileId, &'a Cell)>,
}

impl<'a> Owners<'a> {
    /// Those of `plan` that may own one of `positions`: all that meet the box around them.
    fn new(plan: &'a Plan, positions: impl Iterator<Item = DVec3>) -> Owners<'a> {
        let around = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (lo, hi) = positions.fold(around, |(lo, hi), p| (lo.min(p), hi.max(p)));
        let meets = |cell: &Cell| cell.min.cmple(hi).all() && cell.max.cmpgt(lo).all();
        let cells = (0..).map(TileId).zip(&plan.cells).filter(|(_, cell)| meets(cell));
        Owners { cells: cells.collect() }
    }

    /// The tile whose cell owns `position`.
    fn of(&self, position: DVec3) -> TileId {
        let owner = self.cells.iter().find(|(_, cell)| cell.owns(position));
        owner.expect("cells fill space").0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{FaceId, VertexId};

    /// A square of 10 x 10 vertices, each cell of it cut along the same diagonal.
    fn square() -> TileMesh {
        let ids = (0..100).map(VertexId).collect();
        let positions = (0..100u32).map(|v| DVec3::new(f64::from(v % 10), f64::from(v / 10), 0.0)).collect();
        let cell = |v: u32| [[v, v + 1, v + 11], [v, v + 11, v + 10]];
        let corners: Vec<[u32; 3]> = (0..90).filter(|v| v % 10 < 9).flat_map(cell).collect();
        TileMesh::new(ids, positions, (0..162).map(FaceId).collect(), corners, vec![true; 100])
    }

    #[test]
    fn a_neighbourhood_is_three_rings() {
        let mesh = square();
        let mut neighbourhood = Neighbourhood::new(&mesh);
        for v in [0, 44, 45, 99, 9] {
            let mut found = neighbourhood.of(v).to_vec();
            found.sort_unstable();
            // Steps along the diagonal go both ways at once, against it they do not.
            let steps = |u: &u32| {
                let (dx, dy) = ((u % 10) as i32 - (v % 10) as i32, (u / 10) as i32 - (v / 10) as i32);
                if dx * dy > 0 { dx.abs().max(dy.abs()) } else { dx.abs() + dy.abs() }
            };
            let expected: Vec<u32> = (0..100).filter(|u| steps(u) <= 3).collect();
            assert_eq!(found, expected, "around {v}");
        }
    }
}
