//! Step B: refined normals vote into tensors at the vertices, and the tensors vote again.
//!
//! In: refined normals. Out, at each vertex: the eigenvalue ratios of its own tensor, the fold angle seen at two or three scales,
//! and the direction of the line through it. The weights are those of Kim, Choi and Lee (2009); the second vote is what
//! Guy and Medioni (1997) ask of tokens, done on the one-ring so that it stays connected and cheap.

use super::classify::Surroundings;
use super::normals::FaceGeometry;
use crate::config::method;
use crate::math::{Sym3, half_fold, unit};
use crate::mesh::{Field, TileMesh};
use crate::partition::{Rings, Scale};
use glam::DVec3;

/// What the tensors say of a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vote {
    /// Eigenvalues of the vertex's own tensor, divided by the largest: l1 >= l2 >= l3 >= 0; l1 is 1, or 0 where nothing
    /// voted. The paper method divides them by their 2-norm.
    pub eigenvalues: [f64; 3],
    /// Fold angle in radians, the mean of two or three scales; the paper method has one.
    pub theta: f64,
    /// Half the fold angle that the repeated vote shows, in radians; 0 where there is none.
    pub far: f64,
    /// Ball part of the vertex's own tensor as an angle in radians: large at corners.
    pub phi: f64,
    /// Unit direction of the line, in the tangent plane.
    pub t: DVec3,
    /// Unit direction across the line, in the tangent plane.
    pub b: DVec3,
}

impl Vote {
    /// (l2 + l3) / 2 of eigenvalues that were divided by the largest: 0 on a plane, at most 1.
    pub fn omega(&self) -> f64 {
        (self.eigenvalues[1] + self.eigenvalues[2]) / 2.0
    }

    /// Half the fold angle that the vertex's own tensor shows, in radians.
    pub fn near(&self) -> f64 {
        half_fold(self.eigenvalues[1])
    }
}

/// A tensor with the weighted mean of the normals it was made of.
#[derive(Clone, Copy, Debug, Default)]
pub struct Token {
    /// Sum of the weighted outer products of the normals.
    pub tensor: Sym3,
    /// Sum of the weighted normals; not of unit length.
    pub normal: DVec3,
}

/// Votes of the faces around each vertex of `voted`.
pub fn first_votes(
    mesh: &TileMesh,
    faces: &FaceGeometry,
    normals: &[DVec3],
    scale: &Scale,
    voted: &Rings,
) -> Field<Token> {
    Field::compute(mesh.vertex_count(), voted.all(), |v| first_vote(mesh, faces, normals, scale, v))
}

fn first_vote(mesh: &TileMesh, faces: &FaceGeometry, normals: &[DVec3], scale: &Scale, v: u32) -> Token {
    gather(mesh, faces, normals, v, mesh.faces_of(v), scale.length(1.0)) // sigma / 3
}

/// The votes of the faces `around` (ascending) at `v`, by area and by distance: exp(-|c - v| / `falloff`).
pub(super) fn gather(
    mesh: &TileMesh,
    faces: &FaceGeometry,
    normals: &[DVec3],
    v: u32,
    around: &[u32],
    falloff: f64,
) -> Token {
    let largest = around.iter().fold(0.0, |m: f64, &f| m.max(faces.areas[f as usize]));
    let mut token = Token::default();
    if largest <= 0.0 {
        return token;
    }
    let origin = mesh.position(v);
    // Only where windings disagree: normals are turned to the side of the first face, so that they do not cancel.
    let side = around
        .iter()
        .any(|&f| !faces.opposed_to(f).is_empty())
        .then(|| around.iter().map(|&f| normals[f as usize]).find(|n| *n != DVec3::ZERO))
        .flatten();
    for &f in around {
        // Relative to v, so that a mesh far from the origin loses no digits.
        let [a, b, c] = mesh.corners[f as usize].map(|u| mesh.position(u) - origin);
        let d = (a + b + c) / 3.0;
        let weight = faces.areas[f as usize] / largest * libm::exp(-d.dot(d).sqrt() / falloff);
        let n = normals[f as usize];
        token.tensor.add(&Sym3::outer(n, weight));
        let turned = side.is_some_and(|s| s.dot(n) < 0.0);
        token.normal += if turned { -n } else { n } * weight;
    }
    token
}

/// Lets the tensors vote over the one-ring as often as the scale asks for: T <- 2 T + sum over the one-ring.
pub fn vote_again(mesh: &TileMesh, tokens: &Field<Token>, scale: &Scale, voted: &Rings) -> Field<Sym3> {
    let n = mesh.vertex_count();
    let rounds = scale.rounds(method::REVOTES);
    let mut tensors = Field::compute(n, voted.all(), |v| tokens.get(v).tensor);
    for round in 1..=rounds {
        tensors = Field::compute(n, voted.within(rounds - round), |v| {
            let mut sum = tensors.get(v).scaled(2.0);
            mesh.ring_of(v).iter().for_each(|&u| sum.add(&tensors.get(u)));
            sum
        });
    }
    tensors
}

/// Reads both tensors of each vertex.
pub fn votes(mesh: &TileMesh, tokens: &Field<Token>, again: &Field<Sym3>, voted: &Rings) -> Field<Vote> {
    Field::compute(mesh.vertex_count(), voted.within(0), |v| {
        let token = tokens.get(v);
        let eigenvalues = normalised(token.tensor.eigenvalues());
        let wide = again.get(v).eigen();
        let normal = unit(token.normal);
        let along = wide.vectors[2];
        let t = unit(along - normal * along.dot(normal));
        let far = half_fold(normalised(wide.values)[1]);
        Vote {
            eigenvalues,
            theta: half_fold(eigenvalues[1]) + far,
            far,
            phi: 2.0 * half_fold(eigenvalues[2]),
            t,
            b: normal.cross(t),
        }
    })
}

/// Lets the tensors of calm vertices vote further, each as often as its surroundings ask for, and takes what they show as a
/// third scale of theta. `folded` holds a ring for each vote, and is where votes are known afterwards.
pub fn widen(
    mesh: &TileMesh,
    votes: &mut Field<Vote>,
    again: Field<Sym3>,
    surroundings: &Field<Surroundings>,
    folded: &Rings,
) {
    let n = mesh.vertex_count();
    let rounds = folded.rings();
    let mut tensors = again;
    for round in 1..=rounds {
        tensors = Field::compute(n, folded.within(rounds - round), |v| {
            let own = tensors.get(v);
            let further = surroundings.get(v).further;
            debug_assert!(further <= rounds, "further vote {further} lies outside what the halo covers");
            if further < round {
                return own;
            }
            let mut sum = own.scaled(2.0);
            mesh.ring_of(v).iter().for_each(|&u| sum.add(&tensors.get(u)));
            // Six neighbours and two own votes: whoever stands still keeps the same weight.
            sum.scaled(1.0 / 8.0)
        });
    }
    let asked = |v: &u32| surroundings.get(*v).further > 0;
    let calm: Vec<u32> = folded.within(0).iter().copied().filter(asked).collect();
    votes.restrict(folded.within(0));
    votes.revise(&calm, |vote, v| {
        let widest = half_fold(normalised(tensors.get(v).eigenvalues())[1]);
        Vote { theta: (vote.near() + vote.far + widest) * (2.0 / 3.0), ..vote }
    });
}

/// Eigenvalues divided by the largest. Rounding may leave a zero slightly negative.
pub(super) fn normalised(values: [f64; 3]) -> [f64; 3] {
    let values = values.map(|x| x.max(0.0));
    values.map(|x| x / values[0].max(1e-300))
}
