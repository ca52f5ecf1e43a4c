//! Walls between a ring on the ground, or on a roof, and the border of the roof above.
//!
//! In: foot, top and number of cells of each column of the ring; out: the vertices between, and triangles. Neighbouring
//! columns may differ in their cells, under a gable for one; triangles join them from bottom to top, always from the lower
//! of the two next vertices, which keeps them sound as long as jitter stays below [`JITTER`].

use super::super::random::Random;
use glam::DVec3;

/// Largest jitter on a wall, in cells.
const JITTER: f64 = 0.2;

/// One column of a wall.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Vertex and position at the foot.
    pub foot: (u32, DVec3),
    /// Vertex and position at the roof.
    pub top: (u32, DVec3),
    /// Cells between them, at least one.
    pub segments: u32,
    /// Along the wall, or zero at its corners.
    pub tangent: DVec3,
}

impl Column {
    /// The vertices from foot to top. Those between are added to `positions`.
    fn raise(&self, positions: &mut Vec<DVec3>, random: &mut Random) -> Vec<(u32, f64)> {
        let cells = f64::from(self.segments);
        let mut vertices = vec![(self.foot.0, self.foot.1.z)];
        for cell in 1..self.segments {
            let share = (f64::from(cell) + random.between(-JITTER, JITTER)) / cells;
            let aside = self.tangent * random.between(-JITTER, JITTER);
            let position = self.foot.1.lerp(self.top.1, share) + aside;
            vertices.push((positions.len() as u32, position.z));
            positions.push(position);
        }
        vertices.push((self.top.0, self.top.1.z));
        vertices
    }
}

/// Adds the walls around a ring of columns, counter-clockwise. Returns the vertices of each column from foot to top.
pub fn build(
    columns: &[Column],
    positions: &mut Vec<DVec3>,
    faces: &mut Vec<[u32; 3]>,
    random: &mut Random,
) -> Vec<Vec<u32>> {
    let raised: Vec<Vec<(u32, f64)>> = columns.iter().map(|column| column.raise(positions, random)).collect();
    for (k, left) in raised.iter().enumerate() {
        let right = &raised[(k + 1) % raised.len()];
        let (mut i, mut j) = (0, 0);
        while i + 1 < left.len() || j + 1 < right.len() {
            let next = |column: &[(u32, f64)], at: usize| column.get(at + 1).map_or(f64::INFINITY, |v| v.1);
            if next(left, i) < next(right, j) {
                faces.push([left[i].0, right[j].0, left[i + 1].0]);
                i += 1;
            } else {
                faces.push([left[i].0, right[j].0, right[j + 1].0]);
                j += 1;
            }
        }
    }
    raised.into_iter().map(|column| column.into_iter().map(|(vertex, _)| vertex).collect()).collect()
}
