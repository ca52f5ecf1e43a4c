//! What a mesh is to the rest of the program: id spaces, and the mesh of one tile with its adjacency.

mod ids;

pub use ids::{FaceId, TileId, VertexId};
