//! From votes to what a vertex may be: local threshold, corner, boundary.
//!
//! In: votes. Out: the threshold of each vertex's surroundings and whether they are calm, and, where a trace may reach,
//! whether lines stop.

use super::levels::Levels;
use super::tensor::Vote;
use crate::config::method;
use crate::math::DEGREE;
use crate::mesh::{Beyond, Field, TileMesh};
use crate::partition::{Plan, Rings};
use rayon::prelude::*;

/// What lines do at a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stop {
    /// The tensor has a ball part: several creases meet.
    pub corner: bool,
    /// An edge with one face ends here.
    pub boundary: bool,
    /// So many faces meet here that nobody looks through.
    pub hub: bool,
}

impl Stop {
    /// Whether a walk ends here, supported.
    #[inline]
    pub fn any(self) -> bool {
        self.corner || self.boundary || self.hub
    }
}

/// What the surroundings of a vertex are like.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Surroundings {
    /// Local threshold on the fold angle, radians.
    pub threshold: f64,
    /// Nothing is steep here that a larger scale could blur.
    pub calm: bool,
    /// Further tensor votes.
    pub further: usize,
}

/// Vertices whose folds one parallel task sorts into cubes.
const CHUNK: usize = 4096;

/// Surroundings at `at`, from the background fold: `votes` of every vertex of `voted` enter, which holds all that the levels
/// need. `rounds` is K of each vertex. The threshold is a multiple of the background, within fixed limits.
pub fn surroundings(
    mesh: &TileMesh,
    plan: &Plan,
    votes: &Field<Vote>,
    voted: &Rings,
    rounds: &[u32],
    at: &[u32],
) -> Field<Surroundings> {
    let fold = |&v: &u32| (mesh.position(v), votes.get(v).theta);
    let levels =
        Levels::new(&plan.lattice, voted.within(0).par_chunks(CHUNK).map(|chunk| chunk.iter().map(fold)));
    let position = |i| mesh.position(at[i]);
    let background = levels.at_each(&plan.lattice, at.len(), position, method::BACKGROUND_QUANTILE);
    let mut table = vec![0.0; mesh.vertex_count()];
    at.iter().zip(background).for_each(|(&v, b)| table[v as usize] = b);
    Field::compute(mesh.vertex_count(), at, |v| {
        let usual = method::THRESHOLD_BACKGROUND * table[v as usize];
        let calm = usual < method::CALM_DEG * DEGREE;
        let further = if calm { plan.scale.further_votes(rounds[v as usize]) } else { 0 };
        let threshold = (usual * (1.0 + method::FURTHER_BACKGROUND * further as f64))
            .clamp(method::THRESHOLD_MIN_DEG * DEGREE, method::THRESHOLD_MAX_DEG * DEGREE);
        Surroundings { threshold, calm, further }
    })
}

/// Corners, boundary vertices and hubs among `at`.
pub fn stops(mesh: &TileMesh, votes: &Field<Vote>, at: &[u32]) -> Field<Stop> {
    Field::compute(mesh.vertex_count(), at, |v| {
        let vote = votes.get(v);
        let plate = 2.0 * vote.near();
        let corner = vote.phi >= method::CORNER_MIN_DEG * DEGREE && vote.phi >= method::CORNER_RATIO * plate;
        Stop { corner, boundary: on_boundary(mesh, v), hub: mesh.is_hub(v) }
    })
}

/// Whether an edge at `v` has a single face.
pub fn on_boundary(mesh: &TileMesh, v: u32) -> bool {
    mesh.faces_of(v).iter().any(|&f| mesh.beyond_at(f, v).contains(&Beyond::Nothing))
}
