//! The faces of a tile under numbers that are near each other where the faces are.
//!
//! In: a tile mesh, whose faces are numbered as in the file. Out: the same faces and vertices renumbered along steps from
//! face to face, where the order of the file leads from one end of the tile to the other: each round of refinement reads
//! a dozen faces around each face, and would wait for memory most of the time. Rows keep their order, so that sums over them
//! are the same sums.

use crate::mesh::{Csr, TileMesh};
use std::borrow::Cow;

/// Faces and the faces around their corners.
pub struct Near<'a> {
    /// For each face under its new number, that of the tile; nothing where they are the same.
    old: Option<Vec<u32>>,
    /// Corners of each face, under the numbers that `around` knows.
    corners: Cow<'a, [[u32; 3]]>,
    /// Faces around each corner, in the order of the tile, under new numbers.
    around: Cow<'a, Csr>,
}

/// Faces with numbers that differ by less are near each other: their normals and areas fit into the cache of a core.
const NEAR: u32 = 1 << 14;
/// With fewer faces nothing is far.
const FEW: usize = 4 * NEAR as usize;
/// The order of the file is kept if at most one pair of neighbours in so many is far from each other.
const RARE: usize = 8;
/// Every so many faces are looked at.
const STRIDE: usize = 61;

impl<'a> Near<'a> {
    /// Renumbers the faces of `mesh`, if that is worth it and somebody wants it.
    pub fn new(mesh: &'a TileMesh, wanted: bool) -> Near<'a> {
        if !wanted || is_coherent(mesh) { Near::as_they_are(mesh) } else { Near::renumbered(mesh) }
    }

    /// With the numbers of the tile.
    fn as_they_are(mesh: &'a TileMesh) -> Near<'a> {
        Near { old: None, corners: Cow::Borrowed(&mesh.corners), around: Cow::Borrowed(&mesh.faces_around) }
    }

    fn renumbered(mesh: &TileMesh) -> Near<'a> {
        let order = along_edges(mesh);
        let mut place = vec![0u32; order.len()];
        order.iter().zip(0..).for_each(|(&f, new)| place[f as usize] = new);
        // Vertices as the faces meet them.
        const UNMET: u32 = u32::MAX;
        let mut number = vec![UNMET; mesh.vertex_count()];
        let mut met: Vec<u32> = Vec::with_capacity(mesh.vertex_count());
        let mut meet = |v: u32| {
            let number = &mut number[v as usize];
            if *number == UNMET {
                *number = met.len() as u32;
                met.push(v);
            }
            *number
        };
        let corners: Vec<[u32; 3]> = order.iter().map(|&f| mesh.corners[f as usize].map(&mut meet)).collect();
        let lengths = met.iter().map(|&v| mesh.faces_around.row(v).len() as u32);
        let items = met.iter().flat_map(|&v| mesh.faces_around.row(v)).map(|&f| place[f as usize]).collect();
        let around = Csr::from_rows(lengths, items);
        Near { old: Some(order), corners: Cow::Owned(corners), around: Cow::Owned(around) }
    }

    /// The number in the tile of face `f`.
    #[inline]
    pub fn in_tile(&self, f: u32) -> u32 {
        self.old.as_ref().map_or(f, |old| old[f as usize])
    }

    /// The faces around each corner of face `f`.
    #[inline]
    pub fn around(&self, f: u32) -> [&[u32]; 3] {
        self.corners[f as usize].map(|v| self.around.row(v))
    }

    /// `values` of faces under their numbers in the tile.
    pub fn back<T: Copy + Default>(&self, values: Vec<T>) -> Vec<T> {
        let Some(old) = &self.old else { return values };
        let mut back = vec![T::default(); values.len()];
        old.iter().zip(values).for_each(|(&f, value)| back[f as usize] = value);
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
    fn renumbered_faces_have_the_same_faces_around_in_the_same_order() {
        let mesh = strip(101, 37);
        let near = Near::renumbered(&mesh);
        for f in 0..101 {
            let old = near.in_tile(f);
            let expected = mesh.corners[old as usize].map(|v| mesh.faces_around.row(v).to_vec());
            let found = near.around(f).map(|row| row.iter().map(|&g| near.in_tile(g)).collect::<Vec<_>>());
            assert_eq!(found, expected);
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
