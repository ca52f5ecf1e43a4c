//! Which numbers the vertices and faces of a tile get.
//!
//! In: vertices and faces by ascending ids. Out: the same, in that order or along a space-filling curve. Every step reads
//! what is around a vertex or a face: where the order of the file leads from one end of the tile to the other, as that of
//! most triangulated scans does, it would wait for memory most of the time. What comes out does not depend on it: all sums
//! go by ids.

use super::curve::Curve;
use super::scan::Bounds;
use crate::mesh::{FaceId, VertexId};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::atomic::AtomicU32;
use std::sync::atomic::Ordering::Relaxed;

/// How numbers are given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Numbering {
    /// As ids ascend.
    AsTheyCome,
    /// Along a curve, if the order of ids is incoherent.
    #[default]
    WhereItPays,
}

/// What gets numbers: places in these arrays.
pub(super) struct Numbered {
    pub vertex_ids: Vec<VertexId>,
    pub positions: Vec<DVec3>,
    pub face_ids: Vec<FaceId>,
    pub corners: Vec<[u32; 3]>,
}

/// With fewer faces all of the tile is in the cache.
const FEW: usize = 1 << 12;
/// Vertices and faces whose numbers differ by less are near each other: what is known of so many fits into the cache of a
/// core.
const NEAR: u32 = 1 << 13;
/// Faces handled by one parallel task.
const CHUNK: usize = 4096;
/// The order is kept if at most one corner in so many is far from what it belongs to.
const RARE: usize = 8;

impl Numbering {
    /// Gives numbers to a tile of a mesh with these `bounds`.
    pub(super) fn apply(self, tile: Numbered, bounds: &Bounds) -> Numbered {
        match self {
            Numbering::WhereItPays if !is_coherent(tile.positions.len(), &tile.corners) => {
                along_curve(tile, bounds)
            }
            _ => tile,
        }
    }
}

/// Whether most corners of faces are near the other corners, and most faces around a vertex near the first of them.
fn is_coherent(vertices: usize, corners: &[[u32; 3]]) -> bool {
    if corners.len() <= FEW {
        return true;
    }
    let first: Vec<AtomicU32> = (0..vertices).into_par_iter().map(|_| AtomicU32::new(u32::MAX)).collect();
    let chunks = || corners.par_chunks(CHUNK).zip((0..corners.len() as u32).into_par_iter().step_by(CHUNK));
    chunks().for_each(|(faces, f)| {
        for (face, f) in faces.iter().zip(f..) {
            for first in face.map(|v| &first[v as usize]) {
                // Where there is some order, it was one of the last faces, and nothing has to be written.
                if first.load(Relaxed) > f {
                    first.fetch_min(f, Relaxed);
                }
            }
        }
    });
    let far_of_chunk = |(faces, f): (&[[u32; 3]], u32)| {
        let mut far = 0;
        for (face, f) in faces.iter().zip(f..) {
            for &v in face {
                let before = f - first[v as usize].load(Relaxed);
                far += usize::from((before > NEAR) | (v.abs_diff(face[0]) > NEAR));
            }
        }
        far
    };
    let far: Vec<usize> = chunks().map(far_of_chunk).collect();
    RARE * far.into_iter().sum::<usize>() <= 3 * corners.len()
}

/// Vertices along a curve, faces by the first of their corners on it.
fn along_curve(tile: Numbered, bounds: &Bounds) -> Numbered {
    let Numbered { vertex_ids, positions, face_ids, mut corners } = tile;
    let curve = Curve::new(bounds);
    let mut order: Vec<(u64, u32)> =
        positions.par_iter().zip(0..positions.len() as u32).map(|(&p, v)| (curve.coarse_key(p), v)).collect();
    // Numbers before ascend with ids, so that there is one order only.
    order.par_sort_unstable();
    let mut number = vec![0u32; order.len()];
    order.iter().zip(0..).for_each(|(&(_, old), new)| number[old as usize] = new);
    let vertex_ids = order.par_iter().map(|&(_, v)| vertex_ids[v as usize]).collect();
    let positions = order.par_iter().map(|&(_, v)| positions[v as usize]).collect();
    drop(order);
    corners.par_iter_mut().for_each(|face| *face = face.map(|v| number[v as usize]));
    let first = |face: &[u32; 3]| face[0].min(face[1]).min(face[2]);
    let mut order: Vec<(u32, u32)> =
        corners.par_iter().zip(0..corners.len() as u32).map(|(face, f)| (first(face), f)).collect();
    order.par_sort_unstable();
    let face_ids = order.par_iter().map(|&(_, f)| face_ids[f as usize]).collect();
    let corners = order.par_iter().map(|&(_, f)| corners[f as usize]).collect();
    Numbered { vertex_ids, positions, face_ids, corners }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of n x n vertices, named row by row or as a multiplication jumps.
    fn square(n: u32, jump: u64) -> Numbered {
        let count = n * n;
        let name = |v: u32| (u64::from(v) * jump % u64::from(count)) as u32;
        let mut positions = vec![DVec3::ZERO; count as usize];
        (0..count).for_each(|v| {
            positions[name(v) as usize] = DVec3::new(f64::from(v % n), f64::from(v / n), 0.0);
        });
        let cell = |v: u32| [[v, v + 1, v + n], [v + 1, v + n + 1, v + n]].map(|face| face.map(name));
        let corners: Vec<[u32; 3]> = (0..count - n).filter(|v| v % n < n - 1).flat_map(cell).collect();
        Numbered {
            vertex_ids: (0..u64::from(count)).map(VertexId).collect(),
            positions,
            face_ids: (0..corners.len() as u64).map(FaceId).collect(),
            corners,
        }
    }

    fn bounds(n: u32) -> Bounds {
        Bounds { min: DVec3::ZERO, max: DVec3::new(f64::from(n), f64::from(n), 0.0) }
    }

    #[test]
    fn a_good_order_is_kept() {
        let tile = Numbering::WhereItPays.apply(square(200, 1), &bounds(200));
        assert!(tile.vertex_ids.is_sorted() && tile.face_ids.is_sorted());
    }

    #[test]
    fn a_bad_order_is_replaced_and_the_mesh_stays() {
        let before = square(200, 7919);
        let after = Numbering::WhereItPays.apply(square(200, 7919), &bounds(200));
        assert!(!after.vertex_ids.is_sorted());
        let far = |tile: &Numbered| {
            let span = |face: &[u32; 3]| face.iter().max().zip(face.iter().min()).map_or(0, |(a, b)| a - b);
            tile.corners.iter().filter(|face| span(face) > 1000).count()
        };
        assert!(far(&before) > 10 * far(&after), "{} {}", far(&before), far(&after));
        let mut seen = vec![false; before.corners.len()];
        for (id, face) in after.face_ids.iter().zip(&after.corners) {
            let ids = face.map(|v| after.vertex_ids[v as usize]);
            assert_eq!(ids, before.corners[id.0 as usize].map(|v| VertexId(u64::from(v))));
            let places = face.map(|v| after.positions[v as usize]);
            assert_eq!(places, ids.map(|id| before.positions[id.0 as usize]));
            assert!(!std::mem::replace(&mut seen[id.0 as usize], true));
        }
        assert!(seen.into_iter().all(|seen| seen));
    }

    #[test]
    fn whoever_wants_no_shortcut_gets_none() {
        let tile = Numbering::AsTheyCome.apply(square(200, 7919), &bounds(200));
        assert!(tile.vertex_ids.is_sorted() && tile.face_ids.is_sorted());
    }
}
