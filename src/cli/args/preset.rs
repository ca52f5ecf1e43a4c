//! Presets: sets of values for the kinds of meshes that people have.
//!
//! In: a word. Out: what it stands for, in terms of the options that a user could have given instead; an option that is given
//! wins. The reasons, with the measurements behind them, are in docs/GUIDE.md.

use super::WHAT;
use super::output::GeometryArg;
use crate::config::{Params, Sigma};
use clap::{Args, ValueEnum};

/// The choice of a preset.
#[derive(Debug, Args)]
pub(in crate::cli) struct PresetArgs {
    /// What kind of mesh it is, as a set of values for other options, which win if they are given. `scan`, the default, changes
    /// nothing. `cad`, for clean models and thin features: `--sigma-edges 2 --boundaries --geometry fitted`. `terrain`, for
    /// ground from laser scanning or photogrammetry: `--sigma-edges 2.5 --min-length 6 --geometry
    /// fitted`.
    #[arg(long, value_enum, value_name = "KIND", help_heading = WHAT, default_value = "scan",
          hide_default_value = true, hide_possible_values = true)]
    pub preset: Preset,
}

/// Kinds of meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum Preset {
    Scan,
    Cad,
    Terrain,
}

/// What a preset stands for; `None` is the default of the option.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::cli) struct PresetValues {
    pub sigma_edges: Option<f64>,
    pub min_angle_deg: Option<f64>,
    pub min_length_sigmas: Option<f64>,
    pub boundaries: bool,
    pub geometry: Option<GeometryArg>,
}

impl Preset {
    /// The word of the command line.
    pub fn name(self) -> &'static str {
        match self {
            Preset::Scan => "scan",
            Preset::Cad => "cad",
            Preset::Terrain => "terrain",
        }
    }

    /// What it stands for.
    pub fn values(self) -> PresetValues {
        let none = PresetValues::default();
        match self {
            Preset::Scan => none,
            // Without noise there is nothing to average: a smaller scale puts no corner where there is none and tells thin walls
            // apart. The rim of a sheet is a line of its drawing.
            Preset::Cad => PresetValues {
                sigma_edges: Some(2.0),
                boundaries: true,
                geometry: Some(GeometryArg::Fitted),
                ..none
            },
            // Breaklines are low: a larger sigma loses embankments before it loses false lines, a smaller one follows them to
            // where they fade. It finds more that is short, in vegetation above all, and breaklines are long.
            Preset::Terrain => PresetValues {
                sigma_edges: Some(2.5),
                min_length_sigmas: Some(6.0),
                geometry: Some(GeometryArg::Fitted),
                ..none
            },
        }
    }
}

impl PresetValues {
    /// The scale, unless one is `given`.
    pub fn sigma(&self, given: Option<Sigma>) -> Sigma {
        given.or(self.sigma_edges.map(Sigma::Edges)).unwrap_or(Params::default().sigma)
    }

    /// What was set, as options.
    pub fn words(&self) -> String {
        let mut words = Vec::new();
        let mut number = |option: &str, value: Option<f64>| {
            words.extend(value.map(|value| format!("{option} {value}")));
        };
        number("--sigma-edges", self.sigma_edges);
        number("--min-angle", self.min_angle_deg);
        number("--min-length", self.min_length_sigmas);
        words.extend(self.boundaries.then(|| "--boundaries".to_owned()));
        words.extend(self.geometry.map(|geometry| format!("--geometry {}", geometry.name())));
        words.join(" ")
    }

    /// Without what was given otherwise.
    pub fn without(self, given: &PresetValues, sigma: bool) -> PresetValues {
        PresetValues {
            sigma_edges: self.sigma_edges.filter(|_| !sigma),
            min_angle_deg: self.min_angle_deg.filter(|_| given.min_angle_deg.is_none()),
            min_length_sigmas: self.min_length_sigmas.filter(|_| given.min_length_sigmas.is_none()),
            boundaries: self.boundaries && !given.boundaries,
            geometry: self.geometry.filter(|_| given.geometry.is_none()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_told_as_options() {
        assert_eq!(Preset::Scan.values().words(), "");
        assert_eq!(Preset::Cad.values().words(), "--sigma-edges 2 --boundaries --geometry fitted");
        let given = PresetValues { geometry: Some(GeometryArg::Vertices), ..PresetValues::default() };
        assert_eq!(Preset::Cad.values().without(&given, true).words(), "--boundaries");
    }
}
