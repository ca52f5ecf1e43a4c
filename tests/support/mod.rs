//! What the tests share: running a job, collecting what it hands out, and reading the project's own PLY files.
#![allow(dead_code, reason = "each test binary uses its own part of this")]

pub mod command;
pub mod paper_steps;
pub mod steps;
pub mod tasks;

use crease::glam::DVec3;
use crease::input::{FaceBlock, IoMode, MemorySource, MeshSource, PlySource};
use crease::mesh::VertexId;
use crease::output::{FieldSink, OutputError};
use crease::stitch::VertexFields;
use crease::{Detection, Error, Job, Limits, Params, Silent, Tiling};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A file below `fixtures/`.
pub fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

/// A file of the folder of real meshes, if the environment names one.
pub fn real_mesh(name: &str) -> Option<PathBuf> {
    let path = PathBuf::from(std::env::var_os("CREASE_DATA")?).join("meshes").join(name);
    path.exists().then_some(path)
}

/// Collects the fields of all vertices.
#[derive(Default)]
pub struct Fields(pub BTreeMap<u64, VertexFields>);

impl FieldSink for Fields {
    fn take(&mut self, fields: &[VertexFields]) -> Result<(), OutputError> {
        for f in fields {
            assert!(self.0.insert(f.id.0, *f).is_none(), "{} was handed over twice", f.id);
        }
        Ok(())
    }
}

/// One tile as large as the world.
pub fn in_core() -> Limits {
    Limits { tiling: Tiling::InCore, ..Limits::default() }
}

/// Tiles of about `faces` faces.
pub fn tiled(faces: u64, threads: usize) -> Limits {
    Limits { tiling: Tiling::Faces(faces), threads, ..Limits::default() }
}

/// A mesh as plain arrays, for tests that change it.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    pub positions: Vec<DVec3>,
    pub faces: Vec<[u32; 3]>,
}

impl Mesh {
    /// A roof whose faces and vertices come in no order, the same in every run.
    pub fn scattered() -> Mesh {
        Mesh::roof(40).shuffled()
    }

    /// The same mesh with faces and vertices in no order, the same in every run.
    pub fn shuffled(&self) -> Mesh {
        let (n, m) = (self.positions.len(), self.faces.len());
        let (vertex, face) = (jump(n, 1013), jump(m, 1237));
        let mut mesh = self.clone();
        (0..n).for_each(|v| mesh.positions[vertex(v)] = self.positions[v]);
        (0..m).for_each(|f| mesh.faces[face(f)] = self.faces[f].map(|v| vertex(v as usize) as u32));
        mesh
    }

    /// The mesh of `fixtures/meshes/{name}.ply`.
    pub fn of_fixture(name: &str) -> Mesh {
        let source = open(&fixture(&format!("meshes/{name}.ply")));
        let mut mesh = Mesh { positions: Vec::new(), faces: Vec::new() };
        source
            .read_positions(VertexId(0), source.vertex_count() as usize, &mut mesh.positions)
            .unwrap_or_else(|e| panic!("{e}"));
        let mut block = FaceBlock::default();
        for index in 0..source.block_count() {
            source.read_block(index, &mut block).unwrap_or_else(|e| panic!("{e}"));
            mesh.faces.extend(block.corners.iter().map(|face| face.map(|id| id.0 as u32)));
        }
        mesh
    }

    /// The mesh as a source.
    pub fn source(&self) -> MemorySource<'_> {
        MemorySource::new(&self.positions, &self.faces).unwrap_or_else(|e| panic!("{e}"))
    }
}

/// The fields of one vertex as bits, in which 0 and -0 differ and NaN equals itself.
pub fn field_bits(f: &VertexFields) -> [u64; 9] {
    let [x, y, z] = f.position.to_array().map(f64::to_bits);
    let [l1, l2, l3] = f.eigenvalues.map(f64::to_bits);
    [x, y, z, l1, l2, l3, f.omega.to_bits(), f.salience.to_bits(), f.class as u64]
}

/// Says what differs first between two results, bit for bit; `None` if nothing does.
pub fn first_difference(a: &(Detection, Fields), b: &(Detection, Fields)) -> Option<String> {
    let ids = |fields: &Fields| fields.0.keys().copied().collect::<Vec<_>>();
    if ids(&a.1) != ids(&b.1) {
        return Some(format!("{} and {} vertices have fields", a.1.0.len(), b.1.0.len()));
    }
    let differing = |(x, y): &(&VertexFields, &VertexFields)| field_bits(x) != field_bits(y);
    if let Some((x, y)) = a.1.0.values().zip(b.1.0.values()).find(differing) {
        return Some(format!("the fields of {}: {x:?} and {y:?}", x.id));
    }
    let (a, b) = (&a.0, &b.0);
    if a.defects != b.defects {
        return Some(format!("defects: {:?} and {:?}", a.defects, b.defects));
    }
    if a.lines.largest_salience.to_bits() != b.lines.largest_salience.to_bits() {
        return Some("the largest salience".to_owned());
    }
    if a.lines.lines.len() != b.lines.lines.len() {
        return Some(format!("{} and {} lines", a.lines.lines.len(), b.lines.lines.len()));
    }
    if let Some(i) = a.lines.lines.iter().zip(&b.lines.lines).position(|(x, y)| x != y) {
        return Some(format!("line {i}: {:?} and {:?}", a.lines.lines[i], b.lines.lines[i]));
    }
    (a.lines != b.lines).then(|| "the vertices of the lines".to_owned())
}

/// Opens a mesh that must be good.
pub fn open(path: &Path) -> PlySource {
    PlySource::open(path, IoMode::Auto).unwrap_or_else(|e| panic!("{e}"))
}

/// Runs a job that must succeed and collects the fields.
pub fn run(source: &dyn MeshSource, params: Params, limits: Limits) -> (Detection, Fields) {
    try_run(source, params, limits, 1.0).unwrap_or_else(|e| panic!("{e}"))
}

/// Runs a job with a halo that is too thin by `reach`.
pub fn try_run(
    source: &dyn MeshSource,
    params: Params,
    limits: Limits,
    reach: f64,
) -> Result<(Detection, Fields), Error> {
    let mut fields = Fields::default();
    let job = Job::new(source, params, limits, &Silent)?.with_reach_factor(reach);
    let found = job.run(Some(&mut fields))?;
    Ok((found, fields))
}

/// An element of a binary little-endian PLY file whose properties are all `double` or `uchar`, as numbers by name.
pub fn read_vertices(path: &Path) -> BTreeMap<String, Vec<f64>> {
    let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let end = b"end_header\n";
    let start = bytes.windows(end.len()).position(|w| w == end).expect("a header") + end.len();
    let header = String::from_utf8_lossy(&bytes[..start]);
    let mut count = 0;
    let mut properties = Vec::new();
    for line in header.lines() {
        match line.split(' ').collect::<Vec<_>>()[..] {
            ["element", "vertex", n] => count = n.parse().expect("a count"),
            ["property", kind, name] => properties.push((name.to_owned(), kind == "double")),
            _ => {}
        }
    }
    let mut table: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    let mut rest = &bytes[start..];
    for _ in 0..count {
        for (name, double) in &properties {
            let (head, tail) = rest.split_at(if *double { 8 } else { 1 });
            let x =
                if *double { f64::from_le_bytes(head.try_into().expect("8 bytes")) } else { head[0].into() };
            table.entry(name.clone()).or_default().push(x);
            rest = tail;
        }
    }
    assert!(rest.is_empty(), "{}: more than the vertices", path.display());
    table
}

/// Numbers from 0 to `n` by steps of `step` or a little more: one that has no divisor in common with `n`, so that each is met
/// once.
fn jump(n: usize, step: usize) -> impl Fn(usize) -> usize {
    let share_a_divisor = |a: usize, b: usize| {
        let (mut a, mut b) = (a, b);
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a > 1
    };
    let step = (step..).find(|&step| !share_a_divisor(step, n)).unwrap_or(1);
    move |i| i * step % n
}
