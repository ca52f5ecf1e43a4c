//! Seeded meshes whose feature lines are known.
//!
//! In go the name of a shape, a style of triangles, a kind of noise and a seed; out come a triangle mesh, the polylines
//! along its true feature lines and their corners, and the committed files under `fixtures/`. The same seed gives the
//! same bytes on every platform: all transcendental functions come from the `libm` crate and nothing is ordered by a
//! hash.
//!
//! This is the reusable part of the example `gen`; tests include it by path.

mod blocks;
mod border;
mod boss;
mod builder;
mod city;
mod cone;
mod corners;
mod edit;
mod extrude;
mod folds;
mod loft;
mod outline;
mod patch;
mod refine;
mod relief;
mod revolve;
mod solids;
mod sphere;
mod terrain;

pub mod adversarial;
pub mod fixtures;
pub mod handmade;
pub mod noise;
pub mod ply;
pub mod random;
pub mod scan;
pub mod shape;
pub mod shapes;
pub mod shuffle;
pub mod stream;
pub mod style;

pub use shapes::ShapeName;
