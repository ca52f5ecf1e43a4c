//! One smooth piece of a surface, meshed in a plane chart.
//!
//! In: border rings and inner lines with their places in the chart and in space; out: triangles of about the target
//! edge length by constrained Delaunay refinement. Border and inner lines are kept exactly and never split, so that
//! neighbouring patches fit.

use super::refine::Refinement;
use anyhow::{Context, Result, ensure};
use glam::{DVec2, DVec3};
use spade::handles::{FixedDirectedEdgeHandle, FixedVertexHandle};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};
use std::collections::BTreeSet;

/// A triangulation of a chart.
pub type Cdt = ConstrainedDelaunayTriangulation<Point2<f64>>;

/// A fixed vertex: where it lies in the chart, and where in space.
#[derive(Clone, Copy, Debug)]
pub struct Pin {
    /// In the chart.
    pub uv: DVec2,
    /// In space.
    pub at: DVec3,
}

/// What to mesh. Charts are seen from outside: `u` to the right and `v` up, the surface faces the viewer.
#[derive(Clone, Debug, Default)]
pub struct Patch {
    /// Closed borders, of the patch and of its holes, in either direction.
    pub rings: Vec<Vec<Pin>>,
    /// Open polylines inside that the mesh must contain.
    pub lines: Vec<Vec<Pin>>,
}

/// Where points are put between the pins.
#[derive(Clone, Copy)]
pub enum Fill<'a> {
    /// Nowhere.
    Pins,
    /// Evenly in the chart, with this target edge length.
    Even(f64),
    /// By the area of a triangle in space in units of its squared target edge length.
    Graded(&'a dyn Fn([DVec3; 3]) -> f64),
}

/// Triangles of one patch.
#[derive(Clone, Debug, Default)]
pub struct Piece {
    /// Positions; some may be unused.
    pub points: Vec<DVec3>,
    /// Corners, counter-clockwise from outside.
    pub faces: Vec<[usize; 3]>,
}

/// A plane in space as chart: `u` cross `v` points outwards.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// Where `u` and `v` are zero.
    pub origin: DVec3,
    /// Unit vector of the first coordinate.
    pub u: DVec3,
    /// Unit vector of the second coordinate, at right angles to `u`.
    pub v: DVec3,
}

impl Plane {
    /// From space to the chart.
    pub fn place(&self, at: DVec3) -> DVec2 {
        DVec2::new((at - self.origin).dot(self.u), (at - self.origin).dot(self.v))
    }

    /// From the chart to space.
    pub fn lift(&self, uv: DVec2) -> DVec3 {
        self.origin + self.u * uv.x + self.v * uv.y
    }
}

impl Patch {
    /// Meshes the patch; `lift` places the points between the pins.
    ///
    /// # Errors
    /// If borders or lines cross or touch other than in common points.
    pub fn mesh(&self, fill: Fill<'_>, lift: impl Fn(DVec2) -> DVec3) -> Result<Piece> {
        let mut cdt = Cdt::new();
        let mut pinned = Vec::new();
        let mut border = BTreeSet::new();
        // All points come before the first constraint: a point that hits a constraint would split it.
        let rings = self.insert(&self.rings, &mut cdt, &mut pinned)?;
        let lines = self.insert(&self.lines, &mut cdt, &mut pinned)?;
        for ring in &rings {
            for (i, &from) in ring.iter().enumerate() {
                let to = ring[(i + 1) % ring.len()];
                constrain(&mut cdt, from, to)?;
                border.insert(key(from, to));
            }
        }
        for segment in lines.iter().flat_map(|line| line.windows(2)) {
            constrain(&mut cdt, segment[0], segment[1])?;
        }
        // Without inner lines the outside is left alone. With them it cannot be told apart by the library (a line looks
        // like a border) and is refined too; those triangles are dropped afterwards.
        let refinement = Refinement { border: &border, exclude_outside: self.lines.is_empty() };
        let mut points = pinned;
        match fill {
            Fill::Pins => {}
            Fill::Even(spacing) => refinement.even(&mut cdt, spacing)?,
            Fill::Graded(size) => refinement.graded(&mut cdt, &mut points, &lift, size)?,
        }
        lift_new(&cdt, &mut points, &lift);
        let faces =
            inner_faces(&cdt, &border).into_iter().map(|face| face.map(|corner| corner.index())).collect();
        Ok(Piece { points, faces })
    }

    /// Inserts pins in order. Handles ascend from 0, so `pinned` is indexed by them; a pin met again keeps its handle.
    fn insert(
        &self,
        polylines: &[Vec<Pin>],
        cdt: &mut Cdt,
        pinned: &mut Vec<DVec3>,
    ) -> Result<Vec<Vec<FixedVertexHandle>>> {
        let mut place = |pin: &Pin| -> Result<FixedVertexHandle> {
            let handle = cdt.insert(Point2::new(pin.uv.x, pin.uv.y)).context("border point not usable")?;
            if handle.index() == pinned.len() {
                pinned.push(pin.at);
            }
            ensure!(pinned[handle.index()] == pin.at, "two points of space share a place in the chart");
            Ok(handle)
        };
        polylines.iter().map(|polyline| polyline.iter().map(&mut place).collect()).collect()
    }
}

/// An undirected edge as a sortable key.
fn key(a: FixedVertexHandle, b: FixedVertexHandle) -> (usize, usize) {
    (a.index().min(b.index()), a.index().max(b.index()))
}

fn constrain(cdt: &mut Cdt, from: FixedVertexHandle, to: FixedVertexHandle) -> Result<()> {
    ensure!(cdt.can_add_constraint(from, to), "border or line crosses another");
    cdt.add_constraint(from, to);
    ensure!(cdt.exists_constraint(from, to), "border or line passes through a point of another");
    Ok(())
}

/// Lifts the vertices of the triangulation that `points` has none for yet.
pub fn lift_new(cdt: &Cdt, points: &mut Vec<DVec3>, lift: impl Fn(DVec2) -> DVec3) {
    for vertex in cdt.vertices().skip(points.len()) {
        let position = vertex.position();
        points.push(lift(DVec2::new(position.x, position.y)));
    }
}

/// Triangles inside the rings: flood from outside, where each border edge changes sides.
pub fn inner_faces(cdt: &Cdt, border: &BTreeSet<(usize, usize)>) -> Vec<[FixedVertexHandle; 3]> {
    let mut inside: Vec<Option<bool>> = vec![None; cdt.num_all_faces()];
    let mut todo: Vec<(FixedDirectedEdgeHandle, bool)> =
        cdt.convex_hull().map(|edge| (edge.rev().fix(), false)).collect();
    while let Some((edge, from_inside)) = todo.pop() {
        let edge = cdt.directed_edge(edge);
        let face = edge.face();
        if face.is_outer() || inside[face.index()].is_some() {
            continue;
        }
        let [a, b] = edge.vertices().map(|vertex| vertex.fix());
        let now_inside = from_inside != border.contains(&key(a, b));
        inside[face.index()] = Some(now_inside);
        todo.extend([(edge.next().rev().fix(), now_inside), (edge.prev().rev().fix(), now_inside)]);
    }
    cdt.inner_faces()
        .filter(|face| inside[face.index()] == Some(true))
        .map(|face| face.vertices().map(|vertex| vertex.fix()))
        .collect()
}
