//! From votes to what a vertex may be: local threshold, corner, boundary.
//!
//! In: votes. Out, at each vertex that a trace may reach: the threshold of its surroundings and whether lines stop here.

use super::levels::Levels;
use super::tensor::Vote;
use crate::config::method;
use crate::math::DEGREE;
use crate::mesh::{EdgeUse, Field, TileMesh};
use crate::partition::{Cube, Lattice, Rings};

/// What lines do at a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stop {
    /// The tensor has a ball part: several creases meet.
    pub corner: bool,
    /// An edge with one face ends here.
    pub boundary: bool,
}

impl Stop {
    /// Whether a walk ends here, supported.
    #[inline]
    pub fn any(self) -> bool {
        self.corner || self.boundary
    }
}

/// Thresholds in radians at `at`: a multiple of the background fold of the surroundings, within fixed limits. `voted`
/// holds every vertex whose theta enters.
pub fn thresholds(
    mesh: &TileMesh,
    lattice: &Lattice,
    votes: &Field<Vote>,
    voted: &Rings,
    at: &[u32],
) -> Field<f64> {
    let folds = voted.within(0).iter().map(|&v| (mesh.position(v), votes.get(v).theta));
    let levels = Levels::new(lattice, folds);
    let cubes: Vec<Cube> = at.iter().map(|&v| lattice.cube_of(mesh.position(v))).collect();
    let background = levels.at_each(&cubes, method::BACKGROUND_QUANTILE);
    let mut table = vec![0.0; mesh.vertex_count()];
    at.iter().zip(background).for_each(|(&v, b)| table[v as usize] = b);
    Field::compute(mesh.vertex_count(), at, |v| {
        (method::THRESHOLD_BACKGROUND * table[v as usize])
            .clamp(method::THRESHOLD_MIN_DEG * DEGREE, method::THRESHOLD_MAX_DEG * DEGREE)
    })
}

/// Corners and boundary vertices among `at`.
pub fn stops(mesh: &TileMesh, votes: &Field<Vote>, at: &[u32]) -> Field<Stop> {
    Field::compute(mesh.vertex_count(), at, |v| {
        let vote = votes.get(v);
        let plate = 2.0 * crate::math::half_fold(vote.eigenvalues[1]);
        let corner = vote.phi >= method::CORNER_MIN_DEG * DEGREE && vote.phi >= method::CORNER_RATIO * plate;
        Stop { corner, boundary: on_boundary(mesh, v) }
    })
}

/// Whether an edge at `v` has a single face.
pub(super) fn on_boundary(mesh: &TileMesh, v: u32) -> bool {
    // Around an inner vertex of a manifold there are as many neighbours as faces; only then is a closer look worth it.
    let (faces, ring) = (mesh.faces_of(v), mesh.ring_of(v));
    if ring.len() > faces.len() {
        return true;
    }
    let mut uses: Vec<EdgeUse> = Vec::with_capacity(2 * faces.len());
    mesh.edge_uses(v, &mut uses);
    uses.chunk_by(|a, b| a.other == b.other).any(|edge| edge.len() == 1)
}
