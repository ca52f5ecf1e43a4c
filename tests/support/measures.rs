//! What can be measured on a generated shape. For tests that include the generator as `generator`.

use super::generator::shape::Shape;
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};

/// A position as a key.
pub fn bits(point: DVec3) -> [u64; 3] {
    // Adding zero turns -0 to 0.
    (point + DVec3::ZERO).to_array().map(f64::to_bits)
}

/// The angle between two vectors, in degrees.
pub fn angle_deg(a: DVec3, b: DVec3) -> f64 {
    libm::atan2(a.cross(b).length(), a.dot(b)).to_degrees()
}

/// A shape with its edges.
pub struct Surface<'a> {
    pub shape: &'a Shape,
    /// The face to the left of each directed edge.
    left: BTreeMap<(u32, u32), usize>,
}

impl<'a> Surface<'a> {
    /// Asserts that no two faces see an edge in the same direction.
    pub fn new(shape: &'a Shape) -> Self {
        let mut left = BTreeMap::new();
        for (face, &[a, b, c]) in shape.faces.iter().enumerate() {
            for edge in [(a, b), (b, c), (c, a)] {
                assert_eq!(left.insert(edge, face), None, "two faces on the same side of edge {edge:?}");
            }
        }
        Self { shape, left }
    }

    /// Directed edges without their opposite.
    pub fn border(&self) -> Vec<(u32, u32)> {
        self.left.keys().copied().filter(|&(a, b)| !self.left.contains_key(&(b, a))).collect()
    }

    /// Vertices minus edges plus faces. All vertices have faces.
    pub fn euler(&self) -> i64 {
        let used: BTreeSet<u32> = self.shape.faces.iter().flatten().copied().collect();
        assert_eq!(used.len(), self.shape.vertices.len(), "vertices without faces");
        let edges = (self.left.len() + self.border().len()) / 2;
        self.shape.vertices.len() as i64 - edges as i64 + self.shape.faces.len() as i64
    }

    /// The angle between the normals on both sides of an edge, in degrees; `None` on the border.
    fn fold_deg(&self, (a, b): (u32, u32)) -> Option<f64> {
        let normal = |edge| self.left.get(&edge).map(|&face| self.shape.area_normal(self.shape.faces[face]));
        Some(angle_deg(normal((a, b))?, normal((b, a))?))
    }

    /// The edges of the mesh that the true lines consist of, as ascending pairs. Asserts that they are edges.
    pub fn line_edges(&self) -> BTreeSet<(u32, u32)> {
        let index: BTreeMap<_, u32> = self.shape.vertices.iter().map(|&at| bits(at)).zip(0..).collect();
        let segments = self.shape.lines.iter().flat_map(|line| line.windows(2));
        segments
            .map(|segment| {
                let [a, b] = [segment[0], segment[1]].map(|point| {
                    *index.get(&bits(point)).unwrap_or_else(|| panic!("{point} of a line is no vertex"))
                });
                assert!(self.fold_deg((a, b)).is_some(), "{a} to {b} of a line is no inner edge");
                (a.min(b), a.max(b))
            })
            .collect()
    }

    /// The angles along the true lines, in degrees.
    pub fn angles_on_lines(&self) -> Vec<f64> {
        self.line_edges().into_iter().filter_map(|edge| self.fold_deg(edge)).collect()
    }

    /// The edges beside the true lines with their angles in degrees.
    pub fn angles_beside_lines(&self) -> Vec<((u32, u32), f64)> {
        let lines = self.line_edges();
        let beside = self.left.keys().filter(|(a, b)| a < b && !lines.contains(&(*a, *b)));
        beside.filter_map(|&edge| Some((edge, self.fold_deg(edge)?))).collect()
    }

    /// Volume by the divergence theorem; positive only if normals point outwards.
    pub fn volume(&self) -> f64 {
        let faces = self.shape.faces.iter().map(|&face| self.shape.triangle(face));
        faces.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }
}

/// The smallest angle of each triangle, in degrees.
pub fn smallest_angles(shape: &Shape) -> Vec<f64> {
    let smallest = |&face: &[u32; 3]| {
        let [a, b, c] = shape.triangle(face);
        angle_deg(b - a, c - a).min(angle_deg(c - b, a - b)).min(angle_deg(a - c, b - c))
    };
    shape.faces.iter().map(smallest).collect()
}

/// Lengths of the edges with their middles, each edge as often as it has faces.
pub fn sides(shape: &Shape) -> Vec<(f64, DVec3)> {
    let triangles = shape.faces.iter().map(|&face| shape.triangle(face));
    let ends = triangles.flat_map(|[a, b, c]| [(a, b), (b, c), (c, a)]);
    ends.map(|(a, b)| (a.distance(b), (a + b) * 0.5)).collect()
}
