//! Seeded meshes whose feature lines are known.
//!
//! In go the name of a shape and a seed, out come a triangle mesh and the polylines along its true feature lines,
//! and the committed files under `fixtures/`. The same seed gives the same bytes on every platform: all
//! transcendental functions come from the `libm` crate and nothing is ordered by a hash.
//!
//! This is the reusable part of the example `gen`; tests include it by path.

mod border;
mod builder;
mod city;
mod cone;
mod corners;
mod edit;
mod extrude;
mod folds;
mod outline;
mod patch;
mod refine;
mod revolve;
mod solids;

pub mod fixtures;
pub mod handmade;
pub mod ply;
pub mod random;
pub mod shape;
pub mod shapes;
pub mod style;

pub use shapes::ShapeName;
