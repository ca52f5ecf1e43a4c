//! Positions as walks along lines see them: noise taken off, so that a direction from vertex to vertex means something.
//!
//! In: the mesh and the local number of refinement rounds. Out: positions after as many rounds of umbrella smoothing, each
//! half way to the mean of the neighbours, as the noise asks for: at most three, none on a clean mesh. Only directions of
//! walks are taken from them; lines run through the vertices where they are. Vertices on a boundary stay.

use crate::mesh::{Field, TileMesh};
use crate::partition::{Rings, Scale};
use crate::voting::on_boundary;
use glam::DVec3;

/// Positions in mesh units. `rounds` is K of each vertex; `smoothed` holds a ring for each round of smoothing.
pub fn smooth(mesh: &TileMesh, scale: &Scale, rounds: &[u32], smoothed: &Rings) -> Field<DVec3> {
    let n = mesh.vertex_count();
    let most = smoothed.rings();
    let mut positions = Field::compute(n, smoothed.all(), |v| mesh.position(v));
    for round in 1..=most {
        positions = Field::compute(n, smoothed.within(most - round), |v| {
            let own = positions.get(v);
            let ring = mesh.ring_of(v);
            let asked = scale.smoothing_rounds(rounds[v as usize]);
            debug_assert!(asked <= most, "round {asked} of smoothing lies outside what the halo covers");
            if asked < round || ring.is_empty() || on_boundary(mesh, v) {
                return own;
            }
            let mut sum = DVec3::ZERO;
            ring.iter().for_each(|&u| sum += positions.get(u));
            0.5 * own + 0.5 * (sum / ring.len() as f64)
        });
    }
    positions
}
