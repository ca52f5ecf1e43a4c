//! A machined part: a plate with a filleted boss and a hole. In: seed and style; out: a closed solid on which sharp
//! edges, fillets, cylinders and flat faces meet.

use super::builder::Builder;
use super::extrude::{at_height, closed, top_plane, walls};
use super::outline::Outline;
use super::patch::Plane;
use super::random::Random;
use super::revolve::{Revolved, circle, ring_of};
use super::shape::Shape;
use super::style::Sizing;
use anyhow::Result;
use glam::{DVec2, DVec3};
use std::f64::consts::FRAC_PI_2;

/// Width and depth of the plate.
const PLATE: DVec2 = DVec2::new(44.0, 36.0);
/// Its height.
const THICKNESS: f64 = 8.0;
/// Radius of two of its upright edges; the other two are sharp.
const ROUNDING: f64 = 8.0;
/// Middle of the boss.
const BOSS: DVec2 = DVec2::new(16.0, 18.0);
/// Radius of the boss.
const RADIUS: f64 = 8.0;
/// How much the boss is higher than the plate.
const HEIGHT: f64 = 14.0;
/// Radius of the fillet between plate and boss: it turns by some 11 degrees from one edge to the next, no feature.
const FILLET: f64 = 5.0;

/// The part. Lines are the edges of the plate, of the hole, and of the top of the boss; the fillet has none.
pub fn boss(sizing: Sizing, seed: u64) -> Result<Shape> {
    let mut random = Random::new(seed, "boss");
    let mut builder = Builder::new(sizing);
    let corners = [
        (DVec2::ZERO, 0.0),
        (DVec2::new(PLATE.x, 0.0), ROUNDING),
        (PLATE, ROUNDING),
        (DVec2::new(0.0, PLATE.y), 0.0),
    ];
    let outlines = [Outline::rounded(&corners), Outline::hole(DVec2::new(35.0, 18.0), 4.0)];
    let mut bases = Vec::new();
    for outline in &outlines {
        bases.push(walls(&mut builder, outline, 0.0, THICKNESS, &sizing, &mut random)?);
    }
    builder.flat(Plane { origin: DVec3::ZERO, u: DVec3::Y, v: DVec3::X }, &bases)?;
    let mut tops: Vec<Vec<DVec3>> = bases.iter().map(|base| at_height(base, THICKNESS)).collect();
    for ring in bases.iter().chain(&tops) {
        builder.line(closed(ring));
    }

    let foot = circle(BOSS, RADIUS + FILLET, THICKNESS, &sizing);
    let top = circle(BOSS, RADIUS, THICKNESS + HEIGHT, &sizing);
    let stops: Vec<f64> = sizing
        .arc_places(|_| DVec3::ZERO, FILLET * FRAC_PI_2, FRAC_PI_2)
        .into_iter()
        .map(|along| along / profile_length())
        .collect();
    let side = Revolved::new(BOSS, profile);
    side.build(&mut builder, [&foot, &top], &stops[1..], &sizing, &mut random)?;
    tops.push(ring_of(&foot));
    builder.flat(top_plane(THICKNESS), &tops)?;
    let rim = ring_of(&top);
    builder.line(closed(&rim));
    builder.flat(top_plane(THICKNESS + HEIGHT), &[rim])?;
    Ok(builder.finish())
}

/// From the foot of the fillet to the top of the boss.
fn profile_length() -> f64 {
    FILLET * FRAC_PI_2 + HEIGHT - FILLET
}

/// Radius and height of the boss: a quarter of a circle, then straight up.
fn profile(part: f64) -> DVec2 {
    let along = part * profile_length();
    let arc = FILLET * FRAC_PI_2;
    if along >= arc {
        return DVec2::new(RADIUS, THICKNESS + FILLET + (along - arc));
    }
    let (sine, cosine) = libm::sincos(along / FILLET);
    DVec2::new(RADIUS + FILLET * (1.0 - sine), THICKNESS + FILLET * (1.0 - cosine))
}
