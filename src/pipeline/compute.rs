//! One tile, second half: steps A to D, and E and F on the lines that end in it; from a certified tile to what it hands
//! over. The methods differ in how they find features ([`Finding`]); from there on they are one.
//!
//! A pure function of what was loaded: it does not know whether the tile is one of a thousand or the only one.

use super::census::{LocalEdge, census};
use super::certify::Certified;
use super::paper::PaperMethod;
use super::seams::seams;
use crate::config::{Method, Params, method};
use crate::math::DEGREE;
use crate::mesh::{Field, TileMesh, concat};
use crate::partition::Plan;
use crate::refine::{
    Evidence, Extremes, Fit, Fitter, Link, Linker, Support, average_along, contrast, ridges, smooth,
    traceable,
};
use crate::stitch::{Candidate, Class, Fragments, LinkPath, OpenEdge, Rules, TileShare, VertexFields, close};
use crate::voting::{
    Noisy, Stop, Surroundings, Vote, first_votes, refine, stops, surroundings, vote_again, votes, widen,
};
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::mem::take;

/// Vertices handled by one parallel task.
const CHUNK: usize = 4096;

/// What one tile contributes.
#[derive(Serialize, Deserialize)]
pub struct TileResult {
    /// Its share of the lines: what it could finish alone, and what it could not.
    pub share: TileShare,
    /// Fields of the vertices it owns, by ascending id; empty unless they were asked for.
    pub fields: Vec<VertexFields>,
    /// Faces that were loaded.
    pub loaded_faces: u64,
    /// Faces that the tile owns: those whose vertex of lowest id it owns.
    pub owned_faces: u64,
}

/// What is asked for, and how.
#[derive(Clone, Copy, Debug)]
pub struct Asked {
    /// The fields of every owned vertex.
    pub fields: bool,
    /// To leave out what nothing in the result depends on: contrast where no trace looks, planes where no line is left.
    pub shortcuts: bool,
}

/// Steps A to D, and F as far as it is local. The paper method needs the `extremes` of the whole mesh. What of the tile is
/// used up on the way is given up.
pub fn compute(
    tile: &mut Certified,
    plan: &Plan,
    params: &Params,
    extremes: &Extremes,
    asked: Asked,
) -> TileResult {
    let finding = match &params.method {
        Method::Robust => find(tile, plan, params, asked.shortcuts),
        Method::Paper(thresholds) => {
            PaperMethod { plan, sigma: params.sigma, thresholds }.find(tile, extremes)
        }
    };
    let tile = &*tile;
    let links = finding.links(tile, plan);
    let (open_edges, defects) = census(tile);
    let open_edges = if params.boundaries { open_edges } else { Vec::new() };
    let mesh = &tile.mesh;
    let named = named(mesh, &links, &open_edges);
    let mut with = if asked.fields { tile.demand.owned.to_vec() } else { Vec::new() };
    mesh.sort_by_id(&mut with);
    let table = finding.table(tile, plan, &named, &with, asked.shortcuts);
    // Planes are fitted where the tables or the lines will show them; in the order of the tile, so that what is near comes
    // one after the other.
    let fit = |candidates: &mut [&mut Candidate]| {
        let mut at: Vec<(u32, u32)> =
            candidates.par_iter().map(|c| mesh.local(c.id)).zip(0..candidates.len() as u32).collect();
        at.par_sort_unstable();
        let (at, order): (Vec<u32>, Vec<u32>) = at.into_iter().unzip();
        let fits = if table.is_made() { table.of(&at) } else { finding.fits(tile, plan, &at) };
        for ((v, i), fit) in at.into_iter().zip(order).zip(fits) {
            candidates[i as usize].class = finding.class(v, &fit);
            candidates[i as usize].fit = fit;
        }
    };
    let global = |l: &Link| LinkPath::new(l.vertices().iter().map(|&v| mesh.id(v)), l.weight);
    let owned = &tile.demand.owned;
    let fragments = Fragments {
        vertices: named.par_iter().map(|&v| finding.candidate(tile, v)).collect(),
        links: links.par_iter().map(global).collect(),
        open_edges: open_edges
            .iter()
            .map(|e| OpenEdge { ends: e.ends.map(|v| mesh.id(v)), crowded: e.crowded })
            .collect(),
        seams: seams(tile, plan, &named),
        largest_salience: finding.support.max_over(owned, |s| s.salience),
        defects,
    };
    TileResult {
        share: close(fragments, &Rules::new(&plan.scale, params), &fit),
        fields: with.iter().map(|&v| finding.fields(tile, &table, v)).collect(),
        loaded_faces: mesh.face_count() as u64,
        owned_faces: tile.owned_faces(),
    }
}

/// The vertices that a path or an open edge names, by ascending ids.
fn named(mesh: &TileMesh, links: &[Link], open_edges: &[LocalEdge]) -> Vec<u32> {
    let mut named = vec![false; mesh.vertex_count()];
    let on_edges = open_edges.iter().flat_map(|e| &e.ends);
    links.iter().flat_map(Link::vertices).chain(on_edges).for_each(|&v| named[v as usize] = true);
    let mut named: Vec<u32> =
        (0..mesh.vertex_count() as u32).into_par_iter().filter(|&v| named[v as usize]).collect();
    mesh.sort_by_id(&mut named);
    named
}

/// Refined normals, and where they can be relied on.
pub(super) struct Refined {
    /// By face.
    normals: Vec<DVec3>,
    /// Known at the vertices around which all normals went through all their rounds.
    known: Field<bool>,
}

/// What steps A and B find out.
struct Tensors {
    refined: Refined,
    votes: Field<Vote>,
    surroundings: Field<Surroundings>,
}

/// Steps A and B: refined normals, tensors, fold angles.
fn vote(tile: &mut Certified, plan: &Plan) -> Tensors {
    let noisy = Noisy {
        normals: take(&mut tile.faces.normals),
        s0: take(&mut tile.noise),
        needed: take(&mut tile.needed),
    };
    let normals = refine(&tile.mesh, &tile.faces, &plan.scale, noisy);
    let Certified { mesh, faces, demand, vertex_rounds, .. } = tile;
    let tokens = first_votes(mesh, faces, &normals, &plan.scale, &demand.voted);
    let again = vote_again(mesh, &tokens, &plan.scale, &demand.voted);
    let mut votes = votes(mesh, &tokens, &again, &demand.voted);
    drop(tokens);
    let surroundings = surroundings(mesh, plan, &votes, &demand.voted, vertex_rounds, demand.folded.all());
    widen(mesh, &mut votes, again, &surroundings, &demand.folded);
    let known = Field::compute(mesh.vertex_count(), demand.voted.within(0), |_| true);
    Tensors { refined: Refined { normals, known }, votes, surroundings }
}

/// Contrast, stops, support and R.
fn find(tile: &mut Certified, plan: &Plan, params: &Params, shortcuts: bool) -> Finding {
    let Tensors { refined, votes, surroundings } = vote(tile, plan);
    let Certified { mesh, demand, vertex_rounds, .. } = tile;
    let positions = smooth(mesh, &plan.scale, vertex_rounds, &demand.smoothed);
    let stops = stops(mesh, &votes, &demand.traced);
    let traced = match shortcuts {
        true => traceable(&votes, &surroundings, &demand.traced),
        false => demand.traced.to_vec(),
    };
    let evidence = Evidence {
        mesh,
        votes: &votes,
        positions: &positions,
        contrast: &contrast(mesh, &plan.scale, &votes, vertex_rounds, &traced),
        surroundings: &surroundings,
        stops: &stops,
        traced: &demand.traced,
    };
    let support = evidence.support(&demand.linked);
    let r = average_along(mesh, &votes, &surroundings, vertex_rounds, &demand.thinned);
    let refined = Some(refined);
    let min_angle = params.min_angle_deg * DEGREE;
    let (omega, strong) = (Vote::omega, Support::strong);
    Finding { refined, votes, positions, support, stops, r, min_angle, omega, strong }
}

/// What was found out about single vertices.
pub(super) struct Finding {
    /// What planes are fitted to; nothing where the method refines no normals.
    pub refined: Option<Refined>,
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
    /// Features with a smaller dihedral angle are none, radians.
    pub min_angle: f64,
    /// Omega of the eigenvalues, as the method normalises them.
    pub omega: fn(&Vote) -> f64,
    /// Which vertices can carry a component of the line graph.
    pub strong: fn(&Support) -> bool,
}

/// Fits of some vertices, in ascending order.
#[derive(Default)]
struct FitTable {
    at: Vec<u32>,
    fits: Vec<Fit>,
}

impl FitTable {
    /// That of `v`; nothing where it was not fitted.
    fn at(&self, v: u32) -> Fit {
        self.at.binary_search(&v).map_or_else(|_| Fit::default(), |i| self.fits[i])
    }

    /// Whether the fits were made beforehand.
    fn is_made(&self) -> bool {
        !self.at.is_empty()
    }

    fn of(&self, at: &[u32]) -> Vec<Fit> {
        at.iter().map(|&v| self.at(v)).collect()
    }
}

impl Finding {
    /// Step D: ridges, and the links from those that the tile owns.
    fn links(&self, tile: &Certified, plan: &Plan) -> Vec<Link> {
        let Certified { mesh, demand, .. } = tile;
        let Finding { votes, positions, support, stops, r, .. } = self;
        let ridge = ridges(mesh, &plan.scale, votes, r, support, stops, &tile.vertex_rounds, &demand.linked);
        let linker = Linker { mesh, positions, votes, r, support, stops, ridge: &ridge };
        let from_chunk = |owned: &[u32]| -> Vec<Link> {
            let mut links = Vec::new();
            owned.iter().for_each(|&v| linker.links_from(v, &mut links));
            links
        };
        let links: Vec<Vec<Link>> = demand.owned.par_chunks(CHUNK).map(from_chunk).collect();
        concat(&links)
    }

    /// Step F at the vertices of lines (`named`) and at those of `with` that are features, if there are any `with`, or if
    /// nobody wants shortcuts.
    fn table(&self, tile: &Certified, plan: &Plan, named: &[u32], with: &[u32], shortcuts: bool) -> FitTable {
        if with.is_empty() && shortcuts {
            return FitTable::default();
        }
        let feature = |v: &u32| self.support.get(*v).feature() && !self.stops.get(*v).any();
        let mut at: Vec<u32> = with.iter().copied().filter(feature).chain(named.iter().copied()).collect();
        at.sort_unstable();
        at.dedup();
        FitTable { fits: self.fits(tile, plan, &at), at }
    }

    /// Step F at the vertices `at`. Without refined normals the angle is that of the tensors, and nothing is known of where
    /// the line runs.
    fn fits(&self, tile: &Certified, plan: &Plan, at: &[u32]) -> Vec<Fit> {
        let Finding { votes, stops, .. } = self;
        let Certified { mesh, faces, vertex_rounds: rounds, .. } = tile;
        match &self.refined {
            Some(Refined { normals, known }) => {
                Fitter { mesh, faces, normals, known, scale: &plan.scale, votes, stops, rounds }.fits(at)
            }
            None => at.iter().map(|&v| Fit { angle: votes.get(v).theta, ..Fit::default() }).collect(),
        }
    }

    /// The class of `v`, whose fit only matters if it is a feature where lines do not stop.
    fn class(&self, v: u32, fit: &Fit) -> Class {
        let stop = self.stops.get(v);
        if stop.boundary {
            Class::Boundary
        } else if stop.corner {
            Class::Corner
        } else if !self.support.get(v).feature() || fit.angle < self.min_angle {
            Class::Face
        } else if fit.angle >= method::SHARP_DEG * DEGREE {
            Class::Sharp
        } else {
            Class::Weak
        }
    }

    /// A vertex of a link, not fitted yet.
    fn candidate(&self, tile: &Certified, v: u32) -> Candidate {
        let stop = self.stops.get(v);
        Candidate {
            id: tile.mesh.id(v),
            position: tile.mesh.position(v),
            theta: self.votes.get(v).theta,
            fit: Fit::default(),
            salience: self.support.get(v).salience,
            class: Class::default(),
            corner: stop.corner,
            stop: stop.any(),
            strong: (self.strong)(&self.support.get(v)),
            rounds: tile.vertex_rounds[v as usize],
        }
    }

    fn fields(&self, tile: &Certified, fits: &FitTable, v: u32) -> VertexFields {
        let vote = self.votes.get(v);
        VertexFields {
            id: tile.mesh.id(v),
            position: tile.mesh.position(v),
            eigenvalues: vote.eigenvalues,
            omega: (self.omega)(&vote),
            salience: self.support.get(v).salience,
            class: self.class(v, &fits.at(v)),
        }
    }
}
