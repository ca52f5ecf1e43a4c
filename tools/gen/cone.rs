//! A cone. In: nothing but seed and style; out: a closed solid whose only line is the circle of its base.
//!
//! The side is unrolled into a sector of a disc about the tip, cut open at angle 0.

use super::builder::Builder;
use super::extrude::closed;
use super::patch::{Patch, Pin, Plane};
use super::random::Random;
use super::revolve::{circle, ring_of};
use super::shape::Shape;
use super::style::Sizing;
use anyhow::Result;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// Radius of the base.
const RADIUS: f64 = 22.0;
/// Height of the tip. The normals of side and base are 130.2 degrees apart.
const HEIGHT: f64 = 26.0;

/// The cone. Its tip is neither a line nor the corner of one.
pub fn cone(sizing: Sizing, seed: u64) -> Result<Shape> {
    let mut random = Random::new(seed, "cone");
    let slant = (RADIUS * RADIUS + HEIGHT * HEIGHT).sqrt();
    let shrink = RADIUS / slant;
    let base = circle(DVec2::ZERO, RADIUS, 0.0, &sizing);
    let seam = sizing.cut(base[0].at, DVec3::Z * HEIGHT, &mut random);

    let in_sector = |angle: f64, from_tip: f64| {
        let (sine, cosine) = libm::sincos(angle * shrink);
        DVec2::new(cosine, sine) * from_tip
    };
    let from_tip = |point: &DVec3| point.distance(DVec3::Z * HEIGHT);
    let along_seam = |angle: f64| {
        let inner = &seam[1..seam.len() - 1];
        inner.iter().map(move |at| Pin { uv: in_sector(angle, from_tip(at)), at: *at })
    };
    let mut border: Vec<Pin> =
        base.iter().map(|point| Pin { uv: in_sector(point.angle, slant), at: point.at }).collect();
    border.extend(along_seam(TAU));
    border.push(Pin { uv: DVec2::ZERO, at: DVec3::Z * HEIGHT });
    border.extend(along_seam(0.0).collect::<Vec<_>>().into_iter().rev());
    let lift = |uv: DVec2| {
        let angle = libm::atan2(uv.y, uv.x);
        let angle = if angle < 0.0 { angle + TAU } else { angle } / shrink;
        let (sine, cosine) = libm::sincos(angle);
        let part = uv.length() / slant;
        DVec3::new(cosine * RADIUS * part, sine * RADIUS * part, HEIGHT * (1.0 - part))
    };

    let mut builder = Builder::new(sizing);
    builder.developed(&Patch { rings: vec![border], lines: Vec::new() }, lift)?;
    let ring = ring_of(&base);
    builder.line(closed(&ring));
    builder.flat(Plane { origin: DVec3::ZERO, u: DVec3::Y, v: DVec3::X }, &[ring])?;
    Ok(builder.finish())
}
