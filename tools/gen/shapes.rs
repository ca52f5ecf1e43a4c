//! The register of shapes. In: a name such as `city`, `city25`, `bracket`, `folds20`; out: the shape for a seed.
//!
//! A new shape needs a variant of [`ShapeName`], its place in `FORMS` and `ALL`, its arms below, and what is known of it
//! in `tests/shapes.rs`.

use super::shape::Shape;
use super::style::{Sizing, Style};
use super::{blocks, boss, city, cone, folds, loft, revolve, solids, sphere, terrain};
use anyhow::{Context, Result, ensure};
use glam::DVec3;
use std::fmt;
use std::str::FromStr;

/// What can be generated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShapeName {
    /// A box: `box`.
    Box,
    /// A prism over a regular hexagon: `hexprism`.
    Hexprism,
    /// An angle bracket with a hole through one leg: `bracket`.
    Bracket,
    /// A cylinder: `cylinder`.
    Cylinder,
    /// A box with one rounded upright edge: `rounded`.
    Rounded,
    /// A cone: `cone`.
    Cone,
    /// Houses on rolling ground: `city` for 9, `city4` for 4.
    City {
        /// How many.
        houses: u32,
    },
    /// A sheet with four folds: `folds20` for folds of 20 degrees.
    Folds {
        /// Between the normals on both sides of each fold.
        angle_deg: f64,
    },
    /// The same, larger: `sheet20`.
    Sheet {
        /// Between the normals on both sides of each fold.
        angle_deg: f64,
    },
    /// A torus, without any feature: `torus`.
    Torus,
    /// A solid stair: `stairs3` for treads and risers of 3 edge lengths.
    Stairs {
        /// Length of treads and risers.
        step: f64,
    },
    /// A gear wheel: `gear`.
    Gear,
    /// A sphere, without any feature: `sphere`.
    Sphere,
    /// Boxes on a plate: `boxgrid2` for boxes 2 edge lengths apart.
    Boxgrid {
        /// From one box to the next.
        gap: f64,
    },
    /// A thin wall on a plate: `wall2` for a thickness of 2 edge lengths.
    Wall {
        /// Of the wall.
        thickness: f64,
    },
    /// A plate with a filleted boss and a hole: `boss`.
    Boss,
    /// A solid from a square to a circle, with edges that fade: `loft`.
    Loft,
    /// Rolling ground with embankment, ditch and scarp: `terrain`.
    Terrain,
    /// A panel with two creases that fade: `fading`.
    Fading,
}

/// A number that may follow a word.
struct Number {
    /// The number if there is none in the name.
    usual: f64,
    /// Smallest and largest.
    range: (f64, f64),
    /// Whether it counts something.
    whole: bool,
    /// For help texts.
    says: &'static str,
}

impl ShapeName {
    /// How names are written, for help texts.
    pub const FORMS: &'static str = "box, hexprism, bracket, cylinder, rounded, cone, city[HOUSES], folds[DEGREES], \
                                     sheet[DEGREES], torus, sphere, stairs[STEP], gear, boxgrid[GAP], wall[THICKNESS], boss, loft, \
                                     terrain, fading";

    /// One of each kind: the ten of the reference and its torus first, with their sizes there.
    pub const ALL: [Self; 28] = [
        Self::Box,
        Self::Hexprism,
        Self::Bracket,
        Self::Cylinder,
        Self::Rounded,
        Self::Cone,
        Self::City { houses: 9 },
        Self::Sheet { angle_deg: 20.0 },
        Self::Sheet { angle_deg: 10.0 },
        Self::Sheet { angle_deg: 5.0 },
        Self::Torus,
        Self::Folds { angle_deg: 20.0 },
        Self::Folds { angle_deg: 10.0 },
        Self::Folds { angle_deg: 5.0 },
        Self::Stairs { step: 2.0 },
        Self::Stairs { step: 3.0 },
        Self::Stairs { step: 5.0 },
        Self::Gear,
        Self::Sphere,
        Self::Boxgrid { gap: 2.0 },
        Self::Boxgrid { gap: 3.0 },
        Self::Boxgrid { gap: 5.0 },
        Self::Wall { thickness: 2.0 },
        Self::Wall { thickness: 3.0 },
        Self::Boss,
        Self::Loft,
        Self::Terrain,
        Self::Fading,
    ];

    /// Makes the shape in the plain style, without noise.
    ///
    /// # Errors
    /// If its parameters make borders cross.
    pub fn build(self, seed: u64) -> Result<Shape> {
        self.build_in(&Style::PLAIN, seed)
    }

    /// Makes the shape in a style, without noise.
    ///
    /// # Errors
    /// If the shape does not come in this style, or its parameters make borders cross.
    pub fn build_in(self, style: &Style, seed: u64) -> Result<Shape> {
        style.check()?;
        let axis = self.straight_axis();
        ensure!(style.stretch == 1.0 || axis.is_some(), "{self} has no straight direction to stretch along");
        ensure!(
            !style.cad || self.has_cad(),
            "{self} has neither flat faces nor arcs to be tessellated like CAD"
        );
        let context = || format!("cannot make {self} with seed {seed}");
        let even = Sizing::even(style, axis.unwrap_or(DVec3::ZERO));
        if style.density == 1.0 {
            return self.make(even, seed).with_context(context);
        }
        // Where the mesh is fine depends on the bounds, which an even mesh of the same shape tells.
        let bounds = self.make(even, seed).with_context(context)?.bounds();
        self.make(even.graded(style.density, bounds), seed).with_context(context)
    }

    fn make(self, sizing: Sizing, seed: u64) -> Result<Shape> {
        match self {
            Self::Box => solids::cuboid(sizing, seed),
            Self::Hexprism => solids::hexprism(sizing, seed),
            Self::Bracket => solids::bracket(sizing, seed),
            Self::Cylinder => solids::cylinder(sizing, seed),
            Self::Rounded => solids::rounded(sizing, seed),
            Self::Cone => cone::cone(sizing, seed),
            Self::City { houses } => city::city(houses, sizing, seed),
            Self::Folds { angle_deg } => folds::folds(angle_deg, folds::SMALL, sizing, seed),
            Self::Sheet { angle_deg } => folds::folds(angle_deg, folds::LARGE, sizing, seed),
            Self::Torus => revolve::torus(sizing, seed),
            Self::Stairs { step } => solids::stairs(step, sizing, seed),
            Self::Gear => solids::gear(sizing, seed),
            Self::Sphere => sphere::sphere(sizing, seed),
            Self::Boxgrid { gap } => blocks::boxgrid(gap, sizing, seed),
            Self::Wall { thickness } => blocks::wall(thickness, sizing, seed),
            Self::Boss => boss::boss(sizing, seed),
            Self::Loft => loft::loft(sizing, seed),
            Self::Terrain => terrain::terrain(sizing, seed),
            Self::Fading => terrain::fading(sizing, seed),
        }
    }

    /// The direction along which triangles can be stretched, if there is one: that of the extrusion, or any for what
    /// is flat. Seen from the charts of the shape, before it is turned upright.
    fn straight_axis(self) -> Option<DVec3> {
        match self {
            Self::Box | Self::Hexprism | Self::Bracket | Self::Cylinder | Self::Rounded => Some(DVec3::Z),
            Self::Stairs { .. } | Self::Gear => Some(DVec3::Z),
            Self::Boxgrid { .. } | Self::Wall { .. } => Some(DVec3::X),
            Self::City { .. } | Self::Folds { .. } | Self::Sheet { .. } | Self::Terrain | Self::Fading => {
                Some(DVec3::Y)
            }
            Self::Cone | Self::Torus | Self::Sphere | Self::Boss | Self::Loft => None,
        }
    }

    /// Whether a CAD program would have made it. Free-form surfaces have nothing that could be left without points.
    fn has_cad(self) -> bool {
        !matches!(self, Self::Loft | Self::Terrain | Self::Fading)
    }

    /// The word, and the number that may follow it with its value here.
    fn parts(self) -> (&'static str, Option<f64>) {
        match self {
            Self::Box => ("box", None),
            Self::Hexprism => ("hexprism", None),
            Self::Bracket => ("bracket", None),
            Self::Cylinder => ("cylinder", None),
            Self::Rounded => ("rounded", None),
            Self::Cone => ("cone", None),
            Self::City { houses } => ("city", Some(f64::from(houses))),
            Self::Folds { angle_deg } => ("folds", Some(angle_deg)),
            Self::Sheet { angle_deg } => ("sheet", Some(angle_deg)),
            Self::Torus => ("torus", None),
            Self::Stairs { step } => ("stairs", Some(step)),
            Self::Gear => ("gear", None),
            Self::Sphere => ("sphere", None),
            Self::Boxgrid { gap } => ("boxgrid", Some(gap)),
            Self::Wall { thickness } => ("wall", Some(thickness)),
            Self::Boss => ("boss", None),
            Self::Loft => ("loft", None),
            Self::Terrain => ("terrain", None),
            Self::Fading => ("fading", None),
        }
    }

    /// What the number says.
    fn number(self) -> Option<Number> {
        match self {
            Self::City { .. } => Some(Number { usual: 9.0, range: (1.0, 1e4), whole: true, says: "houses" }),
            Self::Folds { .. } | Self::Sheet { .. } => {
                Some(Number { usual: 20.0, range: (0.1, 120.0), whole: false, says: "degrees" })
            }
            Self::Stairs { .. } => {
                Some(Number { usual: 3.0, range: (1.0, 15.0), whole: false, says: "edges a step" })
            }
            Self::Boxgrid { .. } => {
                Some(Number { usual: 3.0, range: (1.0, 20.0), whole: false, says: "edges between" })
            }
            Self::Wall { .. } => {
                Some(Number { usual: 2.0, range: (0.5, 20.0), whole: false, says: "edges of thickness" })
            }
            _ => None,
        }
    }

    /// The same shape with another number.
    fn with(self, number: f64) -> Self {
        match self {
            Self::City { .. } => Self::City { houses: number as u32 },
            Self::Folds { .. } => Self::Folds { angle_deg: number },
            Self::Sheet { .. } => Self::Sheet { angle_deg: number },
            Self::Stairs { .. } => Self::Stairs { step: number },
            Self::Boxgrid { .. } => Self::Boxgrid { gap: number },
            Self::Wall { .. } => Self::Wall { thickness: number },
            other => other,
        }
    }
}

impl FromStr for ShapeName {
    type Err = anyhow::Error;

    fn from_str(name: &str) -> Result<Self> {
        let number_at = name.find(|c: char| c.is_ascii_digit()).unwrap_or(name.len());
        let (word, digits) = name.split_at(number_at);
        let known = Self::ALL.into_iter().find(|known| known.parts().0 == word);
        let shape = known.with_context(|| format!("no shape of this name; there are {}", Self::FORMS))?;
        let Some(Number { usual, range: (least, most), whole, says }) = shape.number() else {
            ensure!(digits.is_empty(), "the name {word} stands alone, without a number");
            return Ok(shape);
        };
        let number = if digits.is_empty() { usual } else { digits.parse()? };
        ensure!((least..=most).contains(&number), "{word} has {least} to {most} {says}");
        ensure!(!whole || number == libm::floor(number), "{word} has a whole number of {says}");
        Ok(shape.with(number))
    }
}

impl fmt::Display for ShapeName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.parts() {
            (word, Some(number)) => write!(f, "{word}{number}"),
            (word, None) => write!(f, "{word}"),
        }
    }
}
