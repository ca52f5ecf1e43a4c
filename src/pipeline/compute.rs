//! One tile, second half: steps A to D, from a certified tile to what it hands over. The methods differ in how they find
//! features ([`Finding`]); from there on they are one.
//!
//! A pure function of what was loaded: it does not know whether the tile is one of a thousand or the only one.

use super::census::census;
use super::certify::Certified;
use super::paper::PaperMethod;
use crate::config::{Method, Params, method};
use crate::math::DEGREE;
use crate::mesh::Field;
use crate::partition::Plan;
use crate::refine::{Evidence, Extremes, Link, Linker, Support, average_along, contrast, ridges, smooth};
use crate::stitch::{Class, Fragments, LineVertex, LinkPath, OpenEdge, VertexFields};
use crate::voting::{
    Stop, Surroundings, Vote, first_votes, refine, stops, surroundings, vote_again, votes, widen,
};
use glam::DVec3;

/// What one tile contributes.
pub struct TileResult {
    /// Its share of the line graph.
    pub fragments: Fragments,
    /// Fields of the vertices it owns, by ascending id; empty unless they were asked for.
    pub fields: Vec<VertexFields>,
    /// Faces that were loaded.
    pub loaded_faces: u64,
    /// Faces that the tile owns: those whose vertex of lowest id it owns.
    pub owned_faces: u64,
}

/// Steps A to D. The paper method needs the `extremes` of the whole mesh. `with_fields` asks for the fields of every owned
/// vertex.
pub fn compute(
    tile: &Certified,
    plan: &Plan,
    params: &Params,
    extremes: &Extremes,
    with_fields: bool,
) -> TileResult {
    let finding = match &params.method {
        Method::Robust => find(tile, plan, params),
        Method::Paper(thresholds) => {
            PaperMethod { plan, sigma: params.sigma, thresholds }.find(tile, extremes)
        }
    };
    let links = finding.links(tile, plan);
    let (open_edges, defects) = census(tile);
    let open_edges = if params.boundaries { open_edges } else { Vec::new() };
    let mesh = &tile.mesh;
    let mut named: Vec<u32> = links.iter().flat_map(|l| l.vertices.iter().copied()).collect();
    named.extend(open_edges.iter().flat_map(|e| e.ends));
    named.sort_unstable();
    named.dedup();
    let global = |l: &Link| LinkPath::new(l.vertices.iter().map(|&v| mesh.id(v)), l.weight);
    let owned = &tile.demand.owned;
    let fragments = Fragments {
        vertices: named.iter().map(|&v| finding.line_vertex(tile, v)).collect(),
        links: links.iter().map(global).collect(),
        open_edges: open_edges
            .iter()
            .map(|e| OpenEdge { ends: e.ends.map(|v| mesh.id(v)), crowded: e.crowded })
            .collect(),
        largest_salience: finding.support.max_over(owned, |s| s.salience),
        defects,
    };
    let with = if with_fields { owned.as_slice() } else { &[] };
    TileResult {
        fragments,
        fields: with.iter().map(|&v| finding.fields(tile, v)).collect(),
        loaded_faces: mesh.face_count() as u64,
        owned_faces: mesh.corners.iter().filter(|c| tile.owns_face(c)).count() as u64,
    }
}

/// Steps A and B: refined normals, tensors, fold angles.
fn vote(tile: &Certified, plan: &Plan) -> (Field<Vote>, Field<Surroundings>) {
    let Certified { mesh, faces, demand, vertex_rounds, .. } = tile;
    let normals = refine(mesh, faces, &plan.scale, &tile.noise, &tile.needed);
    let tokens = first_votes(mesh, faces, &normals, &plan.scale, &demand.voted);
    let again = vote_again(mesh, &tokens, &plan.scale, &demand.voted);
    let narrow = votes(mesh, &tokens, &again, &demand.voted);
    let around = surroundings(mesh, plan, &narrow, &demand.voted, vertex_rounds, demand.folded.all());
    (widen(mesh, &narrow, &again, &around, &demand.folded), around)
}

/// Contrast, stops, support and R.
fn find(tile: &Certified, plan: &Plan, params: &Params) -> Finding {
    let Certified { mesh, demand, vertex_rounds, .. } = tile;
    let (votes, surroundings) = vote(tile, plan);
    let positions = smooth(mesh, &plan.scale, vertex_rounds, &demand.smoothed);
    let stops = stops(mesh, &votes, &demand.traced);
    let evidence = Evidence {
        mesh,
        votes: &votes,
        positions: &positions,
        contrast: &contrast(mesh, &plan.scale, &votes, vertex_rounds, &demand.traced),
        surroundings: &surroundings,
        stops: &stops,
        min_angle: params.min_angle_deg * DEGREE,
    };
    let support = evidence.support(&demand.linked);
    let r = average_along(mesh, &votes, &surroundings, vertex_rounds, &demand.thinned);
    Finding { votes, positions, support, stops, r, omega: Vote::omega, strong: Support::strong }
}

/// What was found out about single vertices.
pub(super) struct Finding {
    /// Eigenvalues, fold angles, directions.
    pub votes: Field<Vote>,
    /// Where links take the vertices to be.
    pub positions: Field<DVec3>,
    /// Which vertices are features.
    pub support: Field<Support>,
    /// Where lines stop.
    pub stops: Field<Stop>,
    /// What thinning compares.
    pub r: Field<f64>,
    /// Omega of the eigenvalues, as the method normalises them.
    pub omega: fn(&Vote) -> f64,
    /// Which vertices can carry a component of the line graph.
    pub strong: fn(&Support) -> bool,
}

impl Finding {
    /// Step D: ridges, and the links from those that the tile owns.
    fn links(&self, tile: &Certified, plan: &Plan) -> Vec<Link> {
        let Certified { mesh, demand, .. } = tile;
        let Finding { votes, positions, support, stops, r, .. } = self;
        let ridge = ridges(mesh, &plan.scale, votes, r, support, stops, &tile.vertex_rounds, &demand.linked);
        let linker = Linker { mesh, positions, votes, r, support, stops, ridge: &ridge };
        let mut links = Vec::new();
        demand.owned.iter().for_each(|&v| linker.links_from(v, &mut links));
        links
    }

    fn class(&self, v: u32) -> Class {
        let stop = self.stops.get(v);
        if stop.boundary {
            Class::Boundary
        } else if stop.corner {
            Class::Corner
        } else if !self.support.get(v).feature() {
            Class::Face
        } else if self.votes.get(v).theta >= method::SHARP_DEG * DEGREE {
            Class::Sharp
        } else {
            Class::Weak
        }
    }

    fn line_vertex(&self, tile: &Certified, v: u32) -> LineVertex {
        let stop = self.stops.get(v);
        LineVertex {
            id: tile.mesh.id(v),
            position: tile.mesh.position(v),
            theta: self.votes.get(v).theta,
            salience: self.support.get(v).salience,
            class: self.class(v),
            corner: stop.corner,
            stop: stop.any(),
            strong: (self.strong)(&self.support.get(v)),
            rounds: tile.vertex_rounds[v as usize],
        }
    }

    fn fields(&self, tile: &Certified, v: u32) -> VertexFields {
        let vote = self.votes.get(v);
        VertexFields {
            id: tile.mesh.id(v),
            position: tile.mesh.position(v),
            eigenvalues: vote.eigenvalues,
            omega: (self.omega)(&vote),
            salience: self.support.get(v).salience,
            class: self.class(v),
        }
    }
}
