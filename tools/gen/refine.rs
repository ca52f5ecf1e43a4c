//! Points inside a patch. In: the constrained triangulation of its pins; out: triangles that are small and well shaped.
//!
//! Border and inner lines are never split. Even meshes are left to the library. Graded ones alternate between splitting
//! the triangles that are too large where they lie, and the refinement of angles by the library.

use super::patch::{Cdt, inner_faces, lift_new};
use anyhow::{Result, ensure};
use glam::{DVec2, DVec3};
use spade::handles::FixedVertexHandle;
use spade::{AngleLimit, Point2, RefinementParameters, Triangulation};
use std::collections::BTreeSet;

/// Largest triangle in units of the squared target edge length: gives a mean edge length of about the target.
const MAX_AREA: f64 = 0.62;

/// The same for graded meshes. Splitting at the barycentre leaves smaller triangles than the library does.
const MAX_GRADED_AREA: f64 = 0.66;

/// Circumradius over shortest edge that refinement accepts: smallest angles of about 22 degrees. As a ratio, because
/// the way over degrees goes through the sine of the platform.
const RADIUS_TO_EDGE: f64 = 1.33;

/// How a patch is refined.
pub struct Refinement<'a> {
    /// Edges of the rings, as pairs of ascending vertices.
    pub border: &'a BTreeSet<(usize, usize)>,
    /// Whether the library can tell the outside and leave it alone.
    pub exclude_outside: bool,
}

impl Refinement<'_> {
    /// Adds points until triangles are well shaped and about `spacing` wide.
    ///
    /// # Errors
    /// If there is no end to it.
    pub fn even(&self, cdt: &mut Cdt, spacing: f64) -> Result<()> {
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for vertex in cdt.vertices() {
            let position = DVec2::new(vertex.position().x, vertex.position().y);
            (low, high) = (low.min(position), high.max(position));
        }
        // Several times what a regular mesh of the bounding box needs: only a run that would not end gets there.
        let area = (high - low).element_product() / (spacing * spacing);
        let limit = (8.0 * area) as usize + 1000;
        let parameters = self.parameters(limit).with_max_allowed_area(MAX_AREA * spacing * spacing);
        ensure!(cdt.refine(parameters).refinement_complete, "refinement does not come to an end");
        Ok(())
    }

    /// Adds points until triangles are well shaped and, by `size`, small. Lifts what it adds.
    ///
    /// # Errors
    /// If there is no end to it.
    pub fn graded(
        &self,
        cdt: &mut Cdt,
        points: &mut Vec<DVec3>,
        lift: &impl Fn(DVec2) -> DVec3,
        size: &dyn Fn([DVec3; 3]) -> f64,
    ) -> Result<()> {
        loop {
            // Angles alone add few points to a mesh that was good before.
            let limit = 8 * cdt.num_vertices() + 1000;
            let complete = cdt.refine(self.parameters(limit)).refinement_complete;
            ensure!(complete, "refinement does not come to an end");
            lift_new(cdt, points, lift);
            let mut large: Vec<(f64, [FixedVertexHandle; 3])> = inner_faces(cdt, self.border)
                .into_iter()
                .map(|face| (size(face.map(|corner| points[corner.index()])), face))
                .filter(|(size, _)| *size > MAX_GRADED_AREA)
                .collect();
            if large.is_empty() {
                return Ok(());
            }
            large.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            for (_, face) in large {
                split(cdt, face)?;
            }
        }
    }

    fn parameters(&self, limit: usize) -> RefinementParameters<f64> {
        RefinementParameters::new()
            .keep_constraint_edges()
            .exclude_outer_faces(self.exclude_outside)
            .with_angle_limit(AngleLimit::from_radius_to_shortest_edge_ratio(RADIUS_TO_EDGE))
            .with_max_additional_vertices(limit)
    }
}

/// Puts a point into the middle of a triangle, if no split of a neighbour has taken it away.
fn split(cdt: &mut Cdt, [a, b, c]: [FixedVertexHandle; 3]) -> Result<()> {
    let still_there = cdt
        .get_edge_from_neighbors(a, b)
        .and_then(|edge| edge.opposite_vertex())
        .is_some_and(|opposite| opposite.fix() == c);
    if still_there {
        let [a, b, c] = [a, b, c].map(|corner| cdt.vertex(corner).position());
        cdt.insert(Point2::new((a.x + b.x + c.x) / 3.0, (a.y + b.y + c.y) / 3.0))?;
    }
    Ok(())
}
