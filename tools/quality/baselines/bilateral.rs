//! Bilateral filtering of face normals. In: a mesh; out: normals after a number of iterations.
//!
//! Zheng, Fu, Au, Tai, "Bilateral normal filtering for mesh denoising", IEEE TVCG 17(10), 2011, the local scheme:
//! n_i <- unit(sum over the faces j that share a vertex with i, i included, of A_j exp(-|c_i - c_j|^2 / 2 sigma_c^2)
//! exp(-|n_i - n_j|^2 / 2 sigma_s^2) n_j). Vertices are not moved afterwards: angles are taken from the normals.

use super::super::mesh::Mesh;
use glam::DVec3;

/// Filters step by step.
#[derive(Clone)]
pub struct Bilateral {
    /// Normals as they are now; zero for faces without area.
    pub normals: Vec<DVec3>,
    /// Of each face: the faces that share a vertex with it and itself, with what stays the same of their weights.
    neighbours: Vec<Vec<(u32, f64)>>,
}

impl Bilateral {
    /// Starts from the normals of the mesh.
    pub fn new(mesh: &Mesh) -> Bilateral {
        let center = |face: &[u32; 3]| face.map(|v| mesh.positions[v as usize]).iter().sum::<DVec3>() / 3.0;
        let centers: Vec<DVec3> = mesh.faces.iter().map(center).collect();
        let area = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| mesh.positions[v as usize]);
            0.5 * (b - a).cross(c - a).length()
        };
        let areas: Vec<f64> = mesh.faces.iter().map(area).collect();
        // sigma_c as the paper chooses it: the mean distance of the barycentres of faces with a common edge.
        let hinges = mesh.hinges();
        let sum: f64 =
            hinges.iter().map(|h| centers[h.faces[0] as usize].distance(centers[h.faces[1] as usize])).sum();
        let spread = (sum / hinges.len().max(1) as f64).max(f64::MIN_POSITIVE);
        let mut around_vertex = vec![Vec::new(); mesh.positions.len()];
        for (face, corners) in (0_u32..).zip(&mesh.faces) {
            corners.iter().for_each(|&v| around_vertex[v as usize].push(face));
        }
        let neighbours = (0..mesh.faces.len()).map(|i| {
            let mut around: Vec<u32> =
                mesh.faces[i].iter().flat_map(|&v| &around_vertex[v as usize]).copied().collect();
            around.sort_unstable();
            around.dedup();
            let weight = |j: u32| {
                let apart = centers[i].distance(centers[j as usize]) / spread;
                (j, areas[j as usize] * libm::exp(-0.5 * apart * apart))
            };
            around.into_iter().map(weight).collect()
        });
        Bilateral { neighbours: neighbours.collect(), normals: mesh.face_normals() }
    }

    /// One iteration; `range` is sigma_s, a chord between unit normals.
    pub fn iterate(&mut self, range: f64) {
        let factor = -0.5 / (range * range);
        let filtered = self.normals.iter().zip(&self.neighbours).map(|(&normal, around)| {
            let mut sum = DVec3::ZERO;
            for &(j, weight) in around {
                let other = self.normals[j as usize];
                sum += other * (weight * libm::exp(factor * normal.distance_squared(other)));
            }
            sum.try_normalize().unwrap_or(normal)
        });
        self.normals = filtered.collect();
    }
}
