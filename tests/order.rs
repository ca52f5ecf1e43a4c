//! Files without spatial order: a mesh that was rewritten gives the same bytes as the file it came from, within the memory
//! and the disk that were promised, and leaves nothing behind.

mod support;

use crease::glam::DVec3;
use crease::input::{FaceBlock, InputError, IoMode, MeshSource, PlySource};
use crease::mesh::{FaceId, VertexId};
use crease::output::{AttributeFile, FieldSink, OutputError, write_ply};
use crease::partition::{Joined, SpatialStore, join, scan, sort};
use crease::spill::{ScratchDir, SpillError};
use crease::stitch::VertexFields;
use crease::{Error, Job, Limits, Order, Params, Silent, Tiling};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use support::{Mesh, real_mesh};

/// How a mesh is written for a test.
#[derive(Clone, Copy, Debug, Default)]
struct Style {
    /// Coordinates as `double` instead of `float`.
    double: bool,
    /// The element `face` before the element `vertex`.
    faces_first: bool,
}

/// Numbers in no order, the same in every run.
struct Lottery(u64);

impl Lottery {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((u128::from(self.0) * n as u128) >> 64) as usize
    }

    fn permutation(&mut self, n: usize) -> Vec<usize> {
        let mut all: Vec<usize> = (0..n).collect();
        (1..n).rev().for_each(|i| all.swap(i, self.below(i + 1)));
        all
    }
}

/// Polygons over positions.
#[derive(Clone, Debug)]
struct Polygons {
    positions: Vec<DVec3>,
    faces: Vec<Vec<u32>>,
}

impl Polygons {
    fn of(mesh: &Mesh) -> Polygons {
        let faces = mesh.faces.iter().map(|face| face.to_vec()).collect();
        Polygons { positions: mesh.positions.clone(), faces }
    }

    /// A roof with dormers over a grid of n by n squares, every third of which is a quad.
    fn roof(n: u32) -> Polygons {
        let (side, mut positions, mut faces) = (n + 1, Vec::new(), Vec::new());
        for y in 0..side {
            for x in 0..side {
                let slope = f64::from((n / 2).abs_diff(x)) * -0.7;
                let dormer = if y % 40 < 12 && x % 50 < 20 { 3.0 } else { 0.0 };
                let grain = f64::from((x * 7 + y * 13) % 11) * 0.01;
                positions.push(DVec3::new(x.into(), y.into(), slope + dormer + grain));
            }
        }
        for y in 0..n {
            for x in 0..n {
                let a = y * side + x;
                if (x + y) % 3 == 0 {
                    faces.push(vec![a, a + 1, a + side + 1, a + side]);
                } else {
                    faces.push(vec![a, a + 1, a + side]);
                    faces.push(vec![a + 1, a + side + 1, a + side]);
                }
            }
        }
        Polygons { positions, faces }
    }

    /// The same mesh with vertices and faces in no order.
    fn shuffled(&self, seed: u64) -> Polygons {
        let mut lottery = Lottery(seed);
        let places = lottery.permutation(self.positions.len());
        let mut positions = self.positions.clone();
        self.positions.iter().zip(&places).for_each(|(&p, &place)| positions[place] = p);
        let renamed = |face: &Vec<u32>| face.iter().map(|&v| places[v as usize] as u32).collect();
        let order = lottery.permutation(self.faces.len());
        Polygons { positions, faces: order.iter().map(|&f| renamed(&self.faces[f])).collect() }
    }

    fn write(&self, path: &Path, style: Style) {
        let scalar = if style.double { "double" } else { "float" };
        let xyz: String = ["x", "y", "z"].map(|axis| format!("property {scalar} {axis}\n")).concat();
        let mut parts = [
            (
                format!("element vertex {}\n{xyz}", self.positions.len()),
                self.positions
                    .iter()
                    .flat_map(|p| p.to_array())
                    .flat_map(|x| match style.double {
                        true => x.to_le_bytes().to_vec(),
                        false => (x as f32).to_le_bytes().to_vec(),
                    })
                    .collect::<Vec<u8>>(),
            ),
            (
                format!("element face {}\nproperty list uchar uint vertex_indices\n", self.faces.len()),
                self.faces
                    .iter()
                    .flat_map(|face| {
                        std::iter::once(face.len() as u8).chain(face.iter().flat_map(|v| v.to_le_bytes()))
                    })
                    .collect(),
            ),
        ];
        if style.faces_first {
            parts.reverse();
        }
        let [(a, x), (b, y)] = parts;
        let header = format!("ply\nformat binary_little_endian 1.0\n{a}{b}end_header\n");
        std::fs::write(path, [header.as_bytes(), &x, &y].concat()).expect("write a mesh");
    }
}

fn open(path: &Path) -> PlySource {
    PlySource::open(path, IoMode::Auto).unwrap_or_else(|e| panic!("{e}"))
}

/// Lines and table of a run with hardly any memory for sorting.
fn outcome(mesh: &Path, limits: Limits) -> (Vec<u8>, Vec<u8>, bool) {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let [lines, table] = ["lines.ply", "table.ply"].map(|name| dir.path().join(name));
    let source = open(mesh);
    let mut fields = AttributeFile::create(&table, &source).unwrap_or_else(|e| panic!("{e}")).with_memory(1);
    let job = Job::new(&source, Params { boundaries: true, ..Params::default() }, limits, &Silent)
        .unwrap_or_else(|e| panic!("{e}"))
        .with_scratch(dir.path(), false)
        .with_order_memory(1);
    let found = job.run(Some(&mut fields)).unwrap_or_else(|e| panic!("{} {limits:?}: {e}", mesh.display()));
    fields.finish(found.lines.largest_salience).unwrap_or_else(|e| panic!("{e}"));
    write_ply(&lines, &found.lines).unwrap_or_else(|e| panic!("{e}"));
    let left = std::fs::read_dir(dir.path()).expect("list").count();
    assert_eq!(left, 2, "{limits:?}: temporary files are left");
    let read = |path| std::fs::read(path).expect("an output");
    (read(lines), read(table), found.work.rewritten)
}

fn limits(faces: u64, order: Order) -> Limits {
    Limits { tiling: Tiling::Faces(faces), threads: 2, order, ..Limits::default() }
}

/// In core, from the file, and from the copy: the same bytes.
fn assert_same_bytes(mesh: &Path, faces: u64) {
    let whole = outcome(mesh, Limits { order: Order::Rewrite, ..support::in_core() });
    assert!(!whole.2, "in core there is nothing to gain");
    for order in [Order::Keep, Order::Rewrite] {
        let cut = outcome(mesh, limits(faces, order));
        assert_eq!(cut.2, order == Order::Rewrite, "{}", mesh.display());
        assert!(cut.0 == whole.0, "{} {order:?}: the lines differ", mesh.display());
        assert!(cut.1 == whole.1, "{} {order:?}: the tables differ", mesh.display());
    }
}

#[test]
fn rewritten_meshes_give_the_same_bytes() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let path = dir.path().join("mesh.ply");
    let styles = [(false, false), (true, true)].map(|(double, faces_first)| Style { double, faces_first });
    for (seed, name) in (1..).zip(["city", "bracket", "folds20"]) {
        let mesh = Polygons::of(&Mesh::of_fixture(name)).shuffled(seed);
        mesh.write(&path, styles[seed as usize % 2]);
        assert_same_bytes(&path, 900);
    }
    for style in styles {
        Polygons::roof(60).shuffled(9).write(&path, style);
        assert_same_bytes(&path, 700);
    }
    // Repeated corners, duplicates, faces without area, vertices that no face uses.
    for seed in [5, 6] {
        Polygons::of(&Mesh::of_fixture("defects")).shuffled(seed).write(&path, Style::default());
        assert_same_bytes(&path, 20);
    }
}

#[test]
fn a_real_scan_gives_the_same_bytes() {
    let Some(mesh) = real_mesh("iron_realscan.ply") else {
        println!("skipped: CREASE_DATA not set");
        return;
    };
    let source = open(&mesh);
    let mut scan = Polygons { positions: Vec::new(), faces: Vec::new() };
    source.read_positions(VertexId(0), source.vertex_count() as usize, &mut scan.positions).expect("read");
    let mut block = FaceBlock::default();
    for index in 0..source.block_count() {
        source.read_block(index, &mut block).expect("read");
        scan.faces.extend(block.corners.iter().map(|face| face.iter().map(|id| id.0 as u32).collect()));
    }
    let dir = tempfile::tempdir().expect("a temporary directory");
    let path = dir.path().join("mesh.ply");
    scan.shuffled(3).write(&path, Style::default());
    assert_same_bytes(&path, 15_000);
}

/// A face as bits.
type Bits = ([VertexId; 3], [[u64; 3]; 3]);

/// All faces of a source by id, each of which must come once, blocks ascending.
fn faces(source: &dyn MeshSource) -> BTreeMap<FaceId, Bits> {
    let (mut block, mut places, mut found) = (FaceBlock::default(), Vec::new(), BTreeMap::new());
    for index in 0..source.block_count() {
        source.read_placed(index, &mut block, &mut places).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(block.corners.len(), places.len());
        for (i, (&corners, places)) in block.corners.iter().zip(&places).enumerate() {
            assert!(i == 0 || block.id(i - 1) < block.id(i), "block {index} does not ascend");
            let bits = places.map(|p| p.to_array().map(f64::to_bits));
            assert!(found.insert(block.id(i), (corners, bits)).is_none(), "{} comes twice", block.id(i));
        }
    }
    found
}

/// A source, its copies, and what they cost.
struct Copies<'a> {
    store: SpatialStore<'a>,
    scratch: ScratchDir,
}

fn copied<'a>(source: &'a PlySource, parent: &Path, memory: u64, sampled: bool, joins: bool) -> Copies<'a> {
    let scratch = ScratchDir::create(parent).expect("create");
    let scanned = scan(source, crease::config::NO_LIMIT, &|_| {}).unwrap_or_else(|e| panic!("{e}"));
    let joined: Option<Joined> = joins.then(|| join(source, &scratch, memory, &|_| {}).expect("join"));
    if let Some(joined) = &joined {
        assert!(faces(joined) == faces(source), "the joined mesh differs");
    }
    let sample = if sampled { scanned.sample.as_slice() } else { &[] };
    let store = sort(source, joined, (&scanned.bounds, sample), &scratch, memory, &|_| {}).expect("sort");
    Copies { store, scratch }
}

#[test]
fn copies_hold_every_face_once() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let path = dir.path().join("mesh.ply");
    let roof = Polygons::roof(110).shuffled(2);
    for (double, sampled, joins) in [(false, true, true), (true, false, true), (false, false, false)] {
        roof.write(&path, Style { double, faces_first: !double });
        let source = open(&path);
        let all = faces(&source);
        for memory in [20_000, 300_000, 100 << 20] {
            let copies = copied(&source, dir.path(), memory, sampled, joins);
            assert!(faces(&copies.store) == all, "{double} {sampled} {joins} {memory}");
            let counted: u64 = copies.store.summaries().iter().map(|block| u64::from(block.faces)).sum();
            assert_eq!(counted, source.face_count());
            assert_eq!(copies.scratch.bytes(), copies.store.bytes(), "only the copy is left");
        }
    }
}

#[test]
fn piles_of_equal_points_come_to_an_end() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let path = dir.path().join("mesh.ply");
    let mut mesh = Polygons::roof(30);
    let n = mesh.positions.len() as u32;
    mesh.positions.extend(std::iter::repeat_n(DVec3::new(3.0, 4.0, 5.0), 6000));
    mesh.faces.extend((0..8000).map(|i: u32| vec![n + i % 6000, n + (i + 1) % 6000, n + (7 * i + 2) % 6000]));
    mesh.faces.extend((0..2000).map(|_| vec![n, n, n + 1]));
    mesh.shuffled(4).write(&path, Style::default());
    let source = open(&path);
    for sampled in [true, false] {
        // A twentieth of the pile at a time.
        let copies = copied(&source, dir.path(), 84_000, sampled, true);
        assert!(faces(&copies.store) == faces(&source));
    }
    let whole = Polygons { positions: vec![DVec3::ONE; 3], faces: vec![vec![0, 1, 2]; 20_000] };
    whole.write(&path, Style::default());
    let source = open(&path);
    let copies = copied(&source, dir.path(), 84_000, true, true);
    assert!(faces(&copies.store) == faces(&source));
}

/// Large enough that vertices are scattered and do not fit: joined, sorted, and detected.
#[test]
fn a_larger_mesh_keeps_within_three_times_its_size() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let path = dir.path().join("mesh.ply");
    // As a scan has them: triangles only.
    let mut roof = Polygons::roof(400);
    roof.faces = roof
        .faces
        .iter()
        .flat_map(|face| (2..face.len()).map(|i| vec![face[0], face[i - 1], face[i]]))
        .collect();
    roof.shuffled(8).write(&path, Style::default());
    let source = open(&path);
    let run = |order| {
        let mut fields = support::Fields::default();
        let found = Job::new(&source, Params::default(), limits(15_000, order), &Silent)
            .unwrap_or_else(|e| panic!("{e}"))
            .with_scratch(dir.path(), false)
            .with_order_memory(1 << 20)
            .run(Some(&mut fields))
            .unwrap_or_else(|e| panic!("{e}"));
        (found, fields)
    };
    let (auto, keep) = (run(Order::Auto), run(Order::Keep));
    assert!(auto.0.work.rewritten && !keep.0.work.rewritten);
    assert_eq!(auto.0.work.stages.iter().filter(|(stage, _)| stage.name() == "order").count(), 2);
    let (peak, size) = (auto.0.work.temporary_bytes, source.file_len());
    assert!(peak > 2 * size && peak <= 3 * size, "{peak} bytes for {size}");
    assert_eq!(keep.0.work.temporary_bytes, 0);
    assert_eq!(support::first_difference(&auto, &keep), None);
    // Squares of 45 by 45 vertices, one after the other.
    roof.faces.sort_by_key(|face| (face[0] / 401 / 45, face[0] % 401 / 45));
    let coherent = dir.path().join("coherent.ply");
    roof.write(&coherent, Style::default());
    let source = open(&coherent);
    let found = Job::new(&source, Params::default(), limits(15_000, Order::Auto), &Silent)
        .and_then(|job| job.with_order_memory(1 << 20).run(None))
        .unwrap_or_else(|e| panic!("{e}"));
    assert!(!found.work.rewritten, "neighbours are near each other in the file");
}

#[test]
fn damaged_copies_are_detected() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let path = dir.path().join("mesh.ply");
    Polygons::roof(60).shuffled(2).write(&path, Style::default());
    let source = open(&path);
    let copies = copied(&source, dir.path(), 200_000, true, true);
    let files: Vec<PathBuf> = std::fs::read_dir(copies.scratch.path())
        .expect("list")
        .map(|e| e.expect("an entry").path())
        .collect();
    let [file] = files.as_slice() else { panic!("{files:?}") };
    let mut bytes = std::fs::read(file).expect("read");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    std::fs::write(file, bytes).expect("write");
    let (mut block, mut places) = (FaceBlock::default(), Vec::new());
    let errors: Vec<InputError> = (0..copies.store.block_count())
        .filter_map(|index| copies.store.read_placed(index, &mut block, &mut places).err())
        .collect();
    assert!(matches!(&errors[..], [InputError::Spill(SpillError::Corrupt { .. })]), "{errors:?}");
}

/// Refuses what it is given.
struct Refuses;

impl FieldSink for Refuses {
    fn take(&mut self, _: &[VertexFields]) -> Result<(), OutputError> {
        Err(OutputError::TooLarge { path: "x".into(), count: 0, what: "rows" })
    }
}

#[test]
fn nothing_is_left_behind_after_an_error() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let (path, workspace) = (dir.path().join("mesh.ply"), dir.path().join("workspace"));
    std::fs::create_dir(&workspace).expect("create");
    Polygons::roof(60).shuffled(2).write(&path, Style::default());
    let source = open(&path);
    let job = |workspace: &Path| {
        Job::new(&source, Params::default(), limits(700, Order::Rewrite), &Silent)
            .unwrap_or_else(|e| panic!("{e}"))
            .with_scratch(workspace, false)
    };
    let refused = job(&workspace).run(Some(&mut Refuses)).expect_err("refused");
    assert!(matches!(refused, Error::Output(_)), "{refused}");
    assert_eq!(std::fs::read_dir(&workspace).expect("list").count(), 0);
    let missing = job(&dir.path().join("missing")).run(None).expect_err("there is no such directory");
    assert!(matches!(&missing, Error::Spill(e) if e.to_string().contains("missing")), "{missing}");
}

#[test]
fn the_command_line_rewrites_too() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let workspace = dir.path().join("workspace");
    std::fs::create_dir(&workspace).expect("create");
    Polygons::roof(60).shuffled(2).write(&dir.path().join("mesh.ply"), Style::default());
    let crease = |words: &[&str]| {
        let mut command = assert_cmd::Command::cargo_bin("crease").expect("the program");
        let done = command.current_dir(dir.path()).args(words).assert().success();
        String::from_utf8_lossy(&done.get_output().stdout).into_owned()
    };
    let common = ["--tile-faces", "700", "--progress", "none", "--workspace", "workspace"];
    let told = crease(&[&["detect", "mesh.ply", "-o", "a.ply", "--order", "rewrite"][..], &common].concat());
    assert!(told.contains("temporary files") && told.contains("rewritten in spatial order"), "{told}");
    let told = crease(&[&["detect", "mesh.ply", "-o", "b.ply", "--order", "keep"][..], &common].concat());
    assert!(!told.contains("temporary files"), "{told}");
    let read = |name: &str| std::fs::read(dir.path().join(name)).expect("an output");
    assert!(read("a.ply") == read("b.ply"));
    assert_eq!(std::fs::read_dir(&workspace).expect("list").count(), 0);
}
