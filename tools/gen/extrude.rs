//! Outlines drawn up to solids. In: polygons and circles in the plane and a height; out: a closed solid with caps.

use super::border::{cut, reversed, ring};
use super::builder::{Builder, SPACING};
use super::patch::{Patch, Pin, Plane};
use super::random::Random;
use anyhow::Result;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// One closed outline of the base.
#[derive(Clone, Debug)]
pub enum Outline {
    /// Corners in order: counter-clockwise around material, clockwise around a hole. Every corner is sharp.
    Polygon(Vec<DVec2>),
    /// A round hole through the solid.
    Hole {
        /// Its middle.
        center: DVec2,
        /// Its radius.
        radius: f64,
    },
}

/// Adds the solid over `outlines` from `z = 0` up to `height`, and its sharp edges as true lines.
///
/// # Errors
/// If outlines cross.
pub fn extrude(builder: &mut Builder, outlines: &[Outline], height: f64, random: &mut Random) -> Result<()> {
    let mut bases = Vec::new();
    for outline in outlines {
        bases.push(match outline {
            Outline::Polygon(corners) => polygon_walls(builder, corners, height, random)?,
            Outline::Hole { center, radius } => hole_wall(builder, *center, *radius, height, random)?,
        });
    }
    // The bottom is seen from below, where x and y change places.
    builder.flat(Plane { origin: DVec3::ZERO, u: DVec3::Y, v: DVec3::X }, &bases)?;
    let tops: Vec<Vec<DVec3>> = bases.iter().map(|base| raised(base, height)).collect();
    builder.flat(Plane { origin: DVec3::Z * height, u: DVec3::X, v: DVec3::Y }, &tops)?;
    for points in bases.iter().chain(&tops) {
        let mut closed = points.clone();
        closed.extend(points.first());
        builder.line(closed);
    }
    Ok(())
}

/// The same points at the top.
fn raised(points: &[DVec3], height: f64) -> Vec<DVec3> {
    points.iter().map(|point| point.with_z(height)).collect()
}

/// A flat wall along each side. Returns the ring of the base.
fn polygon_walls(
    builder: &mut Builder,
    corners: &[DVec2],
    height: f64,
    random: &mut Random,
) -> Result<Vec<DVec3>> {
    let mut posts: Vec<Vec<DVec3>> = Vec::new();
    for corner in corners {
        let post = cut(corner.extend(0.0), corner.extend(height), SPACING, random);
        builder.line(post.clone());
        posts.push(post);
    }
    let mut base: Vec<DVec3> = Vec::new();
    for (i, corner) in corners.iter().enumerate() {
        let next = (i + 1) % corners.len();
        let bottom = cut(corner.extend(0.0), corners[next].extend(0.0), SPACING, random);
        let top = reversed(&raised(&bottom, height));
        let wall = ring(&[&bottom, &posts[next], &top, &reversed(&posts[i])]);
        let along = (corners[next] - *corner).normalize();
        builder.flat(Plane { origin: corner.extend(0.0), u: along.extend(0.0), v: DVec3::Z }, &[wall])?;
        base.extend(&bottom[..bottom.len() - 1]);
    }
    Ok(base)
}

/// The wall of a round hole, unrolled and cut open at angle 0. Returns the ring of the base.
fn hole_wall(
    builder: &mut Builder,
    center: DVec2,
    radius: f64,
    height: f64,
    random: &mut Random,
) -> Result<Vec<DVec3>> {
    let round = TAU * radius;
    // Clockwise from above, so that the unrolled wall is seen from inside the hole, which is outside the material.
    let lift = |uv: DVec2| {
        let angle = -uv.x / radius;
        let (sine, cosine) = libm::sincos(angle);
        (center + DVec2::new(cosine, sine) * radius).extend(uv.y)
    };
    let pieces = libm::round(round / SPACING).max(3.0) as usize;
    let places: Vec<f64> = (0..pieces).map(|i| round * i as f64 / pieces as f64).collect();
    let base: Vec<DVec3> = places.iter().map(|&u| lift(DVec2::new(u, 0.0))).collect();
    let seam = cut(base[0], base[0].with_z(height), SPACING, random);

    // The end of the unrolled wall is its start once more: another place in the chart, the same in space.
    let around = || places.iter().copied().zip(base.iter().copied()).chain([(round, base[0])]);
    let pin = |u: f64, at: DVec3| Pin { uv: DVec2::new(u, at.z), at };
    let mut border: Vec<Pin> = around().map(|(u, at)| pin(u, at)).collect();
    border.extend(seam[1..seam.len() - 1].iter().map(|&at| pin(round, at)));
    border.extend(around().map(|(u, at)| pin(u, at.with_z(height))).collect::<Vec<_>>().into_iter().rev());
    border.extend(seam[1..seam.len() - 1].iter().rev().map(|&at| pin(0.0, at)));
    builder.patch(&Patch { rings: vec![border], lines: Vec::new() }, lift)?;
    Ok(base)
}
