//! Baselines on meshes small enough to know the answer.

use super::super::metric::score;
use super::*;

/// A sheet of 16 by 16 squares, bent up at x = 8 by `angle_deg`, z moved by `noise` up and down like a chessboard.
fn bent_sheet(angle_deg: f64, noise: f64) -> Mesh {
    let (n, mut mesh) = (16_u32, Mesh::default());
    let (sine, cosine) = libm::sincos(angle_deg.to_radians());
    for y in 0..=n {
        for x in 0..=n {
            let beyond = f64::from(x) - 8.0;
            let lift = if (x + y) % 2 == 0 { noise } else { -noise };
            let (x, z) =
                if beyond > 0.0 { (8.0 + beyond * cosine, beyond * sine) } else { (8.0 + beyond, 0.0) };
            mesh.positions.push(DVec3::new(x, y.into(), z + lift));
        }
    }
    for a in (0..n * (n + 1)).filter(|a| a % (n + 1) < n) {
        let up = a + n + 1;
        mesh.faces.extend([[a, a + 1, up + 1], [a, up + 1, up]]);
    }
    mesh
}

fn crease() -> Truth {
    Truth::of_lines(Lines::of_polylines(&[(0..=16).map(|y| DVec3::new(8.0, f64::from(y), 0.0)).collect()]))
}

#[test]
fn the_fixed_threshold_takes_edges_from_30_degrees_on() {
    for (angle, edges) in [(31.0, 16), (29.0, 0)] {
        let found = all(&bent_sheet(angle, 0.0), &crease(), 1.0);
        assert_eq!(found[0].lines.chains.len(), edges, "{angle}");
    }
}

#[test]
fn the_chosen_threshold_finds_a_clean_fold_of_any_angle() {
    for angle in [1.0, 29.0, 80.0] {
        let found = all(&bent_sheet(angle, 0.0), &crease(), 1.0);
        for baseline in &found[1..] {
            assert_eq!(score(&baseline.lines, &crease(), 1.0).at_1h.f1, 1.0, "{angle} {}", baseline.name);
        }
    }
}

#[test]
fn filters_find_what_noise_hides() {
    let mesh = bent_sheet(40.0, 0.3);
    let f1: Vec<f64> =
        all(&mesh, &crease(), 1.0).iter().map(|found| score(&found.lines, &crease(), 1.0).at_1h.f1).collect();
    assert!(f1[1] < 0.9, "{f1:?}");
    assert!(f1[2] > 0.95 && f1[3] > f1[1], "{f1:?}");
}

/// The sweep sorts; a score counts. Both must see the same.
#[test]
fn the_sweep_agrees_with_the_score() {
    let mesh = bent_sheet(25.0, 0.2);
    let sweep = Sweep::new(&mesh, &crease(), 1.0);
    let angles = angles(&sweep, &mesh.face_normals());
    let best = sweep.best(&angles);
    let quality_at = |threshold: f64| score(&sweep.lines(&mesh, &angles, threshold), &crease(), 1.0).at_1h;
    let (a, b) = (best.quality, quality_at(best.threshold_deg));
    assert!((a.precision - b.precision).abs() < 1e-12 && (a.recall - b.recall).abs() < 1e-12, "{a:?} {b:?}");
    for threshold in [5.0, 15.0, 20.0, 25.0, 30.0, 40.0, 60.0] {
        assert!(quality_at(threshold).f1 <= best.quality.f1 + 1e-12, "{threshold}");
    }
}

#[test]
fn nothing_is_the_best_choice_where_nothing_is() {
    for baseline in &all(&bent_sheet(0.0, 0.2), &Truth::default(), 1.0)[1..] {
        assert!(baseline.lines.chains.is_empty(), "{}", baseline.name);
    }
}

#[test]
fn taubin_smooths_and_does_not_shrink() {
    let mesh = bent_sheet(0.0, 0.3);
    let mut taubin = Taubin::new(&mesh);
    (0..20).for_each(|_| taubin.iterate());
    let middle = 8 * 17 + 8;
    assert!(taubin.positions[middle].z.abs() < 0.05);
    // Plain smoothing with the same number of steps would pull the corner in by more than an edge.
    assert!(taubin.positions[0].distance(mesh.positions[0]) < 1.0);
}

#[test]
fn the_bilateral_filter_keeps_an_edge_that_is_wider_than_its_range() {
    let mesh = bent_sheet(60.0, 0.0);
    let mut filter = Bilateral::new(&mesh);
    (0..20).for_each(|_| filter.iterate(0.2));
    let kept = mesh.face_normals().iter().zip(&filter.normals).all(|(a, b)| fold_angle_deg(*a, *b) < 0.1);
    assert!(kept);
    // One that is narrower is spread out.
    let mesh = bent_sheet(5.0, 0.0);
    let mut wide = Bilateral::new(&mesh);
    (0..20).for_each(|_| wide.iterate(0.6));
    let angles = angles(&Sweep::new(&mesh, &crease(), 1.0), &wide.normals);
    assert!(angles.iter().all(|angle| *angle < 2.5));
}
