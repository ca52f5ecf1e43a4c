//! Whatever the mesh: tiles of any size give the result of the run in core to the bit, and the result makes sense.
//!
//! Random meshes of all kinds that scanners and modellers do not make: soups of triangles, faces on top of each other,
//! needles, huge fans, points on a line or all in one place, tiny and huge coordinates.

mod support;

use crease::stitch::Class;
use crease::{Detection, Params};
use glam::DVec3;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed, TestCaseError, TestRunner};
use std::cell::Cell;
use std::collections::BTreeSet;
use support::{Fields, Mesh, first_difference, in_core, tiled, try_run};

/// Meshes of each kind.
const CASES: u32 = 50;
/// Faces of a tile.
const TILES: [u64; 3] = [1, 5, 37];
/// More tiles than this only take longer.
const MOST_TILES: u64 = 60;

fn mesh(positions: Vec<DVec3>, faces: Vec<[u32; 3]>) -> Mesh {
    Mesh { positions, faces }
}

fn point(extent: f64) -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-extent..extent).prop_map(DVec3::from)
}

/// A point with small whole coordinates, so that points coincide and lie on common lines and planes.
fn lattice_point() -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(0..4i32).prop_map(|p| DVec3::from(p.map(f64::from)))
}

/// Any three corners, also the same one twice.
fn faces_on(vertices: usize, most: usize) -> impl Strategy<Value = Vec<[u32; 3]>> {
    let corner = 0..vertices as u32;
    vec([corner.clone(), corner.clone(), corner], 0..most)
}

/// Triangles between random points, most edges with one face or many.
fn soup() -> impl Strategy<Value = Mesh> {
    let points = prop_oneof![vec(point(1.0), 1..40), vec(lattice_point(), 1..40)];
    points.prop_flat_map(|points| {
        let faces = faces_on(points.len(), 80);
        (Just(points), faces).prop_map(|(points, faces)| mesh(points, faces))
    })
}

/// A grid of `columns` times `rows` vertices with the faces of its cells.
fn grid(columns: u32, rows: u32, height: impl Fn(u32, u32) -> f64, diagonal: impl Fn(u32) -> bool) -> Mesh {
    let at = |x: u32, y: u32| y * columns + x;
    let cell = |x: u32, y: u32| {
        let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)];
        if diagonal(a) { [[a, b, c], [b, d, c]] } else { [[a, b, d], [a, d, c]] }
    };
    let places = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
    let positions = places.clone().map(|(x, y)| DVec3::new(x.into(), y.into(), height(x, y))).collect();
    let cells = places.filter(|&(x, y)| x + 1 < columns && y + 1 < rows);
    mesh(positions, cells.flat_map(|(x, y)| cell(x, y)).collect())
}

/// A sheet with random heights and diagonals: flat, rough, or so steep that all faces are needles.
fn sheet() -> impl Strategy<Value = Mesh> {
    let roughness = prop_oneof![Just(0.0), Just(1e-7), 0.01..0.5f64, 5.0..500.0f64];
    (2..12u32, 2..12u32, roughness).prop_flat_map(|(columns, rows, roughness)| {
        let n = (columns * rows) as usize;
        (vec(-1.0..1.0f64, n), vec(any::<bool>(), n)).prop_map(move |(heights, diagonals)| {
            let height = |x: u32, y: u32| roughness * heights[(y * columns + x) as usize];
            grid(columns, rows, height, |a| diagonals[a as usize])
        })
    })
}

/// A gable roof: one crease, in noise.
fn roof() -> impl Strategy<Value = Mesh> {
    let roughness = prop_oneof![Just(0.0), 0.0..0.1f64];
    (8..14u32, 12..18u32, 0.2..3.0f64, roughness).prop_flat_map(|(columns, rows, slope, roughness)| {
        vec(-1.0..1.0f64, (columns * rows) as usize).prop_map(move |noise| {
            let ridge = f64::from(columns / 2);
            let height = |x: u32, y: u32| {
                -slope * (f64::from(x) - ridge).abs() + roughness * noise[(y * columns + x) as usize]
            };
            grid(columns, rows, height, |_| true)
        })
    })
}

/// Many faces around one vertex, closed or not, flat or a cone.
fn fan() -> impl Strategy<Value = Mesh> {
    (3..200u32, any::<bool>(), -2.0..2.0f64).prop_map(|(n, closed, height)| {
        let angle = |i: u32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
        let rim = (0..n).map(|i| DVec3::new(libm::cos(angle(i)), libm::sin(angle(i)), 0.0));
        let positions = std::iter::once(DVec3::new(0.0, 0.0, height)).chain(rim).collect();
        let last = if closed { n } else { n - 1 };
        mesh(positions, (0..last).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect())
    })
}

/// All points on one line, or all in one place.
fn collapsed() -> impl Strategy<Value = Mesh> {
    let places = vec(prop_oneof![Just(0.0), 0.0..10.0f64, (0..5i32).prop_map(f64::from)], 1..30);
    (places, point(1.0), point(5.0), any::<bool>()).prop_flat_map(|(places, direction, origin, one)| {
        let direction = if one { DVec3::ZERO } else { direction };
        let positions: Vec<DVec3> = places.iter().map(|s| origin + direction * *s).collect();
        (Just(positions), faces_on(places.len(), 60)).prop_map(|(positions, faces)| mesh(positions, faces))
    })
}

/// What is done to a mesh.
#[derive(Clone, Copy, Debug)]
enum Change {
    /// A copy of a face; turned round or not.
    Copy { face: prop::sample::Index, turned: bool },
    /// A face the other way round.
    Flip { face: prop::sample::Index },
    /// A face between any three vertices.
    Fin { corners: [prop::sample::Index; 3] },
    /// A vertex in the place of another.
    Weld { vertex: prop::sample::Index, other: prop::sample::Index },
    /// A vertex that no face uses, far away.
    Stray,
    /// A far vertex with a face: long edges.
    Spike { face: prop::sample::Index },
}

fn change() -> impl Strategy<Value = Change> {
    let index = any::<prop::sample::Index>;
    prop_oneof![
        (index(), any::<bool>()).prop_map(|(face, turned)| Change::Copy { face, turned }),
        index().prop_map(|face| Change::Flip { face }),
        [index(), index(), index()].prop_map(|corners| Change::Fin { corners }),
        (index(), index()).prop_map(|(vertex, other)| Change::Weld { vertex, other }),
        Just(Change::Stray),
        index().prop_map(|face| Change::Spike { face }),
    ]
}

fn apply(mesh: &mut Mesh, change: Change) {
    let (vertices, faces) = (mesh.positions.len(), mesh.faces.len());
    match change {
        Change::Copy { face, turned } if faces > 0 => {
            let [a, b, c] = mesh.faces[face.index(faces)];
            mesh.faces.push(if turned { [b, a, c] } else { [c, a, b] });
        }
        Change::Flip { face } if faces > 0 => mesh.faces[face.index(faces)].swap(0, 1),
        Change::Fin { corners } => mesh.faces.push(corners.map(|corner| corner.index(vertices) as u32)),
        Change::Weld { vertex, other } => {
            mesh.positions[vertex.index(vertices)] = mesh.positions[other.index(vertices)];
        }
        Change::Spike { face } if faces > 0 => {
            let [a, b, _] = mesh.faces[face.index(faces)];
            mesh.faces.push([b, a, vertices as u32]);
            mesh.positions.push(mesh.positions[a as usize] + DVec3::new(90.0, 40.0, 20.0));
        }
        Change::Stray | Change::Copy { .. } | Change::Flip { .. } | Change::Spike { .. } => {
            mesh.positions.push(DVec3::splat(1000.0));
        }
    }
}

/// A sheet or roof with defects.
fn damaged() -> impl Strategy<Value = Mesh> {
    (prop_oneof![sheet(), roof()], vec(change(), 1..8)).prop_map(|(mut mesh, changes)| {
        changes.into_iter().for_each(|change| apply(&mut mesh, change));
        mesh
    })
}

/// A mesh in other units and far from the origin, stretched into needles along an axis.
fn transformed() -> impl Strategy<Value = Mesh> {
    let scale = prop_oneof![Just(1e-150), Just(1e-9), Just(1.0), Just(1e6), Just(1e60)];
    let stretch = prop_oneof![Just(1.0), Just(1e-3), Just(1e3), Just(1e-8)];
    let offset = prop_oneof![Just(DVec3::ZERO), Just(DVec3::new(5e5, 5.8e6, 0.0)), Just(DVec3::splat(-1e12))];
    (prop_oneof![sheet(), roof(), fan(), soup()], scale, stretch, offset).prop_map(
        |(mut mesh, scale, stretch, offset)| {
            let size = DVec3::new(scale, scale * stretch, scale);
            mesh.positions.iter_mut().for_each(|p| *p = *p * size + offset * scale);
            mesh
        },
    )
}

/// What a test saw over all its cases, so that it cannot pass by looking at nothing.
#[derive(Default)]
struct Tally {
    cases: Cell<u32>,
    /// Cases with several tiles.
    cut: Cell<u32>,
    /// Cases with creases.
    creases: Cell<u32>,
    /// Cases with lines of any kind.
    lines: Cell<u32>,
}

fn count(cell: &Cell<u32>, when: bool) {
    cell.set(cell.get() + u32::from(when));
}

/// Runs `cases` cases; the same ones every time.
fn examine(meshes: impl Strategy<Value = Mesh>, cases: u32) -> Tally {
    let config =
        Config { cases, failure_persistence: None, rng_seed: RngSeed::Fixed(29), ..Config::default() };
    let tally = Tally::default();
    let outcome =
        TestRunner::new(config).run(&(meshes, 1..4usize, any::<bool>()), |(mesh, threads, wide)| {
            let sigma = crease::Sigma::Edges(if wide { 4.0 } else { 3.0 });
            let params = Params { sigma, boundaries: true, min_length_sigmas: 1.0, ..Params::default() };
            check(&mesh, params, threads, &tally)
        });
    outcome.unwrap_or_else(|e| panic!("{e}"));
    assert!(tally.cases.get() >= cases);
    tally
}

/// One mesh in core and in tiles.
fn check(mesh: &Mesh, params: Params, threads: usize, tally: &Tally) -> Result<(), TestCaseError> {
    let source = mesh.source();
    let whole =
        try_run(&source, params, in_core(), 1.0).map_err(|e| TestCaseError::fail(format!("in core: {e}")))?;
    sensible(mesh, &whole).map_err(|what| TestCaseError::fail(format!("in core: {what}")))?;
    let mut most_tiles = 0;
    for faces in TILES.into_iter().filter(|&n| mesh.faces.len() as u64 <= n * MOST_TILES) {
        let what = format!("tiles of {faces} faces on {threads} threads");
        let cut = try_run(&source, params, tiled(faces, threads), 1.0)
            .map_err(|e| TestCaseError::fail(format!("{what}: {e}")))?;
        if let Some(difference) = first_difference(&whole, &cut) {
            return Err(TestCaseError::fail(format!("{what}, {} of them: {difference}", cut.0.work.tiles)));
        }
        most_tiles = most_tiles.max(cut.0.work.tiles);
    }
    let lines = &whole.0.lines.lines;
    count(&tally.cases, true);
    count(&tally.cut, most_tiles > 1);
    count(&tally.lines, !lines.is_empty());
    count(&tally.creases, lines.iter().any(|line| matches!(line.class, Class::Weak | Class::Sharp)));
    Ok(())
}

/// Whether the result of a run can be one of `mesh`; says what cannot.
fn sensible(mesh: &Mesh, (found, fields): &(Detection, Fields)) -> Result<(), String> {
    let sides = |&[a, b, c]: &[u32; 3]| [(a, b), (b, c), (c, a)].map(|(a, b)| (a.min(b), a.max(b)));
    let edges: BTreeSet<(u32, u32)> = mesh.faces.iter().flat_map(sides).collect();
    let lines = &found.lines;
    for f in fields.0.values() {
        let [l1, l2, l3] = f.eigenvalues;
        let ordered = 1.0 >= l1 && l1 >= l2 && l2 >= l3 && l3 >= 0.0 && (l1 == 1.0 || l1 == 0.0);
        let numbers = [f.omega, f.salience].iter().all(|x| x.is_finite() && *x >= 0.0);
        if !(ordered && numbers && f.salience <= lines.largest_salience) {
            return Err(format!("the fields of {} are {f:?}", f.id));
        }
        if f.position != mesh.positions[f.id.0 as usize] {
            return Err(format!("{} is elsewhere", f.id));
        }
    }
    if !lines.largest_salience.is_finite() {
        return Err(format!("the largest salience is {}", lines.largest_salience));
    }
    for vertex in &lines.vertices {
        let saliency = lines.saliency(vertex);
        if !(vertex.theta.is_finite() && (0.0..=1.0).contains(&saliency)) {
            return Err(format!("{vertex:?} has saliency {saliency}"));
        }
    }
    for (i, line) in lines.lines.iter().enumerate() {
        let numbers = [line.length, line.strength, line.angle];
        // Means of values up to 1, each rounded.
        if !numbers.iter().all(|x| x.is_finite() && *x >= 0.0) || line.strength > 1.0 + 1e-12 {
            return Err(format!("line {i} is {line:?}"));
        }
        if line.vertices.len() < 2 || line.closed != (line.vertices.first() == line.vertices.last()) {
            return Err(format!("line {i} is {line:?}"));
        }
        for e in line.vertices.windows(2) {
            let [a, b] = [e[0], e[1]].map(|v| lines.vertices[v as usize].id.0 as u32);
            if !edges.contains(&(a.min(b), a.max(b))) {
                return Err(format!("line {i} runs from vertex {a} to {b}, which is no edge"));
            }
        }
    }
    Ok(())
}

#[test]
fn soups() {
    let tally = examine(soup(), CASES);
    assert!(tally.cut.get() > CASES / 2 && tally.lines.get() > CASES / 2);
}

#[test]
fn sheets() {
    let tally = examine(sheet(), CASES);
    assert!(tally.cut.get() > CASES / 2 && tally.lines.get() > CASES / 2);
}

#[test]
fn roofs() {
    let tally = examine(roof(), CASES);
    assert!(tally.cut.get() > CASES / 2 && tally.creases.get() > CASES / 2);
}

#[test]
fn fans() {
    let tally = examine(fan(), CASES);
    assert!(tally.cut.get() > CASES / 2);
}

#[test]
fn points_on_a_line_or_in_one_place() {
    let tally = examine(collapsed(), CASES);
    assert!(tally.cut.get() > CASES / 4);
}

#[test]
fn meshes_with_defects() {
    let tally = examine(damaged(), CASES);
    assert!(tally.cut.get() > CASES / 2 && tally.creases.get() > CASES / 10);
}

#[test]
fn other_units_and_places() {
    let tally = examine(transformed(), CASES);
    assert!(tally.cut.get() > CASES / 4);
}
