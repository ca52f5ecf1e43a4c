//! How the mesh is cut up: scan, plan, and the tiles with all that their vertices depend on.
//!
//! Nothing in here changes the result, except the two numbers that the scan finds for everyone: the median side length
//! and the origin of the lattice.

mod adapt;
mod cells;
mod content;
mod curve;
mod halo;
mod lattice;
mod load;
mod locality;
mod numbering;
mod paper;
mod plan;
mod region;
mod reorder;
mod scan;

pub use cells::Cell;
pub use content::content;
pub use halo::{Demand, Loaded, Reach, Rings, merge, noise_demand, round_demand, vertex_demand};
pub use lattice::{Cube, CubeBox, Lattice};
pub use load::{LoadError, MOST_FACES, load};
pub use locality::{Locality, vertex_reads};
pub use numbering::Numbering;
pub use paper::{PaperReach, Pass, half_cube, paper_demand};
pub use plan::{Plan, Scale};
pub use region::{Gap, Region};
pub use reorder::{Joined, SortedTable, SpatialStore, join, least_memory, sort, temporary_bytes};
pub use scan::{BlockSummary, Bounds, Scan, scan};
