//! Step E, last part: the graph falls apart into polylines, and these get their final order.
//!
//! In: a graph. Out: chains between junctions, corners and tips, and closed loops. Canonical: a line starts at the end
//! that makes its sequence of ids the smaller one, and lines are ordered by these sequences.

use super::fragments::{Candidate, Class, Kind};
use super::graph::{Graph, distance};
use crate::config::method;
use crate::math::DEGREE;
use crate::refine::Bend;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// What is said of a line.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measures {
    /// Weak, sharp, boundary or non-manifold.
    pub class: Class,
    /// Whether it returns to its start.
    pub closed: bool,
    /// In mesh units.
    pub length: f64,
    /// Mean S over its length, divided by the largest S of the mesh: 0 to 1. As long as that is not known, not divided.
    pub strength: f64,
    /// Mean dihedral angle over its length, degrees.
    pub angle: f64,
    /// Convex or concave, whichever it is over the greater length.
    pub bend: Bend,
}

impl Measures {
    /// Crease, boundary or non-manifold.
    pub fn kind(&self) -> Kind {
        match self.class {
            Class::Boundary => Kind::Boundary,
            Class::NonManifold => Kind::NonManifold,
            _ => Kind::Crease,
        }
    }
}

/// A chain of nodes that is a line.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainLine {
    /// Nodes of the graph; a closed line ends on its first.
    pub nodes: Vec<u32>,
    /// With an undivided strength.
    pub measures: Measures,
}

/// Chains of nodes between the nodes where lines end, in canonical order.
pub fn chains(graph: &Graph, ends_at: impl Fn(u32) -> bool) -> Vec<Vec<u32>> {
    let is_end = |v: u32| graph.degree(v) != 2 || ends_at(v);
    let mut used = vec![false; graph.nodes() as usize];
    let mut all = Vec::new();
    for v in (0..graph.nodes()).filter(|&v| is_end(v)) {
        used[v as usize] = true;
        for &(u, _) in graph.neighbours(v) {
            let chain = follow(graph, v, u, &is_end);
            chain.iter().for_each(|&w| used[w as usize] = true);
            // Every chain is found from both its ends; one that returns to its end, from both its sides.
            let backwards: Vec<u32> = chain.iter().rev().copied().collect();
            if chain <= backwards {
                all.push(chain);
            }
        }
    }
    for v in 0..graph.nodes() {
        if !used[v as usize] && graph.degree(v) == 2 {
            // A loop without any end starts at its lowest node and goes to the lower of its neighbours.
            let chain = follow(graph, v, graph.neighbours(v)[0].0, &|w| w == v);
            chain.iter().for_each(|&w| used[w as usize] = true);
            all.push(chain);
        }
    }
    all.sort_unstable();
    all.dedup();
    all
}

/// From `v` over `next` on to the next end.
fn follow(graph: &Graph, v: u32, next: u32, is_end: &impl Fn(u32) -> bool) -> Vec<u32> {
    let mut chain = vec![v, next];
    while !is_end(chain[chain.len() - 1]) {
        let (from, at) = (chain[chain.len() - 2], chain[chain.len() - 1]);
        match graph.onward(from, at) {
            Some((onward, _)) => chain.push(onward),
            None => break,
        }
    }
    chain
}

/// Measures a chain of creases.
pub fn crease_line(vertices: &[Candidate], chain: Vec<u32>) -> ChainLine {
    let mut line = plain_line(vertices, chain, Class::Weak);
    let (mut salience, mut angle, mut convex) = (0.0, 0.0, 0.0);
    let sign = |vertex: &Candidate| match vertex.fit.bend {
        Bend::Convex => 1.0,
        Bend::Concave => -1.0,
        Bend::Unknown => 0.0,
    };
    for e in line.nodes.windows(2) {
        let [a, b] = [e[0], e[1]].map(|v| &vertices[v as usize]);
        let half = 0.5 * distance(vertices, e[0], e[1]);
        salience += half * (a.salience + b.salience);
        angle += half * (a.fit.angle + b.fit.angle);
        convex += half * (sign(a) + sign(b));
    }
    let measures = &mut line.measures;
    // A line has a length; the guard is for the one that does not.
    let length = measures.length.max(f64::MIN_POSITIVE);
    measures.strength = salience / length;
    measures.angle = angle / length / DEGREE;
    measures.bend = match convex {
        c if c > 0.0 => Bend::Convex,
        c if c < 0.0 => Bend::Concave,
        _ => Bend::Unknown,
    };
    if measures.angle >= method::SHARP_DEG {
        measures.class = Class::Sharp;
    }
    line
}

/// Length of a polyline.
pub fn length(points: impl Iterator<Item = DVec3>) -> f64 {
    let (mut sum, mut last) = (0.0, None);
    for point in points {
        if let Some(last) = last.replace(point) {
            let d: DVec3 = point - last;
            sum += d.dot(d).sqrt();
        }
    }
    sum
}

/// A chain of mesh edges without a fold of its own.
pub fn plain_line(vertices: &[Candidate], chain: Vec<u32>, class: Class) -> ChainLine {
    let length = length(chain.iter().map(|&v| vertices[v as usize].position));
    let closed = chain.first() == chain.last();
    let measures = Measures { class, closed, length, strength: 0.0, angle: 0.0, bend: Bend::Unknown };
    ChainLine { nodes: chain, measures }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn graph(nodes: usize, edges: &[(u32, u32)]) -> Graph {
        let mut graph = Graph::new(nodes);
        edges.iter().for_each(|&(a, b)| graph.add(a, b, 1.0));
        graph
    }

    #[test]
    fn chains_break_at_junctions_and_corners() {
        // A junction at 2 with arms to 0, 5 and 6; a corner at 4 on the arm to 5.
        let g = graph(7, &[(0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (2, 6)]);
        assert_eq!(chains(&g, |v| v == 4), [vec![0, 1, 2], vec![2, 3, 4], vec![2, 6], vec![4, 5]]);
    }

    #[test]
    fn loops_are_closed_once() {
        let ring = graph(4, &[(0, 2), (2, 1), (1, 3), (3, 0)]);
        assert_eq!(chains(&ring, |_| false), [vec![0, 2, 1, 3, 0]]);
        // With a corner on it, the same loop starts and ends there.
        assert_eq!(chains(&ring, |v| v == 1), [vec![1, 2, 0, 3, 1]]);
        // A loop at a junction.
        let lasso = graph(4, &[(0, 1), (1, 2), (2, 3), (3, 1)]);
        assert_eq!(chains(&lasso, |_| false), [vec![0, 1], vec![1, 2, 3, 1]]);
    }
}
