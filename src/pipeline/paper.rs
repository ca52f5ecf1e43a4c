//! The paper method on one tile: what each of its passes takes from a certified tile.
//!
//! Two numbers of the whole mesh stand between votes and lines: the range of Omega, and the largest salience, for which
//! the range must be known. So the tiles are passed over twice to measure, each time with the halo that the pass needs and
//! no more, and a third time for the lines. What the first two hand over is joined by minimum and maximum, in any order.

use super::certify::Certified;
use super::compute::Finding;
use crate::config::{PaperThresholds, Sigma};
use crate::mesh::Field;
use crate::partition::{Loaded, Plan, half_cube};
use crate::refine::{Extremes, OmegaRange, Support, Supporters, smooth};
use crate::voting::{Stop, Vote, Voters, omega, paper_stops, paper_votes};

/// What the method is told. The tiles that its passes are given must be certified for them.
pub struct PaperMethod<'a> {
    /// Units.
    pub plan: &'a Plan,
    /// Scale of the neighbourhood that votes.
    pub sigma: Sigma,
    /// What a feature is.
    pub thresholds: &'a PaperThresholds,
}

impl PaperMethod<'_> {
    /// First pass: the range of Omega over the owned vertices on sharp edges and corners.
    pub fn omega_range(&self, tile: &Certified) -> OmegaRange {
        OmegaRange::over(&self.votes(tile), self.thresholds, &tile.demand.owned)
    }

    /// Second pass: the largest salience of the owned vertices, from the `range` of Omega over the whole mesh.
    pub fn largest_salience(&self, tile: &Certified, range: OmegaRange) -> f64 {
        let votes = self.votes(tile);
        let stops = self.stops(tile, &votes);
        let owned = &tile.demand.owned;
        self.supporters(tile, &votes, &stops, range).salience(owned).max_over(owned, |s| s.enhanced)
    }

    /// Third pass: features, and what thinning compares. A line runs where the salience is largest *before* it is
    /// enhanced: enhancing would lift the faint flanks of a sharp edge above its crest. The paper knows one threshold: a
    /// feature needs no stronger ones to carry it.
    pub fn find(&self, tile: &Certified, extremes: &Extremes) -> Finding {
        let at = tile.demand.thinned.all();
        let votes = self.votes(tile);
        let stops = self.stops(tile, &votes);
        let supporters = self.supporters(tile, &votes, &stops, extremes.omega);
        let salience = supporters.salience(at);
        let support = supporters.support(&salience, extremes.salience, at);
        let r = Field::compute(tile.mesh.vertex_count(), at, |v| salience.get(v).plain);
        let positions = smooth(&tile.mesh, &self.plan.scale, &tile.vertex_rounds, &tile.demand.smoothed);
        Finding {
            refined: None,
            votes,
            positions,
            support,
            stops,
            r,
            min_angle: 0.0,
            omega: |vote| omega(vote.eigenvalues),
            strong: Support::feature,
        }
    }

    fn votes(&self, tile: &Certified) -> Field<Vote> {
        let Certified { mesh, region, faces, demand, .. } = tile;
        let loaded = Loaded { mesh, region, lattice: &self.plan.lattice };
        let voters = Voters::new(&loaded, half_cube(self.sigma, &self.plan.scale));
        paper_votes(&voters, faces, &self.plan.scale, demand.voted.all())
    }

    fn stops(&self, tile: &Certified, votes: &Field<Vote>) -> Field<Stop> {
        paper_stops(&tile.mesh, votes, self.thresholds, &tile.demand.traced)
    }

    fn supporters<'b>(
        &'b self,
        tile: &'b Certified,
        votes: &'b Field<Vote>,
        stops: &'b Field<Stop>,
        range: OmegaRange,
    ) -> Supporters<'b> {
        let PaperMethod { plan, thresholds, .. } = *self;
        Supporters { mesh: &tile.mesh, votes, stops, thresholds, range, scale: &plan.scale }
    }
}
