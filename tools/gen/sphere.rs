//! A sphere: curved everywhere and no feature.
//!
//! Two hemispheres, each in its stereographic chart. It keeps angles; lengths differ by a factor of two at most.

use super::builder::Builder;
use super::patch::{Patch, Pin};
use super::random::Random;
use super::revolve::{OnCircle, jittered_circle};
use super::shape::Shape;
use super::style::Sizing;
use anyhow::Result;
use glam::{DVec2, DVec3};
use std::f64::consts::FRAC_PI_2;

/// Radius.
const RADIUS: f64 = 20.0;

/// The sphere.
pub fn sphere(sizing: Sizing, seed: u64) -> Result<Shape> {
    let mut random = Random::new(seed, "sphere");
    let equator = jittered_circle(DVec2::ZERO, RADIUS, 0.0, &sizing, &mut random);
    let mut builder = Builder::new(sizing);
    for north in [true, false] {
        let lift = |uv| on_sphere(uv, north);
        let pin = |point: &OnCircle| Pin { uv: in_chart(point.at, north), at: point.at };
        let ring = equator[1..].iter().map(pin).collect();
        if sizing.is_cad() {
            let lines = parallels(&equator, &sizing).iter().map(|line| pins(line, north)).collect();
            builder.developed(&Patch { rings: vec![ring], lines }, lift)?;
        } else {
            builder.conformal(&Patch { rings: vec![ring], lines: Vec::new() }, lift)?;
        }
    }
    Ok(builder.finish())
}

/// The chart of a hemisphere, seen from outside: from below, x and y change places.
fn in_chart(at: DVec3, north: bool) -> DVec2 {
    let flat = at.truncate() * (RADIUS / (RADIUS + at.z.abs()));
    if north { flat } else { DVec2::new(flat.y, flat.x) }
}

fn on_sphere(uv: DVec2, north: bool) -> DVec3 {
    let part = uv.length_squared() / (RADIUS * RADIUS);
    let flat = uv * (2.0 / (1.0 + part));
    let height = RADIUS * (1.0 - part) / (1.0 + part);
    if north { flat.extend(height) } else { DVec3::new(flat.y, flat.x, -height) }
}

/// Circles of latitude on the northern hemisphere, with the points of the equator, and the pole.
fn parallels(equator: &[OnCircle], sizing: &Sizing) -> Vec<Vec<DVec3>> {
    let latitudes = sizing.arc_places(|_| DVec3::ZERO, FRAC_PI_2, FRAC_PI_2);
    let mut lines: Vec<Vec<DVec3>> = latitudes[1..latitudes.len() - 1]
        .iter()
        .map(|&latitude| {
            let (sine, cosine) = libm::sincos(latitude);
            let raise = |point: &OnCircle| (point.at * cosine).with_z(RADIUS * sine);
            equator.iter().map(raise).collect()
        })
        .collect();
    lines.push(vec![DVec3::Z * RADIUS]);
    lines
}

fn pins(line: &[DVec3], north: bool) -> Vec<Pin> {
    let side = if north { DVec3::ONE } else { DVec3::new(1.0, 1.0, -1.0) };
    line.iter().map(|&at| Pin { uv: in_chart(at, north), at: at * side }).collect()
}
