//! The choice of the method, and which options belong to which.
//!
//! In: words. Out: a [`Method`] with its thresholds, or a usage error that names the option the chosen method has no use for:
//! an option that does nothing is worse than none.

use super::WHAT;
use super::sigma::SigmaArgs;
use super::values::share;
use crate::config::{Method, PaperThresholds};
use clap::error::ErrorKind;
use clap::{Args, ValueEnum};

/// The method and the thresholds of the published one.
#[derive(Debug, Args)]
pub(in crate::cli) struct MethodArgs {
    /// How features are told: `robust` follows the noise and the curvature around each place; `paper` is the published
    /// method of neighbour supporting, with global thresholds, for comparison and for clean CAD models.
    #[arg(long, value_enum, value_name = "METHOD", help_heading = WHAT, default_value = "robust", hide_possible_values = true)]
    pub method: MethodKind,

    /// With `--method paper`: the faintest feature to report, as a share of the largest salience of the mesh, from 0 to 1.
    /// Default: 0.1.
    #[arg(long, value_name = "SHARE", help_heading = WHAT, value_parser = share, allow_negative_numbers = true)]
    salience: Option<f64>,

    /// With `--method paper`: a vertex lies on a sharp edge from this second eigenvalue on (the eigenvalues have a 2-norm of
    /// 1). Default: 0.02, a fold of 16 degrees.
    #[arg(long, value_name = "L2", help_heading = WHAT, value_parser = eigenvalue, allow_negative_numbers = true)]
    edge_l2: Option<f64>,

    /// With `--method paper`: a vertex is a corner from this third eigenvalue on. Default: 0.065.
    #[arg(long, value_name = "L3", help_heading = WHAT, value_parser = eigenvalue, allow_negative_numbers = true)]
    corner_l3: Option<f64>,
}

/// The words of the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum MethodKind {
    Robust,
    Paper,
}

impl MethodArgs {
    /// The method that was asked for.
    pub fn method(&self) -> Method {
        let published = PaperThresholds::default();
        match self.method {
            MethodKind::Robust => Method::Robust,
            MethodKind::Paper => Method::Paper(PaperThresholds {
                corner_l3: self.corner_l3.unwrap_or(published.corner_l3),
                edge_l2: self.edge_l2.unwrap_or(published.edge_l2),
                salience: self.salience.unwrap_or(published.salience),
            }),
        }
    }

    /// Refuses what the chosen method has no use for.
    ///
    /// # Errors
    /// That name the option and the method it belongs to.
    pub fn check(&self, sigma: &SigmaArgs, min_angle: Option<f64>) -> Result<(), clap::Error> {
        let of_paper = [
            ("--salience", self.salience.is_some()),
            ("--edge-l2", self.edge_l2.is_some()),
            ("--corner-l3", self.corner_l3.is_some()),
            ("a sigma of 0", sigma.is_zero()),
        ];
        let of_robust = [("--min-angle", min_angle.is_some())];
        let (stray, owner): (&[(&str, bool)], _) = match self.method {
            MethodKind::Robust => (&of_paper, "paper"),
            MethodKind::Paper => (&of_robust, "robust"),
        };
        match stray.iter().find(|(_, given)| *given) {
            Some((option, _)) => Err(refusal(&format!("{option} needs --method {owner}"))),
            None => Ok(()),
        }
    }
}

/// A usage error.
pub(in crate::cli) fn refusal(message: &str) -> clap::Error {
    clap::Error::raw(ErrorKind::ArgumentConflict, format!("{message}\n"))
}

fn eigenvalue(text: &str) -> Result<f64, String> {
    let x = share(text)?;
    if x > 0.0 { Ok(x) } else { Err("it must be above 0 and at most 1".to_owned()) }
}
