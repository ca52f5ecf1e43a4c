//! The promise of the program: the same bytes however the work was cut up.
//!
//! Every output file is written by the real writers and compared byte for byte with that of the in-core run, over tile
//! sizes, thread counts and ways of reading.

mod support;

use crease::input::{IoMode, PlySource};
use crease::output::{AttributeFile, write_ply};
use crease::{Job, Limits, Params, Silent, Tiling};
use std::path::Path;
use support::fixture;

const FIXTURES: [&str; 7] = ["city", "bracket", "bracket_clean", "folds20", "folds10", "defects", "polygons"];

/// Both output files, and how the work went.
struct Outcome {
    lines: Vec<u8>,
    attributes: Vec<u8>,
    tiles: u64,
}

fn outcome(mesh: &Path, params: Params, limits: Limits) -> Outcome {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let (lines, attributes) = (dir.path().join("lines.ply"), dir.path().join("attributes.ply"));
    let source = PlySource::open(mesh, limits.io).unwrap_or_else(|e| panic!("{e}"));
    let mut table = AttributeFile::create(&attributes, &source).unwrap_or_else(|e| panic!("{e}"));
    let found = Job::new(&source, params, limits, &Silent)
        .and_then(|job| job.run(Some(&mut table)))
        .unwrap_or_else(|e| panic!("{} {limits:?}: {e}", mesh.display()));
    table.finish(found.lines.largest_salience).unwrap_or_else(|e| panic!("{e}"));
    write_ply(&lines, &found.lines).unwrap_or_else(|e| panic!("{e}"));
    let read = |path| std::fs::read(path).expect("an output file");
    Outcome { lines: read(lines), attributes: read(attributes), tiles: found.work.tiles }
}

/// Says where two files first differ rather than printing them.
fn assert_same(what: &str, a: &[u8], b: &[u8]) {
    if a != b {
        let at = a.iter().zip(b).position(|(x, y)| x != y).unwrap_or(a.len().min(b.len()));
        panic!("{what}: byte {at} differs ({} and {} bytes)", a.len(), b.len());
    }
}

fn assert_equivalent(mesh: &Path, params: Params, limits: &[Limits]) {
    let whole = outcome(mesh, params, support::in_core());
    for &limits in limits {
        let cut = outcome(mesh, params, limits);
        let what = format!("{} {limits:?} ({} tiles)", mesh.display(), cut.tiles);
        assert_same(&format!("{what}: lines"), &whole.lines, &cut.lines);
        assert_same(&format!("{what}: attributes"), &whole.attributes, &cut.attributes);
    }
}

fn limits(faces: Option<u64>, threads: usize, io: IoMode) -> Limits {
    Limits { tiling: faces.map_or(Tiling::InCore, Tiling::Faces), threads, io }
}

/// Every combination.
fn full_matrix(tiles: &[Option<u64>], threads: &[usize]) -> Vec<Limits> {
    let io = [IoMode::Map, IoMode::Read];
    let threads_and_io = threads.iter().flat_map(|&t| io.map(|io| (t, io)));
    threads_and_io.flat_map(|(t, io)| tiles.iter().map(move |&faces| limits(faces, t, io))).collect()
}

#[test]
fn fixtures_give_the_same_bytes_for_every_cut() {
    let boundaries = Params { boundaries: true, ..Params::default() };
    for name in FIXTURES {
        let mesh = fixture(&format!("meshes/{name}.ply"));
        assert_equivalent(
            &mesh,
            boundaries,
            &full_matrix(&[None, Some(50_000), Some(5_000), Some(500)], &[1, 2, 3, 8]),
        );
        // Hundreds of tiles, each with nearly the whole mesh as its halo: the most seams and the most work.
        let tiny = full_matrix(&[Some(37)], &[3]);
        assert_equivalent(&mesh, boundaries, &tiny[..1]);
    }
}
