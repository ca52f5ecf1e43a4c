//! What a run is asked for.
//!
//! [`Params`] change the result and are what two runs must share to be comparable; [`Limits`] say how the work is cut
//! up and never change a byte of it. The constants of the method, which are not for users to set, are in
//! [`method`].

pub mod method;

use crate::input::IoMode;
use serde::{Deserialize, Serialize};

/// The scale of the voting neighbourhood.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Sigma {
    /// In median edge lengths of the mesh; 3 unless told otherwise.
    Edges(f64),
    /// In the units of the mesh.
    Length(f64),
}

/// Parameters that change the result.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Params {
    /// Scale of the voting neighbourhood.
    pub sigma: Sigma,
    /// The weakest crease to report: lines whose mean dihedral angle is smaller are dropped, and vertices with a smaller
    /// one are class face. In degrees, 0 to 180; 0 leaves the decision to the local threshold.
    pub min_angle_deg: f64,
    /// The shortest line to report, in sigmas. Applies to connected components of crease lines.
    pub min_length_sigmas: f64,
    /// Report open and non-manifold mesh edges too, as classes of their own.
    pub boundaries: bool,
}

impl Default for Params {
    fn default() -> Self {
        Params {
            sigma: Sigma::Edges(method::SIGMA_EDGES),
            min_angle_deg: 0.0,
            min_length_sigmas: method::MIN_LENGTH / method::SIGMA_EDGES,
            boundaries: false,
        }
    }
}

/// A parameter outside the range the method is defined for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ParamError {
    /// The voting scale is unusable.
    #[error(
        "sigma is {edges:.3} median edge lengths; it must lie between {min} and {max} (the median edge of this mesh is {h} units long)"
    )]
    Sigma {
        /// What was asked for, in median edge lengths.
        edges: f64,
        /// Median edge length of the mesh.
        h: f64,
        /// Smallest scale that still reaches past the one-ring.
        min: f64,
        /// Largest scale: the work grows with its square.
        max: f64,
    },
    /// An angle that no fold has.
    #[error("the smallest angle is {0} degrees; it must lie between 0 (flat) and 180 (folded back)")]
    MinAngle(f64),
    /// A negative or non-finite length.
    #[error("the smallest length is {0} sigmas; it must be finite and not negative")]
    MinLength(f64),
}

impl Params {
    /// The ratio k between the asked-for sigma and the standard one of three median edge lengths `h`.
    ///
    /// # Errors
    /// If any parameter is outside the range the method is defined for.
    pub fn scale(&self, h: f64) -> Result<f64, ParamError> {
        let edges = match self.sigma {
            Sigma::Edges(edges) => edges,
            // A mesh without any extent has no edge to compare with; any scale gives the same empty result.
            Sigma::Length(length) if h > 0.0 => length / h,
            Sigma::Length(_) => method::SIGMA_EDGES,
        };
        let (min, max) = method::SIGMA_EDGES_RANGE;
        if !(min..=max).contains(&edges) {
            return Err(ParamError::Sigma { edges, h, min, max });
        }
        if !(0.0..=180.0).contains(&self.min_angle_deg) {
            return Err(ParamError::MinAngle(self.min_angle_deg));
        }
        if !(self.min_length_sigmas >= 0.0 && self.min_length_sigmas.is_finite()) {
            return Err(ParamError::MinLength(self.min_length_sigmas));
        }
        Ok(edges / method::SIGMA_EDGES)
    }
}

/// How the mesh is cut into tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tiling {
    /// One tile as large as the world.
    InCore,
    /// Tiles of about so many faces, halo not counted.
    Faces(u64),
}

/// How the work is done; none of this changes the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Threads that compute; 0 means one per processor.
    pub threads: usize,
    /// Size of the tiles.
    pub tiling: Tiling,
    /// How the input is read.
    pub io: IoMode,
}

impl Default for Limits {
    fn default() -> Self {
        Limits { threads: 0, tiling: Tiling::Faces(DEFAULT_TILE_FACES), io: IoMode::Auto }
    }
}

/// Faces of a tile when nothing is said. A tile costs about 350 bytes a face while it is worked on, halo included, and up
/// to four are in flight: some 3 GB. Smaller tiles spend more on their halos: an ordinary scan needs about 60 edges on
/// every side, a quarter more faces at this size and as many again at a tenth of it.
pub const DEFAULT_TILE_FACES: u64 = 2_000_000;
