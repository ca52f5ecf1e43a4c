//! A sheet of small pictures: each mesh with its true and its found lines. In: cases whose files were kept, and their
//! results; out: a PNG, drawn by `tools/render`.

use super::case::Case;
use super::results::{Record, Results, distinct};
use anyhow::{Context, Result, ensure};
use serde::Serialize;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What `tools/render/sheet.py` draws.
#[derive(Serialize)]
struct Manifest {
    title: String,
    columns: Vec<String>,
    rows: Vec<Row>,
}

#[derive(Serialize)]
struct Row {
    label: String,
    tiles: Vec<Option<Tile>>,
}

#[derive(Serialize)]
struct Tile {
    mesh: PathBuf,
    lines: PathBuf,
    truth: PathBuf,
    label: String,
}

/// Draws one tile for each mesh and noise: the first seed, and the first method that has a score there. `directory` is
/// where the files were kept.
///
/// # Errors
/// If nothing is there to be drawn, or the renderer fails.
pub fn draw(cases: &[Case], results: &Results, directory: &Path, out: &Path) -> Result<()> {
    let columns = distinct(cases, |case: &Case| case.noise.clone());
    let mut rows = Vec::new();
    for mesh in distinct(cases, |case: &Case| case.mesh.clone()) {
        let mut tiles = Vec::new();
        for noise in &columns {
            let case = cases.iter().find(|case| case.mesh == mesh && case.noise == *noise);
            tiles.push(case.map(|case| tile(case, results, directory)).transpose()?.flatten());
        }
        rows.push(Row { label: mesh, tiles });
    }
    ensure!(rows.iter().any(|row| row.tiles.iter().any(Option::is_some)), "there is nothing to draw");
    let title = "Green: true lines. Red: found lines. Dots: found corners. Columns: noise.";
    let manifest = Manifest { title: title.to_owned(), columns, rows };
    let path = directory.join("sheet.json");
    fs::write(&path, serde_json::to_string(&manifest)?)?;
    let renderer = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/render/run");
    let status = Command::new(&renderer)
        .arg("sheet")
        .args([&path, out])
        .status()
        .with_context(|| format!("cannot run {}", renderer.display()))?;
    ensure!(status.success(), "{} failed: {status}", renderer.display());
    Ok(())
}

/// The tile of a case; none if no method has a score.
fn tile(case: &Case, results: &Results, directory: &Path) -> Result<Option<Tile>> {
    let is_of_case = |record: &&Record| {
        record.set == case.set
            && record.mesh == case.mesh
            && record.noise == case.noise
            && record.seed == case.seed
            && record.chosen.is_none()
    };
    let record = results.records.iter().filter(is_of_case).find_map(|record| Some((record, record.score()?)));
    let Some((record, score)) = record else { return Ok(None) };
    Ok(Some(Tile {
        mesh: case.mesh_path(directory)?,
        lines: case.lines_path(directory, &record.method),
        truth: case.truth_path(directory),
        label: if score.true_length > 0.0 {
            format!("F1: {:.2}", score.at_1h.f1)
        } else {
            format!("false: {}", score.false_components)
        },
    }))
}
