//! The faces of a tile under numbers that are near each other where the faces are.
//!
//! In: a tile mesh, whose faces are numbered as in the file. Out: other numbers, along steps from face to face, where the
//! order of the file leads from one end of the tile to the other: each round of refinement reads a dozen faces around each
//! face, and would wait for memory most of the time.

use crate::mesh::TileMesh;

/// Numbers of faces.
pub struct Near {
    /// Nothing where they are those of the tile.
    renumbered: Option<Renumbered>,
}

struct Renumbered {
    /// The number in the tile of each face.
    in_tile: Vec<u32>,
    /// The other way round.
    in_order: Vec<u32>,
}

/// Faces with numbers that differ by less are near each other: their normals and areas fit into the cache of a core.
const NEAR: u32 = 1 << 14;
/// With fewer faces nothing is far.
const FEW: usize = 4 * NEAR as usize;
/// The order of the file is kept if at most one pair of neighbours in so many is far from each other.
const RARE: usize = 8;
/// Every so many faces are looked at.
const STRIDE: usize = 61;

impl Near {
    /// Renumbers the faces of `mesh`, if that is worth it and somebody wants it.
    pub fn new(mesh: &TileMesh, wanted: bool) -> Near {
        if !wanted || is_coherent(mesh) { Near { renumbered: None } } else { Near::along_edges(mesh) }
    }

    fn along_edges(mesh: &TileMesh) -> Near {
        let in_tile = along_edges(mesh);
        let mut in_order = vec![0u32; in_tile.len()];
        in_tile.iter().zip(0..).for_each(|(&f, new)| in_order[f as usize] = new);
        Near { renumbered: Some(Renumbered { in_tile, in_order }) }
    }

    /// The number in the tile of face `f`.
    #[inline]
    pub fn in_tile(&self, f: u32) -> u32 {
        self.renumbered.as_ref().map_or(f, |numbers| numbers.in_tile[f as usize])
    }

    /// The number of the face that has number `f` in the tile.
    #[inline]
    pub fn in_order(&self, f: u32) -> u32 {
        self.renumbered.as_ref().map_or(f, |numbers| numbers.in_order[f as usize])
    }

    /// `values` of faces under their numbers in the tile.
    pub fn back<T: Copy + Default>(&self, values: Vec<T>) -> Vec<T> {
        let Some(Renumbered { in_tile, .. }) = &self.renumbered else { return values };
        let mut back = vec![T::default(); values.len()];
        in_tile.iter().zip(values).for_each(|(&f, value)| back[f as usize] = value);
        back
    }
}

/// Whether most neighbours have numbers that are near each other.
fn is_coherent(mesh: &TileMesh) -> bool {
    let (mut far, mut all) = (0, 0);
    if mesh.face_count() > FEW {
        for f in (0..mesh.face_count() as u32).step_by(STRIDE) {
            for side in 0..3 {
                mesh.faces_beyond(f, side, |g| {
                    all += 1;
                    far += usize::from(g.abs_diff(f) > NEAR);
                });
            }
        }
    }
    RARE * far <= all
}

/// All faces, each component from its lowest face on as steps over edges lead to them.
fn along_edges(mesh: &TileMesh) -> Vec<u32> {
    let faces = mesh.face_count();
    let mut met = vec![false; faces];
    let mut order: Vec<u32> = Vec::with_capacity(faces);
    for first in 0..faces as u32 {
        if std::mem::replace(&mut met[first as usize], true) {
            continue;
        }
        let mut next = order.len();
        order.push(first);
        while next < order.len() {
            let f = order[next];
            next += 1;
            for side in 0..3 {
                mesh.faces_beyond(f, side, |g| {
                    if !std::mem::replace(&mut met[g as usize], true) {
                        order.push(g);
                    }
                });
            }
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{FaceId, VertexId};
    use glam::DVec3;

    /// A strip of `n` faces whose numbers jump by `jump` from face to face.
    fn strip(n: u32, jump: u32) -> TileMesh {
        let mut corners = vec![[0; 3]; n as usize];
        (0..n).for_each(|i| corners[(i * jump % n) as usize] = [i, i + 1, i + 2]);
        TileMesh::new(
            (0..u64::from(n) + 2).map(VertexId).collect(),
            vec![DVec3::ZERO; n as usize + 2],
            (0..u64::from(n)).map(FaceId).collect(),
            corners,
            vec![true; n as usize + 2],
        )
    }

    #[test]
    fn faces_have_numbers_as_steps_over_edges_lead_to_them() {
        let mesh = strip(101, 37);
        let near = Near::along_edges(&mesh);
        for f in 0..100 {
            let (here, next) = (near.in_tile(f), near.in_tile(f + 1));
            assert_eq!(next, (here + 37) % 101, "the strip goes on");
            assert_eq!(near.in_order(here), f);
        }
        let numbers: Vec<u32> = (0..101).map(|f| near.in_tile(f)).collect();
        assert_eq!(near.back(numbers), (0..101).collect::<Vec<_>>());
    }

    #[test]
    fn only_an_order_without_locality_is_left() {
        let faces = FEW as u32 + 1;
        assert!(is_coherent(&strip(faces, 1)));
        assert!(!is_coherent(&strip(faces, 2 * NEAR + 1)));
        assert!(is_coherent(&strip(1001, 37)));
    }
}
