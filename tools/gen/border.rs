//! Borders of patches: segments cut into pieces of about the target edge length.
//!
//! In: the two ends; out: the points from one end to the other, both included. A border that two patches share is cut
//! once and handed to both, so that the patches meet in bit-equal points.

use super::random::Random;
use glam::DVec3;

/// How far an inner point may move off its even place, in piece lengths.
const JITTER: f64 = 0.22;

/// Steps that a curve is measured by. Between them it is taken as straight and its edge length as constant.
const SAMPLES: usize = 2000;

/// Cuts the segment from `a` to `b` into so many pieces, jittered along the segment.
pub fn cut(a: DVec3, b: DVec3, pieces: usize, random: &mut Random) -> Vec<DVec3> {
    let mut points = vec![a];
    for i in 1..pieces {
        let t = (i as f64 + random.between(-JITTER, JITTER)) / pieces as f64;
        points.push(a + (b - a) * t);
    }
    points.push(b);
    points
}

/// Parameters from 0 to 1, both included, that cut `curve` into pieces of about the `size` where they are.
pub fn graded_places(
    curve: impl Fn(f64) -> DVec3,
    size: impl Fn(DVec3) -> f64,
    mut random: Option<&mut Random>,
) -> Vec<f64> {
    // How many pieces there are from the start up to each sample, by the midpoint rule.
    let mut counts = vec![0.0];
    let mut total = 0.0;
    let at = |i: usize| i as f64 / SAMPLES as f64;
    for i in 0..SAMPLES {
        let middle = curve(0.5 * (at(i) + at(i + 1)));
        total += curve(at(i)).distance(curve(at(i + 1))) / size(middle);
        counts.push(total);
    }
    let pieces = libm::round(total).max(1.0) as usize;
    let mut places = vec![0.0];
    for piece in 1..pieces {
        let jitter = random.as_mut().map_or(0.0, |random| random.between(-JITTER, JITTER));
        let wanted = (piece as f64 + jitter) / pieces as f64 * total;
        let after = counts.partition_point(|&count| count < wanted).clamp(1, SAMPLES);
        let (low, high) = (counts[after - 1], counts[after]);
        places.push((after as f64 - 1.0 + (wanted - low) / (high - low)) / SAMPLES as f64);
    }
    places.push(1.0);
    places
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
