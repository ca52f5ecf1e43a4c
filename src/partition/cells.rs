//! Space cut into half-open cells, each the home of one tile.
//!
//! In: the sampled barycentres of the scan. Out: boxes that fill space without overlap, so that every vertex has exactly
//! one owner, computed from its stored coordinates alone. The cuts are k-d splits at the median of the sample along the
//! longest axis. A sample is used rather than the block boxes, because blocks are far too coarse for small tiles and
//! say nothing at all where the order of the file has no locality.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A half-open box: `min <= p < max` on each axis; outer sides are infinite.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Inclusive lower side.
    pub min: DVec3,
    /// Exclusive upper side.
    pub max: DVec3,
    /// Faces the sample promises inside; an estimate.
    pub faces: u64,
}

impl Cell {
    /// All of space.
    pub fn everything(faces: u64) -> Cell {
        Cell { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY, faces }
    }

    /// Whether it is all of space, so that nothing lies outside.
    pub fn is_everything(&self) -> bool {
        self.min == DVec3::NEG_INFINITY && self.max == DVec3::INFINITY
    }

    /// What lies below `at` on `axis`, and what does not.
    fn cut(&self, axis: usize, at: f64) -> [Cell; 2] {
        let (mut max, mut min) = (self.max, self.min);
        max[axis] = at;
        min[axis] = at;
        [Cell { max, ..*self }, Cell { min, ..*self }]
    }

    /// Cuts the part of the cell within `min..max` in the middle of its longest side. `None` if that side is no longer than
    /// `least`, or too short to have a middle.
    pub fn halves(&self, min: DVec3, max: DVec3, least: f64) -> Option<[Cell; 2]> {
        let (lo, hi) = (self.min.max(min), self.max.min(max));
        let extent = hi - lo;
        let axis = longest(extent);
        let at = lo[axis] + 0.5 * extent[axis];
        let faces = self.faces.div_ceil(2);
        (extent[axis] > least && lo[axis] < at && at < hi[axis])
            .then(|| self.cut(axis, at).map(|half| Cell { faces, ..half }))
    }

    /// Whether the cell owns a vertex at `p`.
    #[inline]
    pub fn owns(&self, p: DVec3) -> bool {
        p.cmpge(self.min).all() && p.cmplt(self.max).all()
    }
}

/// Cuts space until each cell is small enough or its sample is a single point. Each sample stands for `stride` faces; the
/// cells come in the order of the splits, which keeps neighbours near each other. The sample is put into another order.
pub fn cut(sample: &mut [DVec3], stride: u64, enough: &dyn Fn(&Cell) -> bool) -> Vec<Cell> {
    let mut cells = Vec::new();
    split(sample, stride, enough, Cell::everything(0), &mut cells);
    cells
}

fn split(
    sample: &mut [DVec3],
    stride: u64,
    enough: &dyn Fn(&Cell) -> bool,
    cell: Cell,
    cells: &mut Vec<Cell>,
) {
    let cell = Cell { faces: sample.len() as u64 * stride, ..cell };
    match (!enough(&cell)).then(|| cut_at(sample)).flatten() {
        None => cells.push(cell),
        Some((axis, at, lower)) => {
            let (left, right) = sample.split_at_mut(lower);
            let [below, above] = cell.cut(axis, at);
            split(left, stride, enough, below, cells);
            split(right, stride, enough, above, cells);
        }
    }
}

/// Divides the sample along the axis of its longest extent, and returns that axis, the coordinate to cut at and how many
/// samples lie below it: the first ones. `None` if all samples coincide.
fn cut_at(sample: &mut [DVec3]) -> Option<(usize, f64, usize)> {
    let lo = sample.iter().fold(DVec3::INFINITY, |m, p| m.min(*p));
    let hi = sample.iter().fold(DVec3::NEG_INFINITY, |m, p| m.max(*p));
    let extent = hi - lo;
    let axis = longest(extent);
    let half = sample.len() / 2;
    sample.select_nth_unstable_by(half, |a, b| a[axis].total_cmp(&b[axis]));
    // The coordinate itself goes right. If the lower half is one value, cut behind that value instead.
    let middle = sample[half][axis];
    let at = if middle > lo[axis] {
        middle
    } else {
        sample.iter().map(|p| p[axis]).filter(|&x| x > middle).reduce(f64::min)?
    };
    let mut lower = 0;
    for i in 0..sample.len() {
        if sample[i][axis] < at {
            sample.swap(i, lower);
            lower += 1;
        }
    }
    Some((axis, at, lower))
}

fn longest(extent: DVec3) -> usize {
    (0..3).fold(0, |best, i| if extent[i] > extent[best] { i } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut_to(mut sample: Vec<DVec3>, stride: u64, target: u64) -> Vec<Cell> {
        cut(&mut sample, stride, &|cell| cell.faces <= target)
    }

    #[test]
    fn halves_own_what_the_cell_does() {
        let cell = Cell::everything(9);
        let (min, max) = (DVec3::ZERO, DVec3::new(1.0, 4.0, 2.0));
        let halves = cell.halves(min, max, 1.0).expect("long enough");
        assert_eq!((halves[0].max.y, halves[1].min.y, halves[0].faces), (2.0, 2.0, 5));
        for p in [DVec3::ZERO, DVec3::splat(2.0), DVec3::splat(-1e9), DVec3::splat(1e9)] {
            assert_eq!(halves.iter().filter(|c| c.owns(p)).count(), 1);
        }
        assert!(cell.halves(min, max, 4.0).is_none());
        assert!(cell.halves(min, min, 0.0).is_none());
        assert!(cell.halves(DVec3::ONE, DVec3::ONE * (1.0 + f64::EPSILON), 0.0).is_none());
    }

    #[test]
    fn every_point_has_one_owner() {
        let sample: Vec<DVec3> = (0..1000u32)
            .map(|i| DVec3::new((i * 37 % 101) as f64, (i * 53 % 97) as f64, (i % 3) as f64))
            .collect();
        let cells = cut_to(sample.clone(), 2, 50);
        assert!(cells.len() >= 40, "{}", cells.len());
        assert_eq!(cells.iter().map(|c| c.faces).sum::<u64>(), 2000);
        assert!(cells.iter().all(|c| c.faces <= 50));
        for p in sample.iter().chain(&[DVec3::splat(-1e9), DVec3::splat(1e9), DVec3::new(50.0, 48.0, 1.0)]) {
            assert_eq!(cells.iter().filter(|c| c.owns(*p)).count(), 1, "{p}");
        }
    }

    #[test]
    fn a_pile_of_equal_points_is_one_cell() {
        let mut sample = vec![DVec3::ONE; 100];
        assert_eq!(cut_to(sample.clone(), 1, 10).len(), 1);
        sample.push(DVec3::ZERO);
        assert_eq!(cut_to(sample, 1, 10).len(), 2);
    }
}
