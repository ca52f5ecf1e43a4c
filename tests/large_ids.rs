//! Ids, counts and offsets beyond 2^32, without the disk space: sources that are mostly empty, and files with holes.

mod support;

use crease::config::Order;
use crease::glam::DVec3;
use crease::input::{FaceBlock, InputError, IoMode, MeshSource, PlySource};
use crease::mesh::{FaceId, VertexId};
use crease::output::write_ply;
use crease::{Detection, Limits, Params};
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;
use support::{Fields, Mesh, first_difference, in_core, run, tiled};

/// Faces of a block of the sparse source.
const BLOCK: usize = 64;
/// Faces that it claims to have.
const CLAIMED: u64 = 1 << 33;
/// How many of them a sample of the scan stands for: it keeps 2^20.
const STRIDE: u64 = CLAIMED >> 20;

/// A mesh whose blocks are spread over 2^33 face ids, and whose vertex ids lie on both sides of 2^32. The vertices before
/// them exist, but nobody names them, and reading them gives nothing.
struct Sparse {
    mesh: Mesh,
    /// Id of the first vertex.
    base: u64,
}

impl Sparse {
    fn new(mesh: Mesh) -> Self {
        let base = (1 << 32) - mesh.positions.len() as u64 / 2;
        Self { mesh, base }
    }

    /// From the first face of a block to that of the next.
    fn gap(&self) -> u64 {
        // Multiples of the stride, so that the scan samples the first face of each block.
        CLAIMED / self.block_count() as u64 / STRIDE * STRIDE
    }

    fn position(&self, id: VertexId) -> DVec3 {
        self.mesh.positions[usize::try_from(id.0 - self.base).expect("a vertex of the mesh")]
    }
}

impl MeshSource for Sparse {
    fn name(&self) -> String {
        "sparse mesh".to_owned()
    }

    fn vertex_count(&self) -> u64 {
        self.base + self.mesh.positions.len() as u64
    }

    fn face_count(&self) -> u64 {
        CLAIMED
    }

    fn block_count(&self) -> usize {
        self.mesh.faces.len().div_ceil(BLOCK)
    }

    fn read_block(&self, block: usize, out: &mut FaceBlock) -> Result<(), InputError> {
        let faces = self.mesh.faces.chunks(BLOCK).nth(block).expect("a block of the mesh");
        out.first = FaceId(block as u64 * self.gap());
        out.corners = faces.iter().map(|face| face.map(|v| VertexId(self.base + u64::from(v)))).collect();
        Ok(())
    }

    fn read_positions(&self, first: VertexId, count: usize, out: &mut Vec<DVec3>) -> Result<(), InputError> {
        let ids = first.0.max(self.base)..first.0 + count as u64;
        out.extend(ids.map(|id| self.position(VertexId(id))));
        Ok(())
    }

    fn gather_positions(&self, ids: &[VertexId], out: &mut Vec<DVec3>) -> Result<(), InputError> {
        out.clear();
        out.extend(ids.iter().map(|&id| self.position(id)));
        Ok(())
    }

    fn corner_positions(
        &self,
        corners: &[[VertexId; 3]],
        out: &mut Vec<[DVec3; 3]>,
    ) -> Result<(), InputError> {
        out.clear();
        out.extend(corners.iter().map(|face| face.map(|id| self.position(id))));
        Ok(())
    }

    fn vertex_offset(&self, _id: VertexId) -> Option<u64> {
        None
    }
}

/// The same result under ids that start at 0.
fn lowered((mut found, fields): (Detection, Fields), base: u64) -> (Detection, Fields) {
    found.lines.vertices.iter_mut().for_each(|v| v.id.0 -= base);
    let lower = |(id, mut f): (u64, _)| {
        let field: &mut crease::stitch::VertexFields = &mut f;
        field.id.0 -= base;
        (id - base, f)
    };
    (found, Fields(fields.0.into_iter().map(lower).collect()))
}

#[test]
fn ids_beyond_32_bits_change_nothing() {
    let mesh = Mesh::of_fixture("city");
    let params = Params { boundaries: true, ..Params::default() };
    let expected = run(&mesh.source(), params, in_core());
    assert!(expected.0.lines.lines.len() > 10);
    let source = Sparse::new(mesh);
    assert!(source.block_count() > 30 && source.gap() * (source.block_count() as u64 - 1) > 1 << 32);
    // By its numbers it is a mesh of many terabytes without any order.
    let limits = Limits { order: Order::Keep, ..tiled(8 * STRIDE, 2) };
    let found = run(&source, params, limits);
    assert!(found.0.work.tiles >= 4, "only {} tiles", found.0.work.tiles);
    assert_eq!((found.0.scan.faces, found.0.scan.sample_stride), (CLAIMED, STRIDE));
    assert_eq!(found.0.scan.unreferenced, source.base + expected.0.scan.unreferenced);
    let ids: Vec<u64> = found.0.lines.vertices.iter().map(|v| v.id.0).collect();
    assert!(ids[0] < 1 << 32 && ids[ids.len() - 1] > 1 << 32, "on both sides: {ids:?}");
    assert_eq!(ids_of_file(&found.0), ids);
    assert_eq!(first_difference(&lowered(found, source.base), &expected), None);
}

/// Writes the lines to a file and reads the ids of their vertices.
fn ids_of_file(found: &Detection) -> Vec<u64> {
    let place = tempfile::tempdir().expect("a directory");
    let path = place.path().join("lines.ply");
    write_ply(&path, &found.lines).expect("a file");
    let bytes = std::fs::read(&path).expect("the file");
    let end = b"end_header\n";
    let start = bytes.windows(end.len()).position(|w| w == end).expect("a header") + end.len();
    let header = String::from_utf8_lossy(&bytes[..start]);
    // PLY has no integer that is wide enough.
    assert!(header.contains("property double z\nproperty double source\n"), "{header}");
    // Three coordinates, the id, two numbers and two bytes.
    let records = bytes[start..].chunks_exact(6 * 8 + 2).take(found.lines.vertices.len());
    records.map(|record| f64::from_le_bytes(record[24..32].try_into().expect("8 bytes")) as u64).collect()
}

/// A file of `length` bytes that are zero, but for those given with their places. Holes take no space on the disk.
fn with_holes(path: &Path, length: u64, parts: &[(u64, &[u8])]) {
    let file = File::create(path).expect("a file");
    file.set_len(length).expect("a hole");
    for (at, bytes) in parts {
        file.write_all_at(bytes, *at).expect("bytes");
    }
}

fn floats(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// Behind an element of 65 GB lie as many vertices as 32 bits can name; the faces name the last three.
#[test]
fn offsets_in_files_have_64_bits() {
    let place = tempfile::tempdir().expect("a directory");
    let path = place.path().join("holes.ply");
    let (skipped, vertices) = (5_000_000_000u64, 1u64 << 32);
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement range {skipped}\nproperty uchar n\nproperty int a\n\
         property int b\nproperty int c\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
         property float z\nelement face 2\nproperty list uchar uint vertex_indices\nend_header\n"
    );
    let positions = header.len() as u64 + 13 * skipped;
    let faces = positions + 12 * vertices;
    let mut records = Vec::new();
    for corners in [[u32::MAX, u32::MAX - 1, u32::MAX - 2], [0, u32::MAX, u32::MAX - 2]] {
        records.push(3);
        corners.iter().for_each(|corner| records.extend(corner.to_le_bytes()));
    }
    let last = floats(&[7.0, 8.0, 9.0, 4.0, 5.0, 6.0, 1.0, 2.0, 3.0]);
    with_holes(
        &path,
        faces + records.len() as u64,
        &[(0, header.as_bytes()), (faces - 36, &last), (faces, &records)],
    );
    for io in [IoMode::Map, IoMode::Read] {
        let source = PlySource::open(&path, io).expect("a mesh");
        assert_eq!((source.vertex_count(), source.face_count()), (vertices, 2));
        let mut block = FaceBlock::default();
        source.read_block(0, &mut block).expect("the faces");
        assert_eq!(block.corners[0], [vertices - 1, vertices - 2, vertices - 3].map(VertexId));
        let (mut corners, mut gathered, mut read) = (Vec::new(), Vec::new(), Vec::new());
        source.corner_positions(&block.corners, &mut corners).expect("positions");
        assert_eq!(corners[0][0], DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(corners[1], [DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0), DVec3::new(7.0, 8.0, 9.0)]);
        source.gather_positions(&[VertexId(0), VertexId(vertices - 2)], &mut gathered).expect("positions");
        assert_eq!(gathered, [DVec3::ZERO, DVec3::new(4.0, 5.0, 6.0)]);
        source.read_positions(VertexId(vertices - 4), 4, &mut read).expect("positions");
        assert_eq!(read[0], DVec3::ZERO);
        assert_eq!(read[3], DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(source.vertex_offset(VertexId(vertices - 1)), Some(faces - 12));
        assert!(source.read_positions(VertexId(vertices - 1), 2, &mut read).is_err());
    }
}

/// A polygon with 4.2e9 corners is a fan of as many triangles; those behind it have ids beyond 2^32.
#[test]
fn triangles_behind_a_giant_polygon_have_ids_beyond_32_bits() {
    let place = tempfile::tempdir().expect("a directory");
    let path = place.path().join("polygon.ply");
    let (giant, small) = (u32::MAX, 5000u64);
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
         property float z\nelement face {}\nproperty list uint uchar vertex_indices\nend_header\n",
        small + 1
    );
    let faces = header.len() as u64 + 4 * 12;
    let behind = faces + 4 + u64::from(giant);
    let triangle = [3, 0, 0, 0, 1, 2, 3];
    let triangles = triangle.repeat(small as usize);
    with_holes(
        &path,
        behind + triangles.len() as u64,
        &[(0, header.as_bytes()), (faces, &giant.to_le_bytes()), (behind, &triangles)],
    );
    for io in [IoMode::Map, IoMode::Read] {
        let source = PlySource::open(&path, io).expect("a mesh");
        assert_eq!(source.polygon_count(), small + 1);
        assert_eq!(source.face_count(), u64::from(giant) - 2 + small);
        assert_eq!(source.block_count(), 2);
        let mut block = FaceBlock::default();
        source.read_block(1, &mut block).expect("the second block");
        // The first block holds 4096 polygons, the giant among them.
        assert_eq!(block.first, FaceId(u64::from(giant) - 2 + 4095));
        assert_eq!(block.corners, vec![[1, 2, 3].map(VertexId); small as usize - 4095]);
    }
}

/// 5e9 modulo 2^32 records would fit.
#[test]
fn five_billion_faces_that_are_not_there_are_missed() {
    let place = tempfile::tempdir().expect("a directory");
    let path = place.path().join("truncated.ply");
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                  property float z\nelement face 5000000000\nproperty list uchar int vertex_indices\nend_header\n";
    with_holes(&path, 1_000_000_000, &[(0, header.as_bytes())]);
    match PlySource::open(&path, IoMode::Auto) {
        Err(InputError::Truncated { element, needed, length, offset, .. }) => {
            assert_eq!((element.as_str(), length), ("face", 1_000_000_000));
            assert_eq!((needed, offset), (5_000_000_000, header.len() as u64 + 36));
        }
        other => panic!("{other:?}"),
    }
}
