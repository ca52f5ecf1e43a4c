//! Glues patches to one mesh. In: patches and true lines; out: a [`Shape`] in which patches share border vertices.

use super::corners::corners_of;
use super::patch::{Fill, Patch, Piece, Pin, Plane};
use super::shape::Shape;
use super::style::Sizing;
use anyhow::{Context, Result, ensure};
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// How far a border point may lie off its plane: rounding only.
const FLATNESS: f64 = 1e-9;

/// A shape in the making.
#[derive(Debug)]
pub struct Builder {
    shape: Shape,
    sizing: Sizing,
    /// Vertex at a position, by the bits of its coordinates: patches meet in equal points or not at all.
    known: BTreeMap<[u64; 3], u32>,
}

impl Builder {
    /// Nothing yet.
    pub fn new(sizing: Sizing) -> Self {
        Self { shape: Shape::default(), sizing, known: BTreeMap::new() }
    }

    /// Meshes and adds a flat patch with the given border rings.
    ///
    /// # Errors
    /// If the rings cross, or leave the plane.
    pub fn flat(&mut self, plane: Plane, rings: &[Vec<DVec3>]) -> Result<()> {
        let squeeze = self.sizing.squeeze();
        let plane = self.sizing.squeezed_plane(plane);
        let pin = |at: DVec3| Pin { uv: plane.place(at * squeeze), at };
        let rings: Vec<Vec<Pin>> = rings.iter().map(|ring| ring.iter().copied().map(pin).collect()).collect();
        let lift = |uv: DVec2| plane.lift(uv) / squeeze;
        for pin in rings.iter().flatten() {
            ensure!(lift(pin.uv).distance(pin.at) < FLATNESS, "{} is not on the plane", pin.at);
        }
        self.developed(&Patch { rings, lines: Vec::new() }, lift)
    }

    /// Meshes and adds a patch whose chart keeps lengths (of the squeezed space).
    ///
    /// # Errors
    /// If its borders cross.
    pub fn developed(&mut self, patch: &Patch, lift: impl Fn(DVec2) -> DVec3) -> Result<()> {
        if self.sizing.is_cad() {
            return self.add(&patch.mesh(Fill::Pins, lift)?);
        }
        self.free_form(patch, lift)
    }

    /// Meshes and adds a patch whose chart keeps lengths nearly, and that is curved: with inner points in any style.
    ///
    /// # Errors
    /// If its borders cross.
    pub fn free_form(&mut self, patch: &Patch, lift: impl Fn(DVec2) -> DVec3) -> Result<()> {
        if self.sizing.is_even() {
            return self.add(&patch.mesh(Fill::Even(self.sizing.edge()), lift)?);
        }
        self.conformal(patch, lift)
    }

    /// Meshes and adds a patch whose chart keeps angles but not lengths.
    ///
    /// # Errors
    /// If its borders cross.
    pub fn conformal(&mut self, patch: &Patch, lift: impl Fn(DVec2) -> DVec3) -> Result<()> {
        let sizing = self.sizing;
        let excess = |corners: [DVec3; 3]| {
            let [a, b, c] = corners.map(|corner| corner * sizing.squeeze());
            let size = sizing.at((corners[0] + corners[1] + corners[2]) / 3.0);
            0.5 * (b - a).cross(c - a).length() / (size * size)
        };
        let piece = patch.mesh(Fill::Graded(&excess), lift)?;
        self.add(&piece)
    }

    /// Adds a mesh.
    ///
    /// # Errors
    /// If there are too many vertices.
    pub fn add(&mut self, piece: &Piece) -> Result<()> {
        for face in &piece.faces {
            let mut corners = [0; 3];
            for (corner, &index) in corners.iter_mut().zip(face) {
                *corner = self.vertex(piece.points[index])?;
            }
            self.shape.faces.push(corners);
        }
        Ok(())
    }

    /// Adds a true feature line.
    pub fn line(&mut self, points: Vec<DVec3>) {
        self.shape.lines.push(points);
    }

    /// The shape as it is now, with the corners of its lines.
    pub fn finish(mut self) -> Shape {
        self.shape.corners = corners_of(&self.shape.lines);
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
