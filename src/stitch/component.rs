//! Step E and F on whole components: from candidates to finished lines.
//!
//! In: a [`Part`] of the candidate graph that is made of whole connected components. Out: its lines with their vertices.
//! Each step of it looks at one component only. Paths are compared along the graph built so far, which never leaves a
//! component; branches, their junctions and the sums of a component lie inside it; so do chains, and a fitted point
//! depends on its chain. The floor for angles takes lines out and looks at components again, which changes nothing where
//! no line was taken out. All orders are orders of keys and ids, so the order within a component is that within the whole.
//! Hence components can be finished in any company and at any time, and the lines are those of the whole mesh.
//!
//! Two things are left for the end: strengths are not divided by the largest S, and lines are not put in order.

use super::fragments::{Candidate, Class, Kind, LinkPath, OpenEdge};
use super::graph::{self, Graph, LoopLength, distance, node_of};
use super::lines::{self, ChainLine, Measures};
use super::set::LineVertex;
use super::{prune, smooth};
use crate::config::{Params, method};
use crate::mesh::VertexId;
use crate::partition::Scale;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What decides about lines.
#[derive(Clone, Copy, Debug)]
pub struct Rules {
    /// Units of the method.
    pub scale: Scale,
    /// Shortest component, mesh units.
    pub shortest: f64,
    /// Smallest angle of a line, degrees.
    pub min_angle_deg: f64,
}

impl Rules {
    /// Those of a run.
    pub fn new(scale: &Scale, params: &Params) -> Rules {
        let shortest = scale.length(params.min_length_sigmas * method::SIGMA_EDGES);
        Rules { scale: *scale, shortest, min_angle_deg: params.min_angle_deg }
    }
}

/// A part of the candidate graph. Nothing needs to be in order, and anything may be there several times.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Every vertex that a link or edge names.
    pub vertices: Vec<Candidate>,
    /// Paths.
    pub links: Vec<LinkPath>,
    /// Boundaries and non-manifold edges.
    pub open_edges: Vec<OpenEdge>,
}

impl Part {
    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        let Part { vertices, links, open_edges } = self;
        (size_of_val(&vertices[..]) + size_of_val(&links[..]) + size_of_val(&open_edges[..])) as u64
    }

    /// Adds another one.
    pub fn append(&mut self, other: Part) {
        self.vertices.extend(other.vertices);
        self.links.extend(other.links);
        self.open_edges.extend(other.open_edges);
    }

    /// The same in pieces of at most `most` elements each.
    pub fn pieces(self, most: usize) -> Vec<Part> {
        let Part { vertices, links, open_edges } = self;
        if vertices.len() + links.len() + open_edges.len() <= most {
            return vec![Part { vertices, links, open_edges }];
        }
        let none = Part::default;
        let vertices = vertices.chunks(most).map(|chunk| Part { vertices: chunk.to_vec(), ..none() });
        let links = links.chunks(most).map(|chunk| Part { links: chunk.to_vec(), ..none() });
        let open_edges = open_edges.chunks(most).map(|chunk| Part { open_edges: chunk.to_vec(), ..none() });
        vertices.chain(links).chain(open_edges).collect()
    }
}

/// A line under global ids.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FinishedLine {
    /// From end to end, from the end that makes the sequence the smaller one; a closed line ends on its first vertex.
    pub ids: Vec<VertexId>,
    /// With an undivided strength.
    pub measures: Measures,
}

/// Lines that nothing can change any more.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Finished {
    /// Every vertex that a line runs through, ascending, and whether a crease does: then its fitted point is one.
    pub vertices: Vec<(LineVertex, bool)>,
    /// Creases, then boundaries, then non-manifold edges; each in canonical order.
    pub lines: Vec<FinishedLine>,
}

impl Finished {
    /// All of `parts`, which have no vertex in common, in order.
    pub fn joined(parts: Vec<Finished>) -> Finished {
        let mut all = Finished::default();
        for Finished { vertices, lines } in parts {
            all.vertices.extend(vertices);
            all.lines.extend(lines);
        }
        all.vertices.par_sort_unstable_by_key(|(vertex, _)| vertex.id);
        all.lines.par_sort_unstable_by(|a, b| {
            (a.measures.kind().cmp(&b.measures.kind())).then_with(|| a.ids.cmp(&b.ids))
        });
        all
    }
}

/// Finishes whole components whose planes were fitted.
pub fn finish(part: Part, rules: &Rules) -> Finished {
    Draft::new(part, rules).finish(rules)
}

/// Whole components without the creases that are too short or too faint. Nothing up to here reads how planes were fitted, or
/// the class that comes of it; nothing after reads it of vertices that are on no line.
pub struct Draft {
    /// Ascending, each once.
    vertices: Vec<Candidate>,
    open_edges: Vec<OpenEdge>,
    creases: Graph,
}

impl Draft {
    /// Of whole components.
    pub fn new(part: Part, rules: &Rules) -> Draft {
        let Part { mut vertices, mut links, mut open_edges } = part;
        vertices.sort_unstable_by_key(|v| v.id);
        debug_assert!(
            vertices.chunk_by(|a, b| a.id == b.id).all(|same| same.iter().all(|v| *v == same[0])),
            "two tiles disagree about a vertex"
        );
        vertices.dedup_by_key(|v| v.id);
        links.sort_unstable_by(LinkPath::order);
        links.dedup();
        open_edges.sort_unstable();
        open_edges.dedup();
        let creases = pruned(&vertices, &links, rules);
        Draft { vertices, open_edges, creases }
    }

    /// The vertices that are left, ascending.
    pub fn left(&mut self) -> impl Iterator<Item = &mut Candidate> {
        let Draft { vertices, open_edges, creases } = self;
        let mut left: Vec<bool> = (0..creases.nodes()).map(|v| creases.degree(v) > 0).collect();
        let ends = open_edges.iter().flat_map(|e| e.ends).filter_map(|id| node_of(vertices, id));
        ends.for_each(|v| left[v as usize] = true);
        vertices.iter_mut().zip(left).filter(|(_, left)| *left).map(|(v, _)| v)
    }

    /// The lines, once planes were fitted at the vertices that are left.
    pub fn finish(self, rules: &Rules) -> Finished {
        let Draft { vertices, open_edges, creases: mut graph } = self;
        let mut lines = creases(&mut graph, &vertices, rules);
        let fitted = smooth::fit_lines(&graph, &vertices, &lines, &rules.scale);
        let creases = lines.len();
        for (kind, class) in [(Kind::Boundary, Class::Boundary), (Kind::NonManifold, Class::NonManifold)] {
            let mut open = Graph::new(vertices.len());
            for edge in open_edges.iter().filter(|e| e.kind() == kind) {
                if let [Some(a), Some(b)] = edge.ends.map(|id| node_of(&vertices, id)) {
                    open.add(a, b, distance(&vertices, a, b));
                }
            }
            let chains = lines::chains(&open, |v| vertices[v as usize].corner);
            lines.extend(chains.into_iter().map(|chain| lines::plain_line(&vertices, chain, class)));
        }
        let mut used = vec![false; vertices.len()];
        lines.iter().flat_map(|line| &line.nodes).for_each(|&v| used[v as usize] = true);
        let mut on_crease = vec![false; vertices.len()];
        lines[..creases].iter().flat_map(|line| &line.nodes).for_each(|&v| on_crease[v as usize] = true);
        let named = |line: ChainLine| FinishedLine {
            ids: line.nodes.iter().map(|&v| vertices[v as usize].id).collect(),
            measures: line.measures,
        };
        Finished {
            vertices: (0..vertices.len())
                .filter(|&v| used[v])
                .map(|v| (LineVertex::new(&vertices[v], fitted[v]), on_crease[v]))
                .collect(),
            lines: lines.into_iter().map(named).collect(),
        }
    }
}

/// The graph of creases, without what is too short or too faint. `links` are in the order of their keys, without
/// repetition.
fn pruned(vertices: &[Candidate], links: &[LinkPath], rules: &Rules) -> Graph {
    let scale = &rules.scale;
    let apart = LoopLength {
        base: scale.length(method::LOOP_LENGTH),
        per_round: scale.length(method::LOOP_PER_ROUND),
    };
    let mut graph = graph::build(vertices, links, apart);
    prune::prune_branches(&mut graph, vertices, scale.length(method::PRUNE_LENGTH));
    prune::prune_components(&mut graph, vertices, rules.shortest);
    graph
}

/// The lines that the graph falls into, without those below the smallest angle, which are taken out of it.
fn creases(graph: &mut Graph, vertices: &[Candidate], rules: &Rules) -> Vec<ChainLine> {
    let lines_of = |graph: &Graph| -> Vec<ChainLine> {
        let chains = lines::chains(graph, |v| vertices[v as usize].corner).into_iter();
        chains.map(|chain| lines::crease_line(vertices, chain)).collect()
    };
    let mut lines = lines_of(graph);
    let weak: Vec<&ChainLine> =
        lines.iter().filter(|line| line.measures.angle < rules.min_angle_deg).collect();
    if !weak.is_empty() {
        // What a weak line held together may be too short on its own, and its junctions may be none any more.
        weak.iter().flat_map(|line| line.nodes.windows(2)).for_each(|e| graph.remove(e[0], e[1]));
        prune::prune_components(graph, vertices, rules.shortest);
        lines = lines_of(graph);
    }
    lines
}
