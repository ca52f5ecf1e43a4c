//! What the tests share: running a job, collecting what it hands out, and reading the project's own PLY files.
#![allow(dead_code, reason = "each test binary uses its own part of this")]

use crease::input::{IoMode, MeshSource, PlySource};
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
