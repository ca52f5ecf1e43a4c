//! The planes that meet at a line vertex: one on each side of the crease, and further ones at corners.
//!
//! In: the patch of a vertex and the direction across its line. Out: planes. Whether a face lies on one side or the other
//! is told by place where the fold is weak and by normal where it is sharp, and by both in between; both are one number, so
//! that there is no threshold between the two. A side is what is connected: across the next crease a step of a stair may
//! be parallel to this one, but it is not reached.

use super::patch::{Patch, Side};
use super::plane::{Plane, agreement, agreement_with, fit_plane, mean_normal};
use crate::config::method;
use crate::math::{Quadric, unit};
use glam::DVec3;

/// Memory that is used again from vertex to vertex.
#[derive(Default)]
pub(super) struct Work {
    /// Distance of each face across the line.
    places: Vec<f64>,
    sides: [Side; 2],
}

/// The planes on the side of `b` and on the other, or `None` where the faces do not fall into two sides. `slack` is how far
/// the vertex may lie from the line.
pub(super) fn two_sides(patch: &Patch, b: DVec3, slack: f64, work: &mut Work) -> Option<[Plane; 2]> {
    let Work { places, sides } = work;
    measure(patch, b, places);
    let mut normals = split(patch, places)?;
    let mut shift = 0.0;
    let mut planes = None;
    for round in 0..=method::FIT_ROUNDS {
        weigh(patch, places, normals, shift, sides);
        let mut found = [Plane { normal: DVec3::ZERO, offset: 0.0, variance: 1.0 }; 2];
        for ((plane, side), normal) in found.iter_mut().zip(&mut *sides).zip(normals) {
            patch.connect(side);
            if side.faces().is_empty() {
                return None;
            }
            if round == 0 {
                plane.normal = mean_normal(patch, side);
            } else {
                *plane = fit_plane(patch, side, normal);
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

/// The distance of each face along `b`.
fn measure(patch: &Patch, b: DVec3, places: &mut Vec<f64>) {
    let [x, y, z] = patch.centres();
    places.clear();
    places.extend(x.iter().zip(y).zip(z).map(|((x, y), z)| x * b.x + y * b.y + z * b.z));
}

/// The weight of each face on each side.
fn weigh(patch: &Patch, places: &[f64], normals: [DVec3; 2], shift: f64, sides: &mut [Side; 2]) {
    let count = patch.len();
    let [plus, minus] = sides.each_mut().map(|side| {
        side.weights.resize(count, 0.0);
        &mut side.weights[..count]
    });
    let (places, weights) = (&places[..count], &patch.weights()[..count]);
    let all = patch.normals().map(|axis| &axis[..count]);
    let between = normals[0] - normals[1];
    for i in 0..count {
        let normal = DVec3::new(all[0][i], all[1][i], all[2][i]);
        let across = coordinate(places[i], normal, between) - shift / method::FIT_RAMP;
        plus[i] = weights[i] * agreement_with(all, i, normals[0]) * share(across);
        minus[i] = weights[i] * agreement_with(all, i, normals[1]) * share(-across);
    }
}

/// How much of a face lies on a side: 0 to 1 over the width of the ramp.
#[inline]
fn share(across: f64) -> f64 {
    let least = if across > 0.0 { across } else { 0.0 };
    if least < 1.0 { least } else { 1.0 }
}

/// On which side of the crease a face lies, in widths of the ramp: by its distance across (`place`) and by which of the two
/// normals it agrees with; `between` is their difference.
#[inline]
fn coordinate(place: f64, normal: DVec3, between: DVec3) -> f64 {
    (place + method::FIT_NORMAL * normal.dot(between)) * (1.0 / method::FIT_RAMP)
}

/// First normals of the two sides: means of two groups, from a division by place alone.
fn split(patch: &Patch, places: &[f64]) -> Option<[DVec3; 2]> {
    let mut normals = [DVec3::ZERO; 2];
    for _ in 0..method::SPLIT_ROUNDS {
        let between = normals[0] - normals[1];
        let mut sums = [DVec3::ZERO; 2];
        for (i, (&near, &place)) in patch.near().iter().zip(places).enumerate() {
            let normal = patch.normal(i);
            let across = coordinate(place, normal, between).clamp(-1.0, 1.0);
            sums[usize::from(across < 0.0)] += normal * (near * across.abs());
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
    let side = &mut work.sides[0];
    let total: f64 = patch.near().iter().sum();
    let mut planes = Vec::new();
    for _ in 0..method::MORE_PLANES {
        let Some((mut normal, share)) = densest(patch, normals) else { break };
        if share < method::MORE_SHARE * total {
            break;
        }
        let mut found = None;
        for round in 0..3 {
            weigh_one(patch, normal, side);
            patch.connect(side);
            if side.faces().is_empty() {
                break;
            }
            if round < 2 {
                normal = mean_normal(patch, side);
            } else {
                found = Some(fit_plane(patch, side, normal));
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

/// The weight of each face in a plane of this normal.
fn weigh_one(patch: &Patch, normal: DVec3, side: &mut Side) {
    let count = patch.len();
    side.weights.resize(count, 0.0);
    let (weights, of_patch) = (&mut side.weights[..count], &patch.weights()[..count]);
    let all = patch.normals().map(|axis| &axis[..count]);
    for i in 0..count {
        weights[i] = of_patch[i] * agreement_with(all, i, normal);
    }
}

/// The normal of a face near the vertex that agrees with none of `normals` and has the most faces near the vertex agree
/// with it; and how many these are, by weight.
fn densest(patch: &Patch, normals: &[DVec3]) -> Option<(DVec3, f64)> {
    let near = || patch.near().iter().enumerate().map(|(i, &near)| (patch.normal(i), near));
    let mut best: Option<(DVec3, f64)> = None;
    for (own, _) in near() {
        if normals.iter().all(|&n| agreement(own, n) == 0.0) {
            let share = near().map(|(normal, near)| near * agreement(normal, own)).sum();
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
