//! From a square to a circle. In: seed and style; out: a closed solid whose four upright edges fade from 90 degrees at
//! the base to nothing at the top.
//!
//! The surface is made of the straight lines between the square and the circle at equal parts of their quarters. Each
//! quarter has a trapezoid as chart, with the right lengths along base, top and middle.

use super::border::{reversed, ring};
use super::builder::Builder;
use super::extrude::{closed, top_plane};
use super::patch::{Patch, Pin, Plane};
use super::random::Random;
use super::relief::SMALLEST_TRUE_ANGLE_DEG;
use super::shape::Shape;
use super::style::Sizing;
use anyhow::Result;
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

/// Side of the square.
const SIDE: f64 = 30.0;
/// Radius of the circle.
const RADIUS: f64 = 12.0;
/// From the square up to the circle.
const HEIGHT: f64 = 30.0;

/// The solid. True lines are the square, the circle, and the edges between as far as they have 5 degrees.
pub fn loft(sizing: Sizing, seed: u64) -> Result<Shape> {
    let mut random = Random::new(seed, "loft");
    let mut builder = Builder::new(sizing);
    let corner = |k: u32| on_quarter(k % 4, 0.0, 0.0);
    let posts: Vec<Vec<DVec3>> =
        (0..4).map(|k| sizing.cut(corner(k), on_quarter(k, 0.0, 1.0), &mut random)).collect();
    let (mut base, mut top) = (Vec::new(), Vec::new());
    for k in 0..4 {
        let (left, right) = (&posts[k as usize], &posts[(k as usize + 1) % 4]);
        let lower = sizing.cut(corner(k), corner(k + 1), &mut random);
        let arc = |along: f64| on_quarter(k, along / (RADIUS * FRAC_PI_2), 1.0);
        let places = sizing.arc_places(arc, RADIUS * FRAC_PI_2, FRAC_PI_2);
        let mut upper: Vec<DVec3> = places.into_iter().map(arc).collect();
        // The ends in the bits of the posts.
        if let [first, .., last] = upper.as_mut_slice() {
            (*first, *last) = (left[left.len() - 1], right[right.len() - 1]);
        }
        let border = ring(&[&lower, right, &reversed(&upper), &reversed(left)]);
        let pins = border.iter().map(|&at| Pin { uv: in_chart(k, at), at }).collect();
        builder.free_form(&Patch { rings: vec![pins], lines: Vec::new() }, |uv| lift(k, uv))?;
        base.extend(&lower[..lower.len() - 1]);
        top.extend(&upper[..upper.len() - 1]);
    }
    for post in &posts {
        let true_part = post.iter().take_while(|at| edge_angle_deg(at.z / HEIGHT) >= SMALLEST_TRUE_ANGLE_DEG);
        builder.line(true_part.copied().collect());
    }
    builder.line(closed(&base));
    builder.line(closed(&top));
    builder.flat(Plane { origin: DVec3::ZERO, u: DVec3::Y, v: DVec3::X }, &[base])?;
    builder.flat(top_plane(HEIGHT), &[top])?;
    Ok(builder.finish())
}

/// The point of quarter `k` at part `q` along the quarter and part `t` of the height.
fn on_quarter(k: u32, q: f64, t: f64) -> DVec3 {
    let straight = DVec2::new(SIDE * 0.5, SIDE * (q - 0.5));
    let (sine, cosine) = libm::sincos((q - 0.5) * FRAC_PI_2);
    let round = DVec2::new(cosine, sine) * RADIUS;
    let DVec2 { x, y } = straight * (1.0 - t) + round * t;
    let turned = match k {
        0 => DVec2::new(x, y),
        1 => DVec2::new(-y, x),
        2 => DVec2::new(-x, -y),
        _ => DVec2::new(y, -x),
    };
    turned.extend(HEIGHT * t)
}

/// Width of the chart at a part of the height.
fn width(t: f64) -> f64 {
    SIDE * (1.0 - t) + RADIUS * FRAC_PI_2 * t
}

/// Height of the chart: length of the straight line in the middle of a quarter.
fn slant() -> f64 {
    on_quarter(0, 0.5, 0.0).distance(on_quarter(0, 0.5, 1.0))
}

fn lift(k: u32, uv: DVec2) -> DVec3 {
    let t = uv.y / slant();
    on_quarter(k, uv.x / width(t) + 0.5, t)
}

/// Where a point of a border of the quarter lies in the chart.
fn in_chart(k: u32, at: DVec3) -> DVec2 {
    let t = at.z / HEIGHT;
    let [first, last] = [0.0, 1.0].map(|q| on_quarter(k, q, t));
    let q = if t == 0.0 {
        first.distance(at) / SIDE
    } else if t == 1.0 {
        let angle =
            libm::atan2(first.truncate().perp_dot(at.truncate()), first.truncate().dot(at.truncate()));
        angle / FRAC_PI_2
    } else if first.distance_squared(at) < last.distance_squared(at) {
        0.0
    } else {
        1.0
    };
    DVec2::new((q - 0.5) * width(t), t * slant())
}

/// The angle between the normals on both sides of an upright edge, at a part of the height.
fn edge_angle_deg(t: f64) -> f64 {
    // The sides leave the edge along the square and the circle: at 45 degrees to its plane, and at right angles.
    let (sine, cosine) = libm::sincos(FRAC_PI_4);
    let square = SIDE * (1.0 - t);
    let across = square * cosine + RADIUS * FRAC_PI_2 * t;
    let inwards = square * sine;
    // The edge leans inwards; seen along it, the inward part is foreshortened.
    let lean = SIDE * std::f64::consts::FRAC_1_SQRT_2 - RADIUS;
    let foreshortened = inwards * HEIGHT / (HEIGHT * HEIGHT + lean * lean).sqrt();
    2.0 * libm::atan2(foreshortened, across).to_degrees()
}
