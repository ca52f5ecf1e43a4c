//! The faces near a vertex, as the fit of planes looks at them.
//!
//! In: refined normals. Out: the faces within a radius, in units of kh relative to the vertex, with their neighbours over
//! edges. A patch is found by one-ring steps inside the radius, the one-ring itself whatever its length, so that it holds
//! nothing that only lies near in space. It depends on nothing farther away than that.

use crate::mesh::{Csr, Field, TileMesh};
use crate::partition::Scale;
use crate::voting::{FaceGeometry, Vote};
use glam::DVec3;

/// Faces around a vertex count at least so much of those at it: some have barycentres beyond any radius.
const LEAST_NEARNESS: f64 = 0.1;

/// Faces with an area near a vertex, by ascending id. Lengths in kh, relative to the vertex.
pub(super) struct Patch {
    /// Corner positions.
    pub corners: Vec<[DVec3; 3]>,
    /// Barycentres.
    pub centres: Vec<DVec3>,
    /// Refined unit normals.
    pub normals: Vec<DVec3>,
    /// Areas.
    pub areas: Vec<f64>,
    /// Area times a weight that falls from 1 at the vertex to 0 at the radius.
    pub weights: Vec<f64>,
    /// Area over 1 + distance^2 for the faces around the one-ring, 0 for the others.
    pub near: Vec<f64>,
    /// Whether the vertex is a corner of the face.
    pub own: Vec<bool>,
    /// Faces that share an edge.
    neighbours: Csr,
}

/// Where patches are cut from.
pub(super) struct Surface<'a> {
    /// The mesh.
    pub mesh: &'a TileMesh,
    /// Areas and windings.
    pub faces: &'a FaceGeometry,
    /// Refined normals.
    pub normals: &'a [DVec3],
    /// The unit of length.
    pub scale: &'a Scale,
    /// Known wherever all faces around a vertex have their refined normals.
    pub votes: &'a Field<Vote>,
}

impl Surface<'_> {
    /// The patch of radius `radius` (in kh) around `v`.
    pub fn patch(&self, v: u32, radius: f64) -> Patch {
        let mesh = self.mesh;
        let (origin, unit) = (mesh.position(v), self.scale.length(1.0));
        let ring = mesh.ring_of(v);
        let mut ids: Vec<u32> = self.within(v, radius * unit);
        ids.extend_from_slice(ring);
        ids = ids.iter().flat_map(|&u| self.faces_around(u)).copied().collect();
        ids.sort_unstable();
        ids.dedup();
        ids.retain(|&f| self.faces.areas[f as usize] > 0.0);

        let corners: Vec<[DVec3; 3]> = ids
            .iter()
            .map(|&f| mesh.corners[f as usize].map(|u| (mesh.position(u) - origin) / unit))
            .collect();
        let centres: Vec<DVec3> = corners.iter().map(|[a, b, c]| (a + b + c) / 3.0).collect();
        let areas: Vec<f64> = ids.iter().map(|&f| self.faces.areas[f as usize] / (unit * unit)).collect();
        let own: Vec<bool> = ids.iter().map(|&f| mesh.corners[f as usize].contains(&v)).collect();
        let of_ring = |u: &u32| *u == v || ring.binary_search(u).is_ok();
        let mut patch = Patch {
            weights: Vec::with_capacity(ids.len()),
            near: Vec::with_capacity(ids.len()),
            normals: ids.iter().map(|&f| self.normals[f as usize]).collect(),
            neighbours: neighbours(mesh, &ids),
            corners,
            centres,
            areas,
            own,
        };
        for (i, &f) in ids.iter().enumerate() {
            let distance2 = patch.centres[i].dot(patch.centres[i]);
            let nearness = 1.0 - distance2 / (radius * radius);
            let nearness = nearness.max(if patch.own[i] { LEAST_NEARNESS } else { 0.0 });
            patch.weights.push(patch.areas[i] * nearness * nearness);
            let near = mesh.corners[f as usize].iter().any(of_ring);
            patch.near.push(if near { patch.areas[i] / (1.0 + distance2) } else { 0.0 });
        }
        self.orient(v, &ids, &mut patch);
        patch
    }

    /// Vertices that one-ring steps inside `radius` (mesh units) lead to, `v` first.
    fn within(&self, v: u32, radius: f64) -> Vec<u32> {
        let origin = self.mesh.position(v);
        let mut ball = vec![v];
        let mut next = 0;
        while next < ball.len() {
            for &w in self.mesh.ring_of(ball[next]) {
                let e = self.mesh.position(w) - origin;
                // A ball is a hundred vertices; looking through it is cheaper than a set.
                if e.dot(e) <= radius * radius && !ball.contains(&w) {
                    ball.push(w);
                }
            }
            next += 1;
        }
        ball
    }

    /// Faces around `u`, whose refined normals must be known.
    fn faces_around(&self, u: u32) -> &[u32] {
        // Reading a vote is how debug builds notice a patch that reaches farther than the halo.
        self.votes.get(u);
        self.mesh.faces_of(u)
    }

    /// Turns the normals to the side of the vertex normal where windings disagree, face by face over edges.
    fn orient(&self, v: u32, ids: &[u32], patch: &mut Patch) {
        if ids.iter().all(|&f| self.faces.opposed_to(f).is_empty()) {
            return;
        }
        let vote = self.votes.get(v);
        let up = vote.t.cross(vote.b);
        let mut todo: Vec<u32> = (0..ids.len() as u32).filter(|&i| patch.own[i as usize]).collect();
        let mut turned: Vec<Option<bool>> = vec![None; ids.len()];
        todo.iter().for_each(|&i| turned[i as usize] = Some(patch.normals[i as usize].dot(up) < 0.0));
        let mut next = 0;
        while next < todo.len() {
            let i = todo[next];
            next += 1;
            let opposed = self.faces.opposed_to(ids[i as usize]);
            for &j in patch.neighbours.row(i) {
                if turned[j as usize].is_none() {
                    let other = opposed.contains(&ids[j as usize]);
                    turned[j as usize] = turned[i as usize].map(|t| t != other);
                    todo.push(j);
                }
            }
        }
        for (normal, turned) in patch.normals.iter_mut().zip(turned) {
            if turned == Some(true) {
                *normal = -*normal;
            }
        }
    }
}

impl Patch {
    /// Number of faces.
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// The faces of positive weight that are connected over edges to those around the vertex or, if it has none, to those
    /// around its one-ring; ascending.
    pub fn connected(&self, weights: &[f64]) -> Vec<u32> {
        let seeds = |of: &dyn Fn(usize) -> bool| -> Vec<u32> {
            (0..self.len()).filter(|&i| weights[i] > 0.0 && of(i)).map(|i| i as u32).collect()
        };
        let mut found = seeds(&|i| self.own[i]);
        if found.is_empty() {
            found = seeds(&|i| self.near[i] > 0.0);
        }
        let mut inside = vec![false; self.len()];
        found.iter().for_each(|&i| inside[i as usize] = true);
        let mut next = 0;
        while next < found.len() {
            for &j in self.neighbours.row(found[next]) {
                if weights[j as usize] > 0.0 && !inside[j as usize] {
                    inside[j as usize] = true;
                    found.push(j);
                }
            }
            next += 1;
        }
        found.sort_unstable();
        found
    }
}

/// For each of the faces `ids`, those of them that share an edge with it; by place in the list.
fn neighbours(mesh: &TileMesh, ids: &[u32]) -> Csr {
    let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * ids.len());
    for (i, &f) in (0..).zip(ids) {
        let [a, b, c] = mesh.corners[f as usize];
        sides.extend([[a, b], [b, c], [c, a]].map(|[a, b]| ([a.min(b), a.max(b)], i)));
    }
    sides.sort_unstable();
    let mut pairs: Vec<(u32, u32)> = Vec::with_capacity(sides.len());
    for edge in sides.chunk_by(|a, b| a.0 == b.0) {
        for &(_, i) in edge {
            pairs.extend(edge.iter().filter(|(_, j)| *j != i).map(|&(_, j)| (i, j)));
        }
    }
    pairs.sort_unstable();
    let mut lengths = vec![0u32; ids.len()];
    pairs.iter().for_each(|(i, _)| lengths[*i as usize] += 1);
    Csr::from_rows(lengths.into_iter(), pairs.into_iter().map(|(_, j)| j).collect())
}
