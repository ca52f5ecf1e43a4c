//! Which components of the candidate graph one tile can finish alone.
//!
//! In: what a tile found. Out: the lines of its *closed* components, and the *open* ones as they are, each with the tiles
//! that it waits for.
//!
//! **The criterion.** A link is handed over by the tile that owns the ridge vertex it starts from, and has at most
//! [`LINK_STEPS`](crate::config::method::LINK_STEPS) edges; an open edge by the tile that owns its lower end. So a tile
//! names a vertex u in a link or edge only if it owns a vertex within that many rings of u, u included. Call these tiles
//! N(u). It is a property of the mesh: every tile that names u computes the same N(u), because it has loaded the rings
//! around. (It names u from a vertex it owns, 3 rings away at most; the rings of u reach 3 further; and the one-rings
//! of all vertices up to 7 rings around owned ones are complete, as support is traced 5 rings around what links touch.)
//! The [`Seam`] of u lists N(u) without what the tile itself owns, and a vertex without a seam is named by no other tile.
//!
//! Let C be a set of links that is connected by common vertices, and let all tiles of all N(u), u in C, have handed over
//! what they found and have been joined with C where they share a vertex. Any link that shares a vertex u with C comes
//! from a tile in N(u), so it is in C: C is a whole component of the candidate graph. In a tile, C is whole if it has no
//! seam. It may be kept open longer than it must, for N(u) counts tiles that could name u, not those that do; that costs
//! memory and changes nothing.
//!
//! Links, boundaries and non-manifold edges make three graphs, whose components are closed each on its own.

use super::apart::apart;
use super::component::{Draft, Finished, Part, Rules};
use super::fragments::{Candidate, Defects, Fragments, Kind, Seam};
use super::places::{Places, Sets};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// A component, as far as one tile sees it, that others may add to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OpenPart {
    /// Of which graph.
    pub kind: Kind,
    /// All of it that this tile found.
    pub part: Part,
    /// Those of its vertices that others may name; at least one.
    pub seams: Vec<Seam>,
}

/// What a tile hands over to be stitched.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TileShare {
    /// What is closed.
    pub finished: Finished,
    /// What is open.
    pub open: Vec<OpenPart>,
    /// Links that were found.
    pub links: u64,
    /// Largest S over the vertices that the tile owns.
    pub largest_salience: f64,
    /// Defects counted by this tile.
    pub defects: Defects,
}

/// Fits planes at some vertices of a tile: completes the candidates it gets.
pub type FitAll<'a> = &'a dyn Fn(&mut [&mut Candidate]);

/// Finishes what is closed, and takes apart what is open. The vertices of `fragments` were not fitted yet: `fit` is called
/// for those that may be on a line, which are half of them.
pub fn close(fragments: Fragments, rules: &Rules, fit: FitAll) -> TileShare {
    let Fragments { vertices, links, open_edges, seams, largest_salience, defects } = fragments;
    let found = links.len() as u64;
    let whole = Part { vertices, links, open_edges };
    let (closed, mut open) = if seams.is_empty() { (whole, Vec::new()) } else { split(&whole, &seams) };
    // What becomes of an open part is not known here.
    let mut left_open: Vec<&mut Candidate> =
        open.iter_mut().flat_map(|open| &mut open.part.vertices).collect();
    fit(&mut left_open);
    let mut drafts: Vec<Draft> = apart(closed).into_par_iter().map(|part| Draft::new(part, rules)).collect();
    fit(&mut drafts.iter_mut().flat_map(Draft::left).collect::<Vec<_>>());
    let finished = drafts.into_par_iter().map(|draft| draft.finish(rules)).collect();
    TileShare { finished: Finished::joined(finished), open, links: found, largest_salience, defects }
}

/// Closed components all together, open ones one by one.
fn split(whole: &Part, seams: &[Seam]) -> (Part, Vec<OpenPart>) {
    let (mut closed, mut all_open) = (Part::default(), Vec::new());
    let places = Places::new(whole);
    let edges_of = |kind: Kind| {
        let edges = whole.open_edges.iter().zip(&places.open_edges);
        edges.filter(move |(edge, _)| edge.kind() == kind)
    };
    for kind in Kind::ALL {
        let links = if kind == Kind::Crease { &whole.links[..] } else { &[] };
        let mut components = Components::new(places.count());
        places.links[..links.len()].iter().for_each(|link| components.join(link));
        edges_of(kind).for_each(|(_, ends)| components.join(ends));
        let components = components.opened_at(seams.iter().map(|seam| places.of(seam.vertex)));
        let mut open: Vec<OpenPart> = (0..components.open)
            .map(|_| OpenPart { kind, part: Part::default(), seams: Vec::new() })
            .collect();
        for (v, vertex) in (0..).zip(&whole.vertices).filter(|(v, _)| components.named[*v as usize]) {
            components.part(v, &mut open, &mut closed).vertices.push(*vertex);
        }
        for (link, at) in links.iter().zip(&places.links) {
            components.part(at[0], &mut open, &mut closed).links.push(*link);
        }
        for (edge, at) in edges_of(kind) {
            components.part(at[0], &mut open, &mut closed).open_edges.push(*edge);
        }
        for seam in seams {
            if let Some(component) = components.of(places.of(seam.vertex)) {
                open[component as usize].seams.push(seam.clone());
            }
        }
        all_open.extend(open);
    }
    (closed, all_open)
}

/// The components of one kind over the vertices of a tile, while they grow.
struct Components {
    sets: Sets,
    /// Whether an edge of this kind names the vertex.
    named: Vec<bool>,
}

/// The same when they have grown.
struct Grown {
    roots: Vec<u32>,
    named: Vec<bool>,
    /// Number of the open component of each root, [`CLOSED`] if it is none.
    number: Vec<u32>,
    /// How many are open.
    open: u32,
}

/// Number of the components that are not open.
const CLOSED: u32 = u32::MAX;

impl Components {
    fn new(vertices: usize) -> Components {
        Components { sets: Sets::new(vertices), named: vec![false; vertices] }
    }

    fn join(&mut self, vertices: &[u32]) {
        self.sets.join(vertices);
        vertices.iter().for_each(|&v| self.named[v as usize] = true);
    }

    /// Those with one of `seams` are open.
    fn opened_at(self, seams: impl Iterator<Item = u32>) -> Grown {
        let Components { sets, named } = self;
        let mut grown = Grown { roots: sets.roots(), number: vec![CLOSED; named.len()], named, open: 0 };
        for v in seams {
            let root = grown.roots[v as usize] as usize;
            if grown.named[v as usize] && grown.number[root] == CLOSED {
                grown.number[root] = grown.open;
                grown.open += 1;
            }
        }
        grown
    }
}

impl Grown {
    /// The open component that `vertex` is in, as far as this kind of edge names it.
    fn of(&self, vertex: u32) -> Option<u32> {
        let number = self.number[self.roots[vertex as usize] as usize];
        (self.named[vertex as usize] && number != CLOSED).then_some(number)
    }

    /// Where to put what belongs to `vertex`.
    fn part<'p>(&self, vertex: u32, open: &'p mut [OpenPart], closed: &'p mut Part) -> &'p mut Part {
        match self.of(vertex) {
            Some(component) => &mut open[component as usize].part,
            None => closed,
        }
    }
}
