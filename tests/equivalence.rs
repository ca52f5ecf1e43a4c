//! The promise of the program: the same bytes however the work was cut up.
//!
//! Every output file is written by the real writers and compared byte for byte with that of the in-core run, over tile
//! sizes, thread counts and ways of reading. The lines of the in-core run are in memory, those of the others in files.

mod support;

use crease::glam::DVec3;
use crease::input::{IoMode, PlySource};
use crease::output::{AttributeFile, write_ply};
use crease::stitch::{Geometry, LineMemory, LineSource};
use crease::{Job, Limits, Method, PaperThresholds, Params, Sigma, Silent, Tiling};
use std::path::{Path, PathBuf};
use support::{Mesh, fixture, real_mesh};

const FIXTURES: [&str; 7] = ["city", "bracket", "bracket_clean", "folds20", "folds10", "defects", "polygons"];

/// All output files, and how the work went.
struct Outcome {
    lines: Vec<u8>,
    fitted: Vec<u8>,
    attributes: Vec<u8>,
    tiles: u64,
}

/// Where the lines are kept.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Lines {
    /// In memory, as a user of the library gets them.
    InMemory,
    /// In so little memory that all of them go to files, as far as they are more than a handful.
    Spilled,
}

/// Bytes for lines that are spilled.
const LITTLE: u64 = 1 << 16;
/// The same for what waits for other tiles: its seams stay in memory.
const LITTLE_OPEN: u64 = 1 << 18;

fn outcome(mesh: &Path, params: Params, limits: Limits, kept: Lines) -> Outcome {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let [lines, fitted, attributes] =
        ["lines.ply", "fitted.ply", "attributes.ply"].map(|name| dir.path().join(name));
    let source = PlySource::open(mesh, limits.io).unwrap_or_else(|e| panic!("{e}"));
    let mut table = AttributeFile::create(&attributes, &source).unwrap_or_else(|e| panic!("{e}"));
    let what = format!("{} {limits:?}", mesh.display());
    let job = Job::new(&source, params, limits, &Silent).unwrap_or_else(|e| panic!("{what}: {e}"));
    let write = |path: &Path, lines: &dyn LineSource| {
        write_ply(path, lines).unwrap_or_else(|e| panic!("{e}"));
    };
    let (largest, tiles) = match kept {
        Lines::InMemory => {
            let found = job.run(Some(&mut table)).unwrap_or_else(|e| panic!("{what}: {e}"));
            write(&lines, &found.lines);
            let largest = found.lines.largest_salience;
            write(&fitted, &found.lines.with_geometry(Geometry::Fitted));
            (largest, found.work.tiles)
        }
        Lines::Spilled => {
            let memory = LineMemory { open: LITTLE_OPEN, last: u64::MAX, lines: LITTLE };
            let job = job.with_line_memory(memory).with_scratch(dir.path(), true);
            let found = job.run_stored(Some(&mut table)).unwrap_or_else(|e| panic!("{what}: {e}"));
            assert!(found.lines.spilled() || found.lines.counts().vertices < 200, "{}", mesh.display());
            write(&lines, &found.lines);
            let largest = found.lines.largest_salience();
            write(&fitted, &found.lines.with_geometry(Geometry::Fitted));
            (largest, found.work.tiles)
        }
    };
    table.finish(largest).unwrap_or_else(|e| panic!("{e}"));
    let read = |path| std::fs::read(path).expect("an output file");
    let outcome = Outcome { lines: read(lines), fitted: read(fitted), attributes: read(attributes), tiles };
    assert_eq!(std::fs::read_dir(dir.path()).expect("list").count(), 3, "something was left behind");
    outcome
}

/// Says where two files first differ rather than printing them.
fn assert_same(what: &str, a: &[u8], b: &[u8]) {
    if a != b {
        let at = a.iter().zip(b).position(|(x, y)| x != y).unwrap_or(a.len().min(b.len()));
        panic!("{what}: byte {at} differs ({} and {} bytes)", a.len(), b.len());
    }
}

fn assert_equivalent(mesh: &Path, params: Params, limits: &[Limits]) {
    let whole = outcome(mesh, params, support::in_core(), Lines::InMemory);
    for &limits in limits {
        let cut = outcome(mesh, params, limits, Lines::Spilled);
        let what = format!("{} {limits:?} ({} tiles)", mesh.display(), cut.tiles);
        assert_same(&format!("{what}: lines"), &whole.lines, &cut.lines);
        assert_same(&format!("{what}: fitted lines"), &whole.fitted, &cut.fitted);
        assert_same(&format!("{what}: attributes"), &whole.attributes, &cut.attributes);
    }
}

fn limits(faces: Option<u64>, threads: usize, io: IoMode) -> Limits {
    Limits { tiling: faces.map_or(Tiling::InCore, Tiling::Faces), threads, io, ..Limits::default() }
}

/// Every combination.
fn full_matrix(tiles: &[Option<u64>], threads: &[usize]) -> Vec<Limits> {
    let io = [IoMode::Map, IoMode::Read];
    let threads_and_io = threads.iter().flat_map(|&t| io.map(|io| (t, io)));
    threads_and_io.flat_map(|(t, io)| tiles.iter().map(move |&faces| limits(faces, t, io))).collect()
}

/// Debug builds check every read of a field as well, and take their time; the full row is for optimised builds.
const THREADS: &[usize] = if cfg!(debug_assertions) { &[3] } else { &[1, 2, 3, 8] };

/// Hundreds of tiles of 37 faces, the most seams there can be. Each has nearly the whole mesh as its halo, so that a cut
/// costs as much as hundreds of runs in core: not with every number of threads.
fn smallest_tiles() -> Vec<Limits> {
    let all = [limits(Some(37), 3, IoMode::Map), limits(Some(37), 1, IoMode::Read)];
    all[..if cfg!(debug_assertions) { 1 } else { 2 }].to_vec()
}

#[test]
fn fixtures_give_the_same_bytes_for_every_cut() {
    let tiles = [None, Some(50_000), Some(5_000), Some(500)];
    for name in FIXTURES {
        let mesh = fixture(&format!("meshes/{name}.ply"));
        let boundaries = Params { boundaries: true, ..Params::default() };
        assert_equivalent(&mesh, boundaries, &[full_matrix(&tiles, THREADS), smallest_tiles()].concat());
    }
}

/// The paper method over a cube of this edge.
fn paper(sigma_edges: f64) -> Params {
    let method = Method::Paper(PaperThresholds::default());
    Params { method, sigma: Sigma::Edges(sigma_edges), boundaries: true, ..Params::default() }
}

#[test]
fn the_paper_method_gives_the_same_bytes_for_every_cut() {
    let cuts = |tiles: &[u64]| -> Vec<Limits> {
        let of = |&faces| [1, 3].map(|threads| limits(Some(faces), threads, IoMode::Map));
        tiles.iter().flat_map(of).collect()
    };
    for name in FIXTURES {
        let mesh = fixture(&format!("meshes/{name}.ply"));
        assert_equivalent(&mesh, paper(3.0), &cuts(&[5_000, 500, 37]));
        assert_equivalent(&mesh, paper(0.0), &cuts(&[500]));
        assert_equivalent(&mesh, paper(7.5), &cuts(&[500]));
    }
    let thresholds = PaperThresholds { salience: 0.2, edge_l2: 0.01, corner_l3: 0.1 };
    let loose = Params { method: Method::Paper(thresholds), ..Params::default() };
    assert_equivalent(&fixture("meshes/bracket.ply"), loose, &[limits(Some(90), 3, IoMode::Read)]);
}

#[test]
fn shortcuts_change_nothing() {
    let all_work = |faces| Limits { shortcuts: false, ..limits(faces, 2, IoMode::Map) };
    for name in FIXTURES {
        let mesh = fixture(&format!("meshes/{name}.ply"));
        assert_equivalent(&mesh, Params::default(), &[all_work(None), all_work(Some(700))]);
    }
    // Without a table of all vertices, planes are fitted only where lines are left.
    let lines = |shortcuts| {
        let source = PlySource::open(&fixture("meshes/city.ply"), IoMode::Map).expect("a mesh");
        let limits = Limits { shortcuts, ..support::in_core() };
        let job = Job::new(&source, Params::default(), limits, &Silent).expect("a job");
        job.run(None).expect("lines").lines
    };
    assert_eq!(lines(true), lines(false));
}

/// A roof in no order, with all that goes by the order of ids: faces that are wound the wrong way, that are there twice, and
/// that share an edge with two others; holes; a vertex with so many faces that nobody looks through it.
fn bad_order() -> Mesh {
    const SIDE: usize = 100;
    let mut mesh = Mesh::roof(SIDE as u32);
    let faces = mesh.faces.len();
    (0..faces).step_by(97).for_each(|f| mesh.faces[f].swap(0, 1));
    (0..faces).step_by(211).for_each(|f| mesh.faces.push(mesh.faces[f]));
    for f in (0..faces).step_by(307) {
        let [a, b, _] = mesh.faces[f];
        let above = mesh.positions[a as usize] + DVec3::new(0.1, 0.2, 0.9);
        mesh.positions.push(above);
        mesh.faces.push([a, b, mesh.positions.len() as u32 - 1]);
    }
    let centre = mesh.positions.len() as u32;
    mesh.positions.push(DVec3::new(-20.0, -20.0, 0.0));
    for i in 0..600 {
        let angle = f64::from(i) * 0.01;
        mesh.positions.push(DVec3::new(-20.0 + 5.0 * libm::cos(angle), -20.0 + 5.0 * libm::sin(angle), 0.0));
        if i > 0 {
            mesh.faces.push([centre, centre + i, centre + i + 1]);
        }
    }
    (0..faces).step_by(1009).for_each(|f| _ = mesh.faces.swap_remove(f));
    mesh.shuffled()
}

#[test]
fn how_tiles_are_numbered_changes_nothing() {
    let mesh = bad_order();
    let source = mesh.source();
    let all = Params { boundaries: true, ..Params::default() };
    for params in [all, Params { boundaries: true, ..paper(3.0) }] {
        let expected = support::run(&source, params, Limits { shortcuts: false, ..support::in_core() });
        assert!(!expected.0.lines.lines.is_empty(), "no lines");
        for limits in [support::in_core(), support::tiled(9_000, 2), support::tiled(700, 2)] {
            let found = support::run(&source, params, limits);
            assert_eq!(support::first_difference(&expected, &found), None, "{limits:?}");
        }
    }
    // A scan as it comes.
    let Some(scan) = real("iron_realscan") else { return };
    assert_equivalent(
        &scan,
        Params::default(),
        &[Limits { shortcuts: false, ..limits(None, 2, IoMode::Map) }],
    );
}

#[test]
fn parameters_do_not_loosen_it() {
    let wide = Params { sigma: Sigma::Edges(4.5), min_angle_deg: 10.0, ..Params::default() };
    let narrow = Params { sigma: Sigma::Length(1.7), min_length_sigmas: 1.0, ..Params::default() };
    for params in [wide, narrow] {
        for name in ["city", "folds20"] {
            let cuts = [limits(Some(700), 2, IoMode::Map), limits(Some(90), 3, IoMode::Read)];
            assert_equivalent(&fixture(&format!("meshes/{name}.ply")), params, &cuts);
        }
    }
}

/// A real mesh, or a word on why there is none.
fn real(name: &str) -> Option<PathBuf> {
    let mesh = real_mesh(&format!("{name}.ply"));
    if mesh.is_none() {
        println!("skipped: CREASE_DATA not set, or without {name}");
    }
    mesh
}

#[test]
fn real_parts_give_the_same_bytes_for_every_cut() {
    for name in ["fandisk_gcn_clean", "fandisk_gcn_gaus0.6_noisy", "trim-star_gcn_gaus0.3_noisy"] {
        let Some(mesh) = real(name) else { continue };
        let small = [limits(Some(500), 3, IoMode::Map), limits(Some(500), 1, IoMode::Read)];
        let cuts = [full_matrix(&[None, Some(5_000)], THREADS), small.to_vec()].concat();
        assert_equivalent(&mesh, Params::default(), &cuts);
        assert_equivalent(&mesh, paper(3.0), &[limits(Some(500), 3, IoMode::Map)]);
    }
}

#[test]
fn real_scans_give_the_same_bytes_for_every_cut() {
    for name in ["iron_realscan", "rabbit_realscan", "nicolo_gcn_imp0.6_noisy", "fertility_gcn_gaus0.3_noisy"]
    {
        let Some(mesh) = real(name) else { continue };
        let cuts = [
            limits(Some(50_000), 1, IoMode::Map),
            limits(Some(50_000), 8, IoMode::Read),
            limits(Some(5_000), 2, IoMode::Read),
            limits(Some(5_000), 3, IoMode::Map),
        ];
        assert_equivalent(&mesh, Params { boundaries: true, ..Params::default() }, &cuts);
        assert_equivalent(&mesh, paper(3.0), &cuts[2..3]);
    }
}

/// Long edges everywhere and faces in no order: the halo is hardest to get right here. A minute of work with
/// optimisation, too long without.
#[cfg(not(debug_assertions))]
#[test]
fn an_airborne_scan_gives_the_same_bytes_for_every_cut() {
    let Some(mesh) = real("ahn3_delft_tin") else { return };
    assert_equivalent(&mesh, Params::default(), &[limits(Some(500_000), 2, IoMode::Map)]);
}
