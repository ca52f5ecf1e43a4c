//! PLY files as a [`MeshSource`].
//!
//! In: a binary little-endian PLY file of any size. Out: blocks of triangles and positions by id. Other encodings are read
//! from start to end (`stream`), to be converted. The file is understood when it is opened: the header is parsed, all records that are needed are known to lie inside the
//! file, and records that differ in size have been walked once. What stays in memory is a few bytes per block.

mod ascii;
mod binary;
mod faces;
mod header;
mod known;
mod layout;
mod raw;
mod record;
mod scalar;
mod stream;
mod vertices;

#[cfg(test)]
mod tests;

pub use header::{Element, Encoding, Header, Property, PropertyKind};
pub use known::KnownPly;
pub use raw::RawVertices;
pub use scalar::ScalarType;
pub(super) use stream::{is_in_place, read};

use super::{ByteSource, FaceBlock, InputError, IoMode, MeshSource};
use crate::mesh::VertexId;
use faces::{Faces, Missing};
use glam::DVec3;
use layout::{FaceLayout, VertexLayout, format_error};
use record::{Place, Slot};
use std::path::Path;
use vertices::Vertices;

/// The mesh of a binary little-endian PLY file.
#[derive(Debug)]
pub struct PlySource {
    source: ByteSource,
    header: Header,
    vertices: Vertices,
    faces: Faces,
}

impl PlySource {
    /// Opens a PLY file and finds its vertices and faces.
    ///
    /// Faces that are not all triangles, and lists in other elements, cost one pass over the records.
    ///
    /// # Errors
    /// If the file cannot be read, is not binary little-endian PLY, lacks positions, faces or their indices, or
    /// ends before the records its header announces.
    pub fn open(path: &Path, io: IoMode) -> Result<Self, InputError> {
        Self::over(ByteSource::open(path, io)?)
    }

    /// The same over a file that is open already.
    pub(super) fn over(source: ByteSource) -> Result<Self, InputError> {
        Self::placed(source, layout::place)
    }

    /// The same with records that `place` has found.
    fn placed(
        source: ByteSource,
        place: impl FnOnce(&ByteSource, &Header, &Needs) -> Result<(VertexLayout, FaceLayout), InputError>,
    ) -> Result<Self, InputError> {
        let header = Header::read(&source)?;
        if header.encoding != Encoding::BinaryLittleEndian {
            let reason = format!(
                "the file is {}, but only binary little-endian is read in place; re-save it as binary_little_endian",
                header.encoding
            );
            return Err(format_error(&source, reason));
        }
        let needs = Needs::find(&header).map_err(|reason| format_error(&source, reason))?;
        let (vertex_layout, face_layout) = place(&source, &header, &needs)?;
        if face_layout.triangles == 0 {
            let polygons = face_layout.polygons;
            let reason = format!(
                "there are no triangles: none of the {polygons} faces has three or more corners; export the surface again"
            );
            return Err(format_error(&source, reason));
        }
        let mut places = [Place { part: 0, offset: 0, kind: ScalarType::F32 }; 3];
        for (place, property) in places.iter_mut().zip(needs.coordinates) {
            if let Slot::Scalar(found) = vertex_layout.shape.slots[property] {
                *place = found;
            }
        }
        let count = header.elements[needs.vertex].count;
        let element = header.elements[needs.vertex].name.clone();
        let vertices = Vertices { layout: vertex_layout, element, count, places };
        let element = header.elements[needs.face].name.clone();
        let faces = Faces { layout: face_layout, element, vertices: count };
        Ok(Self { source, header, vertices, faces })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        self.source.path()
    }

    /// Length of the file in bytes.
    pub fn file_len(&self) -> u64 {
        self.source.len()
    }

    /// What the file says it contains.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Number of records of the face element, before polygons are cut into triangles.
    pub fn polygon_count(&self) -> u64 {
        self.faces.layout.polygons
    }

    /// Sees to it that there is a block `block`.
    fn block(&self, block: usize) -> Result<(), InputError> {
        let (index, count) = (block as u64, self.block_count() as u64);
        match index < count {
            true => Ok(()),
            false => Err(InputError::NoSuch { name: self.name(), what: "block", index, count }),
        }
    }

    /// Number of faces with less than three corners, which yield no triangle.
    pub fn short_polygons(&self) -> u64 {
        self.faces.layout.short
    }
}

impl MeshSource for PlySource {
    fn name(&self) -> String {
        self.path().display().to_string()
    }

    fn unchanged(&self) -> Result<(), InputError> {
        self.source.unchanged()
    }

    fn vertex_count(&self) -> u64 {
        self.vertices.count
    }

    fn face_count(&self) -> u64 {
        self.faces.layout.triangles
    }

    fn block_count(&self) -> usize {
        self.faces.block_count()
    }

    fn read_block(&self, block: usize, out: &mut FaceBlock) -> Result<(), InputError> {
        self.block(block)?;
        self.faces.read_block(&self.source, block, Missing::Refused, out)
    }

    fn read_existing(&self, block: usize, out: &mut FaceBlock) -> Result<u64, InputError> {
        self.block(block)?;
        self.faces.read_block(&self.source, block, Missing::Handed, out)?;
        let (before, count) = (out.corners.len(), self.vertices.count);
        out.corners.retain(|corners| corners.iter().all(|id| id.0 < count));
        Ok((before - out.corners.len()) as u64)
    }

    fn read_positions(&self, first: VertexId, count: usize, out: &mut Vec<DVec3>) -> Result<(), InputError> {
        self.vertices.read(&self.source, first.0, count as u64, out)
    }

    fn gather_positions(&self, ids: &[VertexId], out: &mut Vec<DVec3>) -> Result<(), InputError> {
        self.vertices.gather(&self.source, ids, out)
    }

    fn corner_positions(
        &self,
        corners: &[[VertexId; 3]],
        out: &mut Vec<[DVec3; 3]>,
    ) -> Result<(), InputError> {
        self.vertices.corners(&self.source, corners, out)
    }

    fn coordinate_bytes(&self) -> usize {
        // 32-bit integers have more bits than an `f32`.
        let wide = |kind| matches!(kind, ScalarType::F64 | ScalarType::I32 | ScalarType::U32);
        if self.vertices.places.iter().any(|place| wide(place.kind)) { 8 } else { 4 }
    }

    fn file(&self) -> Option<&Path> {
        Some(self.path())
    }

    fn vertex_offset(&self, id: VertexId) -> Option<u64> {
        self.vertices.offset(&self.source, id.0)
    }
}

/// Which elements and properties of a header make up the mesh, by position.
struct Needs {
    vertex: usize,
    face: usize,
    coordinates: [usize; 3],
    indices: usize,
}

impl Needs {
    /// Finds what is needed, or says what is missing and what to do.
    fn find(header: &Header) -> Result<Self, String> {
        let vertex = only(&header.elements, "element", &["vertex"], |element| &element.name)?
            .ok_or("there is no element `vertex`; export the mesh with its vertices")?;
        let face = only(&header.elements, "element", &["face"], |element| &element.name)?
            .filter(|&face| header.elements[face].count > 0)
            .ok_or_else(|| no_faces(header))?;
        let mut coordinates = [0; 3];
        let properties = &header.elements[vertex].properties;
        for (coordinate, name) in coordinates.iter_mut().zip(["x", "y", "z"]) {
            *coordinate = only(properties, "property", &[name], |property| &property.name)?
                .filter(|&index| matches!(properties[index].kind, PropertyKind::Scalar(_)))
                .ok_or_else(|| {
                    format!("element `vertex` has no number `{name}`; export the mesh with x, y and z")
                })?;
        }
        let properties = &header.elements[face].properties;
        let indices = only(properties, "property", &["vertex_indices", "vertex_index"], |property| &property.name)?
            .ok_or("element `face` has no list `vertex_indices` or `vertex_index`; export the mesh with indexed faces")?;
        let name = &properties[indices].name;
        match properties[indices].kind {
            PropertyKind::List { count, item } if count.is_integer() && item.is_integer() => {}
            PropertyKind::List { count, item } => {
                return Err(format!(
                    "the list `{name}` of element `face` is a list of {item} with a length of type {count}; re-save \
                     the file with integer types"
                ));
            }
            PropertyKind::Scalar(kind) => {
                return Err(format!(
                    "property `{name}` of element `face` is a single {kind}, not a list; export the mesh with \
                     indexed faces"
                ));
            }
        }
        Ok(Self { vertex, face, coordinates, indices })
    }
}

/// Position of the item with the first of `names` that occurs, which must not occur twice.
fn only<T>(
    items: &[T],
    what: &str,
    names: &[&str],
    name_of: impl Fn(&T) -> &String,
) -> Result<Option<usize>, String> {
    for name in names {
        let mut found = (0..items.len()).filter(|&index| name_of(&items[index]) == name);
        match (found.next(), found.next()) {
            (None, _) => {}
            (first, None) => return Ok(first),
            (Some(_), Some(_)) => {
                return Err(format!("the header declares the {what} `{name}` twice; re-save the file"));
            }
        }
    }
    Ok(None)
}

fn no_faces(header: &Header) -> String {
    if header.elements.iter().any(|element| element.name == "tristrips" && element.count > 0) {
        "there are no faces, only triangle strips; re-save the mesh with an element `face`".to_owned()
    } else {
        super::format::no_faces()
    }
}
