//! The faces near a vertex, as the fit of planes looks at them.
//!
//! In: refined normals. Out: the faces within a radius, in units of kh relative to the vertex, with their neighbours over
//! edges. A patch is made of the faces around those vertices that one-ring steps inside the radius lead to, so that it
//! holds nothing that only lies near in space, and depends on nothing beyond these faces.
//!
//! Patches are made for every vertex of a line, and most of the time of a run would go into their memory: all of it is
//! used again for the next one ([`Scratch`]).

use super::sides::Work;
use crate::config::method;
use crate::math::Sym3;
use crate::mesh::{Beyond, Field, TileMesh};
use crate::partition::Scale;
use crate::voting::{FaceGeometry, Vote};
use glam::DVec3;

/// Faces around a vertex count at least so much of those at it: some have barycentres beyond any radius.
const LEAST_NEARNESS: f64 = 0.1;

/// Faces with an area near a vertex, by ascending id. Lengths in kh, relative to the vertex.
#[derive(Default)]
pub(super) struct Patch {
    /// The faces.
    pub faces: Vec<PatchFace>,
    /// For each face and each of its sides the face there, by place; the number of faces where there is none.
    beside: Vec<[u32; 3]>,
    /// Pairs of faces at edges with more than two, both ways, by the first.
    crowded: Vec<(u32, u32)>,
    /// Places of the faces around the vertex.
    own: Vec<u32>,
}

/// A face of a patch.
#[derive(Clone, Copy)]
pub(super) struct PatchFace {
    /// Barycentre.
    pub centre: DVec3,
    /// Mean of p p^T over the three corners p.
    pub spread: Sym3,
    /// Refined unit normal.
    pub normal: DVec3,
    /// Area times a weight that falls from 1 at the vertex to 0 at the radius.
    pub weight: f64,
    /// Area over 1 + distance^2 for the faces around the vertex and its one-ring, 0 for the others.
    pub near: f64,
    /// Local index.
    id: u32,
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

    /// Where `x` is among the members.
    #[inline]
    fn place_of(&self, x: u32) -> Option<u32> {
        let place = self.place[x as usize];
        (self.members.get(place as usize) == Some(&x)).then_some(place)
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
        let Scratch { patch, order, faces, .. } = scratch;
        patch.faces.clear();
        patch.own.clear();
        let inverse2 = 1.0 / (radius * radius);
        for &key in &*order {
            let (id, near) = (key >> 1, key & 1 == 0);
            let area = self.faces.areas[id as usize] * (per_unit * per_unit);
            let of_face = mesh.corners[id as usize];
            let corners = of_face.map(|u| (mesh.position(u) - origin) * per_unit);
            let centre = (corners[0] + corners[1] + corners[2]) * (1.0 / 3.0);
            let distance2 = centre.dot(centre);
            let own = of_face.contains(&v);
            let nearness = 1.0 - distance2 * inverse2;
            let nearness = nearness.max(if own { LEAST_NEARNESS } else { 0.0 });
            if area > 0.0 && (nearness > 0.0 || near) {
                let mut spread = Sym3::default();
                corners.iter().for_each(|&p| spread.add(&Sym3::outer(p, 1.0 / 3.0)));
                if own {
                    patch.own.push(patch.faces.len() as u32);
                }
                patch.faces.push(PatchFace {
                    centre,
                    spread,
                    normal: self.normals[id as usize],
                    weight: area * nearness * nearness,
                    near: if near { area / (1.0 + distance2) } else { 0.0 },
                    id,
                });
            }
        }
        patch.join(mesh, faces);
        self.orient(v, patch);
    }

    /// The faces around the vertices that one-ring steps inside `radius` (mesh units) lead to through no hub, in ascending
    /// `order`.
    fn gather(&self, v: u32, radius: f64, scratch: &mut Scratch) {
        let Scratch { ball, faces, order, .. } = scratch;
        let origin = self.mesh.position(v);
        let radius2 = radius * radius;
        ball.members.clear();
        ball.insert(v);
        let (mut next, mut nearest) = (0, 1);
        while next < ball.members.len() {
            let u = ball.members[next];
            let ring = if self.mesh.is_hub(u) { &[] } else { self.mesh.ring_of(u) };
            for &w in ring {
                let e = self.mesh.position(w) - origin;
                if e.dot(e) <= radius2 && ball.members.len() < method::FIT_MOST {
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
        for (i, &u) in ball.members.iter().enumerate().filter(|(_, u)| !self.mesh.is_hub(**u)) {
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
        let opposed_to = |i: u32, patch: &Patch| self.faces.opposed_to(patch.faces[i as usize].id);
        let all = 0..patch.faces.len() as u32;
        if self.faces.opposed.is_none() || all.clone().all(|i| opposed_to(i, patch).is_empty()) {
            return;
        }
        let vote = self.votes.get(v);
        let up = vote.t.cross(vote.b);
        let mut todo = patch.own.clone();
        let mut turned: Vec<Option<bool>> = vec![None; patch.faces.len()];
        todo.iter().for_each(|&i| turned[i as usize] = Some(patch.faces[i as usize].normal.dot(up) < 0.0));
        let mut next = 0;
        while next < todo.len() {
            let i = todo[next];
            next += 1;
            let opposed = opposed_to(i, patch);
            patch.beside(i, |j| {
                if turned[j as usize].is_none() {
                    let other = opposed.contains(&patch.faces[j as usize].id);
                    turned[j as usize] = turned[i as usize].map(|t| t != other);
                    todo.push(j);
                }
            });
        }
        for (face, turned) in patch.faces.iter_mut().zip(turned) {
            if turned == Some(true) {
                face.normal = -face.normal;
            }
        }
    }
}

impl Patch {
    /// Finds the faces that share edges; `places` is used for that.
    fn join(&mut self, mesh: &TileMesh, places: &mut SparseSet) {
        let Patch { faces, beside, crowded, .. } = self;
        places.members.clear();
        faces.iter().for_each(|face| _ = places.insert(face.id));
        let nobody = faces.len() as u32;
        beside.clear();
        crowded.clear();
        for (i, face) in faces.iter().enumerate() {
            beside.push([0, 1, 2].map(|side| match mesh.across.beyond(face.id, side) {
                Beyond::Nothing => nobody,
                Beyond::One(g) => places.place_of(g).unwrap_or(nobody),
                Beyond::Several => {
                    mesh.faces_beyond(face.id, side, |g| {
                        crowded.extend(places.place_of(g).map(|j| (i as u32, j)));
                    });
                    nobody
                }
            }));
        }
    }

    /// Calls `visit` with each face that shares an edge with face `i`.
    #[inline]
    fn beside(&self, i: u32, mut visit: impl FnMut(u32)) {
        let nobody = self.faces.len() as u32;
        self.beside[i as usize].iter().filter(|&&j| j != nobody).for_each(|&j| visit(j));
        let first = self.crowded.partition_point(|pair| pair.0 < i);
        self.crowded[first..].iter().take_while(|pair| pair.0 == i).for_each(|pair| visit(pair.1));
    }

    /// Weighs all faces, and finds those of positive weight that are connected over edges to those around the vertex or, if
    /// it has none, to those around its one-ring.
    pub fn connected(&self, weight: impl Fn(usize, &PatchFace) -> f64, found: &mut Connected) {
        let Connected { weights, faces, open, .. } = found;
        weights.clear();
        weights.extend(self.faces.iter().enumerate().map(|(i, face)| weight(i, face)));
        open.clear();
        open.extend(weights.iter().map(|&weight| u8::from(weight > 0.0)));
        // Nobody's place.
        open.push(0);
        // Every face comes in once, and behind the last there is room for what may not come in.
        faces.clear();
        faces.resize(self.faces.len() + 1, 0);
        let mut count = 0;
        let mut meet = |j: u32, open: &mut [u8], faces: &mut [u32]| {
            // Without a branch: which way it goes cannot be guessed.
            faces[count] = j;
            count += usize::from(std::mem::take(&mut open[j as usize]));
            count
        };
        let mut end = 0;
        self.own.iter().for_each(|&i| end = meet(i, open, faces));
        if end == 0 {
            let near = (0..).zip(&self.faces).filter(|(_, face)| face.near > 0.0);
            near.for_each(|(i, _)| end = meet(i, open, faces));
        }
        let mut next = 0;
        while next < end {
            let i = faces[next];
            next += 1;
            for j in self.beside[i as usize] {
                end = meet(j, open, faces);
            }
            if !self.crowded.is_empty() {
                self.beside(i, |j| end = meet(j, open, faces));
            }
        }
        faces.truncate(end);
    }
}

/// Connected faces, and what is needed to find them.
#[derive(Default)]
pub(super) struct Connected {
    /// The weight of each face of the patch.
    pub weights: Vec<f64>,
    /// Places of the connected faces in the patch, as steps over edges lead to them. That order is one of ids and corners,
    /// and so the same in every tile.
    pub faces: Vec<u32>,
    /// 1 for a face of positive weight that was not met yet.
    open: Vec<u8>,
}
