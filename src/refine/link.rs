//! Step D, second part: ridge vertices are joined along the mesh by paths of one to three edges.
//!
//! In: ridges, R, support. Out: paths from the ridge vertices of the tile, each with the weight that decides about it in
//! the line graph. A path is found from either of its ends or from both; equal paths merge later, by global ids.

use super::walk::{ahead, turn};
use crate::config::method;
use crate::mesh::{Field, TileMesh};
use crate::refine::Support;
use crate::voting::{Stop, Vote};
use glam::DVec3;

/// What links are made of.
pub struct Linker<'a> {
    /// The mesh.
    pub mesh: &'a TileMesh,
    /// Where the links take the vertices to be.
    pub positions: &'a Field<DVec3>,
    /// Directions.
    pub votes: &'a Field<Vote>,
    /// R: what a line is strongest in; fold angle averaged along it in radians, or salience.
    pub r: &'a Field<f64>,
    /// Support.
    pub support: &'a Field<Support>,
    /// Where lines stop.
    pub stops: &'a Field<Stop>,
    /// Ridge vertices.
    pub ridge: &'a Field<bool>,
}

/// A path along mesh edges; local indices.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Link {
    path: Path,
    /// The smallest weight of its edges.
    pub weight: f64,
}

impl Link {
    /// Two to four vertices; the end with the lower id comes first.
    pub fn vertices(&self) -> &[u32] {
        self.path.vertices()
    }
}

/// Vertices one after the other.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Path {
    // Not on the heap, where all threads would meet.
    vertices: [u32; method::LINK_STEPS + 1],
    count: usize,
}

impl Path {
    fn push(&mut self, v: u32) {
        self.vertices[self.count] = v;
        self.count += 1;
    }

    fn vertices(&self) -> &[u32] {
        &self.vertices[..self.count]
    }
}

impl Linker<'_> {
    /// The links that start at `v`, if it is a ridge vertex.
    pub fn links_from(&self, v: u32, links: &mut Vec<Link>) {
        if !self.ridge.get(v) {
            return;
        }
        let t = self.votes.get(v).t;
        for d in [t, -t] {
            let on_boundary = |e: &[u32]| e.iter().all(|&v| self.stops.get(v).boundary);
            if let Some(path) = self.path(v, d)
                && !path.vertices().windows(2).any(on_boundary)
            {
                links.push(self.link(path));
            }
        }
    }

    /// The path from `v` towards `d`, if it reaches a ridge vertex or a stop.
    fn path(&self, v: u32, d: DVec3) -> Option<Path> {
        let (mut at, mut d) = (v, d);
        let mut path = Path::default();
        path.push(v);
        for _ in 0..method::LINK_STEPS {
            at = self.next(at, d)?;
            path.push(at);
            if self.is_end(at) {
                return Some(path);
            }
            d = turn(d, self.votes.get(at).t);
        }
        None
    }

    fn is_end(&self, v: u32) -> bool {
        self.ridge.get(v) || self.stops.get(v).any()
    }

    /// The neighbour to go to: a ridge vertex or stop before any other, then the largest cos^2 R.
    fn next(&self, current: u32, d: DVec3) -> Option<u32> {
        let mut best: Option<(bool, f64, u32)> = None;
        for (u, cos) in ahead(self.mesh, |u| self.positions.get(u), current, d) {
            if !(self.stops.get(u).any() || self.support.get(u).passable()) {
                continue;
            }
            let (end, score) = (self.is_end(u), cos * cos * self.r.get(u));
            let better = best.is_none_or(|(e, s, _)| (end && !e) || (end == e && score > s));
            if better {
                best = Some((end, score, u));
            }
        }
        best.map(|(_, _, u)| u)
    }

    /// Orients the path and weighs it.
    fn link(&self, mut path: Path) -> Link {
        let vertices = &mut path.vertices[..path.count];
        // The ends differ, or the path is a ring that the line graph will refuse.
        if self.mesh.id(vertices[0]) >= self.mesh.id(vertices[vertices.len() - 1]) {
            vertices.reverse();
        }
        let weight = vertices.windows(2).fold(f64::INFINITY, |w, e| w.min(self.edge_weight(e[0], e[1])));
        Link { path, weight }
    }

    /// min(R_a, R_b) (0.2 + 0.8 mean |cos(edge, t)|): an edge along the line is worth more than one across it.
    fn edge_weight(&self, a: u32, b: u32) -> f64 {
        let e = self.positions.get(b) - self.positions.get(a);
        let length = e.dot(e).sqrt();
        let along = 0.5 * (e.dot(self.votes.get(a).t).abs() + e.dot(self.votes.get(b).t).abs()) / length;
        self.r.get(a).min(self.r.get(b)) * (0.2 + 0.8 * along)
    }
}
