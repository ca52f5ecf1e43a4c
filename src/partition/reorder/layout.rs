//! How ids and positions lie in temporary files: as few bytes as the mesh needs, little-endian.

use crate::input::MeshSource;
use crate::mesh::{FaceId, VertexId};
use glam::DVec3;

/// Bytes of an id that counts to `count`.
fn width(count: u64) -> usize {
    match count {
        0..=0xffff_ffff => 4,
        0x1_0000_0000..=0xff_ffff_ffff => 5,
        _ => 8,
    }
}

/// Appends the low `width` bytes of `x`.
#[inline]
pub fn put(out: &mut Vec<u8>, x: u64, width: usize) {
    // Copies of a length that is known at compile time are one instruction, others a call.
    match width {
        2 => out.extend_from_slice(&(x as u16).to_le_bytes()),
        4 => out.extend_from_slice(&(x as u32).to_le_bytes()),
        _ => out.extend_from_slice(&x.to_le_bytes()[..width]),
    }
}

/// The number that these bytes are.
#[inline]
pub fn number(bytes: &[u8]) -> u64 {
    if let &[a, b, c, d] = bytes {
        return u64::from(u32::from_le_bytes([a, b, c, d]));
    }
    if let &[a, b] = bytes {
        return u64::from(u16::from_le_bytes([a, b]));
    }
    let mut raw = [0; 8];
    raw[..bytes.len()].copy_from_slice(bytes);
    u64::from_le_bytes(raw)
}

/// Widths of the numbers of one mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Bytes of a face id.
    pub face: usize,
    /// Bytes of a vertex id.
    pub vertex: usize,
    /// Bytes of the number of a corner: three for each face.
    pub corner: usize,
    /// Bytes of a coordinate: those of the source, so that it is stored exactly.
    pub coordinate: usize,
}

/// A face with all that a tile needs of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    pub id: FaceId,
    pub corners: [VertexId; 3],
    pub places: [DVec3; 3],
}

impl Layout {
    /// What `source` needs.
    pub fn of(source: &dyn MeshSource) -> Layout {
        Layout {
            face: width(source.face_count()),
            vertex: width(source.vertex_count()),
            corner: width(source.face_count().saturating_mul(3)),
            coordinate: source.coordinate_bytes(),
        }
    }

    /// Bytes of a position.
    pub fn position(&self) -> usize {
        3 * self.coordinate
    }

    /// Bytes of a corner with its place within a bucket of vertices.
    pub fn corner_record(&self) -> usize {
        4 + self.corner
    }

    /// Bytes of a position with its place within a bucket of faces.
    pub fn placed_corner(&self) -> usize {
        4 + self.position()
    }

    /// Bytes of a [`Face`].
    pub fn face_record(&self) -> usize {
        self.face + 3 * self.vertex + 3 * self.position()
    }

    /// Appends a position.
    #[inline]
    pub fn put_position(&self, out: &mut Vec<u8>, p: DVec3) {
        for x in p.to_array() {
            match self.coordinate {
                // The source says that this loses nothing.
                4 => out.extend_from_slice(&(x as f32).to_le_bytes()),
                _ => out.extend_from_slice(&x.to_le_bytes()),
            }
        }
    }

    /// The position that these bytes are.
    #[inline]
    pub fn read_position(&self, bytes: &[u8]) -> DVec3 {
        let coordinate = |axis: usize| {
            let raw = number(&bytes[axis * self.coordinate..][..self.coordinate]);
            if self.coordinate == 4 { f64::from(f32::from_bits(raw as u32)) } else { f64::from_bits(raw) }
        };
        DVec3::new(coordinate(0), coordinate(1), coordinate(2))
    }

    /// Appends a face.
    pub fn put_face(&self, out: &mut Vec<u8>, face: &Face) {
        put(out, face.id.0, self.face);
        face.corners.iter().for_each(|id| put(out, id.0, self.vertex));
        face.places.iter().for_each(|&p| self.put_position(out, p));
    }

    /// The face that these bytes are.
    pub fn read_face(&self, bytes: &[u8]) -> Face {
        let (id, rest) = bytes.split_at(self.face);
        let (corners, places) = rest.split_at(3 * self.vertex);
        let corner = |i: usize| VertexId(number(&corners[i * self.vertex..][..self.vertex]));
        let place = |i: usize| self.read_position(&places[i * self.position()..]);
        Face { id: FaceId(number(id)), corners: [0, 1, 2].map(corner), places: [0, 1, 2].map(place) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_come_back_as_they_were() {
        for (face, vertex, coordinate) in [(4, 4, 4), (5, 4, 8), (8, 5, 8)] {
            let layout = Layout { face, vertex, corner: 5, coordinate };
            let top = |width: usize| u64::MAX >> (64 - 8 * width);
            let p = DVec3::new(-0.0, f64::from(f32::MIN_POSITIVE), f64::from(0.1f32));
            let places = [p, if coordinate == 8 { p * 1e70 } else { p }, DVec3::ONE];
            let corners = [VertexId(0), VertexId(top(vertex)), VertexId(258)];
            let face = Face { id: FaceId(top(face)), corners, places };
            let mut bytes = Vec::new();
            layout.put_face(&mut bytes, &face);
            assert_eq!(bytes.len(), layout.face_record());
            let again = layout.read_face(&bytes);
            assert_eq!(again, face);
            assert!(again.places[0].x.is_sign_negative());
        }
        assert_eq!([1, u64::from(u32::MAX), 1 << 32, 1 << 40].map(width), [4, 4, 5, 8]);
    }
}
