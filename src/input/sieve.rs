//! A mesh without the faces that cannot be used.
//!
//! In: any source, with faces that name vertices that do not exist, or vertices whose coordinates are not finite. Out: a
//! source without those faces, and how many there were. Triangles are numbered anew, without gaps, so that the result is
//! the one of a file in which the faces that were left out never stood. Vertices keep their ids.
//!
//! Invariant: what is left out is decided once, face by face, when the sieve is made; which tile asks cannot matter.

use super::{FaceBlock, InputError, MeshSource};
use crate::mesh::{FaceId, VertexId};
use glam::DVec3;
use roaring::RoaringTreemap;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Products of four coordinates must stay finite; nothing that is measured in any unit comes near.
pub const LARGEST_COORDINATE: f64 = 1e75;

/// Positions looked at a time.
const CHUNK: u64 = 1 << 16;

/// Whether there can be calculated with all coordinates of `p`: they are finite and not absurdly large.
pub fn is_usable(p: DVec3) -> bool {
    // False for NaN too.
    p.to_array().iter().all(|x| x.abs() < LARGEST_COORDINATE)
}

/// What was left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeftOut {
    /// Faces that name a vertex that does not exist.
    pub missing: u64,
    /// Other faces with a vertex whose coordinates cannot be used.
    pub unusable: u64,
    /// Vertices whose coordinates cannot be used, whether faces named them or not.
    pub vertices: u64,
}

/// A source without faces that cannot be used.
pub struct Sieve<'a> {
    source: &'a dyn MeshSource,
    decided: Arc<Decided>,
}

/// What a sieve has decided, for other processes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Decided {
    /// Vertices whose coordinates cannot be used.
    unusable: RoaringTreemap,
    /// Id of the first face of each block, and the number of all faces behind the last.
    firsts: Vec<u64>,
    left_out: LeftOut,
}

impl<'a> Sieve<'a> {
    /// Goes once through all vertices and once through all faces of `source`. Keeps 8 bytes for each block, and at most
    /// about a bit for each vertex.
    ///
    /// # Errors
    /// If the source cannot be read, or no face is left.
    pub fn new(source: &'a dyn MeshSource) -> Result<Sieve<'a>, InputError> {
        let unusable = unusable_vertices(source)?;
        let left_out = LeftOut { vertices: unusable.len(), ..LeftOut::default() };
        let mut decided = Decided { unusable, firsts: vec![0], left_out };
        let (mut block, mut faces) = (FaceBlock::default(), 0);
        for index in 0..source.block_count() {
            let (missing, unusable) = decided.sift(source, index, &mut block)?;
            decided.left_out.missing += missing;
            decided.left_out.unusable += unusable;
            faces += block.corners.len() as u64;
            decided.firsts.push(faces);
        }
        if faces == 0 {
            let LeftOut { missing, unusable, .. } = decided.left_out;
            let reason = format!(
                "no face can be used: {missing} name vertices that do not exist, {unusable} have coordinates that are not \
                 finite; export the mesh again"
            );
            return Err(InputError::Format { path: source.name().into(), reason });
        }
        Ok(Sieve::again(source, Arc::new(decided)))
    }

    /// The sieve over `source` that has `decided` so before.
    pub fn again(source: &'a dyn MeshSource, decided: Arc<Decided>) -> Sieve<'a> {
        Sieve { source, decided }
    }

    /// What it has decided.
    pub fn decided(&self) -> Arc<Decided> {
        Arc::clone(&self.decided)
    }

    /// What was left out.
    pub fn left_out(&self) -> LeftOut {
        self.decided.left_out
    }
}

impl Decided {
    /// Reads a block without the faces that cannot be used, and says how many those were: of vertices that do not exist,
    /// and of coordinates that cannot be used.
    fn sift(
        &self,
        source: &dyn MeshSource,
        block: usize,
        out: &mut FaceBlock,
    ) -> Result<(u64, u64), InputError> {
        let missing = source.read_existing(block, out)?;
        let before = out.corners.len();
        if !self.unusable.is_empty() {
            out.corners.retain(|corners| corners.iter().all(|id| !self.unusable.contains(id.0)));
        }
        Ok((missing, (before - out.corners.len()) as u64))
    }
}

fn unusable_vertices(source: &dyn MeshSource) -> Result<RoaringTreemap, InputError> {
    let (mut found, mut positions, mut first) = (RoaringTreemap::new(), Vec::new(), 0);
    while first < source.vertex_count() {
        let count = (source.vertex_count() - first).min(CHUNK);
        positions.clear();
        source.read_positions(VertexId(first), count as usize, &mut positions)?;
        let bad = (first..).zip(&positions).filter(|(_, p)| !is_usable(**p)).map(|(id, _)| id);
        // Ids ascend, so each goes to the end.
        bad.for_each(|id| {
            found.insert(id);
        });
        first += count;
    }
    Ok(found)
}

impl MeshSource for Sieve<'_> {
    fn name(&self) -> String {
        self.source.name()
    }

    fn unchanged(&self) -> Result<(), InputError> {
        self.source.unchanged()
    }

    fn vertex_count(&self) -> u64 {
        self.source.vertex_count()
    }

    fn face_count(&self) -> u64 {
        self.decided.firsts.last().copied().unwrap_or(0)
    }

    fn block_count(&self) -> usize {
        self.source.block_count()
    }

    fn read_block(&self, block: usize, out: &mut FaceBlock) -> Result<(), InputError> {
        self.decided.sift(self.source, block, out)?;
        out.ids.clear();
        // A block that the source does not have was refused by it.
        out.first = FaceId(self.decided.firsts.get(block).copied().unwrap_or(0));
        Ok(())
    }

    fn only_usable(&self) -> bool {
        true
    }

    fn read_positions(&self, first: VertexId, count: usize, out: &mut Vec<DVec3>) -> Result<(), InputError> {
        self.source.read_positions(first, count, out)
    }

    fn gather_positions(&self, ids: &[VertexId], out: &mut Vec<DVec3>) -> Result<(), InputError> {
        self.source.gather_positions(ids, out)
    }

    fn corner_positions(
        &self,
        corners: &[[VertexId; 3]],
        out: &mut Vec<[DVec3; 3]>,
    ) -> Result<(), InputError> {
        self.source.corner_positions(corners, out)
    }

    fn coordinate_bytes(&self) -> usize {
        self.source.coordinate_bytes()
    }

    fn vertex_offset(&self, id: VertexId) -> Option<u64> {
        self.source.vertex_offset(id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::MemorySource;

    #[test]
    fn faces_that_cannot_be_used_are_as_if_they_had_never_been() {
        let mut positions: Vec<DVec3> = (0..10_000).map(|i| DVec3::new(f64::from(i), 0.5, -1.0)).collect();
        let faces: Vec<[u32; 3]> = (0..9_998).map(|i| [i, i + 1, i + 2]).collect();
        let bad = [(0, f64::NAN), (5000, f64::INFINITY), (5001, 1e75), (9_999, -1e300)];
        bad.iter().for_each(|&(i, x): &(usize, f64)| positions[i].y = x);
        let uses_bad = |face: &[u32; 3]| bad.iter().any(|&(i, _)| face.contains(&(i as u32)));
        let good: Vec<[u32; 3]> = faces.iter().copied().filter(|face| !uses_bad(face)).collect();
        let source = MemorySource::new(&positions, &faces).expect("indices are good");
        let sieve = Sieve::new(&source).expect("faces are left");
        let unusable = (faces.len() - good.len()) as u64;
        assert_eq!(sieve.left_out(), LeftOut { missing: 0, unusable, vertices: 4 });
        assert_eq!((sieve.face_count(), sieve.vertex_count()), (good.len() as u64, 10_000));
        let (mut block, mut next) = (FaceBlock::default(), 0);
        for index in 0..sieve.block_count() {
            sieve.read_block(index, &mut block).expect("it is there");
            assert_eq!(block.id(0), FaceId(next as u64));
            for corners in &block.corners {
                assert_eq!(*corners, good[next].map(|id| VertexId(id.into())));
                next += 1;
            }
        }
        assert_eq!(next, good.len());
    }

    #[test]
    fn a_mesh_of_which_nothing_is_left_is_an_error() {
        let positions = [DVec3::ZERO, DVec3::X, DVec3::NAN];
        let source = MemorySource::new(&positions, &[[0, 1, 2]]).expect("indices are good");
        let error = Sieve::new(&source).err().expect("refused");
        assert!(error.to_string().contains("1 have coordinates that are not finite"), "{error}");
    }
}
