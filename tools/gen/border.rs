//! Borders of patches: segments cut into pieces of about the target edge length.
//!
//! In: the two ends; out: the points from one end to the other, both included. A border that two patches share is cut
//! once and handed to both, so that the patches meet in bit-equal points.

use super::random::Random;
use glam::DVec3;

/// How far an inner point may move off its even place, in piece lengths.
const JITTER: f64 = 0.22;

/// Cuts the segment from `a` to `b` into pieces of about `spacing`, jittered along the segment.
pub fn cut(a: DVec3, b: DVec3, spacing: f64, random: &mut Random) -> Vec<DVec3> {
    let pieces = libm::round(a.distance(b) / spacing).max(1.0) as usize;
    let mut points = vec![a];
    for i in 1..pieces {
        let t = (i as f64 + random.between(-JITTER, JITTER)) / pieces as f64;
        points.push(a + (b - a) * t);
    }
    points.push(b);
    points
}

/// Joins polylines that each start where the one before ends.
pub fn chain(parts: &[&[DVec3]]) -> Vec<DVec3> {
    let mut points: Vec<DVec3> = Vec::new();
    for part in parts {
        let known = usize::from(points.last() == part.first() && !points.is_empty());
        points.extend(&part[known..]);
    }
    points
}

/// Joins polylines that go round: like [`chain`], without the first point again at the end.
pub fn ring(parts: &[&[DVec3]]) -> Vec<DVec3> {
    let mut points = chain(parts);
    if points.len() > 1 && points.first() == points.last() {
        points.pop();
    }
    points
}

/// The polyline backwards.
pub fn reversed(line: &[DVec3]) -> Vec<DVec3> {
    line.iter().rev().copied().collect()
}
