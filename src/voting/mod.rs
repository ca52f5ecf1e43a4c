//! Steps A and B of the method: normals, noise, tensors, fold angles.
//!
//! Pure functions of a tile mesh. Each is computed where the demand of [`crate::partition`] says, and nowhere else.

mod classify;
mod levels;
mod normals;
mod tensor;

pub use classify::{Stop, stops, thresholds};
pub use levels::Levels;
pub use normals::{FaceGeometry, Noise, refine, rounds};
pub use tensor::{Token, Vote, first_votes, vote_again, votes};
