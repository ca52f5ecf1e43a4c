//! Glues patches to one mesh. In: patches and true lines; out: a [`Shape`] in which patches share border vertices.

use super::patch::{Patch, Pin, Plane};
use super::shape::Shape;
use anyhow::{Context, Result, ensure};
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// Target edge length of all shapes.
pub const SPACING: f64 = 1.0;

/// A shape in the making.
#[derive(Debug, Default)]
pub struct Builder {
    shape: Shape,
    /// Vertex at a position, by the bits of its coordinates: patches meet in equal points or not at all.
    known: BTreeMap<[u64; 3], u32>,
}

impl Builder {
    /// Meshes and adds a patch.
    ///
    /// # Errors
    /// If its borders cross.
    pub fn patch(&mut self, patch: &Patch, lift: impl Fn(DVec2) -> DVec3) -> Result<()> {
        let piece = patch.mesh(SPACING, lift)?;
        for face in piece.faces {
            let mut corners = [0; 3];
            for (corner, index) in corners.iter_mut().zip(face) {
                *corner = self.vertex(piece.points[index])?;
            }
            self.shape.faces.push(corners);
        }
        Ok(())
    }

    /// Meshes and adds a flat patch with the given border rings.
    ///
    /// # Errors
    /// If the rings cross, or leave the plane.
    pub fn flat(&mut self, plane: Plane, rings: &[Vec<DVec3>]) -> Result<()> {
        let rings: Vec<Vec<Pin>> = rings.iter().map(|ring| plane.pins(ring)).collect();
        for pin in rings.iter().flatten() {
            ensure!(plane.lift(pin.uv).distance(pin.at) < 1e-9 * SPACING, "{} is not on the plane", pin.at);
        }
        self.patch(&Patch { rings, lines: Vec::new() }, |uv| plane.lift(uv))
    }

    /// Adds a true feature line.
    pub fn line(&mut self, points: Vec<DVec3>) {
        self.shape.lines.push(points);
    }

    /// The shape as it is now.
    pub fn finish(self) -> Shape {
        self.shape
    }

    fn vertex(&mut self, position: DVec3) -> Result<u32> {
        // Adding zero turns -0 to 0, which is the same place with other bits.
        let bits = (position + DVec3::ZERO).to_array().map(f64::to_bits);
        if let Some(&index) = self.known.get(&bits) {
            return Ok(index);
        }
        let index = u32::try_from(self.shape.vertices.len()).context("more than 2^32 vertices")?;
        self.known.insert(bits, index);
        self.shape.vertices.push(position);
        Ok(index)
    }
}
