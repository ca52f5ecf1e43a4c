//! The thresholds and constants of the paper method (`--method paper`), as published by Wang et al. (2012).
//!
//! What a user may set is in [`PaperThresholds`]; the rest is fixed, so that results can be compared with those of others.
//! Steps that the paper leaves open are taken with the constants of [`super::method`]: the cone and the number of steps of
//! a walk, thinning, linking, graph and pruning. Section 6 of `docs/ALGORITHM.md` says which.

use super::ParamError;
use serde::{Deserialize, Serialize};

/// What is a feature to the paper method. All are pure numbers from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PaperThresholds {
    /// A vertex is a corner if l3, divided by the 2-norm of the eigenvalues, is at least this (the paper's alpha).
    pub corner_l3: f64,
    /// A vertex that is no corner lies on a sharp edge if l2, divided likewise, is at least this (the paper's beta).
    pub edge_l2: f64,
    /// Vertices on sharp edges and corners whose salience, from 0 to 1 over the mesh, is at least this are features.
    pub salience: f64,
}

impl Default for PaperThresholds {
    /// The published values. An even fold has l2 = 0.020 at 16 degrees.
    fn default() -> Self {
        PaperThresholds { corner_l3: 0.065, edge_l2: 0.020, salience: 0.1 }
    }
}

impl PaperThresholds {
    /// # Errors
    /// If a threshold is not one that divides vertices.
    pub(super) fn check(&self) -> Result<(), ParamError> {
        for (name, value) in [("corner l3", self.corner_l3), ("edge l2", self.edge_l2)] {
            // At 0 a vertex without any faces would be a corner; no eigenvalue exceeds the norm of all.
            if !(value > 0.0 && value <= 1.0) {
                return Err(ParamError::Eigenvalue { name, value });
            }
        }
        if !(0.0..=1.0).contains(&self.salience) {
            return Err(ParamError::Salience(self.salience));
        }
        Ok(())
    }
}

/// Supporting walk: cosine of the widest angle (15 degrees) between the directions of neighbouring vertices of a line:
/// (sqrt 6 + sqrt 2) / 4.
pub const SUPPORT_TURN_COS: f64 = 0.965_925_826_289_068_3;
/// Supporting walk: standard deviation of the weight of a supporter by its distance, in h. In h and not in sigma, because a
/// walk has at most five steps of about one h whatever sigma is.
pub const SUPPORT_WIDTH: f64 = 1.5;

/// Enhancement: only a line that has more supporters than this is enhanced, so that specks of noise are not.
pub const ENHANCE_SUPPORTERS: usize = 3;
/// Enhancement: only where Omega (0 to 1 over the mesh) is below this, at the vertex and on average over its supporters.
pub const ENHANCE_BELOW: f64 = 0.45;
/// Enhancement: the factor on the salience is this times exp(-Omega): 5 for the faintest, 3.2 at the limit.
pub const ENHANCE_FACTOR: f64 = 5.0;

/// Omegas that differ by less than this share of the largest are the same: on a regular shape all edges are alike, and what
/// is left are the digits of the coordinates, 1e-7 of them in single precision. To stretch that to 0 to 1 would be to make
/// features of rounding.
pub const OMEGA_RANGE: f64 = 1e-3;
