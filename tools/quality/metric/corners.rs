//! Which found corners are true ones. In: positions; out: how many pairs can be made one to one.

use glam::DVec3;
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// Number of pairs within `reach`. The closest pair is made first, then the closest of the corners that are left; of
/// equal pairs the one with the lower indices. Not the largest possible number, but no pair is made that a closer one
/// forbids.
pub fn matched(found: &[DVec3], truth: &[DVec3], reach: f64) -> usize {
    let place = |(i, point): (usize, &DVec3)| GeomWithData::new(point.to_array(), i);
    let tree = RTree::bulk_load(found.iter().enumerate().map(place).collect());
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (i, corner) in truth.iter().enumerate() {
        for other in tree.locate_within_distance(corner.to_array(), reach * reach) {
            pairs.push((corner.distance_squared(found[other.data]), i, other.data));
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let (mut true_used, mut found_used) = (vec![false; truth.len()], vec![false; found.len()]);
    let mut count = 0;
    for (_, i, j) in pairs {
        if !true_used[i] && !found_used[j] {
            (true_used[i], found_used[j]) = (true, true);
            count += 1;
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_corner_is_matched_once() {
        let at = |x: f64| DVec3::new(x, 0.0, 0.0);
        assert_eq!(matched(&[at(0.1), at(0.2), at(-0.3)], &[at(0.0)], 1.0), 1);
        assert_eq!(matched(&[at(0.0), at(5.0)], &[at(1.5), at(6.5), at(9.0)], 2.0), 2);
        assert_eq!(matched(&[at(0.0)], &[at(2.1)], 2.0), 0);
        assert_eq!(matched(&[], &[at(0.0)], 2.0), 0);
        // The closest pair is made first: 1.0 goes to 1.1, and 0.0 finds nobody else in reach.
        assert_eq!(matched(&[at(1.0), at(9.0)], &[at(0.0), at(1.1)], 1.5), 1);
    }
}
