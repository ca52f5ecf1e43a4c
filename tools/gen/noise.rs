//! What measurement adds to a shape. In: a shape, a kind of noise, its amplitude in mean edge lengths and a seed; out:
//! the vertices moved. True lines and corners stay: they belong to the surface that was measured.

use super::random::Random;
use super::shape::Shape;
use anyhow::{Context, Result, ensure};
use glam::DVec3;
use std::fmt;
use std::str::FromStr;

/// Part of the vertices that impulses move.
const IMPULSES: f64 = 0.1;

/// From one scan stripe to the next, in mean edge lengths: several edges wide, several stripes on each shape.
const STRIPE_PITCH: f64 = 10.0;
/// How wide a stripe is, in pitches; neighbours overlap by the rest.
const STRIPE_WIDTH: f64 = 1.4;
/// White noise within a stripe, in amplitudes: scanners are better within a pass than between passes.
const STRIPE_WHITE: f64 = 0.3;

/// How vertices are moved. All deviations are Gaussian, with the amplitude as standard deviation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseKind {
    /// Along the normal of the vertex.
    Normal,
    /// In each coordinate.
    Isotropic,
    /// Along the normal, of one vertex in ten; the others stay.
    Impulse,
    /// As overlapping scan stripes leave it. Stripes run along y. Each is shifted in all coordinates and tilted about
    /// its middle, by one amplitude at its edges; a vertex where two overlap belongs to one of them by chance. White
    /// noise of 0.3 amplitudes along the normal comes on top.
    Stripes,
    /// Heights are rounded to multiples of the amplitude: the staircase of a raster. Needs no seed.
    Quantised,
}

impl NoiseKind {
    /// All kinds.
    pub const ALL: [Self; 5] = [Self::Normal, Self::Isotropic, Self::Impulse, Self::Stripes, Self::Quantised];

    /// How kinds are written, for help texts.
    pub const FORMS: &'static str = "normal, isotropic, impulse, stripes, quantised";
}

impl fmt::Display for NoiseKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Normal => "normal",
            Self::Isotropic => "isotropic",
            Self::Impulse => "impulse",
            Self::Stripes => "stripes",
            Self::Quantised => "quantised",
        })
    }
}

impl FromStr for NoiseKind {
    type Err = anyhow::Error;

    fn from_str(word: &str) -> Result<Self> {
        let known = Self::ALL.into_iter().find(|kind| kind.to_string() == word);
        known.with_context(|| format!("no noise of this name; there are {}", Self::FORMS))
    }
}

impl Shape {
    /// Moves each vertex along its normal by Gaussian noise with a standard deviation of `amount` mean edge lengths.
    pub fn add_noise(&mut self, amount: f64, seed: u64) {
        if amount == 0.0 {
            return;
        }
        let mut random = Random::new(seed, "noise");
        let deviation = amount * self.mean_edge_length();
        let normals = self.vertex_normals();
        for (vertex, normal) in self.vertices.iter_mut().zip(normals) {
            *vertex += normal * (deviation * random.gaussian());
        }
    }

    /// Adds noise of any kind; `amount` in mean edge lengths.
    ///
    /// # Errors
    /// If the amount is negative or not finite.
    pub fn add_noise_of(&mut self, kind: NoiseKind, amount: f64, seed: u64) -> Result<()> {
        ensure!(amount.is_finite() && amount >= 0.0, "an amplitude of {amount} is not a length");
        if amount == 0.0 {
            return Ok(());
        }
        let edge = self.mean_edge_length();
        let mut random = Random::new(seed, &kind.to_string());
        match kind {
            NoiseKind::Normal => self.add_noise(amount, seed),
            NoiseKind::Isotropic => {
                for vertex in &mut self.vertices {
                    *vertex += gaussian(&mut random) * (amount * edge);
                }
            }
            NoiseKind::Impulse => {
                let normals = self.vertex_normals();
                for (vertex, normal) in self.vertices.iter_mut().zip(normals) {
                    if random.unit() < IMPULSES {
                        *vertex += normal * (amount * edge * random.gaussian());
                    }
                }
            }
            NoiseKind::Stripes => self.add_stripes(amount * edge, STRIPE_PITCH * edge, &mut random),
            NoiseKind::Quantised => {
                let step = amount * edge;
                for vertex in &mut self.vertices {
                    vertex.z = libm::round(vertex.z / step) * step;
                }
            }
        }
        Ok(())
    }

    fn add_stripes(&mut self, amplitude: f64, pitch: f64, random: &mut Random) {
        let normals = self.vertex_normals();
        let (low, high) = self.bounds();
        // The last stripe is the first one that begins beyond the shape.
        let count = ((high.x - low.x) / pitch) as usize + 2;
        let stripes: Vec<Stripe> = (0..count)
            .map(|i| Stripe {
                middle: low.x + i as f64 * pitch,
                shift: gaussian(random) * amplitude,
                tilt: random.gaussian() * amplitude / (0.5 * STRIPE_WIDTH * pitch),
            })
            .collect();
        for (vertex, normal) in self.vertices.iter_mut().zip(normals) {
            let place = (vertex.x - low.x) / pitch;
            let nearest = libm::round(place) as usize;
            // Beyond the middle between two stripes the other one is nearer, but this one may still reach.
            let other = if place < nearest as f64 { nearest.checked_sub(1) } else { Some(nearest + 1) };
            let reach = 0.5 * STRIPE_WIDTH;
            let overlap = other.filter(|&other| (place - other as f64).abs() < reach && other < count);
            let chosen = overlap.filter(|_| random.unit() < 0.5).unwrap_or(nearest);
            let Stripe { middle, shift, tilt } = stripes[chosen];
            let rise = DVec3::Z * (tilt * (vertex.x - middle));
            *vertex += shift + rise + normal * (STRIPE_WHITE * amplitude * random.gaussian());
        }
    }
}

/// One pass of a scanner.
#[derive(Clone, Copy)]
struct Stripe {
    /// Its x.
    middle: f64,
    /// How it was shifted.
    shift: DVec3,
    /// Height over length across.
    tilt: f64,
}

/// Three standard normal coordinates.
fn gaussian(random: &mut Random) -> DVec3 {
    let x = random.gaussian();
    let y = random.gaussian();
    DVec3::new(x, y, random.gaussian())
}
