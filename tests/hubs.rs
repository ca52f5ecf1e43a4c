//! A vertex with very many faces: work around it must not grow with a power of their number, and it is no seam.

mod support;

use crease::{Limits, Params, Tiling};
use glam::DVec3;
use std::f64::consts::TAU;
use support::{Mesh, first_difference, in_core, run, tiled};

/// A cylinder with a pointed lid that is one fan, of so many spokes. All edges but those of the rims are about as long as each
/// other, so that the whole lid lies within the radius of whatever looks around.
fn cylinder(spokes: u32) -> Mesh {
    let ring = |z: f64| {
        (0..spokes).map(move |i| {
            let angle = TAU * f64::from(i) / f64::from(spokes);
            DVec3::new(libm::cos(angle), libm::sin(angle), z)
        })
    };
    let mut positions = vec![DVec3::new(0.0, 0.0, 1.3)];
    positions.extend(ring(1.0).chain(ring(0.0)));
    let faces = (0..spokes).flat_map(|i| {
        let (a, b) = (1 + i, 1 + (i + 1) % spokes);
        [[0, a, b], [a, a + spokes, b], [b, a + spokes, b + spokes]]
    });
    Mesh { positions, faces: faces.collect() }
}

#[test]
fn a_lid_of_six_thousand_faces_ends_and_is_the_same_in_tiles() {
    let mesh = cylinder(6000);
    let source = mesh.source();
    let params = Params { min_length_sigmas: 1.0, boundaries: true, ..Params::default() };
    let whole = run(&source, params, in_core());
    // The rim is a crease, the open end a boundary, and the tip of the lid belongs to neither.
    assert!(whole.0.lines.lines.len() >= 2, "{} lines", whole.0.lines.lines.len());
    let on_tip = whole.0.lines.vertices.iter().filter(|v| v.id.0 == 0).count();
    assert_eq!(on_tip, 0);
    for limits in [tiled(2000, 2), Limits { tiling: Tiling::Faces(5000), ..tiled(5000, 1) }] {
        let found = run(&source, params, limits);
        assert_eq!(first_difference(&whole, &found), None);
    }
}
