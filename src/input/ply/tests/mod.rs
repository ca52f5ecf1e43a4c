//! What [`PlySource`](super::PlySource) promises, on files written by the tests.

mod errors;
mod oracle;
mod shapes;

use super::PlySource;
use crate::input::{FaceBlock, InputError, IoMode, MeshSource};
use crate::mesh::{FaceId, VertexId};
use glam::DVec3;
use tempfile::TempDir;

pub const MODES: [IoMode; 3] = [IoMode::Auto, IoMode::Map, IoMode::Read];

/// Writes `bytes` to a file of its own; the directory goes when the handle goes.
pub fn file(bytes: &[u8]) -> (TempDir, std::path::PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("mesh.ply");
    std::fs::write(&path, bytes).unwrap();
    (dir, path)
}

/// A binary little-endian file: the header lines after `format`, then the payload.
pub fn ply(lines: &str, payload: &[u8]) -> Vec<u8> {
    let mut bytes = format!("ply\nformat binary_little_endian 1.0\n{lines}\nend_header\n").into_bytes();
    bytes.extend_from_slice(payload);
    bytes
}

/// Opens in every mode; all must agree on success, and the last one's outcome is returned.
pub fn open(bytes: &[u8]) -> Result<PlySource, InputError> {
    let (_dir, path) = file(bytes);
    let mut outcomes: Vec<_> = MODES.iter().map(|&mode| PlySource::open(&path, mode)).collect();
    let first = outcomes.remove(0);
    for outcome in outcomes {
        assert_eq!(
            outcome.as_ref().err().map(ToString::to_string),
            first.as_ref().err().map(ToString::to_string)
        );
    }
    first
}

/// All positions and triangles, read through every method and compared.
pub fn everything(mesh: &PlySource) -> Result<(Vec<DVec3>, Vec<[u64; 3]>), InputError> {
    let mut positions = Vec::new();
    mesh.read_positions(VertexId(0), mesh.vertex_count() as usize, &mut positions)?;
    assert_eq!(positions.len() as u64, mesh.vertex_count());
    for step in [1, 2, 7] {
        let ids: Vec<VertexId> = (0..mesh.vertex_count()).step_by(step).map(VertexId).collect();
        let mut gathered = vec![DVec3::ONE];
        mesh.gather_positions(&ids, &mut gathered)?;
        let expected: Vec<DVec3> = positions.iter().copied().step_by(step).collect();
        assert_eq!(gathered, expected);
    }
    if mesh.vertex_count() > 2 {
        let mut middle = vec![DVec3::ONE];
        mesh.read_positions(VertexId(1), mesh.vertex_count() as usize - 2, &mut middle)?;
        assert_eq!(middle[1..], positions[1..positions.len() - 1]);
    }
    let mut triangles = Vec::new();
    let mut block = FaceBlock::default();
    for index in 0..mesh.block_count() {
        mesh.read_block(index, &mut block)?;
        assert_eq!(block.first, FaceId(triangles.len() as u64));
        let mut corners = Vec::new();
        mesh.corner_positions(&block.corners, &mut corners)?;
        assert_eq!(corners.len(), block.corners.len());
        for (ids, places) in block.corners.iter().zip(&corners) {
            assert_eq!(*places, ids.map(|id| positions[id.0 as usize]));
        }
        triangles.extend(block.corners.iter().map(|ids| ids.map(|id| id.0)));
    }
    assert_eq!(triangles.len() as u64, mesh.face_count());
    Ok((positions, triangles))
}

/// Opens and reads everything in every mode; all must agree, also on the error.
pub fn read_all(bytes: &[u8]) -> Result<(Vec<DVec3>, Vec<[u64; 3]>), InputError> {
    let (_dir, path) = file(bytes);
    let mut first: Option<Result<_, InputError>> = None;
    for mode in MODES {
        let outcome = PlySource::open(&path, mode).and_then(|mesh| everything(&mesh));
        if let Some(first) = &first {
            match (first, &outcome) {
                (Ok(first), Ok(outcome)) => assert_eq!(first, outcome),
                (Err(first), Err(outcome)) => assert_eq!(first.to_string(), outcome.to_string()),
                _ => panic!("the modes disagree"),
            }
        } else {
            first = Some(outcome);
        }
    }
    first.unwrap()
}

/// Splitmix64: the same numbers everywhere.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below `end`.
    pub fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }

    pub fn pick<T: Copy>(&mut self, items: &[T]) -> T {
        items[self.below(items.len() as u64) as usize]
    }

    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            items.swap(last, self.below(last as u64 + 1) as usize);
        }
    }
}
