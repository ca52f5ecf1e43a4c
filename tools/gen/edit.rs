//! Changes to a finished shape: noise, offset, order. In: a shape; out: the same shape, moved or reordered.

use super::random::Random;
use super::shape::Shape;
use glam::DVec3;

impl Shape {
    /// Moves each vertex along its normal by Gaussian noise with a standard deviation of `amount` mean edge lengths.
    ///
    /// The true lines stay where they are: they belong to the surface that was measured, not to the measurement.
    pub fn add_noise(&mut self, amount: f64, seed: u64) {
        if amount == 0.0 {
            return;
        }
        let mut random = Random::new(seed, "noise");
        let deviation = amount * self.mean_edge_length();
        let normals = self.vertex_normals();
        for (vertex, normal) in self.vertices.iter_mut().zip(normals) {
            *vertex += normal * (deviation * random.gaussian());
        }
    }

    /// Moves the mesh, its lines and corners.
    pub fn translate(&mut self, offset: DVec3) {
        let lines = self.lines.iter_mut().flatten();
        for point in self.vertices.iter_mut().chain(lines).chain(&mut self.corners) {
            *point += offset;
        }
    }

    /// Turns x to y, y to z and z to x.
    pub fn turn_up(&mut self) {
        let lines = self.lines.iter_mut().flatten();
        for point in self.vertices.iter_mut().chain(lines).chain(&mut self.corners) {
            *point = DVec3::new(point.z, point.x, point.y);
        }
    }

    /// Shuffles the order of the vertices and of the faces. Which corner a face starts with stays.
    pub fn permute(&mut self, seed: u64) {
        let mut random = Random::new(seed, "permute");
        let vertex_order = random.permutation(self.vertices.len());
        let mut new_index = vec![0_u32; self.vertices.len()];
        for (new, &old) in vertex_order.iter().enumerate() {
            new_index[old] = new as u32;
        }
        self.vertices = vertex_order.iter().map(|&old| self.vertices[old]).collect();
        let face_order = random.permutation(self.faces.len());
        self.faces =
            face_order.iter().map(|&old| self.faces[old].map(|corner| new_index[corner as usize])).collect();
    }
}
