//! What a tile finds: its share of the sparse candidate graph, under global ids.
//!
//! Fragments need nothing else to be understood. Vertices near a seam are found by several tiles, with the same bytes,
//! because each computed them from all that they depend on; joining is by id and never by coordinates.

use crate::mesh::{TileId, VertexId};
use crate::refine::Fit;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;

/// What a vertex is. The numbers are those of the output files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[repr(u8)]
pub enum Class {
    /// Smooth or flat surface.
    #[default]
    Face = 0,
    /// A crease below 30 degrees.
    Weak = 1,
    /// A crease of 30 degrees or more.
    Sharp = 2,
    /// Several creases meet.
    Corner = 3,
    /// On an edge with one face.
    Boundary = 4,
    /// On an edge with three or more faces; lines only.
    NonManifold = 5,
}

impl Class {
    /// All classes, by number.
    pub const ALL: [Class; 6] =
        [Class::Face, Class::Weak, Class::Sharp, Class::Corner, Class::Boundary, Class::NonManifold];

    /// The word for it.
    pub fn name(self) -> &'static str {
        ["face", "weak", "sharp", "corner", "boundary", "non-manifold"][self as usize]
    }
}

/// A vertex that lines may run through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// Global id.
    pub id: VertexId,
    /// Position as in the file.
    pub position: DVec3,
    /// Fold angle seen by the tensors, radians.
    pub theta: f64,
    /// Dihedral angle, and the planes that meet at the line.
    pub fit: Fit,
    /// S: fold angle supported along the line, radians; of the paper method the salience, without a unit.
    pub salience: f64,
    /// What it is.
    pub class: Class,
    /// Several creases meet here. Kept apart from the class, which is that of a boundary where both hold.
    pub corner: bool,
    /// Lines may end here without being dangling: corner or boundary.
    pub stop: bool,
    /// Can carry a component.
    pub strong: bool,
    /// K: refinement rounds of the local noise; 0 for the paper method.
    pub rounds: u32,
}

/// A path of one to three mesh edges between ridge vertices or stops.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LinkPath {
    ids: [VertexId; 4],
    len: u8,
    weight: f64,
}

impl LinkPath {
    /// From two to four vertices, the end with the lower id first, and the smallest edge weight.
    pub fn new(vertices: impl Iterator<Item = VertexId>, weight: f64) -> LinkPath {
        let mut path = LinkPath { ids: [VertexId(u64::MAX); 4], len: 0, weight };
        for id in vertices.take(4) {
            path.ids[path.len as usize] = id;
            path.len += 1;
        }
        path
    }

    /// Its vertices.
    pub fn ids(&self) -> &[VertexId] {
        &self.ids[..self.len as usize]
    }

    /// The order in which the line graph considers paths: few edges first, then heavy ones, then low ids.
    pub fn order(&self, other: &LinkPath) -> Ordering {
        (self.len.cmp(&other.len))
            .then_with(|| other.weight.total_cmp(&self.weight))
            .then_with(|| self.ids.cmp(&other.ids))
    }
}

/// Which graph an edge belongs to. Lines of one kind never continue as lines of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Kind {
    /// Links between ridge vertices.
    Crease,
    /// Edges with one face.
    Boundary,
    /// Edges with three or more faces.
    NonManifold,
}

impl Kind {
    /// All kinds, in the order in which their lines are listed.
    pub const ALL: [Kind; 3] = [Kind::Crease, Kind::Boundary, Kind::NonManifold];
}

/// A mesh edge that has not exactly two faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct OpenEdge {
    /// Its ends, lower id first.
    pub ends: [VertexId; 2],
    /// Whether it has more than two faces rather than one.
    pub crowded: bool,
}

impl OpenEdge {
    /// Boundary or non-manifold.
    pub fn kind(&self) -> Kind {
        if self.crowded { Kind::NonManifold } else { Kind::Boundary }
    }
}

/// A vertex that other tiles may name as well.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Seam {
    /// The vertex.
    pub vertex: VertexId,
    /// The tiles that own a vertex within [`crate::config::method::LINK_STEPS`] rings of it, ascending, without what this
    /// tile owns itself.
    pub tiles: Vec<TileId>,
}

/// Defects that only adjacency shows. Each is counted by the one tile that owns its vertex of lowest id.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Defects {
    /// Faces without area.
    pub degenerate_faces: u64,
    /// Faces with the same corners as a face of lower id.
    pub duplicate_faces: u64,
    /// Edges with one face.
    pub boundary_edges: u64,
    /// Edges with three or more faces.
    pub nonmanifold_edges: u64,
    /// Edges that two faces traverse in the same direction.
    pub opposed_edges: u64,
}

impl Defects {
    /// Adds the counts of another tile.
    pub fn add(&mut self, other: &Defects) {
        self.degenerate_faces += other.degenerate_faces;
        self.duplicate_faces += other.duplicate_faces;
        self.boundary_edges += other.boundary_edges;
        self.nonmanifold_edges += other.nonmanifold_edges;
        self.opposed_edges += other.opposed_edges;
    }
}

/// The fields of one vertex, as the attribute table has them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct VertexFields {
    /// Global id.
    pub id: VertexId,
    /// As in the file.
    pub position: DVec3,
    /// l1 >= l2 >= l3, divided by l1; of the paper method, by their 2-norm.
    pub eigenvalues: [f64; 3],
    /// (l2 + l3) / 2; of the paper method (l1 + l2 + l3 - 1) / 2.
    pub omega: f64,
    /// S as in [`Candidate`], not yet divided by the maximum of the mesh.
    pub salience: f64,
    /// Face, weak, sharp, corner or boundary.
    pub class: Class,
}

/// What one tile found.
#[derive(Clone, Debug, Default)]
pub struct Fragments {
    /// Every vertex that a path or open edge names, ascending; not fitted yet, and without a class.
    pub vertices: Vec<Candidate>,
    /// Paths from the ridge vertices that the tile owns.
    pub links: Vec<LinkPath>,
    /// Open edges whose lower end the tile owns, if boundaries were asked for.
    pub open_edges: Vec<OpenEdge>,
    /// Which of the vertices other tiles may name, ascending.
    pub seams: Vec<Seam>,
    /// Largest S over the vertices that the tile owns.
    pub largest_salience: f64,
    /// Defects counted by this tile.
    pub defects: Defects,
}
