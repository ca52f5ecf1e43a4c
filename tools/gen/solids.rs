//! Solids that are outlines drawn up. In: sizes; out: closed solids, all their edges sharp or round as stated.

use super::builder::Builder;
use super::extrude::extrude;
use super::outline::Outline;
use super::random::Random;
use super::shape::Shape;
use super::style::Sizing;
use anyhow::Result;
use glam::DVec2;
use std::f64::consts::{FRAC_PI_3, TAU};

/// A solid with a name for its stream of random numbers.
struct Solid {
    name: &'static str,
    outlines: Vec<Outline>,
    height: f64,
}

impl Solid {
    fn build(self, sizing: Sizing, seed: u64) -> Result<Shape> {
        let mut builder = Builder::new(sizing);
        let mut random = Random::new(seed, self.name);
        extrude(&mut builder, &self.outlines, self.height, &sizing, &mut random)?;
        Ok(builder.finish())
    }
}

fn points(corners: &[(f64, f64)]) -> Vec<DVec2> {
    corners.iter().copied().map(DVec2::from).collect()
}

/// A point of a circle around the origin.
fn on_circle(radius: f64, angle: f64) -> DVec2 {
    let (sine, cosine) = libm::sincos(angle);
    DVec2::new(cosine, sine) * radius
}

/// Width and depth of the boxes.
const BOX: (f64, f64) = (34.0, 28.0);
/// Their height.
const BOX_HEIGHT: f64 = 24.0;

/// A box: 12 edges of 90 degrees.
pub fn cuboid(sizing: Sizing, seed: u64) -> Result<Shape> {
    let corners = points(&[(0.0, 0.0), (BOX.0, 0.0), BOX, (0.0, BOX.1)]);
    Solid { name: "box", outlines: vec![Outline::polygon(&corners)], height: BOX_HEIGHT }.build(sizing, seed)
}

/// The box with one upright edge rounded: smooth there, with 11 sharp edges, of which two turn round.
pub fn rounded(sizing: Sizing, seed: u64) -> Result<Shape> {
    const RADIUS: f64 = 6.0;
    let radii = [0.0, 0.0, RADIUS, 0.0];
    let corners = points(&[(0.0, 0.0), (BOX.0, 0.0), BOX, (0.0, BOX.1)]);
    let outline = Outline::rounded(&corners.into_iter().zip(radii).collect::<Vec<_>>());
    Solid { name: "rounded", outlines: vec![outline], height: BOX_HEIGHT }.build(sizing, seed)
}

/// A prism over a regular hexagon: upright edges of 60 degrees, the others of 90.
pub fn hexprism(sizing: Sizing, seed: u64) -> Result<Shape> {
    let corners: Vec<DVec2> = (0..6).map(|i| on_circle(20.0, f64::from(i) * FRAC_PI_3)).collect();
    Solid { name: "hexprism", outlines: vec![Outline::polygon(&corners)], height: 26.0 }.build(sizing, seed)
}

/// A cylinder: two circles of 90 degrees.
pub fn cylinder(sizing: Sizing, seed: u64) -> Result<Shape> {
    let outline = Outline::disc(DVec2::ZERO, 14.0);
    Solid { name: "cylinder", outlines: vec![outline], height: 30.0 }.build(sizing, seed)
}

/// An angle bracket: two legs, and a round hole through one of them.
pub fn bracket(sizing: Sizing, seed: u64) -> Result<Shape> {
    const LEG: f64 = 32.0;
    const THICKNESS: f64 = 12.0;
    let corners =
        [(0.0, 0.0), (LEG, 0.0), (LEG, THICKNESS), (THICKNESS, THICKNESS), (THICKNESS, LEG), (0.0, LEG)];
    let outer = Outline::polygon(&points(&corners));
    let hole = Outline::hole(DVec2::new(24.0, THICKNESS / 2.0), 3.5);
    Solid { name: "bracket", outlines: vec![outer, hole], height: 10.0 }.build(sizing, seed)
}

/// A solid stair whose treads and risers are `step` long, closed at its sides, back and bottom.
pub fn stairs(step: f64, sizing: Sizing, seed: u64) -> Result<Shape> {
    const RUN: f64 = 30.0;
    const WIDTH: f64 = 36.0;
    let steps = (RUN / step) as u32;
    let mut corners = vec![DVec2::ZERO, DVec2::new(f64::from(steps) * step, 0.0)];
    for i in (0..steps).rev() {
        let (x, y) = (f64::from(i) * step, f64::from(i + 1) * step);
        corners.extend([DVec2::new(x + step, y), DVec2::new(x, y)]);
    }
    // The last corner is above the first one: the lowest riser leads back to it.
    let mut shape = Solid { name: "stairs", outlines: vec![Outline::polygon(&corners)], height: WIDTH }
        .build(sizing, seed)?;
    shape.turn_up();
    Ok(shape)
}

/// A gear wheel with trapezoidal teeth 4 high and a round bore. Lands and gaps are 3 to 4 wide; all edges are sharp.
pub fn gear(sizing: Sizing, seed: u64) -> Result<Shape> {
    const TEETH: u32 = 14;
    const ROOT: f64 = 16.0;
    const TIP: f64 = 20.0;
    /// Half the width of a tooth at its foot and at its tip, as parts of the pitch.
    const HALF: [f64; 2] = [0.26, 0.17];
    let pitch = TAU / f64::from(TEETH);
    let mut corners = Vec::new();
    for tooth in 0..TEETH {
        let middle = f64::from(tooth) * pitch;
        corners.push(on_circle(ROOT, middle - HALF[0] * pitch));
        corners.push(on_circle(TIP, middle - HALF[1] * pitch));
        corners.push(on_circle(TIP, middle + HALF[1] * pitch));
        corners.push(on_circle(ROOT, middle + HALF[0] * pitch));
    }
    let outlines = vec![Outline::polygon(&corners), Outline::hole(DVec2::ZERO, 6.0)];
    Solid { name: "gear", outlines, height: 14.0 }.build(sizing, seed)
}
