//! A file that was opened before, opened again by another process without a pass over its records.
//!
//! In: what [`PlySource::known`] said of the file, perhaps on another machine. Out: the same source, if the file has the length
//! and the time of the last change that it had then; where there are many tasks over one file, none of them walks all of its
//! records. The header is read and compared; nothing else is.

use super::layout::{FaceLayout, VertexLayout};
use super::record::Shape;
use super::{Needs, PlySource};
use crate::input::ply::Header;
use crate::input::{ByteSource, InputError, IoMode};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What must be known to open a file again.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct KnownPly {
    /// Bytes.
    length: u64,
    /// When it was last written: seconds and nanoseconds since 1970.
    modified: (i64, i64),
    vertices: VertexLayout,
    faces: FaceLayout,
}

impl PlySource {
    /// What another process must know to open the file again.
    pub fn known(&self) -> KnownPly {
        KnownPly {
            length: self.source.len(),
            modified: self.source.modified(),
            vertices: self.vertices.layout.clone(),
            faces: self.faces.layout.clone(),
        }
    }
}

impl KnownPly {
    /// Opens the file at `path`.
    ///
    /// # Errors
    /// [`InputError::NotPlanned`] if it is not the file that is known; otherwise as for [`PlySource::open`].
    pub fn open(&self, path: &Path, io: IoMode) -> Result<PlySource, InputError> {
        let source = ByteSource::open(path, io)?;
        if source.len() != self.length {
            let reason = format!("it had {} bytes and has {}", self.length, source.len());
            return Err(InputError::NotPlanned { path: path.to_owned(), reason });
        }
        if source.modified() != self.modified {
            let reason = "it was written to since".to_owned();
            return Err(InputError::NotPlanned { path: path.to_owned(), reason });
        }
        PlySource::placed(source, |source, header, needs| {
            if self.fits(header, needs) {
                return Ok((self.vertices.clone(), self.faces.clone()));
            }
            let reason = "its header is another".to_owned();
            Err(InputError::NotPlanned { path: source.path().to_owned(), reason })
        })
    }

    /// Whether the records are those that the header announces.
    fn fits(&self, header: &Header, needs: &Needs) -> bool {
        let shape = |element: usize| Shape::new(&header.elements[element]);
        (shape(needs.vertex), shape(needs.face)) == (self.vertices.shape.clone(), self.faces.shape.clone())
            && header.elements[needs.face].count == self.faces.polygons
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::{FaceBlock, MeshSource};
    use std::fs::{self, File};

    /// A triangle, a square and a triangle.
    fn mesh() -> Vec<u8> {
        let mut bytes = b"ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
                          property float z\nelement face 3\nproperty list uchar int vertex_indices\nend_header\n"
            .to_vec();
        for (x, y) in [(0f32, 0f32), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
            [x, y, 0.0].iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        }
        for face in [&[0i32, 1, 2][..], &[0, 1, 2, 3], &[2, 3, 0]] {
            bytes.push(face.len() as u8);
            face.iter().for_each(|corner| bytes.extend(corner.to_le_bytes()));
        }
        bytes
    }

    #[test]
    fn it_is_the_same_source_unless_the_file_changed() {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let path = directory.path().join("mesh.ply");
        fs::write(&path, mesh()).expect("write");
        let first = PlySource::open(&path, IoMode::Read).expect("a mesh");
        let known = first.known();
        let again = known.open(&path, IoMode::Map).expect("the same");
        assert_eq!((again.face_count(), again.polygon_count()), (4, 3));
        let corners = |source: &PlySource| {
            let mut block = FaceBlock::default();
            source.read_block(0, &mut block).expect("a block");
            block
        };
        assert_eq!(corners(&first), corners(&again));

        let changed = |part: &str| {
            let error = known.open(&path, IoMode::Read).expect_err("refused");
            assert!(
                matches!(error, InputError::NotPlanned { .. }) && error.to_string().contains(part),
                "{error}"
            );
        };
        let touched = File::options().write(true).open(&path).expect("open");
        let then = touched.metadata().and_then(|found| found.modified()).expect("a time");
        touched.set_modified(std::time::SystemTime::UNIX_EPOCH).expect("touched");
        changed("written to");
        // Even where somebody has set the time back, the header tells.
        let other = String::from_utf8_lossy(&mesh()).replace("property float z", "property int z  ");
        let mut bytes = mesh();
        let header = bytes.windows(10).position(|w| w == b"end_header").expect("a header");
        bytes[..header].copy_from_slice(&other.as_bytes()[..header]);
        fs::write(&path, &bytes).expect("write");
        File::options().write(true).open(&path).and_then(|file| file.set_modified(then)).expect("set back");
        changed("header");
        fs::write(&path, &mesh()[1..]).expect("write");
        changed(" bytes and has ");
    }
}
