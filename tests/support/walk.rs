//! A file read in every way there is: shared by `tests/random_files.rs` and the fuzz targets of `tools/fuzz`.
//!
//! In: any bytes in a file. Out: all that they mean as a mesh, or why they are none. Panics if the ways of reading do not
//! agree, or hand out what they promised never to hand out.

use crease::glam::DVec3;
use crease::input::{FaceBlock, IoMode, MeshSource, PlySource, Sieve, is_usable};
use crease::mesh::VertexId;
use std::path::Path;

/// Corners of the faces of each block, and positions of all vertices, numbers as bits.
pub type Content = (Vec<Vec<[u64; 3]>>, Vec<[u64; 3]>);

/// What `path` holds, the same in both ways of reading; or the message of the error, which is one line.
pub fn walk(path: &Path) -> Result<Content, String> {
    let mapped = content(path, IoMode::Map);
    let read = content(path, IoMode::Read);
    assert_eq!(mapped, read);
    if let Err(error) = &mapped {
        assert!(!error.contains('\n'), "{error}");
    }
    mapped
}

fn bits(p: &DVec3) -> [u64; 3] {
    p.to_array().map(f64::to_bits)
}

fn content(path: &Path, io: IoMode) -> Result<Content, String> {
    let source = PlySource::open(path, io).map_err(|e| e.to_string())?;
    sifted(&source);
    let (mut blocks, mut block, mut places) = (Vec::new(), FaceBlock::default(), Vec::new());
    let mut faces = 0;
    for index in 0..source.block_count() {
        source.read_placed(index, &mut block, &mut places).map_err(|e| e.to_string())?;
        assert_eq!(block.id(0).0, faces, "ids are those of the file");
        assert_eq!(block.corners.len(), places.len());
        assert!(block.corners.as_flattened().iter().all(|id| id.0 < source.vertex_count()));
        let mut ids = block.corners.concat();
        ids.sort_unstable();
        ids.dedup();
        let mut gathered = Vec::new();
        source.gather_positions(&ids, &mut gathered).map_err(|e| e.to_string())?;
        for (corners, places) in block.corners.iter().zip(&places) {
            for (id, place) in corners.iter().zip(places) {
                let at = ids.binary_search(id).expect("it is one of them");
                assert_eq!(bits(&gathered[at]), bits(place));
            }
        }
        faces += block.corners.len() as u64;
        blocks.push(block.corners.iter().map(|corners| corners.map(|id| id.0)).collect());
    }
    assert_eq!(faces, source.face_count());
    let mut positions = Vec::new();
    // A vertex has three bytes at least, so there cannot be more than the file pays for.
    let count = source.vertex_count() as usize;
    source.read_positions(VertexId(0), count, &mut positions).map_err(|e| e.to_string())?;
    Ok((blocks, positions.iter().map(bits).collect()))
}

/// The same without the faces that cannot be used, if any are left.
fn sifted(source: &dyn MeshSource) {
    let Ok(sieve) = Sieve::new(source) else { return };
    let (mut block, mut places, mut faces) = (FaceBlock::default(), Vec::new(), 0);
    for index in 0..sieve.block_count() {
        sieve.read_placed(index, &mut block, &mut places).expect("it was read before");
        assert_eq!(block.id(0).0, faces);
        assert!(places.as_flattened().iter().all(|&p| is_usable(p)));
        faces += block.corners.len() as u64;
    }
    let left_out = sieve.left_out();
    assert_eq!(faces, sieve.face_count());
    assert_eq!(faces + left_out.missing + left_out.unusable, source.face_count());
}
