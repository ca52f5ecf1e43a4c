//! The threshold that suits the truth best. In: angles at the edges of a mesh; out: the threshold with the highest F1
//! at 1h, over all thresholds there are.
//!
//! Positions do not change from one set of angles to the next. So what each edge adds to precision, and which edges
//! are near each sample of the truth, is found once; each threshold then follows from the one above it by sorting.
//! The F1 is exactly that of `metric::score` for the same edges.

use super::super::mesh::{Hinge, Mesh};
use super::super::metric::{Lines, Match, STEP, Samples, TOLERANCES, Truth, compare};
use glam::DVec3;
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// The edges of a mesh against a truth.
pub struct Sweep {
    /// Edges with two faces.
    pub hinges: Vec<Hinge>,
    /// Of each edge: its length, and how much of it is within 1h of the truth. Mesh units.
    edges: Vec<[f64; 2]>,
    /// Of each sample of the truth: the length it stands for, and the edges within 1h of it.
    truth: Vec<(f64, Vec<u32>)>,
}

/// A choice of edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// Edges with at least this angle are lines, degrees; infinite for none at all.
    pub threshold_deg: f64,
    /// How well they match at 1h.
    pub quality: Match,
}

impl Sweep {
    /// Prepares the edges of `mesh`. `h` is its median side.
    pub fn new(mesh: &Mesh, truth: &Truth, h: f64) -> Sweep {
        let hinges = mesh.hinges();
        let reach = TOLERANCES[0] * h;
        let chains: Vec<Vec<u32>> = hinges.iter().map(|hinge| hinge.ends.to_vec()).collect();
        let of_edges = Samples::of_chains(&mesh.positions, &chains, STEP * h);
        let of_truth = Samples::of_chains(&truth.points, &truth.curves, STEP * h);
        let distances = of_edges.distances_to(&of_truth);
        let mut edges = vec![[0.0; 2]; hinges.len()];
        for (i, &edge) in of_edges.chains.iter().enumerate() {
            edges[edge][0] += of_edges.lengths[i];
            edges[edge][1] += if distances[i] <= reach { of_edges.lengths[i] } else { 0.0 };
        }
        // Samples far from all truth are nobody's neighbours.
        let near = (0..distances.len()).filter(|&i| distances[i] <= 1.01 * reach);
        let place = |i: usize| GeomWithData::new(of_edges.points[i].to_array(), of_edges.chains[i] as u32);
        let tree = RTree::bulk_load(near.map(place).collect());
        let edges_near = |point: &DVec3| {
            let mut near: Vec<u32> = tree
                .locate_within_distance(point.to_array(), reach * reach)
                .map(|sample| sample.data)
                .collect();
            near.sort_unstable();
            near.dedup();
            near
        };
        let truth = of_truth.lengths.iter().copied().zip(of_truth.points.iter().map(edges_near)).collect();
        Sweep { hinges, edges, truth }
    }

    /// The best threshold for these angles in degrees, one for each edge; of equally good ones the highest.
    pub fn best(&self, angles: &[f64]) -> Choice {
        let total: f64 = self.truth.iter().map(|(length, _)| length).sum();
        let mut edges: Vec<(f64, [f64; 2])> =
            angles.iter().copied().zip(self.edges.iter().copied()).collect();
        edges.sort_by(|a, b| b.0.total_cmp(&a.0));
        // A sample of the truth is found from the largest angle near it on.
        let found_at = |near: &[u32]| near.iter().map(|&e| angles[e as usize]).max_by(f64::total_cmp);
        let mut truth: Vec<(f64, f64)> =
            self.truth.iter().filter_map(|(length, near)| Some((found_at(near)?, *length))).collect();
        truth.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut truth = truth.into_iter().peekable();
        let (mut found, mut near, mut recalled) = (0.0, 0.0, 0.0);
        let mut best = Choice { threshold_deg: f64::INFINITY, quality: compare([0.0, 0.0], [0.0, total]) };
        for group in edges.chunk_by(|a, b| a.0 == b.0) {
            let threshold_deg = group[0].0;
            for (_, [length, close]) in group {
                found += length;
                near += close;
            }
            while let Some((_, length)) = truth.next_if(|(angle, _)| *angle >= threshold_deg) {
                recalled += length;
            }
            let quality = compare([near, found], [recalled, total]);
            if quality.f1 > best.quality.f1 {
                best = Choice { threshold_deg, quality };
            }
        }
        best
    }

    /// The edges with at least the threshold, as loose lines.
    pub fn lines(&self, mesh: &Mesh, angles: &[f64], threshold_deg: f64) -> Lines {
        let chosen = self.hinges.iter().zip(angles).filter(|(_, angle)| **angle >= threshold_deg);
        Lines::of_edges(&mesh.positions, chosen.map(|(hinge, _)| hinge.ends))
    }
}
