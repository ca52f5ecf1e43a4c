//! STL files: triangles, each with the positions of its own three corners.
//!
//! Triangles share no vertices in the file, so corners with equal positions are welded when it is converted. Normals and
//! whatever some programs keep in the two spare bytes say nothing that the corners do not say.

pub mod ascii;
pub mod binary;
