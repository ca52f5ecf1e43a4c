//! The lines that ought to be found. In: true polylines, and corners if they are known; out: true curves, each between
//! two corners, junctions or tips, and the true corners.

use super::lines::{Lines, place};
use glam::DVec3;
use std::collections::BTreeMap;

/// Where a line turns by more than this between two segments, it has a corner, degrees. Only for lines that come
/// without a list of their corners.
const CORNER_TURN_DEG: f64 = 45.0;

/// True feature lines.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Truth {
    /// Points of the curves and the corners, in mesh units.
    pub points: Vec<DVec3>,
    /// True curves as indices into `points`.
    pub curves: Vec<Vec<u32>>,
    /// True corners as indices into `points`.
    pub corners: Vec<u32>,
}

impl Truth {
    /// Lines whose corners are known.
    pub fn with_corners(mut lines: Lines, corners: &[DVec3]) -> Truth {
        let mut known: BTreeMap<[u64; 3], u32> =
            lines.points.iter().zip(0..).map(|(&point, i)| (place(point), i)).collect();
        let mut indices: Vec<u32> = Vec::new();
        for &corner in corners {
            indices.push(*known.entry(place(corner)).or_insert_with(|| {
                lines.points.push(corner);
                lines.marked.push(false);
                (lines.points.len() - 1) as u32
            }));
        }
        Truth::new(lines, indices)
    }

    /// Lines whose corners are to be seen from them: junctions of three or more, and sharp turns.
    pub fn of_lines(lines: Lines) -> Truth {
        let neighbours = lines.neighbours();
        let turn = CORNER_TURN_DEG.to_radians();
        let is_corner = |&v: &u32| {
            let around: Vec<u32> = neighbours[v as usize].iter().copied().collect();
            match around[..] {
                [a, b] => {
                    let [a, b] = [a, b].map(|u| lines.points[u as usize]);
                    let at = lines.points[v as usize];
                    (at - a).angle_between(b - at) >= turn
                }
                _ => around.len() > 2,
            }
        };
        let corners = (0..lines.points.len() as u32).filter(is_corner).collect();
        Truth::new(lines, corners)
    }

    fn new(lines: Lines, mut corners: Vec<u32>) -> Truth {
        corners.sort_unstable();
        corners.dedup();
        let curves = lines.curves(|v| corners.binary_search(&v).is_ok());
        Truth { points: lines.points, curves, corners }
    }

    /// Positions of the corners.
    pub fn corner_points(&self) -> Vec<DVec3> {
        self.corners.iter().map(|&v| self.points[v as usize]).collect()
    }

    /// All segments with the number of their curve.
    pub fn segments(&self) -> impl Iterator<Item = (usize, DVec3, DVec3)> + '_ {
        let points = |v: u32| self.points[v as usize];
        self.curves
            .iter()
            .enumerate()
            .flat_map(move |(i, curve)| curve.windows(2).map(move |s| (i, points(s[0]), points(s[1]))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Lines {
        let corner = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let (a, b, c, d) = (corner(0.0, 0.0), corner(4.0, 0.0), corner(4.0, 4.0), corner(0.0, 4.0));
        let bend = corner(2.0, -0.5);
        Lines::of_polylines(&[vec![a, bend, b, c, d, a]])
    }

    #[test]
    fn corners_are_seen_where_lines_turn_sharply() {
        let truth = Truth::of_lines(square());
        // The bend turns by 28 degrees only.
        assert_eq!((truth.corners.len(), truth.curves.len()), (4, 4));
        assert_eq!(truth.segments().count(), 5);
    }

    #[test]
    fn stated_corners_are_taken_as_they_are() {
        let truth = Truth::with_corners(square(), &[DVec3::new(4.0, 4.0, 0.0), DVec3::new(0.0, -0.0, 0.0)]);
        assert_eq!((truth.corners.len(), truth.curves.len()), (2, 2));
        let off_the_lines = Truth::with_corners(square(), &[DVec3::Z]);
        assert_eq!((off_the_lines.corner_points(), off_the_lines.curves.len()), (vec![DVec3::Z], 1));
    }
}
