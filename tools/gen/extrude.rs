//! Outlines drawn up to solids. In: outlines in the plane and two heights; out: walls, and with caps a closed solid.

use super::border::{reversed, ring};
use super::builder::Builder;
use super::outline::{Chain, Outline, Side};
use super::patch::{Patch, Pin, Plane};
use super::random::Random;
use super::style::Sizing;
use anyhow::Result;
use glam::{DVec2, DVec3};

/// Adds the solid over `outlines` from `z = 0` up to `height`, and its sharp edges as true lines.
///
/// # Errors
/// If outlines cross.
pub fn extrude(
    builder: &mut Builder,
    outlines: &[Outline],
    height: f64,
    sizing: &Sizing,
    random: &mut Random,
) -> Result<()> {
    let mut bases = Vec::new();
    for outline in outlines {
        bases.push(walls(builder, outline, 0.0, height, sizing, random)?);
    }
    // The bottom is seen from below, where x and y change places.
    builder.flat(Plane { origin: DVec3::ZERO, u: DVec3::Y, v: DVec3::X }, &bases)?;
    let tops: Vec<Vec<DVec3>> = bases.iter().map(|base| at_height(base, height)).collect();
    builder.flat(top_plane(height), &tops)?;
    for ring in bases.iter().chain(&tops) {
        builder.line(closed(ring));
    }
    Ok(())
}

/// The plane at a height, seen from above.
pub fn top_plane(height: f64) -> Plane {
    Plane { origin: DVec3::Z * height, u: DVec3::X, v: DVec3::Y }
}

/// The same points at another height.
pub fn at_height(points: &[DVec3], height: f64) -> Vec<DVec3> {
    points.iter().map(|point| point.with_z(height)).collect()
}

/// A ring as a line: with its first point again at the end.
pub fn closed(ring: &[DVec3]) -> Vec<DVec3> {
    ring.iter().chain(ring.first()).copied().collect()
}

/// Adds the walls over an outline between two heights, and their upright edges as true lines. Returns the ring of the
/// base; that at the top has the same points at the other height.
///
/// # Errors
/// If the outline crosses itself.
pub fn walls(
    builder: &mut Builder,
    outline: &Outline,
    bottom: f64,
    top: f64,
    sizing: &Sizing,
    random: &mut Random,
) -> Result<Vec<DVec3>> {
    let chains = outline.chains();
    let mut posts: Vec<Vec<DVec3>> = Vec::new();
    for chain in chains.iter().filter(|chain| chain.sharp) {
        let foot = chain.start();
        let post = sizing.cut(foot.extend(bottom), foot.extend(top), random);
        builder.line(post.clone());
        posts.push(post);
    }
    let mut base: Vec<DVec3> = Vec::new();
    for (i, chain) in chains.iter().enumerate() {
        let border = match (chain.sides.as_slice(), posts.as_slice()) {
            (_, []) => {
                let side = places(chain, chain.start(), bottom, sizing, random);
                let foot = side[0].at;
                let seam = sizing.cut(foot, foot.with_z(top), random);
                developed_wall(builder, chain, &side, [&seam, &seam], sizing)?;
                side.iter().map(|place| place.at).collect::<Vec<_>>()
            }
            ([Side::Line { from, .. }], posts) => {
                let right = &posts[(i + 1) % posts.len()];
                let border = sizing.cut(posts[i][0], right[0], random);
                let upper = reversed(&at_height(&border, top));
                let wall = ring(&[&border, right, &upper, &reversed(&posts[i])]);
                let along = (right[0].truncate() - *from).normalize();
                let plane = Plane { origin: from.extend(bottom), u: along.extend(0.0), v: DVec3::Z };
                builder.flat(plane, &[wall])?;
                border
            }
            (_, posts) => {
                let right = &posts[(i + 1) % posts.len()];
                let side = places(chain, right[0].truncate(), bottom, sizing, random);
                developed_wall(builder, chain, &side, [&posts[i], right], sizing)?;
                side.iter().map(|place| place.at).collect::<Vec<_>>()
            }
        };
        base.extend(&border[..border.len() - 1]);
    }
    Ok(base)
}

/// A point at the foot of a wall.
struct Place {
    /// Length along the wall from its start.
    along: f64,
    /// In space.
    at: DVec3,
}

/// Cuts the foot of a chain that ends at `end`. Straight sides are cut with jitter, arcs evenly.
fn places(chain: &Chain, end: DVec2, height: f64, sizing: &Sizing, random: &mut Random) -> Vec<Place> {
    let mut places = Vec::new();
    let mut before = 0.0;
    for side in &chain.sides {
        let length = side.length();
        let at = |along: f64| side.at(along).extend(height);
        let cuts = match side {
            Side::Line { from, to } => {
                let points = sizing.cut(from.extend(height), to.extend(height), random);
                points.iter().map(|point| point.truncate().distance(*from)).collect()
            }
            Side::Arc { sweep, .. } => sizing.arc_places(at, length, sweep.abs()),
        };
        let inner = &cuts[..cuts.len() - 1];
        places.extend(inner.iter().map(|&along| Place { along: before + along, at: at(along) }));
        before += length;
    }
    places.push(Place { along: before, at: end.extend(height) });
    // The start in the bits that the walls before and behind use.
    places[0].at = chain.start().extend(height);
    places
}

/// A wall along a chain, unrolled, between two posts; a closed one is cut open there. The chart keeps lengths, if the
/// space is squeezed upwards only.
fn developed_wall(
    builder: &mut Builder,
    chain: &Chain,
    foot: &[Place],
    [left, right]: [&[DVec3]; 2],
    sizing: &Sizing,
) -> Result<()> {
    let squeeze = sizing.squeeze().z;
    let (bottom, top) = (left[0].z, left[left.len() - 1].z);
    let pin = |along: f64, at: DVec3| Pin { uv: DVec2::new(along, at.z * squeeze), at };
    let length = foot[foot.len() - 1].along;
    let mut border: Vec<Pin> = foot.iter().map(|place| pin(place.along, place.at)).collect();
    border.extend(right[1..right.len() - 1].iter().map(|&at| pin(length, at)));
    border.extend(foot.iter().rev().map(|place| pin(place.along, place.at.with_z(top))));
    border.extend(left[1..left.len() - 1].iter().rev().map(|&at| pin(0.0, at)));
    debug_assert!(bottom < top);
    let lift = |uv: DVec2| chain.at(uv.x).extend(uv.y / squeeze);
    builder.developed(&Patch { rings: vec![border], lines: Vec::new() }, lift)
}
