//! Step C: neighbour supporting and weak-feature enhancing (Wang et al. 2012).
//!
//! In: votes, contrast, thresholds, smoothed positions. Out: the salience S of a vertex is the mean fold angle along the line through it, so
//! that a chance fold without neighbours fades and a weak crease that goes on does not. Measured against the threshold
//! of its own surroundings rather than against the strongest edge of the model, weak features stand out.

use super::walk::{ahead, turn};
use crate::config::method;
use crate::math::DEGREE;
use crate::mesh::{Field, TileMesh};
use crate::voting::{Stop, Surroundings, Vote};
use glam::DVec3;

/// What the traces read.
pub struct Evidence<'a> {
    /// The mesh.
    pub mesh: &'a TileMesh,
    /// Fold angles and directions.
    pub votes: &'a Field<Vote>,
    /// Contrast, radians; where traces look at it ([`traceable`]).
    pub contrast: &'a Field<f64>,
    /// Where the traces take the vertices to be.
    pub positions: &'a Field<DVec3>,
    /// Local thresholds.
    pub surroundings: &'a Field<Surroundings>,
    /// Where lines stop.
    pub stops: &'a Field<Stop>,
}

/// Support of a vertex by the line through it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Support {
    /// S: mean fold angle along the line, radians; of the paper method the salience, without a unit.
    pub salience: f64,
    /// SC: mean contrast along the line, radians.
    pub contrast: f64,
    /// q = S / threshold.
    pub measure: f64,
}

impl Support {
    /// Of a method that measures salience alone: no contrast is taken off.
    pub(super) fn of_salience(salience: f64, measure: f64) -> Support {
        Support { salience, contrast: salience, measure: measure.min(MEASURE_CAP) }
    }

    /// No smooth surface folds that much in a ring.
    fn sure(&self) -> bool {
        self.salience >= method::SURE_DEG * DEGREE
    }

    fn stands_out(&self, share: f64) -> bool {
        self.contrast >= share * self.salience || self.sure()
    }

    /// Whether the vertex is a feature.
    pub fn feature(&self) -> bool {
        self.measure >= 1.0 && self.stands_out(method::CREST_CONTRAST)
    }

    /// Whether a path between features may lead through the vertex.
    pub fn passable(&self) -> bool {
        self.measure >= method::LINK_MEASURE
            && self.stands_out(method::LINK_CONTRAST * method::CREST_CONTRAST)
    }

    /// Whether the vertex can carry a component of the line graph (hysteresis).
    pub fn strong(&self) -> bool {
        self.measure >= method::STRONG_MEASURE && self.stands_out(method::STRONG_CONTRAST)
    }
}

/// q is a ratio to a threshold that is never zero; the cap only keeps it printable.
const MEASURE_CAP: f64 = 1e9;

/// Whether a vertex folds too little to support or to be supported.
fn is_low(vote: Vote, surroundings: Surroundings) -> bool {
    vote.theta < method::TRACE_LOW * surroundings.threshold
}

/// Those of `at` that fold enough for traces to look at their contrast. Half of a mesh does not.
pub fn traceable(votes: &Field<Vote>, surroundings: &Field<Surroundings>, at: &[u32]) -> Vec<u32> {
    at.iter().copied().filter(|&v| !is_low(votes.get(v), surroundings.get(v))).collect()
}

impl Evidence<'_> {
    fn low(&self, v: u32) -> bool {
        is_low(self.votes.get(v), self.surroundings.get(v))
    }

    /// Support of each vertex of `at`.
    pub fn support(&self, at: &[u32]) -> Field<Support> {
        Field::compute(self.mesh.vertex_count(), at, |v| self.support_of(v))
    }

    fn support_of(&self, v: u32) -> Support {
        let (mut salience, mut contrast) = (0.0, 0.0);
        if !self.low(v) {
            let vote = self.votes.get(v);
            let forward = self.trace(v, vote.t);
            let backward = self.trace(v, -vote.t);
            let count = 1.0 + forward.count + backward.count;
            salience = (vote.theta + forward.theta + backward.theta) / count;
            contrast = (self.contrast.get(v) + forward.contrast + backward.contrast) / count;
        }
        let measure = (salience / self.surroundings.get(v).threshold).min(MEASURE_CAP);
        Support { salience, contrast, measure }
    }

    /// Follows the line from `v` towards `d`.
    fn trace(&self, v: u32, d: DVec3) -> Side {
        let mut side = Side { theta: 0.0, contrast: 0.0, count: method::TRACE_STEPS as f64 };
        let (mut current, mut previous, mut d) = (v, v, d);
        let most = method::TRACE_LEND * self.votes.get(v).theta;
        for step in 0..method::TRACE_STEPS {
            // A line that runs out leaves its missing vertices in the count, as zeros.
            let Some(next) = self.next(v, current, previous, d) else { break };
            if self.stops.get(next).any() {
                // A line that ends where lines end is supported all the way.
                side.count = step as f64;
                break;
            }
            let vote = self.votes.get(next);
            let lent = vote.theta.min(most);
            side.theta += lent;
            side.contrast += self.contrast.get(next) * (lent / vote.theta);
            d = turn(d, vote.t);
            (previous, current) = (current, next);
        }
        side
    }

    /// The neighbour of `current` that best continues the line: not back, in the cone, itself folded enough and running
    /// the same way unless it is a stop, with the largest cos^2 theta.
    fn next(&self, start: u32, current: u32, previous: u32, d: DVec3) -> Option<u32> {
        let mut best = None;
        let mut largest = 0.0;
        for (u, cos) in ahead(self.mesh, |u| self.positions.get(u), current, d)
            .filter(|(u, _)| *u != start && *u != previous)
        {
            let vote = self.votes.get(u);
            if !self.stops.get(u).any() && (self.low(u) || vote.t.dot(d).abs() < method::TURN_COS) {
                continue;
            }
            let score = cos * cos * vote.theta;
            if score > largest {
                largest = score;
                best = Some(u);
            }
        }
        best
    }
}

/// What one side of a trace adds.
struct Side {
    theta: f64,
    contrast: f64,
    count: f64,
}
