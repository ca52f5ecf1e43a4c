//! Step A, first half: normals, and how noisy they are.
//!
//! In: a tile mesh. Out: unit normals, areas, and the local noise level s0 as a number K of rounds of refinement.

use super::levels::{Levels, at_each};
use crate::config::method;
use crate::mesh::{Beyond, Csr, EdgeUse, TileMesh};
use crate::partition::{Lattice, Region, Scale};
use glam::DVec3;
use rayon::prelude::*;

/// Normals and areas of all faces that were loaded.
pub struct FaceGeometry {
    /// Unit normal; zero for a degenerate face.
    pub normals: Vec<DVec3>,
    /// Area in square mesh units; zero for a degenerate face.
    pub areas: Vec<f64>,
    /// For each face, the faces that run along a common edge in the same direction, which they should not; almost always
    /// none.
    pub opposed: Option<Csr>,
}

impl FaceGeometry {
    /// Computes normals and areas, and finds neighbours of opposite winding.
    pub fn new(mesh: &TileMesh, scale: &Scale) -> FaceGeometry {
        let (normals, areas) = mesh
            .corners
            .par_iter()
            .map(|corners| {
                let [a, b, c] = corners.map(|v| mesh.position(v));
                let cross = (b - a).cross(c - a);
                let length = cross.dot(cross).sqrt();
                if length <= scale.degenerate() { (DVec3::ZERO, 0.0) } else { (cross / length, 0.5 * length) }
            })
            .unzip();
        FaceGeometry { normals, areas, opposed: opposed_faces(mesh) }
    }

    /// Faces that are wound against `f`; almost always none.
    #[inline]
    pub fn opposed_to(&self, f: u32) -> &[u32] {
        self.opposed.as_ref().map_or(&[], |opposed| opposed.row(f))
    }
}

/// The normal of `g` as a face with normal `own` should count it: turned round if the two are wound against each other
/// (`g` is among `opposed`) and disagree.
#[inline]
pub(super) fn seen_from(own: DVec3, opposed: &[u32], g: u32, normal: DVec3) -> DVec3 {
    if !opposed.is_empty() && own.dot(normal) < 0.0 && opposed.contains(&g) { -normal } else { normal }
}

/// Pairs of faces that traverse a common edge in the same direction.
fn opposed_faces(mesh: &TileMesh) -> Option<Csr> {
    // Almost always there is none, and that is seen much faster than which there are.
    let vertices = (0..mesh.vertex_count() as u32).into_par_iter().with_min_len(CHUNK);
    if !vertices.map_init(Vec::new, |scratch, v| mesh.is_opposed(v, scratch)).any(|opposed| opposed) {
        return None;
    }
    let mut pairs: Vec<(u32, u32)> = edges(mesh, |_, uses, out| {
        for (i, a) in uses.iter().enumerate() {
            let same = uses[i + 1..]
                .iter()
                .take_while(|b| b.other() == a.other())
                .filter(|b| b.outward() == a.outward());
            same.for_each(|b| out.extend([(a.face(), b.face()), (b.face(), a.face())]));
        }
    });
    pairs.sort_unstable();
    pairs.dedup();
    let mut lengths = vec![0u32; mesh.face_count()];
    pairs.iter().for_each(|(f, _)| lengths[*f as usize] += 1);
    Some(Csr::from_rows(lengths.into_iter(), pairs.into_iter().map(|(_, g)| g).collect()))
}

/// Vertices handled by one parallel task.
const CHUNK: usize = 4096;

/// Runs `visit` over the edges from every vertex to those above it, in parallel, and joins what it pushes in vertex order.
pub(super) fn edges<T: Send>(mesh: &TileMesh, visit: impl Fn(u32, &[EdgeUse], &mut Vec<T>) + Sync) -> Vec<T> {
    let vertices: Vec<u32> = (0..mesh.vertex_count() as u32).collect();
    let parts: Vec<Vec<T>> = vertices
        .par_chunks(CHUNK)
        .map(|chunk| {
            let (mut uses, mut out) = (Vec::new(), Vec::new());
            for &v in chunk {
                mesh.edges_upwards(v, &mut uses);
                visit(v, &uses, &mut out);
            }
            out
        })
        .collect();
    parts.into_iter().flatten().collect()
}

/// The local noise: s0 and the number of refinement rounds it asks for.
pub struct Noise<'a> {
    levels: Levels,
    lattice: &'a Lattice,
    region: &'a Region,
}

impl<'a> Noise<'a> {
    /// Collects the chords |n_f - n_g| over edges with two faces, at the middles of the edges. An edge of a degenerate face
    /// has no chord.
    pub fn new(mesh: &TileMesh, faces: &FaceGeometry, lattice: &'a Lattice, region: &'a Region) -> Noise<'a> {
        let chord = &|f: u32, side: usize| match mesh.across.beyond(f, side) {
            Beyond::One(g) if g > f && faces.areas[f as usize] > 0.0 && faces.areas[g as usize] > 0.0 => {
                let (nf, ng) = (faces.normals[f as usize], faces.normals[g as usize]);
                let corners = mesh.corners[f as usize];
                let (a, b) = (corners[side], corners[(side + 1) % 3]);
                let d = nf - seen_from(nf, faces.opposed_to(f), g, ng);
                Some((0.5 * (mesh.position(a) + mesh.position(b)), d.dot(d).sqrt()))
            }
            _ => None,
        };
        let count = mesh.face_count();
        let chords = (0..count.div_ceil(CHUNK)).into_par_iter().map(|chunk| {
            let faces = (chunk * CHUNK) as u32..count.min((chunk + 1) * CHUNK) as u32;
            faces.flat_map(|f| (0..3).filter_map(move |side| chord(f, side)))
        });
        Noise { levels: Levels::new(lattice, chords), lattice, region }
    }

    /// s0 at each position, `None` where the region does not hold all that it depends on.
    pub fn levels_at(&self, positions: &[DVec3]) -> Vec<Option<f64>> {
        let level = |c| self.region.covers_level(c).then(|| self.levels.at(c, method::NOISE_QUANTILE));
        at_each(self.lattice, positions.len(), |i| positions[i], level)
    }
}

/// K: how many refinement rounds a noise of `s0` asks for.
pub fn rounds(scale: &Scale, s0: f64) -> u32 {
    let most = scale.rounds(method::REFINE_ROUNDS) as f64;
    (method::REFINE_SLOPE * s0 * scale.k * scale.k + 0.5).floor().min(most) as u32
}
