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
use crate::mesh::{Beyond, Field, TileMesh};
use crate::partition::Scale;
use crate::voting::{FaceGeometry, Vote};
use glam::DVec3;

/// Faces around a vertex count at least so much of those at it: some have barycentres beyond any radius.
const LEAST_NEARNESS: f64 = 0.1;

/// Faces with an area near a vertex, as steps along one-rings come upon them: first those around the vertex, then those
/// around its one-ring, then the others. That order is one of ids, and so the same in every tile. Lengths in kh, relative
/// to the vertex. All arrays run parallel, so that sums and weights over all faces are made in lanes, and are longer than
/// they must be: they grow to the largest patch.
#[derive(Default)]
pub(super) struct Patch {
    /// Number of faces.
    count: usize,
    /// How many are around the vertex: the first ones.
    own: usize,
    /// How many are around the vertex and its one-ring: the first ones.
    near: usize,
    centres: Axes,
    normals: Axes,
    weights: Vec<f64>,
    near_weights: Vec<f64>,
    moments: Vec<Moments>,
    /// Local indices.
    ids: Vec<u32>,
    /// For each face and each of its sides the face there, by place; the number of faces where there is none.
    beside: Vec<[u32; 3]>,
    /// Pairs of faces at edges with more than two, both ways, by the first.
    crowded: Vec<(u32, u32)>,
}

/// Vectors by coordinates.
#[derive(Default)]
pub(super) struct Axes {
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
}

impl Axes {
    fn make_room(&mut self, count: usize) {
        [&mut self.x, &mut self.y, &mut self.z].into_iter().for_each(|axis| make_room(axis, count));
    }

    /// The first `count` of each coordinate.
    #[inline]
    pub fn first(&self, count: usize) -> [&[f64]; 3] {
        [&self.x[..count], &self.y[..count], &self.z[..count]]
    }

    #[inline]
    pub fn get(&self, i: usize) -> DVec3 {
        DVec3::new(self.x[i], self.y[i], self.z[i])
    }

    #[inline]
    fn set(&mut self, i: usize, v: DVec3) {
        (self.x[i], self.y[i], self.z[i]) = (v.x, v.y, v.z);
    }
}

/// At least `count` places. Never fewer: what is there is written over, and nothing has to be cleared or moved.
fn make_room<T: Copy + Default>(list: &mut Vec<T>, count: usize) {
    if list.len() < count {
        list.resize(count, T::default());
    }
}

/// Means over the three corners p of a face: 1; x, y, z; xx, yy, zz, yz, xz, xy.
pub(super) type Moments = [f64; 10];

/// The moments of a face with these corners and this barycentre.
fn moments(corners: [DVec3; 3], centre: DVec3) -> Moments {
    let [a, b, c] = corners;
    let diag = (a * a + b * b + c * c) * (1.0 / 3.0);
    let off = |p: DVec3| DVec3::new(p.y * p.z, p.x * p.z, p.x * p.y);
    let off = (off(a) + off(b) + off(c)) * (1.0 / 3.0);
    [1.0, centre.x, centre.y, centre.z, diag.x, diag.y, diag.z, off.x, off.y, off.z]
}

/// Memory that is used again from vertex to vertex.
pub(super) struct Scratch {
    /// The patch of the last vertex.
    pub patch: Patch,
    /// For the planes through it.
    pub work: Work,
    ball: Vec<u32>,
    vertices: Stamps,
    faces: Stamps,
    /// Faces around the ball, each once.
    met: Vec<u32>,
}

impl Scratch {
    /// For the patches of `mesh`.
    pub fn new(mesh: &TileMesh) -> Scratch {
        Scratch {
            patch: Patch::default(),
            work: Work::default(),
            ball: Vec::new(),
            vertices: Stamps::new(mesh.vertex_count()),
            faces: Stamps::new(mesh.face_count()),
            met: Vec::new(),
        }
    }
}

/// A number for some of the indices below a bound, all forgotten in constant time: each comes with the stamp of its day. Of
/// its memory only those pages are ever there where something was put.
struct Stamps {
    slots: Vec<u64>,
    today: u32,
}

impl Stamps {
    fn new(bound: usize) -> Stamps {
        // Day 0 is that of all slots that were never written.
        Stamps { slots: vec![0; bound], today: 0 }
    }

    fn forget(&mut self) {
        if self.today == u32::MAX {
            self.slots.fill(0);
            self.today = 0;
        }
        self.today += 1;
    }

    #[inline]
    fn put(&mut self, x: u32, number: u32) {
        self.slots[x as usize] = u64::from(self.today) << 32 | u64::from(number);
    }

    /// Puts `number` if there is none, and says so.
    #[inline]
    fn put_first(&mut self, x: u32, number: u32) -> bool {
        let slot = &mut self.slots[x as usize];
        let first = (*slot >> 32) as u32 != self.today;
        let new = u64::from(self.today) << 32 | u64::from(number);
        // Without a branch: which way it goes cannot be guessed.
        *slot = if first { new } else { *slot };
        first
    }

    /// The number of `x`, `otherwise` if it has none.
    #[inline]
    fn get_or(&self, x: u32, otherwise: u32) -> u32 {
        let slot = self.slots[x as usize];
        if (slot >> 32) as u32 == self.today { slot as u32 } else { otherwise }
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
        let (mesh, per_unit) = (self.mesh, 1.0 / self.scale.length(1.0));
        let near = self.gather(v, radius * self.scale.length(1.0), scratch);
        let Scratch { patch, met, faces, .. } = scratch;
        let met = &met[..near.most];
        patch.make_room(met.len());
        faces.forget();
        let origin = mesh.position(v);
        let inverse2 = 1.0 / (radius * radius);
        let mut count = 0;
        for (i, &f) in met.iter().enumerate() {
            let area = self.faces.areas[f as usize] * (per_unit * per_unit);
            let [a, b, c] = mesh.corners[f as usize];
            let place = |u: u32| (mesh.position(u) - origin) * per_unit;
            let corners = [place(a), place(b), place(c)];
            let centre = (corners[0] + corners[1] + corners[2]) * (1.0 / 3.0);
            let distance2 = centre.dot(centre);
            let least = if i < near.own { LEAST_NEARNESS } else { 0.0 };
            let nearness = 1.0 - distance2 * inverse2;
            let nearness = if nearness > least { nearness } else { least };
            if area > 0.0 && (nearness > 0.0 || i < near.all) {
                faces.put(f, count as u32);
                patch.ids[count] = f;
                patch.centres.set(count, centre);
                patch.normals.set(count, self.normals[f as usize]);
                patch.weights[count] = area * nearness * nearness;
                patch.near_weights[count] = area / (1.0 + distance2);
                patch.moments[count] = moments(corners, centre);
                count += 1;
            }
            // Until the last of them has come in.
            if i < near.own {
                patch.own = count;
            }
            if i < near.all {
                patch.near = count;
            }
        }
        patch.count = count;
        patch.join(mesh, faces);
        self.orient(v, patch);
    }

    /// The faces around the vertices that one-ring steps inside `radius` (mesh units) lead to through no hub: the first
    /// ones of `scratch.met`.
    fn gather(&self, v: u32, radius: f64, scratch: &mut Scratch) -> Near {
        let Scratch { ball, vertices, faces, met, .. } = scratch;
        let origin = self.mesh.position(v);
        let radius2 = radius * radius;
        vertices.forget();
        faces.forget();
        vertices.put(v, 0);
        make_room(ball, 1);
        ball[0] = v;
        let (mut count, mut next, mut ring_end) = (1, 0, 1);
        let mut near = Near { own: 0, all: 0, most: 0 };
        while next < count {
            let u = ball[next];
            if !self.mesh.is_hub(u) {
                let ring = self.mesh.ring_of(u);
                make_room(ball, count + ring.len());
                for &w in ring {
                    let e = self.mesh.position(w) - origin;
                    // Without branches, as in `put_first`.
                    ball[count] = w;
                    let inside = e.dot(e) <= radius2;
                    count += usize::from(vertices.put_first(w, 0) & inside & (count < method::FIT_MOST));
                }
                let around = self.faces_around(u);
                make_room(met, near.most + around.len());
                for &f in around {
                    met[near.most] = f;
                    near.most += usize::from(faces.put_first(f, 0));
                }
            }
            if next == 0 {
                (ring_end, near.own) = (count, near.most);
            }
            next += 1;
            if next == ring_end {
                near.all = near.most;
            }
        }
        near
    }

    /// Faces around `u`, whose refined normals must be known.
    fn faces_around(&self, u: u32) -> &[u32] {
        // Reading this is how debug builds notice a patch that reaches farther than the halo.
        self.known.get(u);
        self.mesh.faces_of(u)
    }

    /// Turns the normals to the side of the vertex normal where windings disagree, face by face over edges.
    fn orient(&self, v: u32, patch: &mut Patch) {
        let opposed_to = |i: u32, patch: &Patch| self.faces.opposed_to(patch.ids[i as usize]);
        if self.faces.opposed.is_none() || (0..patch.len() as u32).all(|i| opposed_to(i, patch).is_empty()) {
            return;
        }
        let vote = self.votes.get(v);
        let up = vote.t.cross(vote.b);
        let mut todo: Vec<u32> = (0..patch.own as u32).collect();
        let mut turned: Vec<Option<bool>> = vec![None; patch.len()];
        todo.iter().for_each(|&i| turned[i as usize] = Some(patch.normals.get(i as usize).dot(up) < 0.0));
        let mut next = 0;
        while next < todo.len() {
            let i = todo[next];
            next += 1;
            let opposed = opposed_to(i, patch);
            patch.beside(i, |j| {
                if turned[j as usize].is_none() {
                    let other = opposed.contains(&patch.ids[j as usize]);
                    turned[j as usize] = turned[i as usize].map(|t| t != other);
                    todo.push(j);
                }
            });
        }
        for (i, _) in turned.into_iter().enumerate().filter(|(_, turned)| *turned == Some(true)) {
            patch.normals.set(i, -patch.normals.get(i));
        }
    }
}

/// How many faces of a list are around the vertex, around it or its one-ring, and in the list: each the first ones.
struct Near {
    own: usize,
    all: usize,
    most: usize,
}

impl Patch {
    /// Number of faces.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Barycentres.
    pub fn centres(&self) -> [&[f64]; 3] {
        self.centres.first(self.count)
    }

    /// Refined unit normals.
    pub fn normals(&self) -> [&[f64]; 3] {
        self.normals.first(self.count)
    }

    /// One of them.
    #[inline]
    pub fn normal(&self, i: usize) -> DVec3 {
        self.normals.get(i)
    }

    /// Areas times a weight that falls from 1 at the vertex to 0 at the radius.
    pub fn weights(&self) -> &[f64] {
        &self.weights[..self.count]
    }

    /// Area over 1 + distance^2, of the faces around the vertex and its one-ring: the first ones of the patch.
    pub fn near(&self) -> &[f64] {
        &self.near_weights[..self.near]
    }

    /// What planes are fitted to.
    pub fn moments(&self) -> &[Moments] {
        &self.moments[..self.count]
    }

    /// Room for `count` faces; none is there.
    fn make_room(&mut self, count: usize) {
        (self.count, self.own, self.near) = (0, 0, 0);
        [&mut self.centres, &mut self.normals].into_iter().for_each(|axes| axes.make_room(count));
        [&mut self.weights, &mut self.near_weights].into_iter().for_each(|list| make_room(list, count));
        make_room(&mut self.moments, count);
        make_room(&mut self.ids, count);
        make_room(&mut self.beside, count);
    }

    /// Finds the faces that share edges, by the place of each.
    fn join(&mut self, mesh: &TileMesh, places: &Stamps) {
        let Patch { count, ids, beside, crowded, .. } = self;
        let nobody = *count as u32;
        crowded.clear();
        for (i, (&f, beside)) in ids[..*count].iter().zip(beside).enumerate() {
            for (side, place) in beside.iter_mut().enumerate() {
                *place = match mesh.across.beyond(f, side) {
                    Beyond::Nothing => nobody,
                    Beyond::One(g) => places.get_or(g, nobody),
                    Beyond::Several => {
                        mesh.faces_beyond(f, side, |g| match places.get_or(g, nobody) {
                            j if j == nobody => (),
                            j => crowded.push((i as u32, j)),
                        });
                        nobody
                    }
                };
            }
        }
    }

    /// Calls `visit` with each face that shares an edge with face `i`.
    #[inline]
    fn beside(&self, i: u32, mut visit: impl FnMut(u32)) {
        let nobody = self.len() as u32;
        self.beside[i as usize].iter().filter(|&&j| j != nobody).for_each(|&j| visit(j));
        let first = self.crowded.partition_point(|pair| pair.0 < i);
        self.crowded[first..].iter().take_while(|pair| pair.0 == i).for_each(|pair| visit(pair.1));
    }

    /// Finds the faces of positive weight that are connected over edges to those around the vertex or, if it has none, to
    /// those around its one-ring.
    pub fn connect(&self, side: &mut Side) {
        let Side { weights, faces, open, .. } = side;
        make_room(open, self.len() + 1);
        make_room(faces, self.len() + 1);
        // The last is nobody's place; behind the last face is room for what may not come in.
        let (open, faces) = (&mut open[..=self.len()], &mut faces[..=self.len()]);
        open.iter_mut().zip(&*weights).for_each(|(open, &weight)| *open = u8::from(weight > 0.0));
        open[self.len()] = 0;
        let mut meet = |j: u32, count: &mut usize, faces: &mut [u32]| {
            // Every face comes in once. Without a branch: which way it goes cannot be guessed.
            faces[*count] = j;
            *count += usize::from(std::mem::take(&mut open[j as usize]));
        };
        let mut count = 0;
        (0..self.own as u32).for_each(|i| meet(i, &mut count, faces));
        if count == 0 {
            (0..self.near as u32).for_each(|i| meet(i, &mut count, faces));
        }
        let mut next = 0;
        while next < count {
            let i = faces[next];
            next += 1;
            self.beside[i as usize].iter().for_each(|&j| meet(j, &mut count, faces));
            if !self.crowded.is_empty() {
                self.beside(i, |j| meet(j, &mut count, faces));
            }
        }
        side.count = count;
    }
}

/// A part of a patch that a plane may be fitted to.
#[derive(Default)]
pub(super) struct Side {
    /// The weight of each face of the patch.
    pub weights: Vec<f64>,
    /// Places of the connected faces in the patch; the first `count` of them.
    faces: Vec<u32>,
    count: usize,
    /// 1 for a face of positive weight that was not met yet.
    open: Vec<u8>,
}

impl Side {
    /// Places of the connected faces in the patch, as steps over edges lead to them. That order is one of ids and corners,
    /// and so the same in every tile.
    pub fn faces(&self) -> &[u32] {
        &self.faces[..self.count]
    }
}
