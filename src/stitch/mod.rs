//! Fragments of all tiles in, feature lines out.
//!
//! Everything that needs the whole mesh happens here, on the small graph: joining across seams by global id, junctions,
//! pruning by length, hysteresis by component, normalisation by the global maximum, and the final order. The result is a
//! function of the *set* of fragments; how many tiles they came from cannot be seen in it.

mod fragments;
mod graph;
mod lines;
mod prune;
mod smooth;

pub use fragments::{Class, Defects, Fragments, LineVertex, LinkPath, OpenEdge, VertexFields};
pub use lines::Line;

use crate::config::{Params, method};
use crate::partition::Scale;
use glam::DVec3;
use graph::{Graph, LoopLength, distance, node_of};
use serde::{Deserialize, Serialize};

/// The feature lines of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LineSet {
    /// Vertices that lines run through, by ascending id.
    pub vertices: Vec<LineVertex>,
    /// Creases, then boundaries, then non-manifold edges; each in canonical order.
    pub lines: Vec<Line>,
    /// Largest S of the mesh: what saliency is divided by.
    pub largest_salience: f64,
    /// Where the lines run.
    pub geometry: Geometry,
}

/// Where lines run. They have the same vertices, classes and angles either way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Geometry {
    /// Along edges of the mesh, from vertex to vertex.
    #[default]
    Vertices,
    /// Where the surfaces on both sides meet, smoothed along the line.
    Fitted,
}

/// Joins the fragments of all tiles.
pub fn stitch(fragments: Fragments, scale: &Scale, params: &Params) -> LineSet {
    let Fragments { mut vertices, mut links, mut open_edges, largest_salience, .. } = fragments;
    vertices.sort_unstable_by_key(|v| v.id);
    debug_assert!(
        vertices.chunk_by(|a, b| a.id == b.id).all(|same| same.iter().all(|v| *v == same[0])),
        "two tiles disagree about a vertex"
    );
    vertices.dedup_by_key(|v| v.id);
    links.sort_unstable_by(LinkPath::order);
    links.dedup();
    let apart = LoopLength {
        base: scale.length(method::LOOP_LENGTH),
        per_round: scale.length(method::LOOP_PER_ROUND),
    };
    let mut creases = graph::build(&vertices, &links, apart);
    prune::prune_branches(&mut creases, &vertices, scale.length(method::PRUNE_LENGTH));
    let shortest = scale.length(params.min_length_sigmas * method::SIGMA_EDGES);
    prune::prune_components(&mut creases, &vertices, shortest);
    let crease_lines = |creases: &Graph| -> Vec<Line> {
        let chains = lines::chains(creases, |v| vertices[v as usize].corner).into_iter();
        chains.map(|chain| lines::crease_line(&vertices, chain, largest_salience)).collect()
    };
    let mut lines = crease_lines(&creases);
    if lines.iter().any(|line| line.angle < params.min_angle_deg) {
        // What a weak line held together may be too short on its own, and its junctions may be none any more.
        let weak = lines.iter().filter(|line| line.angle < params.min_angle_deg);
        weak.for_each(|line| line.vertices.windows(2).for_each(|e| creases.remove(e[0], e[1])));
        prune::prune_components(&mut creases, &vertices, shortest);
        lines = crease_lines(&creases);
    }
    open_edges.sort_unstable();
    for (crowded, class) in [(false, Class::Boundary), (true, Class::NonManifold)] {
        let mut open = Graph::new(vertices.len());
        for edge in open_edges.iter().filter(|e| e.crowded == crowded) {
            if let [Some(a), Some(b)] = edge.ends.map(|id| node_of(&vertices, id)) {
                open.add(a, b, distance(&vertices, a, b));
            }
        }
        let chains = lines::chains(&open, |v| vertices[v as usize].corner);
        lines.extend(chains.into_iter().map(|chain| lines::plain_line(&vertices, chain, class)));
    }
    smooth::fit_lines(&creases, &mut vertices, &lines, scale);
    let mut set = LineSet { vertices, lines, largest_salience, geometry: Geometry::Vertices };
    set.drop_unused();
    set
}

impl LineSet {
    /// Keeps only the vertices that a line runs through.
    fn drop_unused(&mut self) {
        let mut place = vec![u32::MAX; self.vertices.len()];
        self.lines.iter().flat_map(|l| &l.vertices).for_each(|&v| place[v as usize] = 0);
        for (next, slot) in (0..).zip(place.iter_mut().filter(|slot| **slot == 0)) {
            *slot = next;
        }
        self.lines.iter_mut().flat_map(|l| &mut l.vertices).for_each(|v| *v = place[*v as usize]);
        let mut used = place.iter().map(|&slot| slot != u32::MAX);
        self.vertices.retain(|_| used.next().unwrap_or(false));
    }

    /// The same lines, with the points and lengths of `geometry`.
    pub fn with_geometry(mut self, geometry: Geometry) -> LineSet {
        self.geometry = geometry;
        for i in 0..self.lines.len() {
            let points = self.lines[i].vertices.iter().map(|&v| self.point(&self.vertices[v as usize]));
            self.lines[i].length = lines::length(points);
        }
        self
    }

    /// Where the lines run at a vertex.
    pub fn point(&self, vertex: &LineVertex) -> DVec3 {
        match self.geometry {
            Geometry::Vertices => vertex.position,
            Geometry::Fitted => vertex.fitted,
        }
    }

    /// S of a vertex divided by the largest S of the mesh.
    pub fn saliency(&self, vertex: &LineVertex) -> f64 {
        if self.largest_salience > 0.0 { vertex.salience / self.largest_salience } else { 0.0 }
    }
}
