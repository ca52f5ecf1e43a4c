//! Surfaces of revolution about an upright axis. In: a smooth profile; out: the surface, cut open at angle 0.
//!
//! The chart is the angle to the right and the integral of ds / radius upwards. It keeps angles, so that triangles that
//! are well shaped in the chart are so in space, whatever the radius; how large they are is measured in space.

use super::builder::Builder;
use super::patch::{Patch, Pin};
use super::random::Random;
use super::shape::Shape;
use super::style::Sizing;
use anyhow::Result;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// Pieces of the table of the chart. Between its entries the chart is taken as linear; points are on the surface
/// whatever the chart.
const TABLE: usize = 4000;

/// A surface of revolution.
pub struct Revolved<P> {
    /// Where the axis is.
    pub axis: DVec2,
    /// Radius and height for a parameter from 0 to 1, with the outside to its right.
    profile: P,
    /// The upward coordinate of the chart at even steps of the parameter.
    table: Vec<f64>,
}

/// A point of a circle about the axis.
#[derive(Clone, Copy, Debug)]
pub struct OnCircle {
    /// Its angle; 0 comes again as a full turn at the end of a circle.
    pub angle: f64,
    /// In space.
    pub at: DVec3,
}

/// Cuts a circle evenly. The last point is the first one once more.
pub fn circle(axis: DVec2, radius: f64, height: f64, sizing: &Sizing) -> Vec<OnCircle> {
    let at = |along: f64| on_circle(axis, radius, height, along / radius);
    closed_circle(sizing.arc_places(at, TAU * radius, TAU), radius, at)
}

/// The same with jitter; CAD tessellations are even.
pub fn jittered_circle(
    axis: DVec2,
    radius: f64,
    height: f64,
    sizing: &Sizing,
    random: &mut Random,
) -> Vec<OnCircle> {
    if sizing.is_cad() {
        return circle(axis, radius, height, sizing);
    }
    let at = |along: f64| on_circle(axis, radius, height, along / radius);
    let round = TAU * radius;
    let parts = sizing.places(|part| at(part * round), Some(random));
    closed_circle(parts.into_iter().map(|part| part * round).collect(), radius, at)
}

fn closed_circle(places: Vec<f64>, radius: f64, at: impl Fn(f64) -> DVec3) -> Vec<OnCircle> {
    let mut points: Vec<OnCircle> =
        places.into_iter().map(|along| OnCircle { angle: along / radius, at: at(along) }).collect();
    if let [first, .., last] = points.as_mut_slice() {
        *last = OnCircle { angle: TAU, at: first.at };
    }
    points
}

/// The positions of a circle without the repeated one.
pub fn ring_of(circle: &[OnCircle]) -> Vec<DVec3> {
    circle[..circle.len() - 1].iter().map(|point| point.at).collect()
}

fn on_circle(axis: DVec2, radius: f64, height: f64, angle: f64) -> DVec3 {
    let (sine, cosine) = libm::sincos(angle);
    (axis + DVec2::new(cosine, sine) * radius).extend(height)
}

impl<P: Fn(f64) -> DVec2> Revolved<P> {
    /// The surface of a profile that keeps away from the axis.
    pub fn new(axis: DVec2, profile: P) -> Self {
        let mut table = vec![0.0];
        for i in 0..TABLE {
            let [a, b] = [i, i + 1].map(|i| profile(i as f64 / TABLE as f64));
            table.push(table[i] + a.distance(b) / (0.5 * (a.x + b.x)));
        }
        Self { axis, profile, table }
    }

    /// The point for an angle and a parameter of the profile.
    pub fn at(&self, angle: f64, parameter: f64) -> DVec3 {
        let DVec2 { x: radius, y: height } = (self.profile)(parameter);
        on_circle(self.axis, radius, height, angle)
    }

    /// Adds the surface between two circles. CAD tessellations have circles at the parameters `stops`
    /// between, and their two circles must have the same angles.
    ///
    /// # Errors
    /// If the circles cannot be joined.
    pub fn build(
        &self,
        builder: &mut Builder,
        [bottom, top]: [&[OnCircle]; 2],
        stops: &[f64],
        sizing: &Sizing,
        random: &mut Random,
    ) -> Result<()> {
        let cuts = sizing.places(|t| self.at(0.0, t), Some(random));
        let inner = if sizing.is_cad() { stops } else { &cuts[1..cuts.len() - 1] };
        let pin = |point: &OnCircle, up: f64| Pin { uv: DVec2::new(point.angle, up), at: point.at };
        let seam = |angle: f64| {
            inner.iter().map(move |&t| Pin { uv: DVec2::new(angle, self.up(t)), at: self.at(0.0, t) })
        };
        let mut border: Vec<Pin> = bottom.iter().map(|point| pin(point, 0.0)).collect();
        border.extend(seam(TAU));
        border.extend(top.iter().rev().map(|point| pin(point, self.table[TABLE])));
        border.extend(seam(0.0).rev());
        let lift = |uv: DVec2| self.at(uv.x, self.parameter(uv.y));
        if !sizing.is_cad() {
            return builder.conformal(&Patch { rings: vec![border], lines: Vec::new() }, lift);
        }
        let inside = &bottom[1..bottom.len() - 1];
        let parallel = |&t: &f64| {
            let point = |angle: f64| Pin { uv: DVec2::new(angle, self.up(t)), at: self.at(angle, t) };
            inside.iter().map(|place| point(place.angle)).collect()
        };
        let lines = inner.iter().map(parallel).collect();
        builder.developed(&Patch { rings: vec![border], lines }, lift)
    }

    /// The upward coordinate of a parameter.
    fn up(&self, parameter: f64) -> f64 {
        let place = parameter * TABLE as f64;
        let i = (place as usize).min(TABLE - 1);
        self.table[i] + (self.table[i + 1] - self.table[i]) * (place - i as f64)
    }

    /// The parameter of an upward coordinate.
    fn parameter(&self, up: f64) -> f64 {
        let i = self.table.partition_point(|&entry| entry < up).clamp(1, TABLE) - 1;
        let rest = (up - self.table[i]) / (self.table[i + 1] - self.table[i]);
        (i as f64 + rest) / TABLE as f64
    }
}

/// A torus: curved everywhere and no feature.
pub fn torus(sizing: Sizing, seed: u64) -> Result<Shape> {
    const LARGE: f64 = 20.0;
    const SMALL: f64 = 8.0;
    let surface = Revolved::new(DVec2::ZERO, |t: f64| {
        let (sine, cosine) = libm::sincos(TAU * t);
        DVec2::new(LARGE + SMALL * cosine, SMALL * sine)
    });
    let mut builder = Builder::new(sizing);
    let equator = circle(DVec2::ZERO, LARGE + SMALL, 0.0, &sizing);
    let mut random = Random::new(seed, "torus");
    let stops = sizing.arc_places(|_| DVec3::ZERO, 1.0, TAU);
    let inner = &stops[1..stops.len() - 1];
    surface.build(&mut builder, [&equator, &equator], inner, &sizing, &mut random)?;
    Ok(builder.finish())
}
