//! A mesh that is already in memory, as a [`MeshSource`].
//!
//! In: borrowed positions and triangles. Out: the same blocks a file would give. The indices are checked once, when
//! the source is made, so that reads cannot meet a bad one.

use super::{BLOCK, FaceBlock, InputError, MeshSource};
use crate::mesh::{FaceId, VertexId};
use glam::DVec3;

/// Triangles and positions borrowed from the caller.
#[derive(Clone, Copy, Debug)]
pub struct MemorySource<'a> {
    positions: &'a [DVec3],
    faces: &'a [[u32; 3]],
}

impl<'a> MemorySource<'a> {
    /// Wraps a mesh after checking that every corner names one of `positions`.
    ///
    /// # Errors
    /// [`InputError::MemoryIndex`] for the first face that names a vertex that does not exist.
    pub fn new(positions: &'a [DVec3], faces: &'a [[u32; 3]]) -> Result<Self, InputError> {
        let vertices = positions.len() as u64;
        for (face, corners) in faces.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&index| u64::from(index) >= vertices) {
                return Err(InputError::MemoryIndex { face: face as u64, index, vertices });
            }
        }
        Ok(Self { positions, faces })
    }

    fn position(&self, id: VertexId) -> Result<DVec3, InputError> {
        usize::try_from(id.0)
            .ok()
            .and_then(|index| self.positions.get(index).copied())
            .ok_or_else(|| self.no_such("vertex", id.0, self.vertex_count()))
    }

    fn no_such(&self, what: &'static str, index: u64, count: u64) -> InputError {
        InputError::NoSuch { name: self.name(), what, index, count }
    }
}

impl MeshSource for MemorySource<'_> {
    fn name(&self) -> String {
        "mesh in memory".to_owned()
    }

    fn vertex_count(&self) -> u64 {
        self.positions.len() as u64
    }

    fn face_count(&self) -> u64 {
        self.faces.len() as u64
    }

    fn block_count(&self) -> usize {
        self.faces.len().div_ceil(BLOCK as usize)
    }

    fn read_block(&self, block: usize, out: &mut FaceBlock) -> Result<(), InputError> {
        let Some(faces) = self.faces.chunks(BLOCK as usize).nth(block) else {
            return Err(self.no_such("block", block as u64, self.block_count() as u64));
        };
        out.restart(FaceId(block as u64 * BLOCK));
        out.corners.extend(faces.iter().map(|face| face.map(|index| VertexId(u64::from(index)))));
        Ok(())
    }

    fn read_positions(&self, first: VertexId, count: usize, out: &mut Vec<DVec3>) -> Result<(), InputError> {
        let range = usize::try_from(first.0)
            .ok()
            .and_then(|first| Some(first..first.checked_add(count)?))
            .and_then(|range| self.positions.get(range));
        let Some(positions) = range else {
            let last = first.0.saturating_add((count as u64).saturating_sub(1));
            return Err(self.no_such("vertex", last, self.vertex_count()));
        };
        out.extend_from_slice(positions);
        Ok(())
    }

    fn gather_positions(&self, ids: &[VertexId], out: &mut Vec<DVec3>) -> Result<(), InputError> {
        out.clear();
        out.reserve(ids.len());
        for &id in ids {
            out.push(self.position(id)?);
        }
        Ok(())
    }

    fn corner_positions(
        &self,
        corners: &[[VertexId; 3]],
        out: &mut Vec<[DVec3; 3]>,
    ) -> Result<(), InputError> {
        out.clear();
        out.reserve(corners.len());
        for &[a, b, c] in corners {
            out.push([self.position(a)?, self.position(b)?, self.position(c)?]);
        }
        Ok(())
    }

    fn vertex_offset(&self, _id: VertexId) -> Option<u64> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_and_positions_are_those_given() {
        let positions: Vec<DVec3> = (0..9000).map(|i| DVec3::new(f64::from(i), 0.5, -1.0)).collect();
        let faces: Vec<[u32; 3]> = (0..8998).map(|i| [i, i + 1, i + 2]).collect();
        let mesh = MemorySource::new(&positions, &faces).unwrap();
        assert_eq!((mesh.vertex_count(), mesh.face_count(), mesh.block_count()), (9000, 8998, 3));
        let mut block = FaceBlock::default();
        let mut seen = 0;
        for index in 0..mesh.block_count() {
            mesh.read_block(index, &mut block).unwrap();
            assert_eq!(block.first, FaceId(seen as u64));
            for corners in &block.corners {
                assert_eq!(*corners, faces[seen].map(|v| VertexId(u64::from(v))));
                seen += 1;
            }
            let mut places = vec![[DVec3::ZERO; 3]];
            mesh.corner_positions(&block.corners, &mut places).unwrap();
            assert_eq!(places.len(), block.corners.len());
            assert_eq!(places[0][2], positions[block.corners[0][2].0 as usize]);
        }
        assert_eq!(seen, faces.len());
        let mut out = vec![DVec3::ONE];
        mesh.read_positions(VertexId(8998), 2, &mut out).unwrap();
        assert_eq!(out, [DVec3::ONE, positions[8998], positions[8999]]);
        mesh.gather_positions(&[VertexId(3), VertexId(70)], &mut out).unwrap();
        assert_eq!(out, [positions[3], positions[70]]);
        assert_eq!(mesh.vertex_offset(VertexId(0)), None);
    }

    #[test]
    fn a_bad_index_is_refused_at_construction() {
        let positions = [DVec3::ZERO; 3];
        let error = MemorySource::new(&positions, &[[0, 1, 2], [0, 3, 1]]).unwrap_err();
        assert!(matches!(error, InputError::MemoryIndex { face: 1, index: 3, vertices: 3 }));
    }

    #[test]
    fn what_does_not_exist_is_an_error() {
        let positions = [DVec3::ZERO; 3];
        let mesh = MemorySource::new(&positions, &[[0, 1, 2]]).unwrap();
        let mut out = Vec::new();
        assert!(mesh.read_block(1, &mut FaceBlock::default()).is_err());
        assert!(mesh.read_positions(VertexId(2), 2, &mut out).is_err());
        assert!(mesh.read_positions(VertexId(u64::MAX), 2, &mut out).is_err());
        assert!(mesh.gather_positions(&[VertexId(3)], &mut out).is_err());
        assert!(mesh.corner_positions(&[[VertexId(0), VertexId(1), VertexId(9)]], &mut Vec::new()).is_err());
    }
}
