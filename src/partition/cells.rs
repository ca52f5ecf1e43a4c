//! Space cut into half-open cells, each the home of one tile.
//!
//! In: the sampled barycentres of the scan. Out: boxes that fill space without overlap, so that every vertex has exactly
//! one owner, computed from its stored coordinates alone. The cuts are k-d splits at the median of the sample along the
//! longest axis. A sample is used rather than the block boxes, because blocks are far too coarse for small tiles and
//! say nothing at all where the order of the file has no locality.

use glam::DVec3;

/// A half-open box: `min <= p < max` on each axis; outer sides are infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
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

    /// Whether the cell owns a vertex at `p`.
    #[inline]
    pub fn owns(&self, p: DVec3) -> bool {
        p.cmpge(self.min).all() && p.cmplt(self.max).all()
    }
}

/// Cuts space until each cell holds about `target` faces or its sample is a single point. Each sample stands for
/// `stride` faces; the cells come in the order of the splits, which keeps neighbours near each other. The
/// sample is sorted on the way.
pub fn cut(sample: &mut [DVec3], stride: u64, target: u64) -> Vec<Cell> {
    let mut cells = Vec::new();
    split(sample, stride, target.max(1), Cell::everything(0), &mut cells);
    cells
}

fn split(sample: &mut [DVec3], stride: u64, target: u64, cell: Cell, cells: &mut Vec<Cell>) {
    let faces = sample.len() as u64 * stride;
    match (faces > target).then(|| cut_at(sample)).flatten() {
        None => cells.push(Cell { faces, ..cell }),
        Some((axis, at, lower)) => {
            let (left, right) = sample.split_at_mut(lower);
            let mut max = cell.max;
            max[axis] = at;
            split(left, stride, target, Cell { max, ..cell }, cells);
            let mut min = cell.min;
            min[axis] = at;
            split(right, stride, target, Cell { min, ..cell }, cells);
        }
    }
}

/// Sorts the sample along the axis of its longest extent and returns that axis, the coordinate to cut at and how many
/// samples lie below it; `None` if all samples coincide.
fn cut_at(sample: &mut [DVec3]) -> Option<(usize, f64, usize)> {
    let lo = sample.iter().fold(DVec3::INFINITY, |m, p| m.min(*p));
    let hi = sample.iter().fold(DVec3::NEG_INFINITY, |m, p| m.max(*p));
    let extent = hi - lo;
    let axis = (0..3).fold(0, |best, i| if extent[i] > extent[best] { i } else { best });
    sample.sort_by(|a, b| a[axis].total_cmp(&b[axis]));
    // The coordinate itself goes right. If the lower half is one value, cut behind that value instead.
    let middle = sample[sample.len() / 2][axis];
    let at = if middle > sample[0][axis] {
        middle
    } else {
        sample.iter().map(|p| p[axis]).find(|&x| x > middle)?
    };
    let lower = sample.partition_point(|p| p[axis] < at);
    Some((axis, at, lower))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_has_one_owner() {
        let sample: Vec<DVec3> = (0..1000u32)
            .map(|i| DVec3::new((i * 37 % 101) as f64, (i * 53 % 97) as f64, (i % 3) as f64))
            .collect();
        let cells = cut(&mut sample.clone(), 2, 50);
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
        assert_eq!(cut(&mut sample.clone(), 1, 10).len(), 1);
        sample.push(DVec3::ZERO);
        assert_eq!(cut(&mut sample, 1, 10).len(), 2);
    }
}
