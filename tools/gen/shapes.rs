//! The register of shapes. In: a name such as `city`, `city25`, `bracket`, `folds20`; out: the shape for a seed.
//!
//! A new shape needs a variant of [`ShapeName`], its word in `FromStr` and `Display`, and its arm in `build`.

use super::builder::Builder;
use super::extrude::{Outline, extrude};
use super::random::Random;
use super::shape::Shape;
use anyhow::{Context, Result, bail, ensure};
use glam::DVec2;
use std::fmt;
use std::str::FromStr;

/// What can be generated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShapeName {
    /// Houses on rolling ground: `city` for 9, `city4` for 4.
    City {
        /// How many.
        houses: u32,
    },
    /// An angle bracket with a hole through one leg: `bracket`.
    Bracket,
    /// A sheet with four folds: `folds20` for folds of 20 degrees.
    Folds {
        /// Between the normals on both sides of each fold.
        angle_deg: f64,
    },
}

impl ShapeName {
    /// How names are written, for help texts.
    pub const FORMS: &'static str = "city[HOUSES], bracket, folds[DEGREES]";

    /// Makes the shape, without noise.
    ///
    /// # Errors
    /// If its parameters make borders cross.
    pub fn build(self, seed: u64) -> Result<Shape> {
        match self {
            Self::City { houses } => super::city::city(houses, seed),
            Self::Bracket => bracket(seed),
            Self::Folds { angle_deg } => super::folds::folds(angle_deg, seed),
        }
        .with_context(|| format!("cannot make {self} with seed {seed}"))
    }
}

impl FromStr for ShapeName {
    type Err = anyhow::Error;

    fn from_str(name: &str) -> Result<Self> {
        let number_at = name.find(|c: char| c.is_ascii_digit()).unwrap_or(name.len());
        let (word, number) = name.split_at(number_at);
        match word {
            "city" => {
                let houses = if number.is_empty() { 9 } else { number.parse()? };
                ensure!((1..=10_000).contains(&houses), "a city has 1 to 10000 houses");
                Ok(Self::City { houses })
            }
            "bracket" if number.is_empty() => Ok(Self::Bracket),
            "folds" => {
                let angle_deg = if number.is_empty() { 20.0 } else { number.parse()? };
                ensure!(angle_deg > 0.0 && angle_deg <= 120.0, "folds have 0 to 120 degrees");
                Ok(Self::Folds { angle_deg })
            }
            _ => bail!("no shape of this name; there are {}", Self::FORMS),
        }
    }
}

impl fmt::Display for ShapeName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::City { houses } => write!(f, "city{houses}"),
            Self::Bracket => write!(f, "bracket"),
            Self::Folds { angle_deg } => write!(f, "folds{angle_deg}"),
        }
    }
}

/// An angle bracket: two legs, and a round hole through one of them.
fn bracket(seed: u64) -> Result<Shape> {
    const LEG: f64 = 32.0;
    const THICKNESS: f64 = 12.0;
    const HEIGHT: f64 = 10.0;
    let corners =
        [(0.0, 0.0), (LEG, 0.0), (LEG, THICKNESS), (THICKNESS, THICKNESS), (THICKNESS, LEG), (0.0, LEG)];
    let outer = Outline::Polygon(corners.map(DVec2::from).to_vec());
    let hole = Outline::Hole { center: DVec2::new(24.0, THICKNESS / 2.0), radius: 3.5 };
    let mut builder = Builder::default();
    extrude(&mut builder, &[outer, hole], HEIGHT, &mut Random::new(seed, "bracket"))?;
    Ok(builder.finish())
}
