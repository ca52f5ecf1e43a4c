//! The mesh that all steps are measured on: the scan of a city as one tile, with what each step needs from those before.

use super::generator::noise::NoiseKind;
use super::generator::scan::CityScan;
use super::generator::scan::write::{Style, write};
use super::steps::{Steps, Tile, plan};
use anyhow::{Context, Result};
use crease::config::Params;
use crease::input::{IoMode, PlySource};
use crease::partition::{Cell, Loaded, Plan, Region};
use crease::{Tiling, voting};
use tempfile::TempDir;

/// Some fourteen blocks of houses and 70 MB of arrays: more than the caches nearest to a core hold, and soon done.
const TRIANGLES: u64 = 200_000;
const SEED: u64 = 1;
/// Of a good scanner, in mean edge lengths.
const NOISE: f64 = 0.03;

/// The mesh in a file, the tile, and all that was found out about it.
pub struct Town {
    pub source: PlySource,
    pub params: Params,
    pub plan: Plan,
    pub cell: Cell,
    pub region: Region,
    pub tile: Tile,
    pub steps: Steps,
    /// Holds the file, and goes with it.
    pub directory: TempDir,
}

impl Town {
    /// Writes the mesh, reads it, and does all steps once.
    ///
    /// # Errors
    /// If a temporary file cannot be written.
    pub fn build() -> Result<Town> {
        let directory = tempfile::tempdir().context("no directory for temporary files")?;
        let path = directory.path().join("town.ply");
        let city = CityScan::new(TRIANGLES, SEED)?.with_noise(NoiseKind::Normal, NOISE)?;
        write(&city, &Style { mesh: &path, truth: None, offset: None, shuffle: None })?;
        let source = PlySource::open(&path, IoMode::Auto)?;
        let params = Params::default();
        let plan = plan(&source, &params, Tiling::InCore);
        let cell = plan.cells[0];
        let region = plan.first_region(&cell, 0);
        let tile = Tile::load(&source, &plan, &|_| (), &cell);
        let steps = Steps::compute(&tile, &plan);
        Ok(Town { source, params, plan, cell, region, tile, steps, directory })
    }

    /// Faces of the mesh.
    pub fn faces(&self) -> u64 {
        self.tile.mesh.face_count() as u64
    }

    /// Vertices of the mesh.
    pub fn vertices(&self) -> u64 {
        self.tile.mesh.vertex_count() as u64
    }

    /// The tile as halos see it.
    pub fn loaded(&self) -> Loaded<'_> {
        Loaded { mesh: &self.tile.mesh, region: &self.region, lattice: &self.plan.lattice }
    }

    /// Refinement rounds of each face by its noise.
    pub fn rounds(&self, levels: &[Option<f64>]) -> Vec<Option<u32>> {
        levels.iter().map(|s0| s0.map(|s0| voting::rounds(&self.plan.scale, s0))).collect()
    }

    /// Rounds that a face takes part in, on the average.
    pub fn mean_rounds(&self) -> f64 {
        let sum: u64 = self.tile.needed.iter().map(|&k| u64::from(k)).sum();
        sum as f64 / self.faces() as f64
    }
}
