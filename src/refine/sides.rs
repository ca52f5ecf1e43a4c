//! The planes that meet at a line vertex: one on each side of the crease, and further ones at corners.
//!
//! In: the patch of a vertex and the direction across its line. Out: planes. Whether a face lies on one side or the other
//! is told by place where the fold is weak and by normal where it is sharp, and by both in between; both are one number, so
//! that there is no threshold between the two. A side is what is connected: across the next crease a step of a stair may
//! be parallel to this one, but it is not reached.

use super::patch::Patch;
use super::plane::{Plane, agreement, fit_plane, mean_normal};
use crate::config::method;
use crate::math::{Quadric, unit};
use glam::DVec3;

/// The planes on the side of `b` and on the other, or `None` where the faces do not fall into two sides. `slack` is how far
/// the vertex may lie from the line.
pub(super) fn two_sides(patch: &Patch, b: DVec3, slack: f64) -> Option<[Plane; 2]> {
    let mut normals = split(patch, b)?;
    let mut shift = 0.0;
    let mut weights = vec![0.0; patch.len()];
    let mut planes = None;
    for round in 0..=method::FIT_ROUNDS {
        let mut found = [Plane { normal: DVec3::ZERO, offset: 0.0, variance: 1.0 }; 2];
        for (plane, (sign, normal)) in found.iter_mut().zip([1.0, -1.0].into_iter().zip(normals)) {
            for (i, weight) in weights.iter_mut().enumerate() {
                let across = coordinate(patch, i, b, normals) - shift / method::FIT_RAMP;
                let share = (sign * across).clamp(0.0, 1.0);
                *weight = patch.weights[i] * agreement(patch.normals[i], normal) * share;
            }
            let faces = patch.connected(&weights);
            if faces.is_empty() {
                return None;
            }
            if round == 0 {
                plane.normal = mean_normal(patch, &faces, &weights);
            } else {
                *plane = fit_plane(patch, &faces, &weights, normal);
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

/// On which side of the crease face `i` lies, in widths of the ramp: by its distance across and by which of the two normals
/// it agrees with.
fn coordinate(patch: &Patch, i: usize, b: DVec3, normals: [DVec3; 2]) -> f64 {
    let place = patch.centres[i].dot(b);
    let normal = patch.normals[i].dot(normals[0] - normals[1]);
    (place + method::FIT_NORMAL * normal) / method::FIT_RAMP
}

/// First normals of the two sides: means of two groups, from a division by place alone.
fn split(patch: &Patch, b: DVec3) -> Option<[DVec3; 2]> {
    let mut normals = [DVec3::ZERO; 2];
    for _ in 0..method::SPLIT_ROUNDS {
        let mut sums = [DVec3::ZERO; 2];
        for i in (0..patch.len()).filter(|&i| patch.near[i] > 0.0) {
            let across = coordinate(patch, i, b, normals).clamp(-1.0, 1.0);
            sums[usize::from(across < 0.0)] += patch.normals[i] * (patch.near[i] * across.abs());
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
pub(super) fn further_planes(patch: &Patch, normals: &mut Vec<DVec3>, close: f64) -> Vec<Plane> {
    let total: f64 = patch.near.iter().sum();
    let mut planes = Vec::new();
    for _ in 0..method::MORE_PLANES {
        let Some((mut normal, share)) = densest(patch, normals) else { break };
        if share < method::MORE_SHARE * total {
            break;
        }
        let weigh = |normal: DVec3| -> Vec<f64> {
            (0..patch.len()).map(|i| patch.weights[i] * agreement(patch.normals[i], normal)).collect()
        };
        let mut found = None;
        for round in 0..3 {
            let weights = weigh(normal);
            let faces = patch.connected(&weights);
            if faces.is_empty() {
                break;
            }
            if round < 2 {
                normal = mean_normal(patch, &faces, &weights);
            } else {
                found = Some(fit_plane(patch, &faces, &weights, normal));
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
    let near: Vec<usize> = (0..patch.len()).filter(|&i| patch.near[i] > 0.0).collect();
    let mut best: Option<(DVec3, f64)> = None;
    for &i in &near {
        let own = patch.normals[i];
        if normals.iter().all(|&n| agreement(own, n) == 0.0) {
            let share = near.iter().map(|&j| patch.near[j] * agreement(patch.normals[j], own)).sum();
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
