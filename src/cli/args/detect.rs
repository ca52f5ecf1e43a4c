//! What `detect` takes.

use super::input::{BadFacesArgs, InputArgs};
use super::method::MethodArgs;
use super::output::OutputArgs;
use super::report::ReportArgs;
use super::show::{ProgressKind, ShowArgs};
use super::sigma::SigmaArgs;
use super::values::{angle, length};
use super::work::WorkArgs;
use super::{HOW, OUTPUT, WHAT};
use crate::config::Params;
use clap::Args;

/// Arguments of `detect`.
#[derive(Debug, Args)]
pub(in crate::cli) struct DetectArgs {
    #[command(flatten)]
    pub input: InputArgs,

    #[command(flatten)]
    pub method: MethodArgs,

    #[command(flatten)]
    pub sigma: SigmaArgs,

    /// The weakest crease to report, as the mean angle of a line in degrees: 0 is flat, 90 is the edge of a box, 180 is
    /// folded back. Default: 0, which leaves the decision to the noise and the curvature around each place. With
    /// `--method robust` only.
    #[arg(long, value_name = "DEG", help_heading = WHAT, value_parser = angle, allow_negative_numbers = true)]
    pub min_angle: Option<f64>,

    /// The shortest line to report, in sigmas: connected lines that are shorter together are dropped. Default: 2.67.
    #[arg(long, value_name = "SIGMAS", help_heading = WHAT, value_parser = length, allow_negative_numbers = true)]
    pub min_length: Option<f64>,

    /// Report the open borders of the mesh and its non-manifold edges too, each as a class of its own.
    #[arg(long, help_heading = WHAT)]
    pub boundaries: bool,

    #[command(flatten)]
    pub bad: BadFacesArgs,

    #[command(flatten)]
    pub work: WorkArgs,

    #[command(flatten)]
    pub output: OutputArgs,

    #[command(flatten)]
    pub report: ReportArgs,

    /// Leave the workspace when the outputs are there: with --force, or other names, the same command writes them again without
    /// doing the work again.
    #[arg(long, help_heading = HOW)]
    pub keep_workspace: bool,

    /// Say nothing unless something goes wrong: no progress, no summary.
    #[arg(short, long, help_heading = OUTPUT, conflicts_with = "verbose")]
    pub quiet: bool,

    #[command(flatten)]
    pub show: ShowArgs,
}

impl DetectArgs {
    /// How progress is shown.
    pub fn progress(&self) -> ProgressKind {
        if self.quiet { ProgressKind::None } else { self.show.progress }
    }

    /// What changes the result.
    pub fn params(&self) -> Params {
        let default = Params::default();
        Params {
            method: self.method.method(),
            sigma: self.sigma.sigma(),
            min_angle_deg: self.min_angle.unwrap_or(default.min_angle_deg),
            min_length_sigmas: self.min_length.unwrap_or(default.min_length_sigmas),
            boundaries: self.boundaries,
        }
    }
}
