//! The voting scale.

use super::WHAT;
use super::values::{edges, sigma};
use crate::config::Sigma;
use clap::Args;

/// The voting scale.
#[derive(Debug, Args)]
pub(in crate::cli) struct SigmaArgs {
    /// Radius over which the surface is averaged, in the units of the mesh (metres, if the mesh is in metres). Larger
    /// suppresses more noise; features closer together than this merge. With `--method paper` it is the edge of the cube
    /// around a vertex whose faces vote, and may be 0: then only the faces at the vertex do.
    #[arg(long, value_name = "LENGTH", help_heading = WHAT, conflicts_with = "sigma_edges",
          value_parser = sigma, allow_negative_numbers = true)]
    sigma: Option<f64>,

    /// The same in median edge lengths of the mesh, from 1 to 30. Default: 3, or that of the preset.
    #[arg(long, value_name = "K", help_heading = WHAT, value_parser = edges, allow_negative_numbers = true)]
    sigma_edges: Option<f64>,
}

impl SigmaArgs {
    /// The scale that was asked for, if one was.
    pub fn given(&self) -> Option<Sigma> {
        self.sigma.map(Sigma::Length).or(self.sigma_edges.map(Sigma::Edges))
    }

    /// Whether a scale of 0 was asked for.
    pub fn is_zero(&self) -> bool {
        self.given().is_some_and(Sigma::is_zero)
    }
}
