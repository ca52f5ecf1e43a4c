//! A whole file: opened, all blocks and positions read, in both ways of reading, which agree. Whatever is handed out is
//! in range, and nothing is allocated that the bytes do not pay for.
#![no_main]

mod place;

use crease::glam::DVec3;
use crease::input::{FaceBlock, IoMode, MeshSource, PlySource};
use crease::mesh::VertexId;
use libfuzzer_sys::fuzz_target;
use std::path::Path;

/// All that a file says, numbers as bits.
type Content = (Vec<Vec<[u64; 3]>>, Vec<[u64; 3]>);

fn bits(p: &DVec3) -> [u64; 3] {
    p.to_array().map(f64::to_bits)
}

fn content(path: &Path, io: IoMode) -> Result<Content, String> {
    let source = PlySource::open(path, io).map_err(|e| e.to_string())?;
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
    // Records without bytes cost nothing, so there may be any number of them; a few are enough.
    let count = source.vertex_count().min(1 << 16) as usize;
    source.read_positions(VertexId(0), count, &mut positions).map_err(|e| e.to_string())?;
    Ok((blocks, positions.iter().map(bits).collect()))
}

fuzz_target!(|bytes: &[u8]| {
    let path = place::written("mesh.ply", bytes);
    let mapped = content(&path, IoMode::Map);
    let read = content(&path, IoMode::Read);
    assert_eq!(mapped, read);
    if let Err(error) = mapped {
        assert!(!error.contains('\n'), "{error}");
    }
});
