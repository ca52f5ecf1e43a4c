//! What a mesh is, in a number: to know it again.
//!
//! In: positions and corners as a source hands them out. Out: 128 bits that are the same for the same mesh, in whatever
//! file it is, and however many threads looked at it. Chunks of positions and blocks of faces are digested on their own,
//! and the digests in the order of the mesh. XXH3 tells meshes apart that differ by accident, at the speed of memory; it
//! does not withstand somebody who wants to deceive, who could as well change the result.

use super::scan::VERTEX_CHUNK;
use crate::input::{FaceBlock, InputError, MeshSource};
use crate::mesh::VertexId;
use glam::DVec3;
use rayon::prelude::*;
use xxhash_rust::xxh3::{Xxh3, xxh3_128};

/// Records that are handed to the digest at a time: by the piece it is several times slower.
const BATCH: usize = 64;

/// Digest of some positions, bit for bit.
pub fn of_positions(positions: &[DVec3]) -> u128 {
    digest(positions, |p| p.to_array().map(f64::to_le_bytes))
}

/// Digest of the corners of a block.
pub fn of_faces(block: &FaceBlock) -> u128 {
    digest(&block.corners, |corners| corners.map(|id| id.0.to_le_bytes()))
}

fn digest<T: Copy>(records: &[T], bytes_of: impl Fn(T) -> [[u8; 8]; 3]) -> u128 {
    let (mut digest, mut bytes) = (Xxh3::new(), Vec::with_capacity(24 * BATCH));
    for batch in records.chunks(BATCH) {
        bytes.clear();
        batch.iter().for_each(|&record| bytes.extend_from_slice(bytes_of(record).as_flattened()));
        digest.update(&bytes);
    }
    digest.digest128()
}

/// Digest of a mesh from those of its chunks of positions and its blocks, both in order.
pub fn joined(vertices: u64, positions: &[u128], faces: &[u128]) -> u128 {
    let mut bytes = vertices.to_le_bytes().to_vec();
    positions.iter().chain(faces).for_each(|digest| bytes.extend(digest.to_le_bytes()));
    xxh3_128(&bytes)
}

/// The number that [`super::scan`] finds on its way. Reads positions and faces from start to end, and none by id.
/// `progress` is told of every face.
///
/// # Errors
/// If the source fails.
pub fn content(source: &dyn MeshSource, progress: &(dyn Fn(u64) + Sync)) -> Result<u128, InputError> {
    let n = source.vertex_count();
    let chunks: Vec<u64> = (0..n.div_ceil(VERTEX_CHUNK)).collect();
    let positions: Vec<Result<u128, InputError>> = chunks
        .par_iter()
        .map(|chunk| {
            let first = chunk * VERTEX_CHUNK;
            let mut positions = Vec::new();
            source.read_positions(VertexId(first), (n - first).min(VERTEX_CHUNK) as usize, &mut positions)?;
            Ok(of_positions(&positions))
        })
        .collect();
    let positions: Vec<u128> = positions.into_iter().collect::<Result<_, _>>()?;
    let blocks: Vec<usize> = (0..source.block_count()).collect();
    let faces: Vec<Result<u128, InputError>> = blocks
        .par_iter()
        .map(|&index| {
            let mut block = FaceBlock::default();
            source.read_block(index, &mut block)?;
            progress(block.corners.len() as u64);
            Ok(of_faces(&block))
        })
        .collect();
    let faces: Vec<u128> = faces.into_iter().collect::<Result<_, _>>()?;
    Ok(joined(n, &positions, &faces))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::NO_LIMIT;
    use crate::input::MemorySource;
    use crate::partition::scan;

    #[test]
    fn it_is_that_of_the_scan_and_of_nothing_else() {
        let positions: Vec<DVec3> = (0..70_000).map(|i| DVec3::new(f64::from(i), 0.5, -1.0)).collect();
        let faces: Vec<[u32; 3]> = (0..9000).map(|i| [i, i + 1, i + 2]).collect();
        let of = |positions: &[DVec3], faces: &[[u32; 3]]| {
            let source = MemorySource::new(positions, faces).expect("a mesh");
            let found = content(&source, &|_| {}).expect("a number");
            assert_eq!(found, scan(&source, NO_LIMIT, &|_| {}).expect("a scan").content);
            found
        };
        let whole = of(&positions, &faces);
        assert_eq!(whole, of(&positions, &faces));
        let mut others = vec![of(&positions[1..], &faces), of(&positions, &faces[1..])];
        for place in [0, 69_999] {
            let mut moved = positions.clone();
            // The least change there is.
            moved[place].y = moved[place].y.next_up();
            others.push(of(&moved, &faces));
        }
        let mut turned = faces.clone();
        turned[8999].rotate_left(1);
        others.push(of(&positions, &turned));
        turned.swap(0, 5000);
        others.push(of(&positions, &turned));
        others.push(whole);
        others.sort_unstable();
        others.dedup();
        assert_eq!(others.len(), 7);
    }
}
