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
    unit(if t.dot(d) >= 0.0 { d + t } else { d - t })
}
