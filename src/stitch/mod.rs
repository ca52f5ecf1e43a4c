//! Fragments of all tiles in, feature lines out.
//!
//! ```text
//!  tile ── close ──> open parts ── open ──> whole components ── component ──┐
//!            │                                                              ├──> store ──> source
//!            └─────> whole components ── component ─────────────────────────┘
//! ```
//!
//! Instead of `source`, `group` hands what some tiles leave together to another stitcher, which takes it in their place.
//!
//! Everything that needs more than a tile happens here, on the small graph: joining across seams by global id, junctions,
//! pruning by length, hysteresis by component, normalisation by the global maximum, and the final order. It is done
//! component by component, each as soon as no tile can add to it ([`close`](fn@close) says when that is), so that neither
//! the graph nor the lines are ever in memory as a whole. What waits and does not fit goes to the disk (`shelf`). The result is a function of the *set* of fragments; how many
//! tiles they came from, and in what order, cannot be seen in it.

mod apart;
mod close;
mod component;
mod error;
mod fragments;
mod graph;
mod group;
mod lines;
mod open;
mod places;
mod prune;
mod set;
mod shelf;
mod smooth;
mod source;
mod statistics;
mod stitcher;
mod store;

#[cfg(test)]
mod tests;

pub use close::{FitAll, OpenPart, TileShare, close};
pub use component::{Finished, FinishedLine, Part, Rules};
pub use error::StitchError;
pub use fragments::{Candidate, Class, Defects, Fragments, Kind, LinkPath, OpenEdge, Seam, VertexFields};
pub use group::{GroupShare, PutBlock, Section};
pub use lines::Measures;
pub use open::Held;
pub use set::{Geometry, Line, LineSet, LineVertex};
pub use source::{Counts, LineSource, Polyline, Stream};
pub use statistics::{ClassTotal, Statistics};
pub use stitcher::{LineMemory, StitchWork, Stitched, Stitcher};
pub use store::StoredLines;
