//! The second stage of the paper method: neighbour supporting and weak-feature enhancing (Wang et al. 2012).
//!
//! In: the votes and classes of the first stage, and the range of Omega over the whole mesh. Out: the salience of each
//! vertex, which is the Omega of the vertices that support it along the line through it, weighted by distance. Pseudo
//! features of noise find few supporters; weak features that go on are enhanced.
//!
//! Departures, where the paper says nothing: which neighbour a walk goes to is decided as in [`super::support`] (the cone,
//! then the largest cos^2 Omega), by Omega as it is, so that it does not depend on the rest of the mesh. A vertex supports
//! itself, at distance 0. A corner has no direction: it is never turned away from, and supports as the last of its side.

use super::support::Support;
use super::walk::{ahead, turn};
use crate::config::{PaperThresholds, method, paper};
use crate::mesh::{Field, TileMesh};
use crate::partition::Scale;
use crate::voting::{Initial, Stop, Vote, omega};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// The range of Omega over vertices on sharp edges and corners. Minimum and maximum, so that no order matters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OmegaRange {
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
}

impl Default for OmegaRange {
    /// Of no vertex at all.
    fn default() -> Self {
        OmegaRange { min: f64::INFINITY, max: f64::NEG_INFINITY }
    }
}

impl OmegaRange {
    /// Over the vertices of `at` that are more than a face.
    pub fn over(votes: &Field<Vote>, thresholds: &PaperThresholds, at: &[u32]) -> OmegaRange {
        let eigenvalues = at.iter().map(|&v| votes.get(v).eigenvalues);
        let sharp = eigenvalues.filter(|&l| Initial::of(l, thresholds) != Initial::Face);
        sharp.map(omega).fold(OmegaRange::default(), |range, x| range.join(OmegaRange { min: x, max: x }))
    }

    /// Both.
    pub fn join(self, other: OmegaRange) -> OmegaRange {
        OmegaRange { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// `omega` from 0 (the smallest) to 1 (the largest). Where all are alike, all are 1.
    pub fn normalised(self, omega: f64) -> f64 {
        let range = self.max - self.min;
        if range < paper::OMEGA_RANGE * self.max { 1.0 } else { (omega - self.min) / range }
    }
}

/// What the paper method must know of the whole mesh before it can tell features.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extremes {
    /// Of Omega.
    pub omega: OmegaRange,
    /// Largest salience.
    pub salience: f64,
}

/// What the supporting walks read.
pub struct Supporters<'a> {
    /// The mesh.
    pub mesh: &'a TileMesh,
    /// Eigenvalues and directions.
    pub votes: &'a Field<Vote>,
    /// Where lines stop.
    pub stops: &'a Field<Stop>,
    /// Which vertices are candidates.
    pub thresholds: &'a PaperThresholds,
    /// Omega over the whole mesh.
    pub range: OmegaRange,
    /// Unit of length.
    pub scale: &'a Scale,
}

/// How well the line through a vertex supports it. No unit: sums of Omegas from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Salience {
    /// The weighted sum of the Omegas along the line.
    pub plain: f64,
    /// The same, larger where the line is weak and long: what the threshold is compared with.
    pub enhanced: f64,
}

/// What the supporters of a vertex add up to.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    weighted: f64,
    omega: f64,
    count: usize,
}

impl Supporters<'_> {
    /// Salience of each vertex of `at`; 0 for vertices on faces.
    pub fn salience(&self, at: &[u32]) -> Field<Salience> {
        Field::compute(self.mesh.vertex_count(), at, |v| self.salience_of(v))
    }

    /// What the threshold makes of the salience of each vertex of `at`.
    pub fn support(&self, salience: &Field<Salience>, largest: f64, at: &[u32]) -> Field<Support> {
        Field::compute(self.mesh.vertex_count(), at, |v| {
            let enhanced = salience.get(v).enhanced;
            let measure = match self.initial(v) {
                Initial::Face => 0.0,
                // A threshold of 0 lets every candidate through.
                _ if self.thresholds.salience == 0.0 => f64::INFINITY,
                _ => enhanced / largest.max(f64::MIN_POSITIVE) / self.thresholds.salience,
            };
            Support::of_salience(enhanced, measure)
        })
    }

    fn initial(&self, v: u32) -> Initial {
        Initial::of(self.votes.get(v).eigenvalues, self.thresholds)
    }

    fn omega(&self, v: u32) -> f64 {
        self.range.normalised(omega(self.votes.get(v).eigenvalues))
    }

    fn salience_of(&self, v: u32) -> Salience {
        if self.initial(v) == Initial::Face {
            return Salience::default();
        }
        let t = self.votes.get(v).t;
        let mut sum = Sum::default();
        self.walk(v, t, &mut sum);
        self.walk(v, -t, &mut sum);
        let own = self.omega(v);
        let plain = own + sum.weighted;
        Salience { plain, enhanced: plain * enhancement(own, sum.omega, sum.count) }
    }

    /// Adds the supporters of `v` on the side of `d`.
    fn walk(&self, v: u32, d: DVec3, sum: &mut Sum) {
        let (mut current, mut previous, mut d) = (v, v, d);
        for _ in 0..method::TRACE_STEPS {
            let Some(next) = self.next(v, current, previous, d) else { return };
            let omega = self.omega(next);
            let e = self.mesh.position(next) - self.mesh.position(v);
            sum.weighted += omega * weight(e.dot(e), self.scale.h);
            sum.omega += omega;
            sum.count += 1;
            if self.stops.get(next).any() {
                return;
            }
            d = turn(d, self.votes.get(next).t);
            (previous, current) = (current, next);
        }
    }

    /// The neighbour of `current` that best continues the line: not back, in the cone, more than a face, running the same
    /// way to 15 degrees, with the largest cos^2 Omega.
    fn next(&self, start: u32, current: u32, previous: u32, d: DVec3) -> Option<u32> {
        let directed = |v: u32| self.initial(v) != Initial::Corner;
        let t = self.votes.get(current).t;
        let mut best = None;
        let mut largest = 0.0;
        for (u, cos) in ahead(self.mesh, |u| self.mesh.position(u), current, d)
            .filter(|(u, _)| *u != start && *u != previous)
        {
            let turns = directed(current)
                && directed(u)
                && self.votes.get(u).t.dot(t).abs() < paper::SUPPORT_TURN_COS;
            if self.initial(u) == Initial::Face || turns {
                continue;
            }
            let score = cos * cos * omega(self.votes.get(u).eigenvalues);
            if score > largest {
                largest = score;
                best = Some(u);
            }
        }
        best
    }
}

/// What a supporter counts at the square of a distance: exp(-d^2 / (2 (1.5 h)^2)).
fn weight(distance2: f64, h: f64) -> f64 {
    let width = paper::SUPPORT_WIDTH * h;
    libm::exp(-distance2 / (2.0 * width * width))
}

/// The factor on the salience of a vertex with this Omega whose `count` supporters have Omegas of this `sum`: a weak
/// feature among weak features that goes on is enhanced, the weaker the more.
fn enhancement(own: f64, sum: f64, count: usize) -> f64 {
    let weak = |omega: f64| omega < paper::ENHANCE_BELOW;
    if count > paper::ENHANCE_SUPPORTERS && weak(own) && weak(sum / count as f64) {
        paper::ENHANCE_FACTOR * libm::exp(-own)
    } else {
        1.0
    }
}
