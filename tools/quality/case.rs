//! One mesh with known lines. In: a recipe or a real pair; out: the mesh file, the mesh, its truth and h.

use super::generator::ShapeName;
use super::generator::noise::NoiseKind;
use super::generator::ply::{self, Scalar};
use super::generator::style::Style;
use super::mesh::Mesh;
use super::metric::{Lines, Truth};
use super::pairs::Pair;
use anyhow::{Context, Result, ensure};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// What a case is called, and how it is made.
#[derive(Clone, Debug)]
pub struct Case {
    /// The set it is averaged with.
    pub set: String,
    /// The mesh, without noise and seed.
    pub mesh: String,
    /// The noise, as in the head of a column.
    pub noise: String,
    /// The seed, if it is generated.
    pub seed: Option<u64>,
    source: Source,
}

/// Where a mesh comes from.
#[derive(Clone, Debug)]
enum Source {
    Shape(Recipe),
    Pair { pair: Pair, noisy: bool },
}

/// How a mesh is generated.
#[derive(Clone, Copy, Debug)]
pub struct Recipe {
    /// The shape.
    pub shape: ShapeName,
    /// What its triangles look like.
    pub style: Style,
    /// Kind of noise.
    pub kind: NoiseKind,
    /// Amplitude of the noise in mean edge lengths.
    pub amount: f64,
    /// Seed of the mesh and of the noise.
    pub seed: u64,
}

/// A mesh whose lines are known.
#[derive(Clone, Debug)]
pub struct Problem {
    /// Where the mesh lies as a file.
    pub path: PathBuf,
    /// The mesh.
    pub mesh: Mesh,
    /// Its true lines.
    pub truth: Truth,
    /// Median side, mesh units.
    pub h: f64,
}

impl Case {
    /// A generated mesh.
    pub fn of_recipe(set: &str, recipe: Recipe) -> Case {
        Case {
            set: set.to_owned(),
            mesh: format!("{} {}", recipe.shape, recipe.style).replace("--", "").trim().to_owned(),
            noise: match recipe.kind {
                NoiseKind::Normal => recipe.amount.to_string(),
                kind => format!("{kind} {}", recipe.amount),
            },
            seed: Some(recipe.seed),
            source: Source::Shape(recipe),
        }
    }

    /// One version of a real mesh.
    pub fn of_pair(set: &str, pair: Pair, noisy: bool) -> Case {
        Case {
            set: set.to_owned(),
            mesh: pair.name.to_owned(),
            noise: if noisy { "noisy" } else { "clean" }.to_owned(),
            seed: None,
            source: Source::Pair { pair, noisy },
        }
    }

    /// A name for files.
    pub fn stem(&self) -> String {
        let seed = self.seed.map_or(String::new(), |seed| format!("-{seed}"));
        let plain = |c: char| if c.is_ascii_alphanumeric() || "-._".contains(c) { c } else { '_' };
        format!("{}-{}-{}{seed}", self.set, self.mesh, self.noise).chars().map(plain).collect()
    }

    /// Where the mesh lies: in `directory` if it is generated.
    ///
    /// # Errors
    /// If the environment does not say where the real meshes are.
    pub fn mesh_path(&self, directory: &Path) -> Result<PathBuf> {
        match self.source {
            Source::Shape(_) => Ok(directory.join(format!("{}.ply", self.stem()))),
            Source::Pair { pair, noisy } => pair.path(noisy),
        }
    }

    /// Where the true lines lie if they are kept.
    pub fn truth_path(&self, directory: &Path) -> PathBuf {
        directory.join(format!("{}.truth.ply", self.stem()))
    }

    /// Where the lines that a method found lie.
    pub fn lines_path(&self, directory: &Path, method: &str) -> PathBuf {
        directory.join(format!("{}.{method}.ply", self.stem()))
    }

    /// Makes the mesh, as a file in `directory` too if it is not one already.
    ///
    /// # Errors
    /// If it cannot be made, read or written.
    pub fn build(&self, directory: &Path) -> Result<Problem> {
        let path = self.mesh_path(directory)?;
        let recipe = match self.source {
            Source::Shape(recipe) => recipe,
            Source::Pair { pair, noisy } => {
                let (mesh, truth) = pair.read(noisy)?;
                return Problem::new(path, mesh, truth);
            }
        };
        let mut shape = recipe.shape.build_in(&recipe.style, recipe.seed)?;
        shape.add_noise_of(recipe.kind, recipe.amount, recipe.seed)?;
        write(&path, |out| ply::write_mesh(out, &shape, Scalar::Double))?;
        let truth = Truth::with_corners(Lines::of_polylines(&shape.lines), &shape.corners);
        Problem::new(path, Mesh { positions: shape.vertices, faces: shape.faces }, truth)
    }
}

impl Problem {
    /// A mesh with its truth.
    ///
    /// # Errors
    /// If no side of the mesh has a length.
    pub fn new(path: PathBuf, mesh: Mesh, truth: Truth) -> Result<Problem> {
        let h = mesh.median_side()?;
        ensure!(h > 0.0, "{}: no side has a length", path.display());
        Ok(Problem { path, mesh, truth, h })
    }
}

/// Writes a file through a buffer.
///
/// # Errors
/// If it cannot be written.
pub fn write(path: &Path, content: impl Fn(&mut BufWriter<File>) -> std::io::Result<()>) -> Result<()> {
    File::create(path)
        .map(BufWriter::new)
        .and_then(|mut out| {
            content(&mut out)?;
            out.flush()
        })
        .with_context(|| format!("cannot write {}", path.display()))
}
