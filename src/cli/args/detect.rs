//! What `detect` takes.

use super::input::{BadFacesArgs, InputArgs};
use super::method::MethodArgs;
use super::output::{GeometryArg, OutputArgs};
use super::preset::{Preset, PresetArgs, PresetValues};
use super::report::ReportArgs;
use super::show::{ProgressKind, ShowArgs};
use super::sigma::SigmaArgs;
use super::values::{angle, length};
use super::work::WorkArgs;
use super::{HOW, OUTPUT, WHAT};
use crate::config::Params;
use crate::stitch::Geometry;
use clap::Args;

/// Arguments of `detect`.
#[derive(Debug, Args)]
pub(in crate::cli) struct DetectArgs {
    #[command(flatten)]
    pub input: InputArgs,

    #[command(flatten)]
    pub preset: PresetArgs,

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
        let (default, preset) = (Params::default(), self.preset.preset.values());
        Params {
            method: self.method.method(),
            sigma: preset.sigma(self.sigma.given()),
            min_angle_deg: self.min_angle.or(preset.min_angle_deg).unwrap_or(default.min_angle_deg),
            min_length_sigmas: self
                .min_length
                .or(preset.min_length_sigmas)
                .unwrap_or(default.min_length_sigmas),
            boundaries: self.boundaries || preset.boundaries,
        }
    }

    /// Where lines run.
    pub fn geometry(&self) -> Geometry {
        let geometry = self.output.geometry.or(self.preset.preset.values().geometry);
        geometry.unwrap_or(GeometryArg::Vertices).into()
    }

    /// The preset and what it set, if it is not the default: `cad: --sigma-edges 2`. What was given besides is left out.
    pub fn preset_line(&self) -> Option<String> {
        let preset = self.preset.preset;
        let given = PresetValues {
            sigma_edges: None,
            min_angle_deg: self.min_angle,
            min_length_sigmas: self.min_length,
            boundaries: self.boundaries,
            geometry: self.output.geometry,
        };
        let set = preset.values().without(&given, self.sigma.given().is_some()).words();
        match (preset, set.is_empty()) {
            (Preset::Scan, _) => None,
            (_, true) => Some(format!("{}: nothing, all of it was given", preset.name())),
            (_, false) => Some(format!("{}: {set}", preset.name())),
        }
    }
}
