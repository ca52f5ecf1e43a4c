//! The defects of a mesh that only adjacency shows, each counted by the one tile that owns it.

use super::certify::Certified;
use crate::mesh::{Beyond, TileMesh};
use crate::stitch::Defects;
use rayon::prelude::*;

/// An open edge under local indices.
pub struct LocalEdge {
    /// Its ends, lower id first.
    pub ends: [u32; 2],
    /// Whether it has more than two faces rather than one.
    pub crowded: bool,
}

/// The open edges whose lower end is owned, and the defects this tile has to count.
pub fn census(tile: &Certified) -> (Vec<LocalEdge>, Defects) {
    let mesh = &tile.mesh;
    let degenerate =
        mesh.corners.iter().zip(&tile.faces.areas).filter(|(c, area)| **area == 0.0 && tile.owns_face(c));
    let mut defects = Defects {
        degenerate_faces: degenerate.count() as u64,
        duplicate_faces: mesh.duplicates.iter().filter(|&&v| tile.owns(v)).count() as u64,
        ..Defects::default()
    };
    // At almost all vertices every side of every face has one other face beyond it, that is wound like this one.
    let wound_alike = tile.faces.opposed.is_none();
    let one = |beyond: &Beyond| matches!(beyond, Beyond::One(_));
    let is_sound = |v: u32| mesh.faces_of(v).iter().all(|&f| mesh.beyond_at(f, v).iter().all(one));
    let of_chunk = |owned: &[u32]| {
        let worth_a_look = owned.iter().copied().filter(|&v| !(wound_alike && is_sound(v)));
        open_edges(mesh, worth_a_look)
    };
    let found: Vec<(Vec<LocalEdge>, Defects)> = tile.demand.owned.par_chunks(CHUNK).map(of_chunk).collect();
    let mut open = Vec::new();
    for (edges, counted) in found {
        open.extend(edges);
        defects.add(&counted);
    }
    (open, defects)
}

/// Vertices handled by one parallel task.
const CHUNK: usize = 4096;

/// The open edges from `vertices` to those of higher ids, and what is wrong with the others.
fn open_edges(mesh: &TileMesh, vertices: impl Iterator<Item = u32>) -> (Vec<LocalEdge>, Defects) {
    let (mut open, mut uses, mut defects) = (Vec::new(), Vec::new(), Defects::default());
    for v in vertices {
        mesh.edges_upwards(v, &mut uses);
        for edge in uses.chunk_by(|a, b| a.other() == b.other()) {
            let opposed = edge.len() == 2 && edge[0].outward() == edge[1].outward();
            defects.opposed_edges += u64::from(opposed);
            defects.boundary_edges += u64::from(edge.len() == 1);
            defects.nonmanifold_edges += u64::from(edge.len() > 2);
            if edge.len() != 2 {
                open.push(LocalEdge { ends: [v, edge[0].other()], crowded: edge.len() > 2 });
            }
        }
    }
    (open, defects)
}
