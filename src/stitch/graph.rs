//! Step E, first part: the line graph.
//!
//! In: vertices and link paths of all tiles. Out: a sparse graph without doubled lines: a path is kept, all its edges at
//! once, unless its ends are already near each other in the graph built so far. Paths are considered in the order of
//! their keys, so the graph does not depend on which tile handed over what.

use super::fragments::{Candidate, LinkPath};
use smallvec::SmallVec;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Undirected graph over line vertices; nodes are indices that ascend with global ids.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    /// Neighbours of each node, ascending, with the length of the edge. Junctions have more than a few, and are rare.
    adjacency: Vec<SmallVec<[(u32, f64); 3]>>,
}

impl Graph {
    /// A graph of `nodes` nodes without edges.
    pub fn new(nodes: usize) -> Graph {
        Graph { adjacency: vec![SmallVec::new(); nodes] }
    }

    /// Number of nodes, with and without edges.
    pub fn nodes(&self) -> u32 {
        self.adjacency.len() as u32
    }

    /// Neighbours of `a`, ascending, with lengths.
    pub fn neighbours(&self, a: u32) -> &[(u32, f64)] {
        &self.adjacency[a as usize]
    }

    /// Number of edges at `a`.
    pub fn degree(&self, a: u32) -> usize {
        self.adjacency[a as usize].len()
    }

    /// Adds the edge between `a` and `b`; an edge that is there stays as it is.
    pub fn add(&mut self, a: u32, b: u32, length: f64) {
        for (from, to) in [(a, b), (b, a)] {
            let list = &mut self.adjacency[from as usize];
            if let Err(at) = list.binary_search_by_key(&to, |e| e.0) {
                list.insert(at, (to, length));
            }
        }
    }

    /// Removes the edge between `a` and `b`.
    pub fn remove(&mut self, a: u32, b: u32) {
        self.adjacency[a as usize].retain(|e| e.0 != b);
        self.adjacency[b as usize].retain(|e| e.0 != a);
    }

    /// Removes all edges at `a`.
    pub fn isolate(&mut self, a: u32) {
        for (b, _) in std::mem::take(&mut self.adjacency[a as usize]) {
            self.adjacency[b as usize].retain(|e| e.0 != a);
        }
    }

    /// The neighbour of `at` that is not `from`, with the length of the edge; for nodes of degree two.
    pub fn onward(&self, from: u32, at: u32) -> Option<(u32, f64)> {
        self.neighbours(at).iter().copied().find(|e| e.0 != from)
    }
}

/// How far apart along the graph the ends of a path must be for it to be kept: `base` plus `per_round` for each
/// refinement round at the quieter end; mesh units.
#[derive(Clone, Copy, Debug)]
pub struct LoopLength {
    /// Without noise.
    pub base: f64,
    /// For each round.
    pub per_round: f64,
}

/// Builds the graph. `links` must be in the order of their keys, without repetition; `vertices` ascending.
pub fn build(vertices: &[Candidate], links: &[LinkPath], apart: LoopLength) -> Graph {
    let mut graph = Graph::new(vertices.len());
    let mut search = Search::new(vertices.len());
    let limit = |v: u32| apart.base + apart.per_round * f64::from(vertices[v as usize].rounds);
    for link in links {
        let nodes: SmallVec<[u32; 4]> = link.ids().iter().filter_map(|id| node_of(vertices, *id)).collect();
        let (a, b) = (nodes[0], nodes[nodes.len() - 1]);
        if !search.within(&graph, a, b, limit(a).min(limit(b))) {
            for e in nodes.windows(2) {
                graph.add(e[0], e[1], distance(vertices, e[0], e[1]));
            }
        }
    }
    graph
}

/// The node of a global id.
pub fn node_of(vertices: &[Candidate], id: crate::mesh::VertexId) -> Option<u32> {
    vertices.binary_search_by_key(&id, |v| v.id).ok().map(|i| i as u32)
}

/// Length of the edge between two nodes.
pub fn distance(vertices: &[Candidate], a: u32, b: u32) -> f64 {
    let d = vertices[a as usize].position - vertices[b as usize].position;
    d.dot(d).sqrt()
}

/// Shortest paths from one node, with arrays that are reused from search to search.
struct Search {
    best: Vec<f64>,
    epoch: Vec<u32>,
    now: u32,
    queue: BinaryHeap<Reverse<(Length, u32)>>,
}

/// A length that is never NaN, ordered.
#[derive(Clone, Copy, PartialEq)]
struct Length(f64);

impl Eq for Length {}

impl PartialOrd for Length {
    fn partial_cmp(&self, other: &Length) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Length {
    fn cmp(&self, other: &Length) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl Search {
    fn new(nodes: usize) -> Search {
        Search { best: vec![0.0; nodes], epoch: vec![0; nodes], now: 0, queue: BinaryHeap::new() }
    }

    /// Whether `b` can be reached from `a` within `limit`. Adding lengths is monotone, so what Dijkstra finds is the least
    /// rounded sum over all paths and does not depend on the order of the queue.
    fn within(&mut self, graph: &Graph, a: u32, b: u32, limit: f64) -> bool {
        self.now = self.now.wrapping_add(1);
        if self.now == 0 {
            self.epoch.fill(0);
            self.now = 1;
        }
        self.queue.clear();
        self.reach(a, 0.0);
        while let Some(Reverse((Length(d), u))) = self.queue.pop() {
            if u == b {
                return true;
            }
            if d > self.best[u as usize] {
                continue;
            }
            for &(w, length) in graph.neighbours(u) {
                let far = d + length;
                let known = self.epoch[w as usize] == self.now && self.best[w as usize] <= far;
                if far <= limit && !known {
                    self.reach(w, far);
                }
            }
        }
        false
    }

    fn reach(&mut self, v: u32, d: f64) {
        self.best[v as usize] = d;
        self.epoch[v as usize] = self.now;
        self.queue.push(Reverse((Length(d), v)));
    }
}
