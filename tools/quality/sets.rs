//! What is measured on: sets of cases, and the seeds they are made with. In: names of sets; out: cases.

use super::case::{Case, Recipe};
use super::generator::noise::NoiseKind;
use super::generator::style::Style;
use super::pairs::PAIRS;
use anyhow::{Context, Result, bail};
use clap::ValueEnum;

/// Seeds to look at while the method is changed.
pub const TUNING_SEEDS: [u64; 3] = [1, 2, 3];
/// Seeds whose results are reported. Nothing may be chosen by looking at them, or they say nothing any more.
pub const REPORT_SEEDS: [u64; 3] = [101, 102, 103];

/// Noise that every set is measured at unless told otherwise, in mean edge lengths.
const AMOUNTS: [f64; 5] = [0.0, 0.1, 0.2, 0.3, 0.5];

/// A set of cases that are averaged together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Set {
    /// Solids, a city and folded sheets, with features far apart, and a torus without any.
    Reference,
    /// Features 2 to 5 edges apart.
    Dense,
    /// Creases that are weak, fade, or lie beside curved faces, and a sphere without any.
    Weak,
    /// Other kinds of noise: isotropic, impulses, scan stripes, rounded heights.
    Noise,
    /// Other triangles: stretched, graded, as CAD programs write them, finer.
    Variants,
    /// Real meshes, clean and noisy; `CREASE_DATA` names their folder.
    Pairs,
    /// All of them.
    All,
}

/// Shapes of the reference set: those of `tools/reference/shapes.py`.
const REFERENCE: [&str; 11] = [
    "box", "hexprism", "bracket", "cylinder", "rounded", "cone", "city", "sheet20", "sheet10", "sheet5",
    "torus",
];

/// Shapes of the dense set.
const DENSE: [&str; 9] =
    ["stairs2", "stairs3", "stairs5", "gear", "boxgrid2", "boxgrid3", "boxgrid5", "wall2", "wall3"];

/// Shapes of the weak set.
const WEAK: [&str; 8] = ["terrain", "fading", "loft", "boss", "sphere", "folds20", "folds10", "folds5"];

/// Shapes that are measured with every kind of noise: flat and curved faces, strong and weak folds, nothing at all.
const NOISY: [&str; 5] = ["bracket", "cylinder", "city4", "folds20", "torus"];

/// Kinds of noise other than that of all other sets. Impulses hit one vertex in ten and may be large; rounding and
/// stripes are not averaged out by neighbours and need not be.
const KINDS: [(NoiseKind, [f64; 3]); 4] = [
    (NoiseKind::Isotropic, [0.1, 0.3, 0.5]),
    (NoiseKind::Impulse, [0.3, 0.6, 1.0]),
    (NoiseKind::Stripes, [0.1, 0.2, 0.3]),
    (NoiseKind::Quantised, [0.1, 0.2, 0.3]),
];

/// Shapes that come in every style: flat and curved faces, straight and round edges, strong and weak folds.
const STYLED: [&str; 4] = ["bracket", "cylinder", "city4", "folds20"];

/// Styles of triangles with the amounts of noise they are measured at. Noise is in mean edge lengths: on the slivers
/// of a CAD file that is no unit for anything, so there is none.
const STYLES: [(Style, &[f64]); 5] = [
    (Style { stretch: 5.0, ..Style::PLAIN }, &[0.0, 0.1, 0.2]),
    (Style { density: 10.0, ..Style::PLAIN }, &[0.0, 0.1, 0.2]),
    (Style { cad: true, ..Style::PLAIN }, &[0.0]),
    (Style { edge: 0.5, ..Style::PLAIN }, &[0.0, 0.1, 0.2]),
    (Style { edge: 0.25, ..Style::PLAIN }, &[0.0, 0.1, 0.2]),
];

impl Set {
    /// The sets that it stands for.
    pub fn members(self) -> Vec<Set> {
        let all = Set::value_variants().iter().copied().filter(|set| *set != Set::All);
        all.filter(|set| self == Set::All || *set == self).collect()
    }

    /// As in results and documents.
    pub fn name(self) -> &'static str {
        match self {
            Set::Reference => "reference",
            Set::Dense => "dense",
            Set::Weak => "weak",
            Set::Noise => "noise",
            Set::Variants => "variants",
            Set::Pairs => "pairs",
            Set::All => "all",
        }
    }

    /// The cases of the set for these seeds. `amounts` replaces the amounts of noise.
    ///
    /// # Errors
    /// If a case cannot be made.
    pub fn cases(self, seeds: &[u64], amounts: Option<&[f64]>) -> Result<Vec<Case>> {
        let usual = amounts.unwrap_or(&AMOUNTS);
        let mut cases = Vec::new();
        for set in self.members() {
            let mut add = |shapes: &[&str], style, kind, amounts: &[f64]| -> Result<()> {
                for shape in shapes {
                    for &amount in amounts {
                        for &seed in seeds {
                            let recipe = Recipe { shape: shape.parse()?, style, kind, amount, seed };
                            cases.push(Case::of_recipe(set.name(), recipe));
                        }
                    }
                }
                Ok(())
            };
            match set {
                Set::Reference => add(&REFERENCE, Style::PLAIN, NoiseKind::Normal, usual)?,
                Set::Dense => add(&DENSE, Style::PLAIN, NoiseKind::Normal, usual)?,
                Set::Weak => add(&WEAK, Style::PLAIN, NoiseKind::Normal, usual)?,
                Set::Noise => {
                    for (kind, own) in KINDS {
                        add(&NOISY, Style::PLAIN, kind, amounts.unwrap_or(&own))?;
                    }
                }
                Set::Variants => {
                    for (style, own) in STYLES {
                        add(&STYLED, style, NoiseKind::Normal, amounts.unwrap_or(own))?;
                    }
                }
                Set::Pairs => {
                    for pair in PAIRS {
                        cases.extend([false, true].map(|noisy| Case::of_pair(set.name(), pair, noisy)));
                    }
                }
                Set::All => {}
            }
        }
        Ok(cases)
    }
}

/// Seeds by the name of their purpose, or as numbers.
///
/// # Errors
/// If it is neither.
pub fn parse_seeds(text: &str) -> Result<Vec<u64>> {
    match text {
        "tuning" => Ok(TUNING_SEEDS.to_vec()),
        "report" => Ok(REPORT_SEEDS.to_vec()),
        _ => text
            .split(',')
            .map(|seed| seed.trim().parse().with_context(|| format!("{seed} is no seed")))
            .collect(),
    }
}

/// Amounts of noise, separated by commas.
///
/// # Errors
/// If one is not a number of 0 or more.
pub fn parse_amounts(text: &str) -> Result<Vec<f64>> {
    let amount = |word: &str| match word.trim().parse::<f64>() {
        Ok(amount) if amount >= 0.0 && amount.is_finite() => Ok(amount),
        _ => bail!("{word} is no amount of noise"),
    };
    text.split(',').map(amount).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn what_is_reported_is_not_what_is_tuned_on() {
        assert!(TUNING_SEEDS.iter().all(|seed| !REPORT_SEEDS.contains(seed)));
        assert_eq!(parse_seeds("report").unwrap(), REPORT_SEEDS);
        assert_eq!(parse_seeds("7, 8").unwrap(), [7, 8]);
        assert!(
            parse_seeds("some").is_err() && parse_amounts("-1").is_err() && parse_amounts("nan").is_err()
        );
    }

    #[test]
    fn cases_have_names_of_their_own() {
        let cases = Set::All.cases(&REPORT_SEEDS, None).unwrap();
        let stems: BTreeSet<String> = cases.iter().map(Case::stem).collect();
        assert_eq!(stems.len(), cases.len());
        for set in Set::All.members() {
            assert!(cases.iter().any(|case| case.set == set.name()), "{set:?} is empty");
        }
    }
}
