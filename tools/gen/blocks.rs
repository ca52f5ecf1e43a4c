//! Blocks on a plate. In: their sizes; out: a closed solid with sharp edges only.

use super::builder::Builder;
use super::extrude::{at_height, closed, top_plane, walls};
use super::outline::Outline;
use super::patch::Plane;
use super::random::Random;
use super::shape::Shape;
use super::style::Sizing;
use anyhow::Result;
use glam::{DVec2, DVec3};

/// A rectangle along the axes.
#[derive(Clone, Copy)]
struct Rectangle {
    low: DVec2,
    high: DVec2,
}

impl Rectangle {
    fn outline(self) -> Outline {
        let Self { low, high } = self;
        Outline::polygon(&[low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)])
    }
}

/// Boxes of `4 x 4 x 4`, `gap` apart in rows and columns of five, on a plate.
pub fn boxgrid(gap: f64, sizing: Sizing, seed: u64) -> Result<Shape> {
    const ROWS: u32 = 5;
    const SIDE: f64 = 4.0;
    const MARGIN: f64 = 5.0;
    let place = |i: u32| MARGIN + f64::from(i) * (SIDE + gap);
    let cells = (0..ROWS).flat_map(|row| (0..ROWS).map(move |column| (column, row)));
    let blocks: Vec<Rectangle> = cells
        .map(|(column, row)| DVec2::new(place(column), place(row)))
        .map(|low| Rectangle { low, high: low + SIDE })
        .collect();
    let plate = DVec2::splat(place(ROWS - 1) + SIDE + MARGIN);
    on_plate(plate, [4.0, 8.0], &blocks, sizing, &mut Random::new(seed, "boxgrid"))
}

/// A free-standing wall of the given thickness, 26 long and 16 high, on a plate.
pub fn wall(thickness: f64, sizing: Sizing, seed: u64) -> Result<Shape> {
    let plate = DVec2::new(40.0, 34.0);
    let half = DVec2::new(13.0, 0.5 * thickness);
    let wall = Rectangle { low: 0.5 * plate - half, high: 0.5 * plate + half };
    on_plate(plate, [6.0, 22.0], &[wall], sizing, &mut Random::new(seed, "wall"))
}

/// The solid: a plate with a corner at the origin, and blocks from its top up to the second height.
fn on_plate(
    size: DVec2,
    [top, roof]: [f64; 2],
    blocks: &[Rectangle],
    sizing: Sizing,
    random: &mut Random,
) -> Result<Shape> {
    let mut builder = Builder::new(sizing);
    let plate = Rectangle { low: DVec2::ZERO, high: size };
    let foot = walls(&mut builder, &plate.outline(), 0.0, top, &sizing, random)?;
    let mut ground = vec![at_height(&foot, top)];
    for block in blocks {
        let ring = walls(&mut builder, &block.outline(), top, roof, &sizing, random)?;
        let upper = at_height(&ring, roof);
        builder.line(closed(&upper));
        builder.flat(top_plane(roof), &[upper])?;
        ground.push(ring);
    }
    builder.flat(top_plane(top), &ground)?;
    for ring in ground.iter().chain([&foot]) {
        builder.line(closed(ring));
    }
    builder.flat(Plane { origin: DVec3::ZERO, u: DVec3::Y, v: DVec3::X }, &[foot])?;
    Ok(builder.finish())
}
