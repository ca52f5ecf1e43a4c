//! The steps of one tile through the public interfaces of the library, as the pipeline takes them: for tests that look
//! between the steps, or that ask for a halo the pipeline would never ask for.

use crease::Params;
use crease::glam::DVec3;
use crease::input::MeshSource;
use crease::math::Sym3;
use crease::mesh::{Field, TileId};
use crease::partition::{Plan, Reach, scan};
use crease::pipeline::{Certified, certify};
use crease::refine::{Evidence, Link, Linker, Support, average_along, contrast, ridges};
use crease::voting::{Stop, Token, Vote, first_votes, refine, stops, thresholds, vote_again, votes};

/// Scans and plans.
pub fn plan(source: &dyn MeshSource, params: &Params, tiling: crease::Tiling) -> Plan {
    let mut found = scan(source, &|_| ()).unwrap_or_else(|e| panic!("{e}"));
    Plan::new(&mut found, params, tiling).unwrap_or_else(|e| panic!("{e}"))
}

/// A tile with all that its vertices depend on, as far as `reach` knows. The first region is as small as can be, so that
/// what is loaded beyond the cell is what `reach` asks for.
pub fn tile(source: &dyn MeshSource, plan: &Plan, reach: &Reach, index: usize) -> Certified {
    certify(source, plan, reach, TileId(index as u32), 0).unwrap_or_else(|e| panic!("{e}"))
}

/// What each step found.
pub struct Steps {
    /// Refined normals.
    pub normals: Vec<DVec3>,
    /// T0 and the sum of weighted normals.
    pub tokens: Field<Token>,
    /// T after the repeated votes.
    pub again: Field<Sym3>,
    pub votes: Field<Vote>,
    pub threshold: Field<f64>,
    pub stops: Field<Stop>,
    pub support: Field<Support>,
    pub r: Field<f64>,
    pub ridge: Field<bool>,
    /// Paths from the ridge vertices that the tile owns.
    pub links: Vec<Link>,
}

impl Steps {
    /// Steps A to D.
    pub fn compute(tile: &Certified, plan: &Plan, params: &Params) -> Steps {
        let Certified { mesh, demand, .. } = tile;
        let scale = &plan.scale;
        let normals = refine(mesh, &tile.faces, &plan.scale, &tile.noise, &tile.needed);
        let tokens = first_votes(mesh, &tile.faces, &normals, scale, &demand.voted);
        let again = vote_again(mesh, &tokens, scale, &demand.voted);
        let votes = votes(mesh, &tokens, &again, &demand.voted);
        let contrast = contrast(mesh, scale, &votes, &demand.traced);
        let threshold = thresholds(mesh, &plan.lattice, &votes, &demand.voted, &demand.traced);
        let stops = stops(mesh, &votes, &demand.traced);
        let min_angle = params.min_angle_deg.to_radians();
        let evidence = Evidence {
            mesh,
            votes: &votes,
            contrast: &contrast,
            threshold: &threshold,
            stops: &stops,
            min_angle,
        };
        let support = evidence.support(&demand.linked);
        let r = average_along(mesh, &votes, &tile.vertex_rounds, &demand.thinned);
        let ridge = ridges(mesh, scale, &votes, &r, &support, &stops, &demand.linked);
        let linker = Linker { mesh, votes: &votes, r: &r, support: &support, stops: &stops, ridge: &ridge };
        let mut links = Vec::new();
        demand.owned.iter().for_each(|&v| linker.links_from(v, &mut links));
        Steps { normals, tokens, again, votes, threshold, stops, support, r, ridge, links }
    }
}
