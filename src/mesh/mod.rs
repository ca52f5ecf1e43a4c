//! What a mesh is to the rest of the program: id spaces, the mesh of one tile with its adjacency, and values on it.

mod across;
mod csr;
mod field;
mod ids;
mod pieces;
mod tile_mesh;

pub use across::{Across, Beyond};
pub use csr::Csr;
pub use field::Field;
pub use ids::{FaceId, TileId, VertexId};
pub use pieces::{concat, filled, pieces};
pub use tile_mesh::{EdgeUse, HUB, TileMesh};
