//! Feature lines of triangle meshes that are too big for memory.
#![warn(missing_docs)]

pub mod mesh;
pub mod input;
