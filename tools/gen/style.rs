//! How fine and how even a mesh is. In: what is asked for ([`Style`]); out: lengths of pieces and sizes of triangles
//! ([`Sizing`]).
//!
//! The geometry of a shape does not depend on the style, only its triangles do. (Except for the sizes of the houses of
//! a city, which are drawn from the same stream of random numbers as the cuts.)
//! *Stretched* triangles come from meshing a squeezed space: all lengths that decide where points go are measured after
//! one axis was divided by the factor, so that round triangles there are long ones in the real space.

use super::border::{cut, graded_places};
use super::patch::Plane;
use super::random::Random;
use anyhow::{Result, ensure};
use glam::DVec3;
use std::f64::consts::PI;
use std::fmt;

/// Arcs of CAD tessellations turn by this much from one point to the next: what exporters do by default.
const CAD_STEP: f64 = PI / 15.0;

/// No arc turns by more from one point to the next; a circle of fewer pieces would have corners.
const LARGEST_STEP: f64 = PI / 6.0;

/// What the triangles of a shape look like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    /// Target edge length; the mean one (geometric) with `density`, the shorter one with `stretch`.
    pub edge: f64,
    /// Length over width of the triangles, for shapes with a straight direction; 1 for round ones.
    pub stretch: f64,
    /// Longest over shortest target edge length, between two corners of the bounding box; 1 for an even mesh.
    pub density: f64,
    /// As CAD programs write: points on edges and arcs only, none inside flat faces and along straight edges.
    pub cad: bool,
}

impl Style {
    /// Round and even triangles with edges of length 1.
    pub const PLAIN: Self = Self { edge: 1.0, stretch: 1.0, density: 1.0, cad: false };

    /// # Errors
    /// If a number makes no sense.
    pub fn check(&self) -> Result<()> {
        let Self { edge, stretch, density, .. } = *self;
        ensure!((0.01..=10.0).contains(&edge), "an edge length of {edge} is not within 0.01 .. 10");
        ensure!((1.0..=20.0).contains(&stretch), "a stretch of {stretch} is not within 1 .. 20");
        ensure!((1.0..=30.0).contains(&density), "a density of {density} is not within 1 .. 30");
        Ok(())
    }
}

impl fmt::Display for Style {
    /// As on the command line; nothing for the plain style.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts = Vec::new();
        for (option, value) in
            [("--edge", self.edge), ("--stretch", self.stretch), ("--density", self.density)]
        {
            if value != 1.0 {
                parts.push(format!("{option} {value}"));
            }
        }
        if self.cad {
            parts.push("--cad".to_owned());
        }
        write!(f, "{}", parts.join(" "))
    }
}

/// Target edge lengths that grow along a direction.
#[derive(Clone, Copy, Debug)]
struct Gradation {
    /// Where the edges are shortest, a corner of the bounding box.
    low: DVec3,
    /// The diagonal of the box, divided by its squared length: the scalar product with it runs from 0 to 1.
    along: DVec3,
    /// Logarithm of longest over shortest.
    range: f64,
}

/// Where points go: the style, made ready for one shape.
#[derive(Clone, Copy, Debug)]
pub struct Sizing {
    edge: f64,
    gradation: Option<Gradation>,
    squeeze: DVec3,
    cad: bool,
}

impl Sizing {
    /// The style without its variation of density; triangles are stretched along `axis`, one of the unit vectors.
    pub fn even(style: &Style, axis: DVec3) -> Self {
        let squeeze = DVec3::ONE + axis * (1.0 / style.stretch - 1.0);
        Self { edge: style.edge, gradation: None, squeeze, cad: style.cad }
    }

    /// The same with edge lengths that vary by the factor `ratio` between the corners of a box, evenly in the
    /// logarithm.
    pub fn graded(self, ratio: f64, (low, high): (DVec3, DVec3)) -> Self {
        let along = (high - low) / low.distance_squared(high);
        Self { gradation: Some(Gradation { low, along, range: libm::log(ratio) }), ..self }
    }

    /// Target edge length without gradation.
    pub fn edge(&self) -> f64 {
        self.edge
    }

    /// Target edge length at a place, in the squeezed space.
    pub fn at(&self, place: DVec3) -> f64 {
        self.gradation.map_or(self.edge, |Gradation { low, along, range }| {
            let t = (place - low).dot(along).clamp(0.0, 1.0);
            self.edge * libm::exp(range * (t - 0.5))
        })
    }

    /// Whether the edge length is the same everywhere.
    pub fn is_even(&self) -> bool {
        self.gradation.is_none()
    }

    /// Whether flat faces get no inner points.
    pub fn is_cad(&self) -> bool {
        self.cad
    }

    /// What each axis is multiplied by in the squeezed space.
    pub fn squeeze(&self) -> DVec3 {
        self.squeeze
    }

    /// A plane in the squeezed space.
    pub fn squeezed_plane(&self, plane: Plane) -> Plane {
        if self.squeeze == DVec3::ONE {
            return plane;
        }
        let u = (plane.u * self.squeeze).normalize();
        let v = plane.v * self.squeeze;
        Plane { origin: plane.origin * self.squeeze, u, v: (v - u * v.dot(u)).normalize() }
    }

    /// Cuts a straight edge with jitter; CAD tessellations leave it whole.
    pub fn cut(&self, a: DVec3, b: DVec3, random: &mut Random) -> Vec<DVec3> {
        if self.cad { vec![a, b] } else { self.cut_always(a, b, random) }
    }

    /// Cuts a segment with jitter whatever the style, for borders of curved patches.
    pub fn cut_always(&self, a: DVec3, b: DVec3, random: &mut Random) -> Vec<DVec3> {
        if self.is_even() {
            let pieces = (b - a) * self.squeeze;
            return cut(a, b, libm::round(pieces.length() / self.edge).max(1.0) as usize, random);
        }
        let line = |t: f64| a + (b - a) * t;
        let mut points: Vec<DVec3> = self.places(line, Some(random)).into_iter().map(line).collect();
        // Rounding must not move the end that others share.
        if let Some(last) = points.last_mut() {
            *last = b;
        }
        points
    }

    /// Parameters from 0 to 1, both included, that cut a curve into pieces, with or without jitter.
    pub fn places(&self, curve: impl Fn(f64) -> DVec3, random: Option<&mut Random>) -> Vec<f64> {
        graded_places(|t| curve(t) * self.squeeze, |place| self.at(place / self.squeeze), random)
    }

    /// Lengths from 0 to `length`, both included, that cut an arc without jitter; `arc` takes a length.
    pub fn arc_places(&self, arc: impl Fn(f64) -> DVec3, length: f64, sweep: f64) -> Vec<f64> {
        if !self.is_even() && !self.cad {
            return self.places(|t| arc(t * length), None).into_iter().map(|t| t * length).collect();
        }
        let pieces = if self.cad { sweep / CAD_STEP } else { length / self.edge };
        // Less a little: the sweep of a circle is as many steps as it is, whatever the rounding.
        let least = libm::ceil(sweep / LARGEST_STEP - 1e-9);
        let pieces = libm::round(pieces).max(least) as usize;
        (0..=pieces).map(|i| length * i as f64 / pieces as f64).collect()
    }
}
