//! Step B, last part: contrast, which tells a crease from a surface that is curved everywhere.
//!
//! chi(v) = theta(v) less the mean, over both sides, of the smallest theta met on a short walk across the line: longer where
//! there was more noise to average, because that widens what is left of a crease.

use super::walk::{Best, cos2};
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
        let k = rounds[v as usize];
        let (steps, reach) = (scale.contrast_steps(k), scale.contrast_reach(k));
        let vote = votes.get(v);
        let mut sides = [Walk::new(v, vote.b, vote.theta), Walk::new(v, -vote.b, vote.theta)];
        // By turns: each step waits for the one before, but not for the other side.
        for step in 0..steps {
            for side in sides.iter_mut().filter(|side| side.goes_on) {
                side.go(mesh, votes, v, step, reach);
            }
        }
        vote.theta - 0.5 * (sides[0].least + sides[1].least)
    })
}

/// A walk across the line of a vertex.
struct Walk {
    current: u32,
    direction: DVec3,
    /// The smallest theta on it.
    least: f64,
    goes_on: bool,
}

impl Walk {
    fn new(v: u32, direction: DVec3, theta: f64) -> Walk {
        Walk { current: v, direction, least: theta, goes_on: true }
    }

    /// One step of a walk from `v` that leads no farther than `reach` from there.
    fn go(&mut self, mesh: &TileMesh, votes: &Field<Vote>, v: u32, step: usize, reach: f64) {
        self.goes_on = false;
        if step > 0 && mesh.is_hub(self.current) {
            return;
        }
        // The first step is measured in the tangent plane, so that steep folds are left too; then straight on in space.
        let next = match step {
            0 => first(mesh, v, self.direction, votes.get(v).t),
            _ => straightest(mesh, self.current, self.direction, |e, _| e.dot(e)),
        };
        let Some(next) = next else { return };
        let e = mesh.position(next) - mesh.position(v);
        let distance2 = e.dot(e);
        if distance2 > reach * reach {
            return;
        }
        self.least = votes.get(next).theta.min(self.least);
        if step == 0 {
            self.direction = unit(0.5 * self.direction + 0.5 * e / distance2.sqrt());
        }
        (self.current, self.goes_on) = (next, true);
    }
}

/// The neighbour of `v` with the largest cosine to `d` above cos 60, after projection to the plane of `d` and `t`.
fn first(mesh: &TileMesh, v: u32, d: DVec3, t: DVec3) -> Option<u32> {
    straightest(mesh, v, d, |e, along| along * along + e.dot(t) * e.dot(t))
}

/// The neighbour of `v` with the largest cosine to the unit vector `d` above cos 60. An edge that goes so far along `d` has
/// the squared length `length2`.
#[inline]
fn straightest(mesh: &TileMesh, v: u32, d: DVec3, length2: impl Fn(DVec3, f64) -> f64) -> Option<u32> {
    let origin = mesh.position(v);
    let mut best = Best::above(method::CONE_COS * method::CONE_COS);
    for &u in mesh.ring_of(v) {
        let e = mesh.position(u) - origin;
        let along = e.dot(d);
        best.offer(u, cos2(along, length2(e, along)), true);
    }
    best.vertex()
}
