//! Steps B (contrast), C, D and F: which vertices are features, how they hang together along the mesh, and where the lines
//! run between its vertices.
//!
//! The paper method has its own measure of support ([`Supporters`]) and shares walking, ridges and links.
//!
//! Pure functions of a tile mesh and its votes; they cannot tell whether the tile is one of a thousand or the only one.

mod contrast;
mod fit;
mod link;
mod paper;
mod patch;
mod plane;
mod sides;
mod smooth;
mod support;
mod thin;
mod walk;

pub use contrast::contrast;
pub use fit::{Bend, Fit, Fitter, noise_share, slack};
pub use link::{Link, Linker};
pub use paper::{Extremes, OmegaRange, Salience, Supporters};
pub use smooth::smooth;
pub use support::{Evidence, Support, traceable};
pub use thin::{average_along, ridges};
