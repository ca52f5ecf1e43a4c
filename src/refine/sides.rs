//! The planes that meet at a line vertex: one on each side of the crease, and further ones at corners.
//!
//! In: the patch of a vertex and the direction across its line. Out: planes. Whether a face lies on one side or the other
//! is told by place where the fold is weak and by normal where it is sharp, and by both in between; both are one number, so
//! that there is no threshold between the two. A side is what is connected: across the next crease a step of a stair may
//! be parallel to this one, but it is not reached.

use super::patch::{Connected, Patch, PatchFace};
use super::plane::{Plane, agreement, fit_plane, mean_normal};
use crate::config::method;
use crate::math::{Quadric, unit};
use glam::DVec3;

/// Memory that is used again from vertex to vertex.
#[derive(Default)]
pub(super) struct Work {
    /// Distance of each face across the line.
    places: Vec<f64>,
    connected: Connected,
}

/// The planes on the side of `b` and on the other, or `None` where the faces do not fall into two sides. `slack` is how far
/// the vertex may lie from the line.
pub(super) fn two_sides(patch: &Patch, b: DVec3, slack: f64, work: &mut Work) -> Option<[Plane; 2]> {
    work.places.clear();
    work.places.extend(patch.faces.iter().map(|face| face.centre.dot(b)));
    let mut normals = split(patch, &work.places)?;
    let mut shift = 0.0;
    let mut planes = None;
    for round in 0..=method::FIT_ROUNDS {
        let between = normals[0] - normals[1];
        let mut found = [Plane { normal: DVec3::ZERO, offset: 0.0, variance: 1.0 }; 2];
        for (plane, (sign, normal)) in found.iter_mut().zip([1.0, -1.0].into_iter().zip(normals)) {
            let Work { places, connected } = &mut *work;
            let weight = |i: usize, face: &PatchFace| {
                let across = coordinate(places[i], face.normal, between) - shift / method::FIT_RAMP;
                let share = (sign * across).clamp(0.0, 1.0);
                face.weight * agreement(face.normal, normal) * share
            };
            patch.connected(weight, connected);
            if connected.faces.is_empty() {
                return None;
            }
            if round == 0 {
                plane.normal = mean_normal(patch, connected);
            } else {
                *plane = fit_plane(patch, connected, normal);
            }
        }
        normals = found.map(|plane| plane.normal);
        if round > 0 {
            let meet = meeting(&found).minimum(slack);
            shift = meet.dot(b).clamp(-method::FIT_SHIFT, method::FIT_SHIFT);
            planes = Some(found);
        }
    }
    planes
}

/// On which side of the crease a face lies, in widths of the ramp: by its distance across (`place`) and by which of the two
/// normals it agrees with; `between` is their difference.
fn coordinate(place: f64, normal: DVec3, between: DVec3) -> f64 {
    (place + method::FIT_NORMAL * normal.dot(between)) / method::FIT_RAMP
}

/// First normals of the two sides: means of two groups, from a division by place alone.
fn split(patch: &Patch, places: &[f64]) -> Option<[DVec3; 2]> {
    let mut normals = [DVec3::ZERO; 2];
    for _ in 0..method::SPLIT_ROUNDS {
        let between = normals[0] - normals[1];
        let mut sums = [DVec3::ZERO; 2];
        for (face, &place) in patch.faces.iter().zip(places).filter(|(face, _)| face.near > 0.0) {
            let across = coordinate(place, face.normal, between).clamp(-1.0, 1.0);
            sums[usize::from(across < 0.0)] += face.normal * (face.near * across.abs());
        }
        if sums.contains(&DVec3::ZERO) {
            return None;
        }
        normals = sums.map(unit);
    }
    Some(normals)
}

/// Planes of the faces around the one-ring that belong to none of `normals`, which grows by theirs; those that pass the
/// vertex within `close` kh.
pub(super) fn further_planes(
    patch: &Patch,
    normals: &mut Vec<DVec3>,
    close: f64,
    work: &mut Work,
) -> Vec<Plane> {
    let Work { connected, .. } = work;
    let total: f64 = patch.faces.iter().map(|face| face.near).sum();
    let mut planes = Vec::new();
    for _ in 0..method::MORE_PLANES {
        let Some((mut normal, share)) = densest(patch, normals) else { break };
        if share < method::MORE_SHARE * total {
            break;
        }
        let mut found = None;
        for round in 0..3 {
            patch.connected(|_, face| face.weight * agreement(face.normal, normal), connected);
            if connected.faces.is_empty() {
                break;
            }
            if round < 2 {
                normal = mean_normal(patch, connected);
            } else {
                found = Some(fit_plane(patch, connected, normal));
            }
        }
        normals.push(found.map_or(normal, |plane| plane.normal));
        if let Some(plane) = found {
            let far = plane.offset / close;
            let counts = 1.0 - far * far;
            if counts > 0.0 {
                planes.push(Plane { variance: plane.variance / (counts * counts), ..plane });
            }
        }
    }
    planes
}

/// The normal of a face near the vertex that agrees with none of `normals` and has the most faces near the vertex agree
/// with it; and how many these are, by weight.
fn densest(patch: &Patch, normals: &[DVec3]) -> Option<(DVec3, f64)> {
    let near = || patch.faces.iter().filter(|face| face.near > 0.0);
    let mut best: Option<(DVec3, f64)> = None;
    for own in near().map(|face| face.normal) {
        if normals.iter().all(|&n| agreement(own, n) == 0.0) {
            let share = near().map(|face| face.near * agreement(face.normal, own)).sum();
            if best.is_none_or(|(_, most)| share > most) {
                best = Some((own, share));
            }
        }
    }
    best
}

/// The quadric of some planes.
pub(super) fn meeting(planes: &[Plane]) -> Quadric {
    let mut quadric = Quadric::default();
    planes.iter().for_each(|p| quadric.add_plane(p.normal, p.offset, p.variance));
    quadric
}
