//! Step C: neighbour supporting and weak-feature enhancing (Wang et al. 2012).
//!
//! In: votes, contrast, thresholds, smoothed positions. Out: the salience S of a vertex is the mean fold angle along the line through it, so
//! that a chance fold without neighbours fades and a weak crease that goes on does not. Measured against the threshold
//! of its own surroundings rather than against the strongest edge of the model, weak features stand out.

use super::walk::{Best, cos2_ahead, towards};
use crate::config::method;
use crate::math::{DEGREE, unit};
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
    /// All vertices that a trace may look at.
    pub traced: &'a [u32],
}

/// What a trace looks at before it steps to a vertex, in one line of a cache.
#[derive(Clone, Copy, Default)]
#[repr(align(64))]
struct Sight {
    position: DVec3,
    /// Direction of the line.
    t: DVec3,
    theta: f64,
    /// The least squared cosine between that line and the direction of travel: none where lines stop, more than there is
    /// where the surface folds too little.
    least_cos2: f64,
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

/// A least squared cosine that any line has.
const ANY_COS2: f64 = -1.0;
/// One that no line has.
const NO_COS2: f64 = f64::INFINITY;

/// Whether a vertex folds too little to support or to be supported.
fn is_low(vote: Vote, surroundings: Surroundings) -> bool {
    vote.theta < method::TRACE_LOW * surroundings.threshold
}

/// Those of `at` that fold enough for traces to look at their contrast. Half of a mesh does not.
pub fn traceable(votes: &Field<Vote>, surroundings: &Field<Surroundings>, at: &[u32]) -> Vec<u32> {
    at.iter().copied().filter(|&v| !is_low(votes.get(v), surroundings.get(v))).collect()
}

impl Evidence<'_> {
    /// Support of each vertex of `at`.
    pub fn support(&self, at: &[u32]) -> Field<Support> {
        let n = self.mesh.vertex_count();
        let sights = Field::compute(n, self.traced, |v| self.sight(v));
        Field::compute(n, at, |v| self.support_of(&sights, v))
    }

    fn sight(&self, v: u32) -> Sight {
        let vote = self.votes.get(v);
        let least_cos2 = if self.stops.get(v).any() {
            ANY_COS2
        } else if is_low(vote, self.surroundings.get(v)) {
            NO_COS2
        } else {
            method::TURN_COS * method::TURN_COS
        };
        Sight { position: self.positions.get(v), t: vote.t, theta: vote.theta, least_cos2 }
    }

    fn support_of(&self, sights: &Field<Sight>, v: u32) -> Support {
        let (mut salience, mut contrast) = (0.0, 0.0);
        let vote = self.votes.get(v);
        if !is_low(vote, self.surroundings.get(v)) {
            let [forward, backward] = self.traces(sights, v);
            let count = 1.0 + forward.count + backward.count;
            salience = (vote.theta + forward.theta + backward.theta) / count;
            contrast = (self.contrast.get(v) + forward.contrast + backward.contrast) / count;
        }
        let measure = (salience / self.surroundings.get(v).threshold).min(MEASURE_CAP);
        Support { salience, contrast, measure }
    }

    /// Follows the line from `v` both ways, by turns: each step waits for the one before, but not for the other side.
    fn traces(&self, sights: &Field<Sight>, v: u32) -> [Trace; 2] {
        let Sight { t, theta, .. } = sights.get(v);
        let mut sides = [Trace::new(v, t), Trace::new(v, -t)];
        for step in 0..method::TRACE_STEPS {
            for side in sides.iter_mut().filter(|side| side.goes_on) {
                self.step(sights, v, method::TRACE_LEND * theta, step, side);
            }
        }
        sides
    }

    /// One step of a trace from `start`, on which no vertex counts more than `most`.
    fn step(&self, sights: &Field<Sight>, start: u32, most: f64, step: usize, side: &mut Trace) {
        let Some(next) = self.next(sights, start, side) else {
            // A line that runs out leaves its missing vertices in the count, as zeros.
            side.goes_on = false;
            return;
        };
        let seen = sights.get(next);
        if seen.least_cos2 == ANY_COS2 {
            // A line that ends where lines end is supported all the way.
            side.count = step as f64;
            side.goes_on = false;
            return;
        }
        let lent = seen.theta.min(most);
        side.theta += lent;
        side.contrast += self.contrast.get(next) * (lent / seen.theta);
        side.direction = towards(unit(side.direction), seen.t);
        (side.previous, side.current) = (side.current, next);
    }

    /// The neighbour that best continues the line: not back, in the cone, itself folded enough and running the same way
    /// unless it is a stop, with the largest cos^2 theta.
    #[inline]
    fn next(&self, sights: &Field<Sight>, start: u32, side: &Trace) -> Option<u32> {
        let origin = sights.get(side.current).position;
        let d = side.direction;
        // The direction is compared with as it is: to wait for a square root in each step would take as long as the rest.
        let d2 = d.dot(d);
        let mut best = Best::above(0.0);
        for &u in self.mesh.ring_of(side.current) {
            let seen = sights.get(u);
            let cos2_d2 = cos2_ahead(seen.position - origin, d);
            let turn = seen.t.dot(d);
            let onward = (cos2_d2 >= method::CONE_COS * method::CONE_COS * d2)
                & (turn * turn >= seen.least_cos2 * d2)
                & (u != start)
                & (u != side.previous);
            best.offer(u, cos2_d2 * seen.theta, onward);
        }
        best.vertex()
    }
}

/// One side of a trace.
struct Trace {
    current: u32,
    previous: u32,
    /// Of travel; not of unit length.
    direction: DVec3,
    goes_on: bool,
    /// What it adds.
    theta: f64,
    contrast: f64,
    count: f64,
}

impl Trace {
    fn new(v: u32, direction: DVec3) -> Trace {
        let count = method::TRACE_STEPS as f64;
        Trace { current: v, previous: v, direction, goes_on: true, theta: 0.0, contrast: 0.0, count }
    }
}
