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
use crate::mesh::{FaceId, TileMesh, VertexId, concat, filled, pieces};
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
    let used = Used::new(&chosen, source.vertex_count());
    let vertex_ids = used.ids();
    let mut corners = filled(faces as usize, [0u32; 3]);
    let of_blocks = pieces(&mut corners, chosen.iter().map(|c| c.corners.len()));
    of_blocks.into_par_iter().zip(&chosen).for_each(|(local, c)| {
        local.iter_mut().zip(&c.corners).for_each(|(local, ids)| *local = ids.map(|id| used.rank(id)));
    });
    drop(used);
    let positions = if source.carries_positions() {
        let places = chosen.iter().flat_map(|c| c.places.as_flattened());
        let mut positions = filled(vertex_ids.len(), DVec3::ZERO);
        corners.as_flattened().iter().zip(places).for_each(|(&v, &p)| positions[v as usize] = p);
        positions
    } else {
        gather(source, &vertex_ids)?
    };
    let face_ids: Vec<Vec<FaceId>> = chosen.into_iter().map(|c| c.faces).collect();
    let (face_ids, corners) = ascending(concat(&face_ids), corners);
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

/// Vertices whose positions are asked for at once.
const GATHERED: usize = 1 << 15;

/// The positions of `ids`, in parallel.
fn gather(source: &dyn MeshSource, ids: &[VertexId]) -> Result<Vec<DVec3>, InputError> {
    let mut all = filled(ids.len(), DVec3::ZERO);
    let pieces = all.par_chunks_mut(GATHERED).zip(ids.par_chunks(GATHERED));
    pieces.try_for_each_init(Vec::new, |positions, (piece, ids)| -> Result<(), InputError> {
        source.gather_positions(ids, positions)?;
        piece.copy_from_slice(positions);
        Ok(())
    })?;
    Ok(all)
}

/// Which ids are in use: a bit for each over their span, and a running count for each word. That beats sorting by far, also
/// where ids are scattered.
struct Used {
    first: u64,
    words: Vec<u64>,
    /// How many are in use before each word.
    before: Vec<u32>,
}

impl Used {
    fn new(chosen: &[Chosen], vertices: u64) -> Used {
        let span = |c: &Chosen| {
            let ids = || c.corners.as_flattened().iter();
            ids().min().zip(ids().max()).map_or((vertices, 0), |(low, high)| (low.0, high.0))
        };
        let wider = |a: (u64, u64), b: (u64, u64)| (a.0.min(b.0), a.1.max(b.1));
        let spans: Vec<(u64, u64)> = chosen.par_iter().map(span).collect();
        let (first, last) = spans.into_iter().fold((vertices, 0), wider);
        let count = if first > last { 0 } else { (last - first) / 64 + 1 };
        let words: Vec<AtomicU64> = (0..count as usize).into_par_iter().map(|_| AtomicU64::new(0)).collect();
        chosen.par_iter().for_each(|c| {
            for id in c.corners.as_flattened() {
                let (word, bit) = (&words[((id.0 - first) / 64) as usize], 1 << ((id.0 - first) % 64));
                // A vertex has six faces: most find that another has come first.
                if word.load(Ordering::Relaxed) & bit == 0 {
                    word.fetch_or(bit, Ordering::Relaxed);
                }
            }
        });
        let words: Vec<u64> = words.into_par_iter().map(AtomicU64::into_inner).collect();
        let running = |sum: &mut u32, word: &u64| Some(std::mem::replace(sum, *sum + word.count_ones()));
        let before = words.iter().scan(0, running).collect();
        Used { first, words, before }
    }

    /// All of them, ascending.
    fn ids(&self) -> Vec<VertexId> {
        const WORDS: usize = 1 << 10;
        let of_words = |(chunk, words): (usize, &[u64])| {
            let mut ids = Vec::with_capacity(words.iter().map(|word| word.count_ones() as usize).sum());
            for (i, &word) in words.iter().enumerate() {
                let zeroth = self.first + 64 * (chunk * WORDS + i) as u64;
                let mut rest = word;
                while rest != 0 {
                    ids.push(VertexId(zeroth + u64::from(rest.trailing_zeros())));
                    rest &= rest - 1;
                }
            }
            ids
        };
        let ids: Vec<Vec<VertexId>> = self.words.par_chunks(WORDS).enumerate().map(of_words).collect();
        concat(&ids)
    }

    /// How many are below `id`, which must be one of them.
    #[inline]
    fn rank(&self, id: VertexId) -> u32 {
        let at = id.0 - self.first;
        let word = (at / 64) as usize;
        self.before[word] + (self.words[word] & ((1 << (at % 64)) - 1)).count_ones()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_are_positions() {
        let far = |i: u64| (1 << 25) + 97 * i;
        let ids: Vec<VertexId> =
            [5, 63, 64, 65, 200].into_iter().chain((0..9000).map(far)).map(VertexId).collect();
        let corners: Vec<[VertexId; 3]> = ids.windows(3).map(|w| [w[2], w[0], w[1]]).collect();
        let some = |corners: &[[VertexId; 3]]| Chosen { corners: corners.to_vec(), ..Chosen::default() };
        let chosen: Vec<Chosen> = corners.chunks(1000).rev().map(some).collect();
        let used = Used::new(&chosen, 1 << 40);
        assert_eq!(used.ids(), ids);
        assert!(ids.iter().enumerate().all(|(i, &id)| used.rank(id) == i as u32));
        assert!(Used::new(&[], 10).ids().is_empty());
    }
}
