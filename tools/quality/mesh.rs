//! A triangle mesh in memory, with its edges. In: a PLY file, or a generated shape; out: positions, faces, h, and edges
//! with the faces at them.

use anyhow::{Context, Result};
use crease::input::{FaceBlock, IoMode, MemorySource, MeshSource, PlySource};
use crease::mesh::VertexId;
use glam::DVec3;
use std::path::Path;

/// A triangle mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// In mesh units.
    pub positions: Vec<DVec3>,
    /// Corners as indices into `positions`.
    pub faces: Vec<[u32; 3]>,
}

/// An edge between two faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hinge {
    /// Its vertices, the lower first.
    pub ends: [u32; 2],
    /// Its faces, the lower first.
    pub faces: [u32; 2],
}

impl Mesh {
    /// Reads a mesh as the program does.
    ///
    /// # Errors
    /// What the program would say of the file.
    pub fn read(path: &Path) -> Result<Mesh> {
        let source = PlySource::open(path, IoMode::Auto)?;
        let mut mesh = Mesh::default();
        let count = usize::try_from(source.vertex_count())?;
        source.read_positions(VertexId(0), count, &mut mesh.positions)?;
        let mut block = FaceBlock::default();
        for index in 0..source.block_count() {
            source.read_block(index, &mut block)?;
            for face in &block.corners {
                let mut corners = [0; 3];
                for (corner, id) in corners.iter_mut().zip(face) {
                    *corner = u32::try_from(id.0).context("more than 2^32 vertices")?;
                }
                mesh.faces.push(corners);
            }
        }
        Ok(mesh)
    }

    /// h: the median side, as the program computes it.
    ///
    /// # Errors
    /// If a face names a vertex that does not exist, or a coordinate is not finite.
    pub fn median_side(&self) -> Result<f64> {
        let source = MemorySource::new(&self.positions, &self.faces)?;
        Ok(crease::partition::scan(&source, crease::config::NO_LIMIT, &|_| ())?.median_side)
    }

    /// The edges with exactly two faces, by ascending vertices.
    pub fn hinges(&self) -> Vec<Hinge> {
        let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * self.faces.len());
        for (face, &[a, b, c]) in (0..).zip(&self.faces) {
            sides.extend([[a, b], [b, c], [c, a]].map(|[a, b]| ([a.min(b), a.max(b)], face)));
        }
        sides.sort_unstable();
        let mut hinges = Vec::with_capacity(sides.len() / 2);
        for group in sides.chunk_by(|a, b| a.0 == b.0) {
            if let [(ends, first), (_, second)] = *group {
                hinges.push(Hinge { ends, faces: [first, second] });
            }
        }
        hinges
    }

    /// Unit normals of the faces; zero for a face without area.
    pub fn face_normals(&self) -> Vec<DVec3> {
        let normal = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|corner| self.positions[corner as usize]);
            (b - a).cross(c - a).normalize_or_zero()
        };
        self.faces.iter().map(normal).collect()
    }
}

/// The angle between two unit normals, degrees: 0 is flat. 0 where a face has no normal.
pub fn fold_angle_deg(a: DVec3, b: DVec3) -> f64 {
    // The arc tangent is exact near 0 and 180 degrees, where the arc cosine is not.
    libm::atan2(a.cross(b).length(), a.dot(b)).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hinges_are_the_edges_with_two_faces() {
        // Two triangles that share an edge, and a fin that makes another edge one of three faces.
        let mesh =
            Mesh { positions: vec![DVec3::ZERO; 6], faces: vec![[0, 1, 2], [2, 1, 3], [2, 3, 4], [3, 2, 5]] };
        assert_eq!(mesh.hinges(), [Hinge { ends: [1, 2], faces: [0, 1] }]);
    }

    #[test]
    fn angles_are_those_between_the_normals() {
        let tilted = DVec3::new(0.0, libm::sin(0.3), libm::cos(0.3));
        assert!((fold_angle_deg(DVec3::Z, tilted) - 0.3_f64.to_degrees()).abs() < 1e-12);
        assert!((fold_angle_deg(DVec3::Z, -DVec3::Z) - 180.0).abs() < 1e-12);
        assert_eq!(fold_angle_deg(DVec3::Z, DVec3::ZERO), 0.0);
    }
}
