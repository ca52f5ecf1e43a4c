//! Corners of feature lines. In: polylines; out: the points where three or more meet, or where a line turns sharply.

use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};

/// Cosine of the smallest turn of a corner, 45 degrees. Arcs turn less from one point to the next.
const LARGEST_COSINE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// The corners in the order in which the lines pass them. Lines meet where they have bit-equal points.
pub fn corners_of(lines: &[Vec<DVec3>]) -> Vec<DVec3> {
    // Adding zero turns -0 to 0.
    let key = |point: DVec3| (point + DVec3::ZERO).to_array().map(f64::to_bits);
    let mut directions: BTreeMap<[u64; 3], Vec<DVec3>> = BTreeMap::new();
    for segment in lines.iter().flat_map(|line| line.windows(2)) {
        let direction = (segment[1] - segment[0]).normalize_or_zero();
        directions.entry(key(segment[0])).or_default().push(direction);
        directions.entry(key(segment[1])).or_default().push(-direction);
    }
    let mut seen = BTreeSet::new();
    let is_corner = |point: DVec3| match directions[&key(point)].as_slice() {
        [_] => false,
        [a, b] => -a.dot(*b) <= LARGEST_COSINE,
        _ => true,
    };
    lines
        .iter()
        .filter(|line| line.len() > 1)
        .flatten()
        .copied()
        .filter(|&point| is_corner(point) && seen.insert(key(point)))
        .collect()
}
