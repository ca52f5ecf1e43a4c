//! A sheet folded to and fro by the same angle. In: the angle and the size; out: an open sheet with four folds.

use super::border::ring;
use super::builder::Builder;
use super::patch::{Patch, Pin};
use super::random::Random;
use super::shape::Shape;
use super::style::Sizing;
use anyhow::Result;
use glam::{DVec2, DVec3};

/// Number of folds; there is one strip more.
const FOLDS: usize = 4;
/// Size of a folded sheet.
#[derive(Clone, Copy)]
pub struct Size {
    /// Width of a strip between folds.
    pub width: f64,
    /// Length of the folds.
    pub length: f64,
}

/// A small sheet.
pub const SMALL: Size = Size { width: 16.0, length: 24.0 };
/// The sheet of the reference.
pub const LARGE: Size = Size { width: 18.0, length: 60.0 };

/// The normals on the two sides of each fold differ by `angle_deg`; folds alternate between ridge and valley.
pub fn folds(angle_deg: f64, size: Size, sizing: Sizing, seed: u64) -> Result<Shape> {
    let Size { width, length } = size;
    let mut random = Random::new(seed, "folds");
    let sheet = Sheet::new(angle_deg, width, sizing.squeeze().y);
    // Borders and folds are cut in the flat sheet, then each point goes to its place in space.
    let flat = |x: usize, y: f64| DVec3::new(x as f64 * width, y, 0.0);
    let mut front = Vec::new();
    let mut back = Vec::new();
    for strip in 0..=FOLDS {
        front.push(sizing.cut(flat(strip, 0.0), flat(strip + 1, 0.0), &mut random));
        back.push(sizing.cut(flat(FOLDS + 1 - strip, length), flat(FOLDS - strip, length), &mut random));
    }
    let right = sizing.cut(flat(FOLDS + 1, 0.0), flat(FOLDS + 1, length), &mut random);
    let left = sizing.cut(flat(0, length), flat(0, 0.0), &mut random);
    let parts: Vec<&[DVec3]> =
        front.iter().chain([&right]).chain(&back).chain([&left]).map(Vec::as_slice).collect();
    let border = ring(&parts);
    let creases: Vec<Vec<DVec3>> =
        (1..=FOLDS).map(|i| sizing.cut(flat(i, 0.0), flat(i, length), &mut random)).collect();

    let mut builder = Builder::new(sizing);
    let patch = Patch {
        rings: vec![sheet.pins(&border)],
        lines: creases.iter().map(|line| sheet.pins(line)).collect(),
    };
    builder.developed(&patch, |uv| sheet.lift(uv))?;
    for crease in &patch.lines {
        builder.line(crease.iter().map(|pin| pin.at).collect());
    }
    Ok(builder.finish())
}

/// Where the strips lie.
struct Sheet {
    /// Where each strip starts, at `y = 0`.
    starts: Vec<DVec3>,
    /// The unit vector across each strip.
    across: Vec<DVec3>,
    /// Width of a strip.
    width: f64,
    /// Length in the chart over length along the folds.
    squeeze: f64,
}

impl Sheet {
    fn new(angle_deg: f64, width: f64, squeeze: f64) -> Self {
        let (sine, cosine) = libm::sincos((angle_deg / 2.0).to_radians());
        let mut sheet = Self { starts: Vec::new(), across: Vec::new(), width, squeeze };
        let mut start = DVec3::ZERO;
        for strip in 0..=FOLDS {
            let up = if strip % 2 == 1 { sine } else { -sine };
            let across = DVec3::new(cosine, 0.0, up);
            sheet.starts.push(start);
            sheet.across.push(across);
            start += across * width;
        }
        sheet
    }

    fn lift(&self, uv: DVec2) -> DVec3 {
        let strip = ((uv.x / self.width).max(0.0) as usize).min(FOLDS);
        let rest = uv.x - strip as f64 * self.width;
        self.starts[strip] + self.across[strip] * rest + DVec3::Y * (uv.y / self.squeeze)
    }

    fn pins(&self, points: &[DVec3]) -> Vec<Pin> {
        let pin = |point: &DVec3| {
            let uv = DVec2::new(point.x, point.y * self.squeeze);
            Pin { uv, at: self.lift(uv) }
        };
        points.iter().map(pin).collect()
    }
}
