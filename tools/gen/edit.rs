//! Changes to a finished shape: offset, turn, order. In: a shape; out: the same shape, moved or reordered.

use super::random::Random;
use super::shape::Shape;
use glam::DVec3;

impl Shape {
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
