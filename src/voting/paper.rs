//! The first stage of the paper method: normals vote once, over a cube, and eigenvalues say what a vertex is.
//!
//! In: a tile mesh with its normals as they are. Out, at each vertex: the tensor of the faces in its neighbourhood N_T, and
//! from its eigenvalues whether it lies on a face, a sharp edge or a corner, and how sharp that is (Omega).
//!
//! Tensors, weights and classes are those of Kim, Choi and Lee (2009) and Wang et al. (2012), who scale eigenvalues to a
//! 2-norm of 1. N_T(v) are the faces whose barycentre lies in the cube of edge sigma around v, as far as steps over common
//! edges inside it lead there from the one-ring; and the one-ring itself, whose faces need not lie in the cube.

use super::classify::{Stop, on_boundary};
use super::normals::{FaceGeometry, edges};
use super::tensor::{Vote, gather, normalised};
use crate::config::PaperThresholds;
use crate::math::{half_fold, unit};
use crate::mesh::{Csr, Field, TileMesh};
use crate::partition::{Loaded, Scale};
use glam::DVec3;
use std::collections::HashSet;

/// Which faces vote at a vertex.
pub struct Voters<'a> {
    tile: &'a Loaded<'a>,
    /// Half the edge of the cube in mesh units; none where the one-ring votes alone.
    half_cube: Option<f64>,
    /// For each face the faces that share an edge with it; all of them where the edge is not manifold.
    across: Csr,
}

impl<'a> Voters<'a> {
    /// Over the cube of edge 2 `half_cube`, or over the one-ring alone.
    pub fn new(tile: &'a Loaded<'a>, half_cube: Option<f64>) -> Voters<'a> {
        let across = match half_cube {
            Some(_) => faces_across(tile.mesh),
            None => Csr::from_rows(std::iter::empty(), Vec::new()),
        };
        Voters { tile, half_cube, across }
    }

    /// N_T(v), by ascending ids.
    pub fn of(&self, v: u32) -> Vec<u32> {
        let mesh = self.tile.mesh;
        let mut found = mesh.faces_of(v).to_vec();
        let Some(half) = self.half_cube else { return found };
        debug_assert!(
            self.tile.holds_cube(mesh.position(v), half),
            "the cube around {} lies outside what the halo covers",
            mesh.id(v)
        );
        let mut seen: HashSet<u32> = found.iter().copied().collect();
        let mut next = 0;
        while next < found.len() {
            for &g in self.across.row(found[next]) {
                if seen.insert(g) && from_vertex(mesh, g, v).abs().max_element() <= half {
                    found.push(g);
                }
            }
            next += 1;
        }
        found.sort_unstable_by_key(|&f| mesh.face_ids[f as usize]);
        found
    }

    /// By how much a vote fades with distance: e-fold over this length, in mesh units.
    fn falloff(&self, v: u32, scale: &Scale) -> f64 {
        match self.half_cube {
            Some(_) => scale.length(1.0), // sigma / 3
            None => {
                let mesh = self.tile.mesh;
                let side = |&u: &u32| (mesh.position(u) - mesh.position(v)).length();
                mesh.ring_of(v).iter().map(side).fold(0.0, f64::max)
            }
        }
    }
}

/// The barycentre of face `f` as seen from `v`: from differences, so that a mesh far from the origin loses no digits.
fn from_vertex(mesh: &TileMesh, f: u32, v: u32) -> DVec3 {
    let [a, b, c] = mesh.corners[f as usize].map(|u| mesh.position(u) - mesh.position(v));
    (a + b + c) / 3.0
}

/// The faces that share an edge with each face.
fn faces_across(mesh: &TileMesh) -> Csr {
    let mut pairs: Vec<(u32, u32)> = edges(mesh, |_, uses, out| {
        for edge in uses.chunk_by(|a, b| a.other() == b.other()) {
            for a in edge {
                out.extend(edge.iter().filter(|b| b.face() != a.face()).map(|b| (a.face(), b.face())));
            }
        }
    });
    pairs.sort_unstable();
    pairs.dedup();
    let mut lengths = vec![0u32; mesh.face_count()];
    pairs.iter().for_each(|(f, _)| lengths[*f as usize] += 1);
    Csr::from_rows(lengths.into_iter(), pairs.into_iter().map(|(_, g)| g).collect())
}

/// The votes of the faces in N_T of each vertex of `at`. In a [`Vote`] of this method the eigenvalues have a 2-norm of 1,
/// `t` is the last eigenvector as it is, and `theta` is the fold angle of an even plate tensor with these eigenvalues.
pub fn paper_votes(voters: &Voters, faces: &FaceGeometry, scale: &Scale, at: &[u32]) -> Field<Vote> {
    let mesh = voters.tile.mesh;
    Field::compute(mesh.vertex_count(), at, |v| {
        let token = gather(mesh, faces, &faces.normals, v, &voters.of(v), voters.falloff(v, scale));
        let eigen = token.tensor.eigen();
        let eigenvalues = of_norm_one(eigen.values);
        let fold = |l: f64| 2.0 * half_fold(l / eigenvalues[0].max(f64::MIN_POSITIVE));
        let t = eigen.vectors[2];
        Vote {
            eigenvalues,
            theta: fold(eigenvalues[1]),
            far: 0.0,
            phi: fold(eigenvalues[2]),
            t,
            b: unit(token.normal.cross(t)),
        }
    })
}

/// Eigenvalues divided by the root of the sum of their squares; zeros stay. By the largest first, so that squares of votes
/// from far away do not vanish.
fn of_norm_one(values: [f64; 3]) -> [f64; 3] {
    let [l1, l2, l3] = normalised(values);
    let norm = (l1 * l1 + l2 * l2 + l3 * l3).sqrt().max(f64::MIN_POSITIVE);
    [l1 / norm, l2 / norm, l3 / norm]
}

/// What the eigenvalues say of a vertex before its neighbours are asked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Initial {
    /// One direction of normals.
    #[default]
    Face,
    /// Two.
    SharpEdge,
    /// Three.
    Corner,
}

impl Initial {
    /// From eigenvalues of 2-norm 1, descending.
    pub fn of(eigenvalues: [f64; 3], thresholds: &PaperThresholds) -> Initial {
        let [_, l2, l3] = eigenvalues;
        if l3 >= thresholds.corner_l3 {
            Initial::Corner
        } else if l2 >= thresholds.edge_l2 {
            Initial::SharpEdge
        } else {
            Initial::Face
        }
    }
}

/// Omega = (l1 + l2 + l3) / 2 - 1/2, of eigenvalues of 2-norm 1: 0 on a plane, 0.207 on the edge of a box, 0.366 at its
/// corner. 0 where nothing voted.
pub fn omega(eigenvalues: [f64; 3]) -> f64 {
    let [l1, l2, l3] = eigenvalues;
    if l1 > 0.0 { ((l1 + l2 + l3) / 2.0 - 0.5).max(0.0) } else { 0.0 }
}

/// Corners and boundary vertices among `at`.
pub fn paper_stops(
    mesh: &TileMesh,
    votes: &Field<Vote>,
    thresholds: &PaperThresholds,
    at: &[u32],
) -> Field<Stop> {
    Field::compute(mesh.vertex_count(), at, |v| Stop {
        corner: Initial::of(votes.get(v).eigenvalues, thresholds) == Initial::Corner,
        boundary: on_boundary(mesh, v),
        hub: mesh.is_hub(v),
    })
}
