//! The faces near a vertex, as the fit of planes looks at them.
//!
//! In: refined normals. Out: the faces within a radius, in units of kh relative to the vertex, with their neighbours over
//! edges. A patch is made of the faces around those vertices that one-ring steps inside the radius lead to, so that it
//! holds nothing that only lies near in space, and depends on nothing beyond these faces.

use crate::mesh::{Csr, Field, TileMesh};
use crate::partition::Scale;
use crate::voting::{FaceGeometry, Vote};
use glam::DVec3;

/// Faces around a vertex count at least so much of those at it: some have barycentres beyond any radius.
const LEAST_NEARNESS: f64 = 0.1;

/// Faces with an area near a vertex, by ascending id. Lengths in kh, relative to the vertex.
#[derive(Default)]
pub(super) struct Patch {
    /// Corner positions.
    pub corners: Vec<[DVec3; 3]>,
    /// Barycentres.
    pub centres: Vec<DVec3>,
    /// Refined unit normals.
    pub normals: Vec<DVec3>,
    /// Area times a weight that falls from 1 at the vertex to 0 at the radius.
    pub weights: Vec<f64>,
    /// Area over 1 + distance^2 for the faces around the vertex and its one-ring, 0 for the others.
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
    /// Known at the vertices around which all refined normals are.
    pub known: &'a Field<bool>,
    /// Directions at the vertices that patches are cut around.
    pub votes: &'a Field<Vote>,
}

impl Surface<'_> {
    /// The patch of radius `radius` (in kh) around `v`.
    pub fn patch(&self, v: u32, radius: f64) -> Patch {
        let mesh = self.mesh;
        let (origin, unit) = (mesh.position(v), self.scale.length(1.0));
        let (ball, ring) = self.within(v, radius * unit);
        let around = |vertices: &[u32]| {
            let mut faces: Vec<u32> = vertices.iter().flat_map(|&u| self.faces_around(u)).copied().collect();
            faces.sort_unstable();
            faces.dedup();
            faces
        };
        let nearest = around(&ball[..ring]);
        let mut ids = Vec::new();
        let mut patch = Patch::default();
        for f in around(&ball) {
            let area = self.faces.areas[f as usize] / (unit * unit);
            if area > 0.0 {
                let corners = mesh.corners[f as usize].map(|u| (mesh.position(u) - origin) / unit);
                let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
                let distance2 = centre.dot(centre);
                let own = mesh.corners[f as usize].contains(&v);
                let nearness = 1.0 - distance2 / (radius * radius);
                let nearness = nearness.max(if own { LEAST_NEARNESS } else { 0.0 });
                let near = nearest.binary_search(&f).is_ok();
                if nearness > 0.0 || near {
                    ids.push(f);
                    patch.corners.push(corners);
                    patch.centres.push(centre);
                    patch.normals.push(self.normals[f as usize]);
                    patch.weights.push(area * nearness * nearness);
                    patch.near.push(if near { area / (1.0 + distance2) } else { 0.0 });
                    patch.own.push(own);
                }
            }
        }
        patch.neighbours = neighbours(mesh, &ids);
        self.orient(v, &ids, &mut patch);
        patch
    }

    /// Vertices that one-ring steps inside `radius` (mesh units) lead to, in rings; and how many of them are `v` and its
    /// one-ring, which come first.
    fn within(&self, v: u32, radius: f64) -> (Vec<u32>, usize) {
        let origin = self.mesh.position(v);
        let (mut ball, mut ends) = (vec![v], vec![0, 1]);
        loop {
            let [before, last] = [ends[ends.len() - 2], ends[ends.len() - 1]];
            if before == last {
                return (ball, ends[2.min(ends.len() - 1)]);
            }
            let mut next: Vec<u32> = ball[before..last]
                .iter()
                .flat_map(|&u| self.mesh.ring_of(u))
                .copied()
                .filter(|&w| {
                    let e = self.mesh.position(w) - origin;
                    e.dot(e) <= radius * radius
                })
                .collect();
            next.sort_unstable();
            next.dedup();
            // Each ring is ascending, and neighbours of a ring lie in it or beside it.
            let known = |w: &u32| {
                let inner = if ends.len() > 2 { &ball[ends[ends.len() - 3]..before] } else { &[] };
                ball[before..last].binary_search(w).is_ok() || inner.binary_search(w).is_ok()
            };
            next.retain(|w| !known(w));
            ball.extend(next);
            ends.push(ball.len());
        }
    }

    /// Faces around `u`, whose refined normals must be known.
    fn faces_around(&self, u: u32) -> &[u32] {
        // Reading this is how debug builds notice a patch that reaches farther than the halo.
        self.known.get(u);
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
        self.weights.len()
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
        while let Some(i) = found.pop() {
            for &j in self.neighbours.row(i) {
                if weights[j as usize] > 0.0 && !inside[j as usize] {
                    inside[j as usize] = true;
                    found.push(j);
                }
            }
        }
        (0..self.len() as u32).filter(|&i| inside[i as usize]).collect()
    }
}

/// For each of the faces `ids` (ascending), those of them that share an edge with it; by place in the list.
fn neighbours(mesh: &TileMesh, ids: &[u32]) -> Csr {
    let (mut lengths, mut items) = (Vec::with_capacity(ids.len()), Vec::with_capacity(3 * ids.len()));
    for &f in ids {
        let before = items.len();
        let [a, b, c] = mesh.corners[f as usize];
        for [a, b] in [[a, b], [b, c], [c, a]] {
            // What is not loaded around a corner is not in the patch either.
            let beside =
                mesh.faces_around.row(a).iter().filter(|&&g| g != f && mesh.corners[g as usize].contains(&b));
            items.extend(beside.filter_map(|g| ids.binary_search(g).ok()).map(|j| j as u32));
        }
        lengths.push((items.len() - before) as u32);
    }
    Csr::from_rows(lengths.into_iter(), items)
}
