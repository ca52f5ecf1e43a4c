//! Feature lines as whoever writes them sees them: vertices, then lines, both in canonical order and one at a time.
//!
//! What is behind it may be a set in memory or files on a disk. Both can be read as often as a format needs: once for the
//! vertices, once for the edges, once more for a table of lines.

use super::error::StitchError;
use super::lines::Measures;
use super::set::{Geometry, LineVertex};
use crate::mesh::VertexId;
use glam::DVec3;

/// A line with the places it runs through.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyline {
    /// Which of the vertices it runs through, from 0; a closed line ends on its first.
    pub vertices: Vec<u64>,
    /// Where these are, for the geometry that was asked for.
    pub points: Vec<DVec3>,
    /// Class, length and angle.
    pub measures: Measures,
}

/// How much there is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Vertices on lines; one that several lines share counts once.
    pub vertices: u64,
    /// Edges of all lines.
    pub edges: u64,
    /// Lines.
    pub lines: u64,
    /// Vertices that are corners.
    pub corners: u64,
    /// Highest id of a vertex.
    pub largest_id: Option<VertexId>,
}

/// What an iterator over lines or vertices is.
pub type Stream<'a, T> = Box<dyn Iterator<Item = Result<T, StitchError>> + 'a>;

/// Feature lines that can be read from start to end, any number of times.
pub trait LineSource {
    /// Where the lines run.
    fn geometry(&self) -> Geometry;

    /// Largest S of the mesh: what saliency is divided by.
    fn largest_salience(&self) -> f64;

    /// How much there is.
    fn counts(&self) -> Counts;

    /// Vertices, by ascending id. An error ends the iterator.
    fn vertices(&self) -> Stream<'_, LineVertex>;

    /// Creases, then boundaries, then non-manifold edges; each in canonical order. An error ends the iterator.
    fn lines(&self) -> Stream<'_, Polyline>;

    /// What is said of each line, and how many edges it has: [`LineSource::lines`] for those who need no points, which are most
    /// of what there is to read.
    fn measures(&self) -> Stream<'_, (Measures, u64)> {
        Box::new(self.lines().map(|line| line.map(|line| (line.measures, line.vertices.len() as u64 - 1))))
    }

    /// S of a vertex divided by the largest S of the mesh.
    fn saliency(&self, vertex: &LineVertex) -> f64 {
        let largest = self.largest_salience();
        if largest > 0.0 { vertex.salience / largest } else { 0.0 }
    }
}
