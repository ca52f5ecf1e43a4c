//! One tile, second half: steps A to D, from a certified tile to what it hands over.
//!
//! A pure function of what was loaded: it does not know whether the tile is one of a thousand or the only one.

use super::census::census;
use super::certify::Certified;
use crate::config::{Params, method};
use crate::math::DEGREE;
use crate::mesh::Field;
use crate::partition::Plan;
use crate::refine::{Evidence, Fit, Fitter, Link, Linker, Support, average_along, contrast, ridges};
use crate::stitch::{Class, Fragments, LineVertex, LinkPath, OpenEdge, VertexFields};
use crate::voting::{Stop, Vote, first_votes, refine, stops, thresholds, vote_again, votes};
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

/// Steps A to D, and F as far as it is local. `with_fields` asks for the fields of every owned vertex.
pub fn compute(tile: &Certified, plan: &Plan, params: &Params, with_fields: bool) -> TileResult {
    let (normals, votes) = vote(tile, plan);
    let finding = find(tile, plan, params, votes);
    let links = finding.links(tile, plan);
    let (open_edges, defects) = census(tile);
    let open_edges = if params.boundaries { open_edges } else { Vec::new() };
    let mesh = &tile.mesh;
    let mut named: Vec<u32> = links.iter().flat_map(|l| l.vertices.iter().copied()).collect();
    named.extend(open_edges.iter().flat_map(|e| e.ends));
    named.sort_unstable();
    named.dedup();
    let with = if with_fields { tile.demand.owned.as_slice() } else { &[] };
    let fits = finding.fits(tile, plan, &normals, &named, with);
    let global = |l: &Link| LinkPath::new(l.vertices.iter().map(|&v| mesh.id(v)), l.weight);
    let owned = &tile.demand.owned;
    let fragments = Fragments {
        vertices: named.iter().map(|&v| finding.line_vertex(tile, &fits, v)).collect(),
        links: links.iter().map(global).collect(),
        open_edges: open_edges
            .iter()
            .map(|e| OpenEdge { ends: e.ends.map(|v| mesh.id(v)), crowded: e.crowded })
            .collect(),
        largest_salience: finding.support.max_over(owned, |s| s.salience),
        defects,
    };
    TileResult {
        fragments,
        fields: with.iter().map(|&v| finding.fields(tile, &fits, v)).collect(),
        loaded_faces: mesh.face_count() as u64,
        owned_faces: mesh.corners.iter().filter(|c| tile.owns_face(c)).count() as u64,
    }
}

/// Steps A and B: refined normals, tensors, fold angles.
fn vote(tile: &Certified, plan: &Plan) -> (Vec<DVec3>, Field<Vote>) {
    let Certified { mesh, faces, demand, .. } = tile;
    let normals = refine(mesh, faces, &plan.scale, &tile.noise, &tile.needed);
    let tokens = first_votes(mesh, faces, &normals, &plan.scale, &demand.voted);
    let again = vote_again(mesh, &tokens, &plan.scale, &demand.voted);
    let votes = votes(mesh, &tokens, &again, &demand.voted);
    (normals, votes)
}

/// Contrast, thresholds, stops and support.
fn find(tile: &Certified, plan: &Plan, params: &Params, votes: Field<Vote>) -> Finding {
    let Certified { mesh, demand, .. } = tile;
    let stops = stops(mesh, &votes, &demand.traced);
    let evidence = Evidence {
        mesh,
        votes: &votes,
        contrast: &contrast(mesh, &plan.scale, &votes, &demand.traced),
        threshold: &thresholds(mesh, &plan.lattice, &votes, &demand.voted, &demand.traced),
        stops: &stops,
    };
    let support = evidence.support(&demand.linked);
    Finding { votes, support, stops, min_angle: params.min_angle_deg * DEGREE }
}

/// What was found out about single vertices.
struct Finding {
    votes: Field<Vote>,
    support: Field<Support>,
    stops: Field<Stop>,
    /// Weaker features are none, radians.
    min_angle: f64,
}

impl Finding {
    /// Step D: ridges, and the links from those that the tile owns.
    fn links(&self, tile: &Certified, plan: &Plan) -> Vec<Link> {
        let Certified { mesh, demand, .. } = tile;
        let Finding { votes, support, stops, .. } = self;
        let r = average_along(mesh, votes, &tile.vertex_rounds, &demand.thinned);
        let ridge = ridges(mesh, &plan.scale, votes, &r, support, stops, &demand.linked);
        let linker = Linker { mesh, votes, r: &r, support, stops, ridge: &ridge };
        let mut links = Vec::new();
        demand.owned.iter().for_each(|&v| linker.links_from(v, &mut links));
        links
    }

    /// Step F at the vertices of lines (`named`) and at those of `with` that are features.
    fn fits(
        &self,
        tile: &Certified,
        plan: &Plan,
        normals: &[DVec3],
        named: &[u32],
        with: &[u32],
    ) -> Field<Fit> {
        let Finding { votes, support, stops, .. } = self;
        let feature = |v: &u32| support.get(*v).feature() && !stops.get(*v).any();
        let mut at: Vec<u32> = with.iter().copied().filter(feature).chain(named.iter().copied()).collect();
        at.sort_unstable();
        at.dedup();
        let Certified { mesh, faces, vertex_rounds: rounds, .. } = tile;
        Fitter { mesh, faces, normals, scale: &plan.scale, votes, stops, rounds }.fits(&at)
    }

    fn class(&self, fits: &Field<Fit>, v: u32) -> Class {
        let stop = self.stops.get(v);
        if stop.boundary {
            Class::Boundary
        } else if stop.corner {
            Class::Corner
        } else if !self.support.get(v).feature() || fits.get(v).angle < self.min_angle {
            Class::Face
        } else if fits.get(v).angle >= method::SHARP_DEG * DEGREE {
            Class::Sharp
        } else {
            Class::Weak
        }
    }

    fn line_vertex(&self, tile: &Certified, fits: &Field<Fit>, v: u32) -> LineVertex {
        let stop = self.stops.get(v);
        LineVertex {
            id: tile.mesh.id(v),
            position: tile.mesh.position(v),
            fitted: tile.mesh.position(v),
            theta: self.votes.get(v).theta,
            fit: fits.get(v),
            salience: self.support.get(v).salience,
            class: self.class(fits, v),
            corner: stop.corner,
            stop: stop.any(),
            strong: self.support.get(v).strong(),
            rounds: tile.vertex_rounds[v as usize],
        }
    }

    fn fields(&self, tile: &Certified, fits: &Field<Fit>, v: u32) -> VertexFields {
        let vote = self.votes.get(v);
        VertexFields {
            id: tile.mesh.id(v),
            position: tile.mesh.position(v),
            eigenvalues: vote.eigenvalues,
            omega: vote.omega(),
            salience: self.support.get(v).salience,
            class: self.class(fits, v),
        }
    }
}
