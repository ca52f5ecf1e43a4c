//! Step B, last part: contrast, which tells a crease from a surface that is curved everywhere.
//!
//! chi(v) = theta(v) less the mean, over both sides, of the smallest theta met on a short walk across the line: longer where
//! there was more noise to average, because that widens what is left of a crease.

use crate::config::method;
use crate::math::unit;
use crate::mesh::{Field, TileMesh};
use crate::partition::Scale;
use crate::voting::Vote;
use glam::DVec3;

/// Contrast in radians at each vertex of `at`; `rounds` is K of each vertex.
pub fn contrast(
    mesh: &TileMesh,
    scale: &Scale,
    votes: &Field<Vote>,
    rounds: &[u32],
    at: &[u32],
) -> Field<f64> {
    Field::compute(mesh.vertex_count(), at, |v| {
        let b = votes.get(v).b;
        let k = rounds[v as usize];
        let walk = Walk { steps: scale.contrast_steps(k), reach: scale.contrast_reach(k) };
        let sides = least_on_side(mesh, votes, v, b, walk) + least_on_side(mesh, votes, v, -b, walk);
        votes.get(v).theta - 0.5 * sides
    })
}

/// How far a walk may lead: vertices, and mesh units.
#[derive(Clone, Copy)]
struct Walk {
    steps: usize,
    reach: f64,
}

/// The smallest theta (v included) on a walk from `v` towards `d`.
fn least_on_side(mesh: &TileMesh, votes: &Field<Vote>, v: u32, d: DVec3, walk: Walk) -> f64 {
    let mut d = d;
    let mut current = v;
    let mut least = votes.get(v).theta;
    for step in 0..walk.steps {
        if step > 0 && mesh.is_hub(current) {
            break;
        }
        // The first step is measured in the tangent plane, so that steep folds are left too; then straight on in space.
        let plane = (step == 0).then(|| votes.get(v).t);
        let Some(next) = straightest(mesh, current, d, plane) else { break };
        let e = mesh.position(next) - mesh.position(v);
        let distance2 = e.dot(e);
        if distance2 > walk.reach * walk.reach {
            break;
        }
        least = votes.get(next).theta.min(least);
        if step == 0 {
            d = unit(0.5 * d + 0.5 * e / distance2.sqrt());
        }
        current = next;
    }
    least
}

/// The neighbour of `v` with the largest cosine to `d` above cos 60; with `plane`, the cosine is taken after projection
/// to the plane of `d` and that direction.
fn straightest(mesh: &TileMesh, v: u32, d: DVec3, plane: Option<DVec3>) -> Option<u32> {
    let origin = mesh.position(v);
    let mut best = None;
    let mut largest = method::CONE_COS;
    for &u in mesh.ring_of(v) {
        let e = mesh.position(u) - origin;
        let along = e.dot(d);
        let length = match plane {
            None => e.dot(e).sqrt(),
            Some(t) => (along * along + e.dot(t) * e.dot(t)).sqrt(),
        };
        if length > 0.0 && along / length > largest {
            largest = along / length;
            best = Some(u);
        }
    }
    best
}
