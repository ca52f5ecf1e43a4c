//! Step F: where the line really runs near a vertex, and what angle the surface makes there.
//!
//! In: refined normals and votes. Out, for a vertex: the dihedral angle between the planes on both sides of the crease,
//! whether it is convex, and a quadric whose minimum is where these planes meet. The radius of the patch that is looked
//! at follows the noise: [`method::FIT_NEAR`] to [`method::FIT_FAR`]. All of it lies within the level cubes around the
//! vertex.
//!
//! Tensors see a fold only as far as refined normals keep it, and not at all above a right angle; planes through positions
//! do. Points where planes meet are those of Kobbelt et al. (2001), with planes fitted rather than taken from three
//! vertices, each weighted with its own standard error.

use super::patch::{Scratch, Surface};
use super::plane::Plane;
use super::sides::{further_planes, meeting, two_sides};
use crate::config::method;
use crate::math::Quadric;
use crate::mesh::{Field, TileMesh};
use crate::partition::Scale;
use crate::voting::{FaceGeometry, Stop, Vote};
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Which way a surface bends at a crease, seen from the side that its normals point to. The numbers are those of the
/// output files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[repr(u8)]
pub enum Bend {
    /// Not told: a corner of several creases, or no two sides.
    #[default]
    Unknown = 0,
    /// A ridge.
    Convex = 1,
    /// A valley.
    Concave = 2,
}

/// The surface around a line vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// Dihedral angle between the two sides in radians: 0 is flat, pi is folded back. At a corner whose faces do not fall
    /// into two sides, the largest between two of its planes. Theta where there are no planes.
    pub angle: f64,
    /// Convex or concave.
    pub bend: Bend,
    /// Planes that meet at the line; lengths in kh, relative to the vertex.
    pub quadric: Quadric,
}

/// What fits are made from.
pub struct Fitter<'a> {
    /// The mesh.
    pub mesh: &'a TileMesh,
    /// Areas and windings.
    pub faces: &'a FaceGeometry,
    /// Refined normals.
    pub normals: &'a [DVec3],
    /// Units.
    pub scale: &'a Scale,
    /// Known at the vertices around which all refined normals are.
    pub known: &'a Field<bool>,
    /// Directions.
    pub votes: &'a Field<Vote>,
    /// Corners.
    pub stops: &'a Field<Stop>,
    /// K of each vertex.
    pub rounds: &'a [u32],
}

/// K as a share of [`method::FIT_NOISY_ROUNDS`]: 0 without noise, 1 at most.
pub fn noise_share(scale: &Scale, rounds: u32) -> f64 {
    (f64::from(rounds) / (scale.rounds(method::FIT_NOISY_ROUNDS) as f64).max(1.0)).min(1.0)
}

/// How far a vertex with this share of noise may lie from its line, in kh.
pub fn slack(noise: f64) -> f64 {
    method::FIT_SLACK * (1.0 + noise)
}

/// Fits by one parallel task: enough for its memory to be worth its while.
const FITS: usize = 1024;
/// Tasks at most, however many threads there are: each has 12 bytes for each face of the tile, of which it touches those near
/// its vertices. A table as small as a patch would do, but looking things up in it takes a quarter longer.
const TASKS: usize = 8;

impl Fitter<'_> {
    /// The fit at each vertex of `at`.
    pub fn fits(&self, at: &[u32]) -> Vec<Fit> {
        at.par_iter()
            .with_min_len(FITS.max(at.len().div_ceil(TASKS)))
            .map_init(|| Scratch::new(self.mesh), |scratch, &v| self.fit(v, scratch))
            .collect()
    }

    fn fit(&self, v: u32, scratch: &mut Scratch) -> Fit {
        let Fitter { mesh, faces, normals, scale, known, votes, .. } = *self;
        let vote = votes.get(v);
        if mesh.is_hub(v) {
            return Fit { angle: vote.theta, ..Fit::default() };
        }
        let noise = noise_share(scale, self.rounds[v as usize]);
        let radius = method::FIT_NEAR + (method::FIT_FAR - method::FIT_NEAR) * noise;
        Surface { mesh, faces, normals, scale, known, votes }.patch(v, radius, scratch);
        let Scratch { patch, work, .. } = scratch;
        let sides = two_sides(patch, vote.b, slack(noise), work);
        let close = method::MORE_CLOSE * if self.stops.get(v).corner { 2.0 } else { 1.0 };
        let mut directions: Vec<DVec3> = sides.iter().flatten().map(|plane| plane.normal).collect();
        let further = further_planes(patch, &mut directions, close, work);
        let planes: Vec<Plane> = sides.into_iter().flatten().chain(further).collect();
        let quadric = meeting(&planes);
        let (angle, bend) = match sides {
            Some([plus, minus]) => fold(plus.normal, minus.normal, vote.t),
            None => (widest(&directions).unwrap_or(vote.theta), Bend::Unknown),
        };
        // Coordinates may differ by so many orders of magnitude that squares overflow. Then nothing is known.
        if angle.is_finite() && quadric.matrix.diag.is_finite() && quadric.vector.is_finite() {
            Fit { angle, bend, quadric }
        } else {
            Fit { angle: vote.theta, ..Fit::default() }
        }
    }
}

/// The angle between the normals on the side of b and on the other, seen along the line `t`: what tilts along the line is
/// noise.
fn fold(plus: DVec3, minus: DVec3, t: DVec3) -> (f64, Bend) {
    let angle = libm::atan2(plus.cross(minus).dot(t), plus.dot(minus));
    let bend = match angle {
        a if a > 0.0 => Bend::Convex,
        a if a < 0.0 => Bend::Concave,
        _ => Bend::Unknown,
    };
    (angle.abs(), bend)
}

/// The largest angle between two of `normals`.
fn widest(normals: &[DVec3]) -> Option<f64> {
    let between = |a: DVec3, b: DVec3| {
        let cross = a.cross(b);
        libm::atan2(cross.dot(cross).sqrt(), a.dot(b))
    };
    let pairs =
        normals.iter().enumerate().flat_map(|(i, &a)| normals[..i].iter().map(move |&b| between(a, b)));
    pairs.fold(None, |most: Option<f64>, angle| Some(most.map_or(angle, |most| most.max(angle))))
}
