//! The mesh of one tile: what was loaded, under local indices, with its adjacency.
//!
//! In: triangles with positions, and which vertices are *complete* (all their faces were loaded). Out: one-rings and faces
//! around each vertex, both by ascending global ids, so that a sum over them is the same sum in every tile. Non-manifold
//! edges need no special case: all their faces are around both their ends.
//!
//! Local numbers need not ascend with global ids: where the order of the file jumps, they are given anew, so that what is
//! near has numbers that are near. Nothing that comes out may depend on them.
//!
//! Invariant: for a complete vertex, the faces around it and its one-ring are those of the whole mesh.

use super::pieces::concat;
use super::{Across, Beyond, Csr, FaceId, VertexId};
use glam::DVec3;
use rayon::prelude::*;

/// Vertices, faces and adjacency of a tile.
#[derive(Debug, Default)]
pub struct TileMesh {
    /// Global id of each vertex.
    pub vertex_ids: Vec<VertexId>,
    /// Position of each vertex, as in the file.
    pub positions: Vec<DVec3>,
    /// Global id of each face.
    pub face_ids: Vec<FaceId>,
    /// Local corners of each face, in the order of the file.
    pub corners: Vec<[u32; 3]>,
    /// Faces around each vertex, by ascending ids.
    pub faces_around: Csr,
    /// One-ring of each vertex, by ascending ids.
    pub ring: Csr,
    /// The faces beside each face.
    pub across: Across,
    /// Whether everything around the vertex was loaded.
    pub complete: Vec<bool>,
    /// Faces that repeat the corners of a face of lower id, in any order and direction: they were left out. Their least
    /// corner (local) is kept so that exactly one tile counts them.
    pub duplicates: Vec<u32>,
    /// The vertices by ascending ids; empty if their numbers ascend with these.
    by_id: Vec<u32>,
}

/// One face at an edge, seen from one end: the other end, the face, and whether it runs along the edge from this end to
/// the other. In one number, the other end in front and the direction last, which sorts fast; a tile has fewer than 2^31
/// faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct EdgeUse(u64);

impl EdgeUse {
    fn new(other: u32, face: u32, outward: bool) -> EdgeUse {
        EdgeUse(u64::from(other) << 32 | u64::from(face) << 1 | u64::from(outward))
    }

    /// The other end.
    #[inline]
    pub fn other(self) -> u32 {
        (self.0 >> 32) as u32
    }

    /// The face.
    #[inline]
    pub fn face(self) -> u32 {
        self.0 as u32 >> 1
    }

    /// Whether the face runs along the edge from this end to the other.
    #[inline]
    pub fn outward(self) -> bool {
        self.0 & 1 == 1
    }
}

/// A vertex with more faces than this is a hub: the apex of a fan, as the cap of a cylinder has one. Nothing looks through a
/// hub, for whatever lies around it would look at everything else around it. No scan has such vertices; the caps of CAD
/// models rarely have a hundred faces.
pub const HUB: usize = 512;

/// Vertices handled by one parallel task: large enough to hide its cost, small enough to balance.
const CHUNK: usize = 4096;

impl TileMesh {
    /// Builds the adjacency. Faces with a repeated corner must have been left out; duplicate faces are left out here.
    pub fn new(
        vertex_ids: Vec<VertexId>,
        positions: Vec<DVec3>,
        mut face_ids: Vec<FaceId>,
        mut corners: Vec<[u32; 3]>,
        complete: Vec<bool>,
    ) -> TileMesh {
        let n = vertex_ids.len();
        let mut faces_around = Csr::invert(n, &corners);
        let mut across = Across::new(&corners, &faces_around);
        let mut duplicates = Vec::new();
        if across.may_repeat() {
            let repeated = duplicate_faces(&corners, &face_ids, &faces_around);
            duplicates = repeated.iter().map(|&f| lowest(&vertex_ids, &corners[f as usize])).collect();
            if !repeated.is_empty() {
                leave_out(&repeated, &mut corners, &mut face_ids);
                faces_around = Csr::invert(n, &corners);
                across = Across::new(&corners, &faces_around);
            }
        }
        let mut ring = one_rings(n, &corners, &faces_around);
        let mut by_id = Vec::new();
        if !vertex_ids.is_sorted() || !face_ids.is_sorted() {
            faces_around.sort_rows_by_key(|f| face_ids[f as usize]);
            ring.sort_rows_by_key(|u| vertex_ids[u as usize]);
            by_id = (0..n as u32).collect();
            by_id.par_sort_unstable_by_key(|&v| vertex_ids[v as usize]);
        }
        TileMesh {
            vertex_ids,
            positions,
            face_ids,
            corners,
            faces_around,
            ring,
            across,
            complete,
            duplicates,
            by_id,
        }
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.vertex_ids.len()
    }

    /// Number of faces.
    pub fn face_count(&self) -> usize {
        self.corners.len()
    }

    /// Position of vertex `v`.
    #[inline]
    pub fn position(&self, v: u32) -> DVec3 {
        self.positions[v as usize]
    }

    /// Global id of vertex `v`.
    #[inline]
    pub fn id(&self, v: u32) -> VertexId {
        self.vertex_ids[v as usize]
    }

    /// The number of the vertex with this id, which must be there.
    pub fn local(&self, id: VertexId) -> u32 {
        if self.by_id.is_empty() {
            return self.vertex_ids.partition_point(|&other| other < id) as u32;
        }
        self.by_id[self.by_id.partition_point(|&v| self.id(v) < id)]
    }

    /// Sorts `vertices` by ascending ids.
    pub fn sort_by_id(&self, vertices: &mut [u32]) {
        vertices.par_sort_unstable_by_key(|&v| self.id(v));
    }

    /// The corner with the lowest id.
    #[inline]
    pub fn lowest(&self, corners: &[u32; 3]) -> u32 {
        lowest(&self.vertex_ids, corners)
    }

    /// One-ring of `v`, by ascending ids. In debug builds `v` must be complete.
    #[inline]
    #[track_caller]
    pub fn ring_of(&self, v: u32) -> &[u32] {
        debug_assert!(self.complete[v as usize], "the one-ring of {} was not loaded whole", self.id(v));
        self.ring.row(v)
    }

    /// Faces around `v`, by ascending ids. In debug builds `v` must be complete.
    #[inline]
    #[track_caller]
    pub fn faces_of(&self, v: u32) -> &[u32] {
        debug_assert!(self.complete[v as usize], "the faces around {} were not loaded whole", self.id(v));
        self.faces_around.row(v)
    }

    /// Whether `v` has so many faces that nothing may look through it. Of a vertex that was not loaded whole, that may not
    /// be known yet.
    #[inline]
    pub fn is_hub(&self, v: u32) -> bool {
        self.faces_around.row(v).len() > HUB
    }

    /// Barycentre of face `f`.
    #[inline]
    pub fn barycentre(&self, f: u32) -> DVec3 {
        let [a, b, c] = self.corners[f as usize].map(|v| self.position(v));
        (a + b + c) / 3.0
    }

    /// What lies beyond the two sides of `f` that meet at its corner `v`.
    #[inline]
    pub fn beyond_at(&self, f: u32, v: u32) -> [Beyond; 2] {
        let [a, b, _] = self.corners[f as usize];
        let [after, before] = if v == a {
            [0, 2]
        } else if v == b {
            [1, 0]
        } else {
            [2, 1]
        };
        [after, before].map(|side| self.across.beyond(f, side))
    }

    /// Calls `visit` with each face that shares side `side` of `f`, by ascending ids.
    #[inline]
    pub fn faces_beyond(&self, f: u32, side: usize, mut visit: impl FnMut(u32)) {
        match self.across.beyond(f, side) {
            Beyond::Nothing => (),
            Beyond::One(g) => visit(g),
            Beyond::Several => {
                let corners = self.corners[f as usize];
                let (a, b) = (corners[side], corners[(side + 1) % 3]);
                let around = self.faces_around.row(a).iter();
                around.filter(|&&g| g != f && self.corners[g as usize].contains(&b)).for_each(|&g| visit(g));
            }
        }
    }

    /// Fills `uses` with the edges at `v` to vertices of higher ids, sorted by other end and then by face: the faces of an
    /// edge are consecutive ([`slice::chunk_by`] on `other`).
    pub fn edges_upwards(&self, v: u32, uses: &mut Vec<EdgeUse>) {
        let id = self.id(v);
        self.edges(v, |u| self.id(u) > id, uses);
    }

    /// The same for all edges at `v`.
    pub fn edge_uses(&self, v: u32, uses: &mut Vec<EdgeUse>) {
        self.edges(v, |_| true, uses);
    }

    fn edges(&self, v: u32, wanted: impl Fn(u32) -> bool, uses: &mut Vec<EdgeUse>) {
        uses.clear();
        for &face in self.faces_around.row(v) {
            let (next, previous) = beside(self.corners[face as usize], v);
            if wanted(next) {
                uses.push(EdgeUse::new(next, face, true));
            }
            if wanted(previous) {
                uses.push(EdgeUse::new(previous, face, false));
            }
        }
        uses.sort_unstable();
    }

    /// Whether two faces run along an edge from `v` in the same direction, away from it.
    pub fn is_opposed(&self, v: u32, scratch: &mut Vec<u32>) -> bool {
        scratch.clear();
        scratch.extend(self.faces_around.row(v).iter().map(|&f| beside(self.corners[f as usize], v).0));
        if scratch.len() > FEW {
            scratch.sort_unstable();
            return scratch.windows(2).any(|w| w[0] == w[1]);
        }
        (1..scratch.len()).any(|i| scratch[..i].contains(&scratch[i]))
    }
}

/// So many are compared with each other faster than they are sorted.
const FEW: usize = 16;

/// The corners after and before `v`.
#[inline]
fn beside([a, b, c]: [u32; 3], v: u32) -> (u32, u32) {
    if v == a {
        (b, c)
    } else if v == b {
        (c, a)
    } else {
        (a, b)
    }
}

/// Takes `repeated` (ascending) out of the faces.
fn leave_out(repeated: &[u32], corners: &mut Vec<[u32; 3]>, face_ids: &mut Vec<FaceId>) {
    let mut keep = vec![true; corners.len()];
    repeated.iter().for_each(|&f| keep[f as usize] = false);
    let mut kept = keep.iter();
    corners.retain(|_| *kept.next().unwrap_or(&true));
    let mut kept = keep.iter();
    face_ids.retain(|_| *kept.next().unwrap_or(&true));
}

/// The corner with the lowest id.
#[inline]
fn lowest(ids: &[VertexId], &[a, b, c]: &[u32; 3]) -> u32 {
    let lower = |u: u32, v: u32| if ids[u as usize] < ids[v as usize] { u } else { v };
    lower(lower(a, b), c)
}

/// Faces that have the same three corners as a face of lower id, by ascending numbers.
fn duplicate_faces(corners: &[[u32; 3]], ids: &[FaceId], faces_around: &Csr) -> Vec<u32> {
    let sorted = |f: u32| {
        let mut c = corners[f as usize];
        c.sort_unstable();
        c
    };
    let vertices: Vec<u32> = (0..faces_around.rows() as u32).collect();
    let per_chunk: Vec<Vec<u32>> = vertices
        .par_chunks(CHUNK)
        .map(|chunk| {
            let mut found = Vec::new();
            let mut seen: Vec<([u32; 3], FaceId, u32)> = Vec::new();
            for &v in chunk {
                seen.clear();
                let all = faces_around.row(v).iter().map(|&f| (sorted(f), ids[f as usize], f));
                seen.extend(all.filter(|(corners, ..)| corners[0] == v));
                seen.sort_unstable();
                found.extend(seen.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| w[1].2));
            }
            found
        })
        .collect();
    let mut all = per_chunk.concat();
    all.sort_unstable();
    all
}

/// The other corners of the faces around each vertex, by ascending numbers.
fn one_rings(n: usize, corners: &[[u32; 3]], faces_around: &Csr) -> Csr {
    let (lengths, items): (Vec<Vec<u32>>, Vec<Vec<u32>>) = (0..n)
        .into_par_iter()
        .step_by(CHUNK)
        .map(|first| {
            let chunk = first as u32..n.min(first + CHUNK) as u32;
            let (mut lengths, mut items) =
                (Vec::with_capacity(chunk.len()), Vec::with_capacity(7 * chunk.len()));
            let mut ring = Vec::new();
            for v in chunk {
                let row = faces_around.row(v);
                ring.clear();
                ring.extend(row.iter().map(|&f| beside(corners[f as usize], v).0));
                // Around an inner vertex every neighbour comes after it once, and nobody else comes before it.
                let after = ring.len();
                let previous = row.iter().map(|&f| beside(corners[f as usize], v).1);
                if after <= FEW {
                    previous.for_each(|u| {
                        if !ring[..after].contains(&u) {
                            ring.push(u);
                        }
                    });
                } else {
                    ring.extend(previous);
                }
                ring.sort_unstable();
                ring.dedup();
                lengths.push(ring.len() as u32);
                items.extend_from_slice(&ring);
            }
            (lengths, items)
        })
        .unzip();
    Csr::from_rows(lengths.into_iter().flatten(), concat(&items))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mesh that was loaded whole, ids counted from 0.
    fn whole(positions: &[DVec3], corners: &[[u32; 3]]) -> TileMesh {
        TileMesh::new(
            (0..positions.len() as u64).map(VertexId).collect(),
            positions.to_vec(),
            (0..corners.len() as u64).map(FaceId).collect(),
            corners.to_vec(),
            vec![true; positions.len()],
        )
    }

    #[test]
    fn rings_and_faces_ascend() {
        let mesh = whole(&[DVec3::ZERO; 5], &[[4, 0, 2], [0, 4, 1], [2, 0, 3]]);
        assert_eq!(mesh.ring_of(0), [1, 2, 3, 4]);
        assert_eq!(mesh.faces_of(0), [0, 1, 2]);
        assert_eq!(mesh.ring_of(3), [0, 2]);
    }

    #[test]
    fn numbers_need_not_ascend_with_ids() {
        let ids = [7, 3, 9, 1, 5].map(VertexId).to_vec();
        let faces = [8, 2, 6, 4].map(FaceId).to_vec();
        // The last is the second once more, and has the higher id.
        let corners = vec![[0, 1, 2], [0, 2, 3], [3, 1, 0], [2, 3, 0]];
        let mesh = TileMesh::new(ids, vec![DVec3::ZERO; 5], faces, corners, vec![true; 5]);
        assert_eq!(mesh.face_ids, [8, 2, 6].map(FaceId));
        assert_eq!(mesh.duplicates, [3], "the corner with the lowest id");
        assert_eq!(mesh.ring_of(0), [3, 1, 2]);
        assert_eq!(mesh.faces_of(0), [1, 2, 0]);
        assert_eq!([1, 3, 5, 7, 9].map(|id| mesh.local(VertexId(id))), [3, 1, 4, 0, 2]);
        let mut uses = Vec::new();
        mesh.edges_upwards(0, &mut uses);
        assert!(uses.iter().all(|edge| edge.other() == 2) && uses.len() == 2);
        assert_eq!(mesh.lowest(&[0, 1, 2]), 1);
    }

    #[test]
    fn duplicate_faces_are_left_out_whatever_their_direction() {
        let mesh = whole(&[DVec3::ZERO; 4], &[[0, 1, 2], [1, 2, 3], [2, 1, 0], [1, 2, 0]]);
        assert_eq!(mesh.corners, [[0, 1, 2], [1, 2, 3]]);
        assert_eq!(mesh.face_ids, [FaceId(0), FaceId(1)]);
        assert_eq!(mesh.duplicates, [0, 0]);
    }

    #[test]
    fn edges_know_their_direction() {
        let mesh = whole(&[DVec3::ZERO; 5], &[[0, 1, 2], [1, 0, 3], [0, 1, 4]]);
        let mut uses = Vec::new();
        mesh.edge_uses(0, &mut uses);
        let edge: Vec<_> = uses.iter().filter(|u| u.other() == 1).map(|u| (u.face(), u.outward())).collect();
        assert_eq!(edge, [(0, true), (1, false), (2, true)]);
        assert!(mesh.is_opposed(0, &mut Vec::new()) && !mesh.is_opposed(1, &mut Vec::new()));
        mesh.edges_upwards(1, &mut uses);
        assert_eq!(uses.iter().map(|u| u.other()).collect::<Vec<_>>(), [2, 3, 4]);
        assert_eq!(mesh.beyond_at(0, 2), [Beyond::Nothing; 2]);
        assert_eq!(mesh.beyond_at(0, 0), [Beyond::Several, Beyond::Nothing]);
        assert_eq!(mesh.beyond_at(1, 0), [Beyond::Nothing, Beyond::Several]);
    }
}
