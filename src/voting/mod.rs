//! Steps A and B of the robust method: normals, noise, tensors, fold angles. And the first stage of the paper method:
//! tensors and classes ([`paper_votes`] and what follows it).
//!
//! Pure functions of a tile mesh. Each is computed where the demand of [`crate::partition`] says, and nowhere else.

mod classify;
mod levels;
mod normals;
mod paper;
mod refine;
mod tensor;

pub use classify::{Stop, Surroundings, on_boundary, stops, surroundings};
pub use levels::Levels;
pub use normals::{FaceGeometry, Noise, rounds};
pub use paper::{Initial, Voters, omega, paper_stops, paper_votes};
pub use refine::{Noisy, refine};
pub use tensor::{Token, Vote, first_votes, vote_again, votes, widen};
