//! Taubin smoothing. In: a mesh; out: positions after a number of iterations.
//!
//! Taubin, "A signal processing approach to fair surface design", SIGGRAPH 1995: each iteration is a step of the
//! Laplacian forth and a slightly longer one back, so that the surface does not shrink. All neighbours weigh the
//! same.

use super::super::mesh::Mesh;
use glam::DVec3;

/// The step forth.
const LAMBDA: f64 = 0.5;
/// The step back; 1/lambda + 1/mu = 0.11, a usual pass band.
const MU: f64 = -0.53;

/// Smooths step by step.
pub struct Taubin {
    /// Positions as they are now, mesh units.
    pub positions: Vec<DVec3>,
    neighbours: Vec<Vec<u32>>,
}

impl Taubin {
    /// Starts from the mesh as it is.
    pub fn new(mesh: &Mesh) -> Taubin {
        let mut neighbours = vec![Vec::new(); mesh.positions.len()];
        for &[a, b, c] in &mesh.faces {
            for [from, to] in [[a, b], [b, c], [c, a]] {
                neighbours[from as usize].push(to);
                neighbours[to as usize].push(from);
            }
        }
        for around in &mut neighbours {
            around.sort_unstable();
            around.dedup();
        }
        Taubin { positions: mesh.positions.clone(), neighbours }
    }

    /// One iteration.
    pub fn iterate(&mut self) {
        self.step(LAMBDA);
        self.step(MU);
    }

    fn step(&mut self, factor: f64) {
        let moved = self.positions.iter().zip(&self.neighbours).map(|(&position, around)| {
            if around.is_empty() {
                return position;
            }
            let sum: DVec3 = around.iter().map(|&u| self.positions[u as usize]).sum();
            position + (sum / around.len() as f64 - position) * factor
        });
        self.positions = moved.collect();
    }
}
