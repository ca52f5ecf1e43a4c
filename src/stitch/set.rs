//! Feature lines in memory.

use super::error::StitchError;
use super::fragments::{Candidate, Class};
use super::lines::{self, Measures};
use super::source::{Counts, LineSource, Polyline, Stream};
use crate::mesh::VertexId;
use crate::refine::Bend;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A vertex that lines run through.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LineVertex {
    /// Global id.
    pub id: VertexId,
    /// Position as in the file.
    pub position: DVec3,
    /// Where fitted lines run near the vertex.
    pub fitted: DVec3,
    /// Fold angle seen by the tensors, radians.
    pub theta: f64,
    /// Dihedral angle, radians.
    pub angle: f64,
    /// S: fold angle supported along the line, radians; of the paper method the salience, without a unit.
    pub salience: f64,
    /// Convex or concave.
    pub bend: Bend,
    /// What it is.
    pub class: Class,
    /// Several creases meet here. Kept apart from the class, which is that of a boundary where both hold.
    pub corner: bool,
}

impl LineVertex {
    pub(super) fn new(candidate: &Candidate, fitted: DVec3) -> LineVertex {
        let Candidate { id, position, theta, fit, salience, class, corner, .. } = *candidate;
        LineVertex { id, position, fitted, theta, angle: fit.angle, salience, bend: fit.bend, class, corner }
    }

    /// Where the lines run at the vertex.
    pub fn point(&self, geometry: Geometry) -> DVec3 {
        match geometry {
            Geometry::Vertices => self.position,
            Geometry::Fitted => self.fitted,
        }
    }
}

/// A polyline along mesh edges.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Indices into the vertices of the [`LineSet`]; a closed line ends on its first vertex.
    pub vertices: Vec<u32>,
    /// Weak, sharp, boundary or non-manifold.
    pub class: Class,
    /// Whether it returns to its start.
    pub closed: bool,
    /// In mesh units.
    pub length: f64,
    /// Mean S over its length, divided by the largest S of the mesh: 0 to 1.
    pub strength: f64,
    /// Mean dihedral angle over its length, degrees.
    pub angle: f64,
    /// Convex or concave, whichever it is over the greater length.
    pub bend: Bend,
}

/// Where lines run. They have the same vertices, classes and angles either way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Geometry {
    /// Along edges of the mesh, from vertex to vertex.
    #[default]
    Vertices,
    /// Where the surfaces on both sides meet, smoothed along the line.
    Fitted,
}

/// The feature lines of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LineSet {
    /// Vertices that lines run through, by ascending id.
    pub vertices: Vec<LineVertex>,
    /// Creases, then boundaries, then non-manifold edges; each in canonical order.
    pub lines: Vec<Line>,
    /// Largest S of the mesh: what saliency is divided by.
    pub largest_salience: f64,
    /// Where the lines run.
    pub geometry: Geometry,
}

impl LineSet {
    /// Reads all of `source` into memory.
    ///
    /// # Errors
    /// If it cannot be read, or has more vertices than 32 bits can index.
    pub fn collect(source: &dyn LineSource) -> Result<LineSet, StitchError> {
        let count = source.counts().vertices;
        if count > u64::from(u32::MAX) {
            return Err(StitchError::TooMany { count });
        }
        let line = |line: Polyline| {
            let Measures { class, closed, length, strength, angle, bend } = line.measures;
            let vertices = line.vertices.iter().map(|&v| v as u32).collect();
            Line { vertices, class, closed, length, strength, angle, bend }
        };
        Ok(LineSet {
            vertices: source.vertices().collect::<Result<_, _>>()?,
            lines: source.lines().map(|result| result.map(line)).collect::<Result<_, _>>()?,
            largest_salience: source.largest_salience(),
            geometry: source.geometry(),
        })
    }

    /// The same lines, with the points and lengths of `geometry`.
    pub fn with_geometry(mut self, geometry: Geometry) -> LineSet {
        self.geometry = geometry;
        for line in &mut self.lines {
            let points = line.vertices.iter().map(|&v| self.vertices[v as usize].point(geometry));
            line.length = lines::length(points);
        }
        self
    }

    /// Where the lines run at a vertex.
    pub fn point(&self, vertex: &LineVertex) -> DVec3 {
        vertex.point(self.geometry)
    }

    /// S of a vertex divided by the largest S of the mesh.
    pub fn saliency(&self, vertex: &LineVertex) -> f64 {
        LineSource::saliency(self, vertex)
    }
}

impl LineSource for LineSet {
    fn geometry(&self) -> Geometry {
        self.geometry
    }

    fn largest_salience(&self) -> f64 {
        self.largest_salience
    }

    fn counts(&self) -> Counts {
        Counts {
            vertices: self.vertices.len() as u64,
            edges: self.lines.iter().map(|line| line.vertices.len() as u64 - 1).sum(),
            lines: self.lines.len() as u64,
            corners: self.vertices.iter().filter(|v| v.corner).count() as u64,
            largest_id: self.vertices.last().map(|v| v.id),
        }
    }

    fn vertices(&self) -> Stream<'_, LineVertex> {
        Box::new(self.vertices.iter().map(|vertex| Ok(*vertex)))
    }

    fn lines(&self) -> Stream<'_, Polyline> {
        Box::new(self.lines.iter().map(|line| {
            let Line { ref vertices, class, closed, length, strength, angle, bend } = *line;
            Ok(Polyline {
                points: vertices.iter().map(|&v| self.point(&self.vertices[v as usize])).collect(),
                vertices: vertices.iter().map(|&v| u64::from(v)).collect(),
                measures: Measures { class, closed, length, strength, angle, bend },
            })
        }))
    }
}
