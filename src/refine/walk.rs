//! The step that all walks along and across lines have in common.

use crate::config::method;
use crate::math::unit;
use crate::mesh::TileMesh;
use glam::DVec3;

/// The neighbours of `v` in the cone of 60 degrees around the direction of travel `d`, ascending, with the cosine of the
/// angle to each. Neighbours at the same place have no direction and are left out. `position` is where the walk takes a
/// vertex to be.
pub(super) fn ahead(
    mesh: &TileMesh,
    position: impl Fn(u32) -> DVec3,
    v: u32,
    d: DVec3,
) -> impl Iterator<Item = (u32, f64)> {
    let origin = position(v);
    mesh.ring_of(v).iter().filter_map(move |&u| {
        let e = position(u) - origin;
        let length = e.dot(e).sqrt();
        (length > 0.0).then(|| (u, e.dot(d) / length)).filter(|(_, cos)| *cos >= method::CONE_COS)
    })
}

/// The direction of travel after a step to a vertex whose line runs along `t`, which has no sign of its own: half the
/// old direction, half the line.
pub(super) fn turn(d: DVec3, t: DVec3) -> DVec3 {
    unit(towards(d, t))
}

/// The same, not of unit length.
#[inline]
pub(super) fn towards(d: DVec3, t: DVec3) -> DVec3 {
    d + t * if t.dot(d) >= 0.0 { 1.0 } else { -1.0 }
}

/// The vertex of the highest score: the first of equals. Which of a ring it is cannot be guessed, so nothing here is a
/// branch: positive numbers are in the same order as their bits, and integers are chosen without one.
pub(super) struct Best {
    vertex: u32,
    score: u64,
}

impl Best {
    /// None yet; scores must be above `least`, which is 0 at least.
    #[inline]
    pub fn above(least: f64) -> Best {
        Best { vertex: NOBODY, score: least.to_bits() }
    }

    /// Takes `vertex` if it is `allowed` and better. What is no number is not.
    #[inline]
    pub fn offer(&mut self, vertex: u32, score: f64, allowed: bool) {
        let score = (if score > 0.0 { score } else { 0.0 }).to_bits();
        let better = allowed & (score > self.score);
        self.vertex = if better { vertex } else { self.vertex };
        self.score = if better { score } else { self.score };
    }

    /// The best one.
    #[inline]
    pub fn vertex(self) -> Option<u32> {
        (self.vertex != NOBODY).then_some(self.vertex)
    }
}

/// No vertex of a tile.
const NOBODY: u32 = u32::MAX;

/// The squared cosine of the angle between `e` and `d`, times the squared length of `d`; not a positive number if the angle
/// is above 90 degrees, or if `e` has no length.
#[inline]
pub(super) fn cos2_ahead(e: DVec3, d: DVec3) -> f64 {
    cos2(e.dot(d), e.dot(e))
}

/// The same of a vector with this squared length that goes so far `along` the direction.
#[inline]
pub(super) fn cos2(along: f64, length2: f64) -> f64 {
    let along = if along > 0.0 { along } else { 0.0 };
    along * along / length2
}
