//! Real meshes with a clean and a noisy version of the same connectivity. In: two files; out: the truth for both.
//!
//! The true lines are the edges whose faces meet at 15 degrees or more on the clean mesh, at the positions they have
//! on the mesh that is judged: a vertex that noise has moved along the surface takes its line with it.

use super::mesh::{Mesh, fold_angle_deg};
use super::metric::{Lines, Truth};
use anyhow::{Context, Result, ensure};
use std::env;
use std::path::{Path, PathBuf};

/// Fold angle from which an edge of the clean mesh is a feature, degrees: above the facets of its curved parts, below
/// its creases.
const FEATURE_DEG: f64 = 15.0;
/// Variable with the folder of real meshes.
const FOLDER: &str = "CREASE_DATA";

/// A mesh in two versions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pair {
    /// What it is called, with kind and amount of the noise of the second version as its collection states them.
    pub name: &'static str,
    clean: &'static str,
    noisy: &'static str,
}

/// All pairs.
pub const PAIRS: [Pair; 5] = [
    pair("fandisk_hurtado (gaussian 0.1)", ["fandisk_hurtado_clean.ply", "fandisk_hurtado0.1_noisy.ply"]),
    pair("fandisk_gcn (gaussian 0.6)", ["fandisk_gcn_clean.ply", "fandisk_gcn_gaus0.6_noisy.ply"]),
    pair("trim-star (gaussian 0.3)", ["trim-star_gcn_clean.ply", "trim-star_gcn_gaus0.3_noisy.ply"]),
    pair("fertility (gaussian 0.3)", ["fertility_gcn_clean.ply", "fertility_gcn_gaus0.3_noisy.ply"]),
    pair("nicolo (impulse 0.6)", ["nicolo_gcn_clean.ply", "nicolo_gcn_imp0.6_noisy.ply"]),
];

const fn pair(name: &'static str, [clean, noisy]: [&'static str; 2]) -> Pair {
    Pair { name, clean, noisy }
}

/// The folder of real meshes.
///
/// # Errors
/// If the environment does not name one.
pub fn folder() -> Result<PathBuf> {
    let root = env::var_os(FOLDER)
        .with_context(|| format!("{FOLDER} is not set: it must name a folder with `meshes` in it"))?;
    Ok(Path::new(&root).join("meshes"))
}

impl Pair {
    /// Where one version lies.
    ///
    /// # Errors
    /// If the environment does not say.
    pub fn path(&self, noisy: bool) -> Result<PathBuf> {
        Ok(folder()?.join(if noisy { self.noisy } else { self.clean }))
    }

    /// The mesh of one version and its truth.
    ///
    /// # Errors
    /// If a file is missing, or the two differ in more than positions.
    pub fn read(&self, noisy: bool) -> Result<(Mesh, Truth)> {
        let clean = Mesh::read(&self.path(false)?)?;
        if !noisy {
            let truth = truth(&clean, &clean);
            return Ok((clean, truth));
        }
        let mesh = Mesh::read(&self.path(true)?)?;
        ensure!(
            mesh.faces == clean.faces && mesh.positions.len() == clean.positions.len(),
            "{} and {} differ in their faces",
            self.clean,
            self.noisy
        );
        let truth = truth(&clean, &mesh);
        Ok((mesh, truth))
    }
}

/// Feature edges of `clean`, where they are in `mesh`. What is a corner is seen on the clean mesh.
fn truth(clean: &Mesh, mesh: &Mesh) -> Truth {
    let normals = clean.face_normals();
    let is_feature = |faces: [u32; 2]| {
        let [a, b] = faces.map(|face| normals[face as usize]);
        fold_angle_deg(a, b) >= FEATURE_DEG
    };
    let edges: Vec<[u32; 2]> =
        clean.hinges().iter().filter(|hinge| is_feature(hinge.faces)).map(|hinge| hinge.ends).collect();
    let mut truth = Truth::of_lines(Lines::of_edges(&clean.positions, edges.iter().copied()));
    // The same edges give the same points in the same order.
    truth.points = Lines::of_edges(&mesh.positions, edges).points;
    truth
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn features_are_edges_of_the_clean_mesh_at_the_places_of_the_other() {
        // A roof of 90 degrees over the edge from 0 to 1.
        let clean = Mesh {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::new(0.0, 1.0, -1.0), DVec3::new(0.0, -1.0, -1.0)],
            faces: vec![[0, 1, 2], [1, 0, 3]],
        };
        let mut moved = clean.clone();
        moved.positions[1] = DVec3::new(2.0, 0.0, 5.0);
        let truth = truth(&clean, &moved);
        assert_eq!((truth.curves.len(), truth.points), (1, vec![DVec3::ZERO, DVec3::new(2.0, 0.0, 5.0)]));
        moved.positions[2].z = 0.0;
        moved.positions[3].z = 0.0;
        assert!(super::truth(&moved, &clean).curves.is_empty());
    }
}
