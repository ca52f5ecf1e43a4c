//! Lines as a person would draw them: fitted lines near the true ones, angles that are those of the surface.
//!
//! Shapes come from the generator with their true lines, clean and with noise. Distances are in median sides; what lies
//! farther than 1.5 of them from any true line is a false line and not a matter of fit.

#[allow(dead_code, reason = "the generator serves the example `gen`, too")]
#[path = "../tools/gen/mod.rs"]
mod generator;
mod support;

use crease::glam::DVec3;
use crease::input::MemorySource;
use crease::refine::Bend;
use crease::stitch::{Class, Geometry, LineSet};
use crease::{Detection, Params};
use generator::ShapeName;
use generator::shape::Shape;
use support::{in_core, run};

/// A shape with noise, and what is found on it.
struct Found {
    shape: Shape,
    found: Detection,
}

fn detect(name: &str, noise: f64, params: Params) -> Found {
    let mut shape = name.parse::<ShapeName>().expect("a name").build(1).expect("a shape");
    shape.add_noise(noise, 1);
    let source = MemorySource::new(&shape.vertices, &shape.faces).expect("a mesh");
    let found = run(&source, params, in_core()).0;
    assert!(!found.lines.lines.is_empty(), "{name} with noise {noise}: no lines");
    Found { shape, found }
}

impl Found {
    fn h(&self) -> f64 {
        self.found.scan.median_side
    }

    /// Distance of `point` from the true lines in median sides.
    fn off(&self, point: DVec3) -> f64 {
        let segments = self.shape.lines.iter().flat_map(|line| line.windows(2));
        let distance = |e: &[DVec3]| {
            let d = e[1] - e[0];
            let t = ((point - e[0]).dot(d) / d.dot(d)).clamp(0.0, 1.0);
            (e[0] + t * d - point).length()
        };
        segments.map(distance).fold(f64::INFINITY, f64::min) / self.h()
    }

    /// Root mean square distance from the true lines, and length as a share of that of the true lines.
    fn quality(&self, geometry: Geometry) -> (f64, f64) {
        let lines = self.found.lines.clone().with_geometry(geometry);
        let (mut squares, mut close, mut length) = (0.0, 0.0, 0.0);
        for e in lines.lines.iter().flat_map(|line| line.vertices.windows(2)) {
            let [a, b] = [e[0], e[1]].map(|v| lines.point(&lines.vertices[v as usize]));
            let edge = (b - a).length();
            length += edge;
            for i in 0..10 {
                let off = self.off(a + (b - a) * (0.05 + 0.1 * f64::from(i)));
                if off <= 1.5 {
                    squares += 0.1 * edge * off * off;
                    close += 0.1 * edge;
                }
            }
        }
        let truth: f64 =
            self.shape.lines.iter().flat_map(|l| l.windows(2)).map(|e| (e[1] - e[0]).length()).sum();
        ((squares / close).sqrt(), length / truth)
    }

    /// Angles in degrees at the line vertices near true lines, corners left out; sorted.
    fn angles(&self) -> Vec<f64> {
        let near = self.found.lines.vertices.iter().filter(|v| !v.corner && self.off(v.position) <= 1.5);
        let mut angles: Vec<f64> = near.map(|v| v.angle.to_degrees()).collect();
        angles.sort_by(f64::total_cmp);
        angles
    }
}

#[test]
fn fitted_lines_are_nearer_to_the_true_ones_and_no_longer() {
    // Shape, noise, and the most that the fitted lines may be off: a fifth more than was measured. Where two planes meet at
    // an angle a, an error of theirs is 1 / sin a times as large in the line.
    let cases = [
        ("bracket", 0.1, 0.08),
        ("bracket", 0.2, 0.12),
        ("bracket", 0.3, 0.20),
        ("city4", 0.2, 0.14),
        ("folds120", 0.2, 0.10),
        ("folds20", 0.1, 0.13),
        ("folds20", 0.2, 0.25),
        ("folds10", 0.1, 0.25),
    ];
    for (name, noise, most) in cases {
        let found = detect(name, noise, Params::default());
        let (along_edges, zigzag) = found.quality(Geometry::Vertices);
        let (fitted, length) = found.quality(Geometry::Fitted);
        let what =
            format!("{name}, noise {noise}: {along_edges:.3} and {fitted:.3}, {zigzag:.3} and {length:.3}");
        assert!(fitted < most && fitted < 0.75 * along_edges, "{what}");
        assert!(length < zigzag, "{what}");
    }
}

#[test]
fn angles_are_those_of_the_surface() {
    for (name, truth) in [("folds10", 10.0), ("folds20", 20.0), ("bracket", 90.0), ("folds120", 120.0)] {
        for (noise, tolerance) in [(0.0, 0.01), (0.1, 1.0), (0.2, 2.0)] {
            let angles = detect(name, noise, Params::default()).angles();
            let median = angles[angles.len() / 2];
            assert!((median - truth).abs() < tolerance, "{name}, noise {noise}: {median}");
        }
    }
}

#[test]
fn ridges_are_convex_and_valleys_concave() {
    let folds = detect("folds20", 0.1, Params::default());
    let lines = &folds.found.lines;
    let mut seen = [0; 3];
    for vertex in lines.vertices.iter().filter(|v| folds.off(v.position) < 0.5) {
        // Folds lie at 1, 2, 3, 4 times the width of a strip: a valley, a ridge, a valley, a ridge.
        let fold = (vertex.position.x / (16.0 * libm::cos(10f64.to_radians()))).round() as i64;
        let expected = if fold % 2 == 0 { Bend::Convex } else { Bend::Concave };
        seen[(vertex.bend == expected) as usize] += 1;
    }
    assert!(seen[1] > 50 && seen[0] * 20 < seen[1], "{seen:?}");
}

/// In a clean mesh the vertices lie on the lines, and so do the fitted points; corners stay corners.
#[test]
fn clean_lines_stay_where_they_are() {
    let found = detect("bracket", 0.0, Params::default());
    let lines = &found.found.lines;
    let mut corners = 0;
    for vertex in lines.vertices.iter().filter(|v| found.off(v.position) < 1e-6) {
        // The round hole has a radius of 3.6 sides: planes through its wall cut it short.
        let hole =
            ((vertex.position - DVec3::new(24.0, 6.0, 0.0)) * DVec3::new(1.0, 1.0, 0.0)).length() < 4.0;
        let (off, moved) = (found.off(vertex.fitted), (vertex.fitted - vertex.position).length() / found.h());
        assert!(off < if hole { 0.2 } else { 0.05 }, "{} at {} is off by {off}", vertex.id, vertex.position);
        corners += usize::from(vertex.corner && moved < 0.01);
    }
    assert!(corners >= 10, "{corners} of 12 corners");
}

/// Every line that ends at a vertex ends at the same point, and no point is far from its vertex.
#[test]
fn lines_that_meet_go_on_meeting() {
    let found = detect("city4", 0.2, Params::default());
    let lines = found.found.lines.clone().with_geometry(Geometry::Fitted);
    for vertex in &lines.vertices {
        let moved = (vertex.fitted - vertex.position).length() / found.h();
        assert!(moved <= 1.5 + 1e-9, "{} moved by {moved}", vertex.id);
    }
    let back = lines.clone().with_geometry(Geometry::Vertices);
    assert_eq!(back, found.found.lines);
    assert!(lines.lines.iter().zip(&back.lines).all(|(a, b)| a.vertices == b.vertices && a.class == b.class));
}

#[test]
fn the_smallest_angle_is_that_of_a_line() {
    let count = |lines: &LineSet, class| lines.lines.iter().filter(|l| l.class == class).count();
    // A fold of 10 degrees at this noise is seen as 3 by the tensors; what counts is that it is one of 10.
    let at = |min_angle_deg| detect("folds10", 0.1, Params { min_angle_deg, ..Params::default() });
    let (all, floor) = (at(0.0), at(7.0));
    assert!(count(&floor.found.lines, Class::Weak) >= 4);
    assert!(floor.found.lines.lines.iter().all(|line| line.angle >= 7.0));
    assert!(floor.found.lines.lines.len() <= all.found.lines.lines.len());
    let mut shape = "folds10".parse::<ShapeName>().expect("a name").build(1).expect("a shape");
    shape.add_noise(0.1, 1);
    let source = MemorySource::new(&shape.vertices, &shape.faces).expect("a mesh");
    let (none, fields) = run(&source, Params { min_angle_deg: 40.0, ..Params::default() }, in_core());
    assert!(none.lines.lines.is_empty());
    assert!(fields.0.values().all(|f| !matches!(f.class, Class::Weak | Class::Sharp)));
}
