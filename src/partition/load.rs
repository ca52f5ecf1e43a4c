//! One region of the mesh, read from the source.
//!
//! In: a region. Out: a [`TileMesh`] of all faces that meet it. Only the face blocks that the
//! directory names are read. A block wholly inside the region is taken without looking at its positions, unless the source
//! keeps positions with its blocks: then nothing is looked up by id.

use super::lattice::CubeBox;
use super::numbering::{Numbered, Numbering};
use super::plan::Plan;
use super::region::Region;
use crate::input::{FaceBlock, InputError, MeshSource};
use crate::mesh::{FaceId, TileMesh, VertexId};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// A tile cannot be loaded.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The source failed.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The region holds more faces than it may.
    #[error("a tile would hold {faces} faces or more, of at most {most}")]
    TooManyFaces {
        /// Faces in the part of the region that was looked at.
        faces: u64,
        /// Faces there may be.
        most: u64,
    },
}

/// Faces that local indices can count. A soup without shared edges has a one-ring entry for each corner and each of its two
/// edges, and these are counted in 32 bits.
pub const MOST_FACES: u64 = (u32::MAX / 6) as u64;

/// Faces of one block that meet the region.
#[derive(Default)]
struct Chosen {
    faces: Vec<FaceId>,
    corners: Vec<[VertexId; 3]>,
    /// Positions of the corners, if the source keeps them with its blocks.
    places: Vec<[DVec3; 3]>,
}

/// Loads all faces that meet `region`, using the current thread pool. They are numbered by `numbering`.
///
/// # Errors
/// If the source fails, or the region holds more than `most` faces; nobody went on reading then.
pub fn load(
    source: &dyn MeshSource,
    plan: &Plan,
    region: &Region,
    most: u64,
    numbering: Numbering,
) -> Result<TileMesh, LoadError> {
    let blocks = plan.blocks_in(region);
    let most = most.min(MOST_FACES);
    let count = AtomicU64::new(0);
    let choose_within = |&block: &usize| -> Result<Chosen, LoadError> {
        let before = count.load(Ordering::Relaxed);
        let chosen = if before > most { Chosen::default() } else { choose(source, plan, region, block)? };
        count.fetch_add(chosen.faces.len() as u64, Ordering::Relaxed);
        Ok(chosen)
    };
    let chosen: Vec<Result<Chosen, LoadError>> = blocks.par_iter().map(choose_within).collect();
    let chosen: Vec<Chosen> = chosen.into_iter().collect::<Result<_, _>>()?;
    let faces = count.into_inner();
    if faces > most {
        return Err(LoadError::TooManyFaces { faces, most });
    }
    let vertex_ids = used_vertices(&chosen, source.vertex_count());
    let rank = Rank::new(&vertex_ids);
    let corners: Vec<Vec<[u32; 3]>> =
        chosen.par_iter().map(|c| c.corners.iter().map(|ids| ids.map(|id| rank.of(id))).collect()).collect();
    let mut positions = Vec::new();
    if source.carries_positions() {
        positions.resize(vertex_ids.len(), DVec3::ZERO);
        for (corners, c) in corners.iter().zip(&chosen) {
            for (&v, &p) in corners.as_flattened().iter().zip(c.places.as_flattened()) {
                positions[v as usize] = p;
            }
        }
    } else {
        source.gather_positions(&vertex_ids, &mut positions)?;
    }
    let face_ids: Vec<FaceId> = chosen.iter().flat_map(|c| c.faces.iter().copied()).collect();
    drop(chosen);
    let (face_ids, corners) = ascending(face_ids, corners.concat());
    let Numbered { vertex_ids, positions, face_ids, corners } =
        numbering.apply(Numbered { vertex_ids, positions, face_ids, corners }, &plan.bounds);
    let complete = positions.par_iter().map(|&p| region.contains(plan.lattice.cube_of(p))).collect();
    Ok(TileMesh::new(vertex_ids, positions, face_ids, corners, complete))
}

/// Faces in the order of their ids; blocks that are not those of the file overlap.
fn ascending(ids: Vec<FaceId>, corners: Vec<[u32; 3]>) -> (Vec<FaceId>, Vec<[u32; 3]>) {
    if ids.is_sorted() {
        return (ids, corners);
    }
    let mut faces: Vec<(FaceId, [u32; 3])> = ids.into_iter().zip(corners).collect();
    // Ids are unique, so that there is one order only.
    faces.par_sort_unstable_by_key(|face| face.0);
    faces.into_iter().unzip()
}

/// Reads one block and keeps the faces that meet the region and have three different corners.
fn choose(source: &dyn MeshSource, plan: &Plan, region: &Region, block: usize) -> Result<Chosen, InputError> {
    let mut faces = FaceBlock::default();
    let inside = plan.block_ranges[block].is_some_and(|range| region.main().encloses(&range));
    let carried = source.carries_positions();
    let mut positions = Vec::new();
    if inside && !carried {
        source.read_block(block, &mut faces)?;
    } else {
        source.read_placed(block, &mut faces, &mut positions)?;
    }
    let mut chosen = Chosen::default();
    for (i, ids) in faces.corners.iter().enumerate() {
        let distinct = ids[0] != ids[1] && ids[1] != ids[2] && ids[2] != ids[0];
        let meets = inside || {
            let [a, b, c] = positions[i];
            let range = CubeBox {
                min: plan.lattice.cube_of(a.min(b).min(c)),
                max: plan.lattice.cube_of(a.max(b).max(c)),
            };
            region.meets(&range)
        };
        if distinct && meets {
            chosen.faces.push(faces.id(i));
            chosen.corners.push(*ids);
            if carried {
                chosen.places.push(positions[i]);
            }
        }
    }
    Ok(chosen)
}

/// A bitmap over the span of ids in use: one bit an id beats sorting by far, also where the ids are scattered.
fn used_vertices(chosen: &[Chosen], vertices: u64) -> Vec<VertexId> {
    let ids = || chosen.iter().flat_map(|c| c.corners.iter().flatten());
    let (mut first, mut last) = (vertices, 0);
    ids().for_each(|id| (first, last) = (first.min(id.0), last.max(id.0)));
    if first > last {
        return Vec::new();
    }
    let mut bits = vec![0u64; ((last - first) / 64 + 1) as usize];
    ids().for_each(|id| bits[((id.0 - first) / 64) as usize] |= 1 << ((id.0 - first) % 64));
    let mut used = Vec::with_capacity(bits.iter().map(|w| w.count_ones() as usize).sum());
    for (i, &word) in bits.iter().enumerate() {
        let mut rest = word;
        while rest != 0 {
            used.push(VertexId(first + 64 * i as u64 + u64::from(rest.trailing_zeros())));
            rest &= rest - 1;
        }
    }
    used
}

/// Position of an id in an ascending list, by a bitmap with a running count for each word.
struct Rank {
    first: u64,
    words: Vec<(u64, u32)>,
}

impl Rank {
    fn new(ids: &[VertexId]) -> Rank {
        let (Some(first), Some(last)) = (ids.first(), ids.last()) else {
            return Rank { first: 0, words: Vec::new() };
        };
        let mut words = vec![(0u64, 0u32); ((last.0 - first.0) / 64 + 1) as usize];
        for id in ids {
            words[((id.0 - first.0) / 64) as usize].0 |= 1 << ((id.0 - first.0) % 64);
        }
        let mut before = 0;
        for (word, count) in &mut words {
            *count = before;
            before += word.count_ones();
        }
        Rank { first: first.0, words }
    }

    /// `id` must be in the list.
    fn of(&self, id: VertexId) -> u32 {
        let at = id.0 - self.first;
        let (word, before) = self.words[(at / 64) as usize];
        before + (word & ((1 << (at % 64)) - 1)).count_ones()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_are_positions() {
        let ids: Vec<VertexId> = [5u64, 63, 64, 65, 200, 1 << 33].map(VertexId).to_vec();
        let corners: Vec<[VertexId; 3]> = ids.windows(3).map(|w| [w[2], w[0], w[1]]).collect();
        let chosen = [Chosen { faces: Vec::new(), corners, places: Vec::new() }];
        assert_eq!(used_vertices(&chosen, 1 << 40), ids);
        let rank = Rank::new(&ids);
        assert!(ids.iter().enumerate().all(|(i, &id)| rank.of(id) == i as u32));
        assert!(used_vertices(&[], 10).is_empty());
    }
}
