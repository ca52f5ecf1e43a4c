//! The faces near a vertex, as the fit of planes looks at them.
//!
//! In: refined normals. Out: the faces within a radius, in units of kh relative to the vertex, with their neighbours over
//! edges. A patch is made of the faces around those vertices that one-ring steps inside the radius lead to, so that it
//! holds nothing that only lies near in space, and depends on nothing beyond these faces.
//!
//! Patches are made for every vertex of a line, and most of the time of a run would go into their memory: all of it is
//! used again for the next one ([`Scratch`]).

use super::beside::Beside;
use super::sides::Work;
use crate::math::Sym3;
use crate::mesh::{Field, TileMesh};
use crate::partition::Scale;
use crate::voting::{FaceGeometry, Vote};
use glam::DVec3;

/// Faces around a vertex count at least so much of those at it: some have barycentres beyond any radius.
const LEAST_NEARNESS: f64 = 0.1;

/// Faces with an area near a vertex, by ascending id. Lengths in kh, relative to the vertex.
#[derive(Default)]
pub(super) struct Patch {
    /// Barycentres.
    pub centres: Vec<DVec3>,
    /// Mean of p p^T over the three corners p.
    pub spreads: Vec<Sym3>,
    /// Refined unit normals.
    pub normals: Vec<DVec3>,
    /// Area times a weight that falls from 1 at the vertex to 0 at the radius.
    pub weights: Vec<f64>,
    /// Area over 1 + distance^2 for the faces around the vertex and its one-ring, 0 for the others.
    pub near: Vec<f64>,
    /// Whether the vertex is a corner of the face.
    pub own: Vec<bool>,
    /// Faces that share an edge.
    pub beside: Beside,
    /// Local indices of the faces.
    ids: Vec<u32>,
}

/// Memory that is used again from vertex to vertex.
pub(super) struct Scratch {
    /// The patch of the last vertex.
    pub patch: Patch,
    /// For the planes through it.
    pub work: Work,
    ball: SparseSet,
    faces: SparseSet,
    /// Faces, twice; and one more if they are not around the vertex or its one-ring.
    order: Vec<u32>,
}

impl Scratch {
    /// For the patches of `mesh`.
    pub fn new(mesh: &TileMesh) -> Scratch {
        Scratch {
            patch: Patch::default(),
            work: Work::default(),
            ball: SparseSet::new(mesh.vertex_count()),
            faces: SparseSet::new(mesh.face_count()),
            order: Vec::new(),
        }
    }
}

/// A set of numbers below a bound that inserts and forgets in constant time (Briggs and Torczon 1993): `place` says where a
/// member is, and means nothing for others. Of its memory only those pages are ever there where members were.
struct SparseSet {
    place: Vec<u32>,
    members: Vec<u32>,
}

impl SparseSet {
    fn new(bound: usize) -> SparseSet {
        SparseSet { place: vec![0; bound], members: Vec::new() }
    }

    /// Whether `x` was not in the set before.
    #[inline]
    fn insert(&mut self, x: u32) -> bool {
        let place = &mut self.place[x as usize];
        if self.members.get(*place as usize) == Some(&x) {
            return false;
        }
        *place = self.members.len() as u32;
        self.members.push(x);
        true
    }
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
    /// The patch of radius `radius` (in kh) around `v`, as `scratch.patch`.
    pub fn patch(&self, v: u32, radius: f64, scratch: &mut Scratch) {
        let mesh = self.mesh;
        let (origin, per_unit) = (mesh.position(v), 1.0 / self.scale.length(1.0));
        self.gather(v, radius * self.scale.length(1.0), scratch);
        let Scratch { patch, order, .. } = scratch;
        patch.clear();
        let inverse2 = 1.0 / (radius * radius);
        for &key in &*order {
            let (f, near) = (key >> 1, key & 1 == 0);
            let area = self.faces.areas[f as usize] * (per_unit * per_unit);
            if area > 0.0 {
                let of_face = mesh.corners[f as usize];
                let corners = of_face.map(|u| (mesh.position(u) - origin) * per_unit);
                let centre = (corners[0] + corners[1] + corners[2]) * (1.0 / 3.0);
                let distance2 = centre.dot(centre);
                let own = of_face.contains(&v);
                let nearness = 1.0 - distance2 * inverse2;
                let nearness = nearness.max(if own { LEAST_NEARNESS } else { 0.0 });
                if nearness > 0.0 || near {
                    let mut spread = Sym3::default();
                    corners.iter().for_each(|&p| spread.add(&Sym3::outer(p, 1.0 / 3.0)));
                    patch.ids.push(f);
                    patch.centres.push(centre);
                    patch.spreads.push(spread);
                    patch.normals.push(self.normals[f as usize]);
                    patch.weights.push(area * nearness * nearness);
                    patch.near.push(if near { area / (1.0 + distance2) } else { 0.0 });
                    patch.own.push(own);
                }
            }
        }
        patch.beside.build(patch.ids.iter().map(|&f| mesh.corners[f as usize]));
        self.orient(v, patch);
    }

    /// The faces around the vertices that one-ring steps inside `radius` (mesh units) lead to, in ascending `order`.
    fn gather(&self, v: u32, radius: f64, scratch: &mut Scratch) {
        let Scratch { ball, faces, order, .. } = scratch;
        let origin = self.mesh.position(v);
        let radius2 = radius * radius;
        ball.members.clear();
        ball.insert(v);
        let (mut next, mut nearest) = (0, 1);
        while next < ball.members.len() {
            for &w in self.mesh.ring_of(ball.members[next]) {
                let e = self.mesh.position(w) - origin;
                if e.dot(e) <= radius2 {
                    ball.insert(w);
                }
            }
            if next == 0 {
                nearest = ball.members.len();
            }
            next += 1;
        }
        faces.members.clear();
        order.clear();
        for (i, &u) in ball.members.iter().enumerate() {
            let far = u32::from(i >= nearest);
            let around = self.faces_around(u).iter().filter(|&&f| faces.insert(f));
            // A tile has fewer than 2^31 faces.
            order.extend(around.map(|&f| 2 * f + far));
        }
        order.sort_unstable();
    }

    /// Faces around `u`, whose refined normals must be known.
    fn faces_around(&self, u: u32) -> &[u32] {
        // Reading this is how debug builds notice a patch that reaches farther than the halo.
        self.known.get(u);
        self.mesh.faces_of(u)
    }

    /// Turns the normals to the side of the vertex normal where windings disagree, face by face over edges.
    fn orient(&self, v: u32, patch: &mut Patch) {
        let Patch { ids, beside, own, normals, .. } = patch;
        if self.faces.opposed.is_none() || ids.iter().all(|&f| self.faces.opposed_to(f).is_empty()) {
            return;
        }
        let vote = self.votes.get(v);
        let up = vote.t.cross(vote.b);
        let mut todo: Vec<u32> = (0..ids.len() as u32).filter(|&i| own[i as usize]).collect();
        let mut turned: Vec<Option<bool>> = vec![None; ids.len()];
        todo.iter().for_each(|&i| turned[i as usize] = Some(normals[i as usize].dot(up) < 0.0));
        let mut next = 0;
        while next < todo.len() {
            let i = todo[next];
            next += 1;
            let opposed = self.faces.opposed_to(ids[i as usize]);
            for &j in beside.of(i) {
                if turned[j as usize].is_none() {
                    let other = opposed.contains(&ids[j as usize]);
                    turned[j as usize] = turned[i as usize].map(|t| t != other);
                    todo.push(j);
                }
            }
        }
        for (normal, turned) in normals.iter_mut().zip(turned) {
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

    fn clear(&mut self) {
        let Patch { centres, spreads, normals, weights, near, own, ids, .. } = self;
        centres.clear();
        spreads.clear();
        normals.clear();
        weights.clear();
        near.clear();
        own.clear();
        ids.clear();
    }

    /// The faces of positive weight that are connected over edges to those around the vertex or, if it has none, to those
    /// around its one-ring; ascending.
    pub fn connected(&self, weights: &[f64], found: &mut Connected) {
        let Connected { faces, inside, todo } = found;
        inside.clear();
        inside.resize(self.len(), false);
        todo.clear();
        todo.extend((0..self.len() as u32).filter(|&i| weights[i as usize] > 0.0 && self.own[i as usize]));
        if todo.is_empty() {
            let near = |&i: &u32| weights[i as usize] > 0.0 && self.near[i as usize] > 0.0;
            todo.extend((0..self.len() as u32).filter(near));
        }
        todo.iter().for_each(|&i| inside[i as usize] = true);
        while let Some(i) = todo.pop() {
            for &j in self.beside.of(i) {
                if weights[j as usize] > 0.0 && !inside[j as usize] {
                    inside[j as usize] = true;
                    todo.push(j);
                }
            }
        }
        faces.clear();
        faces.extend((0..self.len() as u32).filter(|&i| inside[i as usize]));
    }
}

/// Connected faces, and what is needed to find them.
#[derive(Default)]
pub(super) struct Connected {
    /// Ascending places in the patch.
    pub faces: Vec<u32>,
    inside: Vec<bool>,
    todo: Vec<u32>,
}
