//! What the generator makes: a triangle mesh with its true feature lines, and what can be measured on it.

use glam::DVec3;
use std::collections::BTreeSet;

/// A triangle mesh and the polylines along which its surface really creases.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shape {
    /// Positions; the target edge length of the generator is 1.
    pub vertices: Vec<DVec3>,
    /// Corners of the triangles, counter-clockwise seen from outside or above.
    pub faces: Vec<[u32; 3]>,
    /// True feature lines. A closed line repeats its first point at the end. Borders are not feature lines.
    pub lines: Vec<Vec<DVec3>>,
    /// True corners: where three or more feature lines meet, or one turns by 45 degrees or more. The tip of a cone is
    /// none, because no line leads to it.
    pub corners: Vec<DVec3>,
}

impl Shape {
    /// The three corner positions of a face.
    pub fn triangle(&self, face: [u32; 3]) -> [DVec3; 3] {
        face.map(|corner| self.vertices[corner as usize])
    }

    /// Normal of a face, twice its area long.
    pub fn area_normal(&self, face: [u32; 3]) -> DVec3 {
        let [a, b, c] = self.triangle(face);
        (b - a).cross(c - a)
    }

    /// Unit normals of the vertices: those of the faces around, weighted by area; zero where there is no face.
    pub fn vertex_normals(&self) -> Vec<DVec3> {
        let mut normals = vec![DVec3::ZERO; self.vertices.len()];
        for &face in &self.faces {
            let normal = self.area_normal(face);
            for corner in face {
                normals[corner as usize] += normal;
            }
        }
        for normal in &mut normals {
            *normal = normal.normalize_or_zero();
        }
        normals
    }

    /// Smallest and largest coordinates; zeros without vertices.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let first = self.vertices.first().copied().unwrap_or_default();
        self.vertices.iter().fold((first, first), |(low, high), &vertex| (low.min(vertex), high.max(vertex)))
    }

    /// Length of all true lines.
    pub fn line_length(&self) -> f64 {
        let segments = self.lines.iter().flat_map(|line| line.windows(2));
        segments.fold(0.0, |sum, segment| sum + segment[0].distance(segment[1]))
    }

    /// Mean length of the edges, each counted once; 0 without edges.
    pub fn mean_edge_length(&self) -> f64 {
        let edges = self.edges();
        let length = |&(a, b): &(u32, u32)| self.vertices[a as usize].distance(self.vertices[b as usize]);
        let total: f64 = edges.iter().map(length).sum();
        if edges.is_empty() { 0.0 } else { total / edges.len() as f64 }
    }

    /// Undirected edges as pairs of ascending vertex indices, in ascending order.
    fn edges(&self) -> BTreeSet<(u32, u32)> {
        let sides = |&[a, b, c]: &[u32; 3]| [(a, b), (b, c), (c, a)];
        self.faces.iter().flat_map(sides).map(|(a, b)| (a.min(b), a.max(b))).collect()
    }
}
