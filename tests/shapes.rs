//! The shapes of the generator are what they claim to be, in every style and with every kind of noise.

#[allow(dead_code, reason = "the generator serves the example `gen`, too")]
#[path = "../tools/gen/mod.rs"]
mod generator;

#[path = "support/measures.rs"]
mod measures;

use generator::ShapeName;
use generator::noise::NoiseKind;
use generator::ply::{Scalar, line_bytes, mesh_bytes};
use generator::shape::Shape;
use generator::style::Style;
use glam::DVec3;
use measures::{Surface, bits, sides, smallest_angles};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;

fn named(name: &str) -> ShapeName {
    name.parse().unwrap_or_else(|error| panic!("{name}: {error:#}"))
}

fn shape(name: &str, seed: u64) -> Shape {
    named(name).build(seed).unwrap_or_else(|error| panic!("{error:#}"))
}

/// The styles beside the plain one.
const STYLES: [Style; 6] = [
    Style { stretch: 5.0, ..Style::PLAIN },
    Style { density: 10.0, ..Style::PLAIN },
    Style { cad: true, ..Style::PLAIN },
    Style { edge: 0.6, ..Style::PLAIN },
    Style { edge: 2.0, ..Style::PLAIN },
    Style { stretch: 3.0, density: 5.0, ..Style::PLAIN },
];

/// What is known of a shape.
struct Known {
    name: &'static str,
    /// Euler's number: 2 for a ball, 0 with a hole through it, 1 for a sheet.
    euler: i64,
    /// Of a solid.
    volume: Option<f64>,
    corners: usize,
    /// Smallest and largest angle along the true lines, in degrees; as the mesh has it, so with the deviation of a
    /// mesh from a round surface.
    angles: (f64, f64),
    /// The largest angle anywhere else.
    beside: f64,
}

const BOX: f64 = 34.0 * 28.0 * 24.0;

/// Every shape of the register. Volumes are those of the exact solids.
const KNOWN: [Known; 28] = [
    Known { name: "box", euler: 2, volume: Some(BOX), corners: 8, angles: (90.0, 90.0), beside: 0.0 },
    // 3 sqrt(3) / 2 r^2 h.
    Known {
        name: "hexprism",
        euler: 2,
        volume: Some(27_019.98),
        corners: 12,
        angles: (60.0, 90.0),
        beside: 0.0,
    },
    Known {
        name: "bracket",
        euler: 0,
        volume: Some(10.0 * (32.0 * 12.0 + 20.0 * 12.0 - PI * 3.5 * 3.5)),
        corners: 12,
        angles: (85.0, 95.0),
        beside: 21.0,
    },
    Known {
        name: "cylinder",
        euler: 2,
        volume: Some(PI * 14.0 * 14.0 * 30.0),
        corners: 0,
        angles: (88.0, 92.0),
        beside: 7.0,
    },
    Known {
        name: "rounded",
        euler: 2,
        // Without what lies between the corner and its circle.
        volume: Some(BOX - 24.0 * 36.0 * (1.0 - PI / 4.0)),
        corners: 6,
        angles: (85.0, 92.0),
        beside: 14.0,
    },
    Known {
        name: "cone",
        euler: 2,
        volume: Some(PI * 22.0 * 22.0 * 26.0 / 3.0),
        corners: 0,
        angles: (129.0, 131.0),
        beside: 30.0,
    },
    // Roofs and walls, and walls on rolling ground.
    Known { name: "city9", euler: 1, volume: None, corners: 84, angles: (50.0, 105.0), beside: 3.0 },
    Known { name: "sheet20", euler: 1, volume: None, corners: 0, angles: (20.0, 20.0), beside: 0.0 },
    Known { name: "sheet10", euler: 1, volume: None, corners: 0, angles: (10.0, 10.0), beside: 0.0 },
    Known { name: "sheet5", euler: 1, volume: None, corners: 0, angles: (5.0, 5.0), beside: 0.0 },
    Known {
        name: "torus",
        euler: 0,
        volume: Some(2.0 * PI * PI * 20.0 * 64.0),
        corners: 0,
        angles: (90.0, 90.0),
        beside: 12.0,
    },
    Known { name: "folds20", euler: 1, volume: None, corners: 0, angles: (20.0, 20.0), beside: 0.0 },
    Known { name: "folds10", euler: 1, volume: None, corners: 0, angles: (10.0, 10.0), beside: 0.0 },
    Known { name: "folds5", euler: 1, volume: None, corners: 0, angles: (5.0, 5.0), beside: 0.0 },
    Known {
        name: "stairs2",
        euler: 2,
        volume: Some(17_280.0),
        corners: 64,
        angles: (90.0, 90.0),
        beside: 0.0,
    },
    Known {
        name: "stairs3",
        euler: 2,
        volume: Some(17_820.0),
        corners: 44,
        angles: (90.0, 90.0),
        beside: 0.0,
    },
    Known {
        name: "stairs5",
        euler: 2,
        volume: Some(18_900.0),
        corners: 28,
        angles: (90.0, 90.0),
        beside: 0.0,
    },
    Known { name: "gear", euler: 0, volume: None, corners: 112, angles: (70.0, 95.0), beside: 14.0 },
    Known {
        name: "sphere",
        euler: 2,
        volume: Some(4.0 / 3.0 * PI * 8000.0),
        corners: 0,
        angles: (90.0, 90.0),
        beside: 6.0,
    },
    Known {
        name: "boxgrid2",
        euler: 2,
        volume: Some(7376.0),
        corners: 208,
        angles: (90.0, 90.0),
        beside: 0.0,
    },
    Known {
        name: "boxgrid3",
        euler: 2,
        volume: Some(8656.0),
        corners: 208,
        angles: (90.0, 90.0),
        beside: 0.0,
    },
    Known {
        name: "boxgrid5",
        euler: 2,
        volume: Some(11_600.0),
        corners: 208,
        angles: (90.0, 90.0),
        beside: 0.0,
    },
    Known { name: "wall2", euler: 2, volume: Some(8992.0), corners: 16, angles: (90.0, 90.0), beside: 0.0 },
    Known { name: "wall3", euler: 2, volume: Some(9408.0), corners: 16, angles: (90.0, 90.0), beside: 0.0 },
    Known { name: "boss", euler: 0, volume: None, corners: 4, angles: (85.0, 95.0), beside: 20.0 },
    Known { name: "loft", euler: 2, volume: None, corners: 4, angles: (5.0, 105.0), beside: 13.0 },
    Known { name: "terrain", euler: 1, volume: None, corners: 0, angles: (5.0, 42.0), beside: 8.0 },
    Known { name: "fading", euler: 1, volume: None, corners: 0, angles: (5.0, 40.0), beside: 11.0 },
];

#[test]
fn every_shape_is_known_by_its_name() {
    let names: Vec<String> = ShapeName::ALL.iter().map(ToString::to_string).collect();
    assert_eq!(names, KNOWN.map(|known| known.name));
    for (name, known) in names.iter().zip(ShapeName::ALL) {
        assert_eq!(named(name), known);
        let word = name.trim_end_matches(|c: char| c.is_ascii_digit());
        assert!(ShapeName::FORMS.split(", ").any(|form| form.split('[').next() == Some(word)), "{word}");
    }
    assert_eq!(named("stairs2.5").to_string(), "stairs2.5");
    for wrong in ["", "boxes", "box3", "city0", "city2.5", "folds200", "stairs0", "wall-1", "gear1"] {
        assert!(wrong.parse::<ShapeName>().is_err(), "{wrong}");
    }
}

#[test]
fn every_shape_is_the_surface_it_claims_to_be() {
    for known in &KNOWN {
        for seed in 1..=2 {
            let shape = shape(known.name, seed);
            check_surface(known, &shape, 0.01, known.name);
            let smallest = smallest_angles(&shape).into_iter().fold(f64::INFINITY, f64::min);
            assert!(smallest > 15.0, "{}: an angle of {smallest} degrees", known.name);
            let length = shape.mean_edge_length();
            assert!((0.95..1.05).contains(&length), "{}: mean edge {length}", known.name);
        }
    }
}

/// Surface, volume within a part, corners.
fn check_surface(known: &Known, shape: &Shape, tolerance: f64, what: &str) {
    let surface = Surface::new(shape);
    assert_eq!(surface.euler(), known.euler, "{what}");
    // Sheets have one border: as many vertices as edges.
    let border = surface.border();
    let starts: BTreeSet<u32> = border.iter().map(|&(a, _)| a).collect();
    assert_eq!(starts.len(), border.len(), "{what}");
    assert_eq!(border.is_empty(), known.euler != 1, "{what}");
    if let Some(volume) = known.volume {
        let found = surface.volume();
        assert!((found / volume - 1.0).abs() < tolerance, "{what}: volume {found} instead of {volume}");
    } else if known.euler != 1 {
        assert!(surface.volume() > 0.0, "{what}: inside out");
    }
    assert_eq!(shape.corners.len(), known.corners, "{what}");
    let on_lines: BTreeSet<_> = shape.lines.iter().flatten().map(|&point| bits(point)).collect();
    assert!(shape.corners.iter().all(|&corner| on_lines.contains(&bits(corner))), "{what}");
}

#[test]
fn every_style_keeps_the_surface_and_its_lines() {
    for known in &KNOWN {
        let plain = shape(known.name, 1);
        for style in &STYLES {
            let what = format!("{} {style}", known.name);
            let shape = match named(known.name).build_in(style, 1) {
                Ok(shape) => shape,
                Err(error) => {
                    let why = format!("{error:#}");
                    assert!(
                        why.contains("straight direction") || why.contains("flat faces"),
                        "{what}: {why}"
                    );
                    continue;
                }
            };
            // Circles of 12 to 30 pieces take more off than those of the plain style.
            check_surface(known, &shape, 0.06, &what);
            for face in &shape.faces {
                let [a, b, c] = shape.triangle(*face);
                let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
                let height = (b - a).cross(c - a).length() / longest;
                assert!(height > 1e-4 * longest, "{what}: a triangle {longest} long and {height} high");
            }
            let lines = Surface::new(&shape).angles_on_lines().len();
            assert_eq!(lines == 0, shape.lines.is_empty(), "{what}");
            let length = shape.line_length() / plain.line_length().max(1e-9);
            assert!(plain.lines.is_empty() || (0.9..1.1).contains(&length), "{what}: lines {length} as long");
        }
    }
}

#[test]
fn creases_have_the_angles_they_claim_and_there_are_no_others() {
    for known in &KNOWN {
        let shape = shape(known.name, 1);
        let surface = Surface::new(&shape);
        let angles = surface.angles_on_lines();
        let low = angles.iter().copied().fold(f64::INFINITY, f64::min);
        let high = angles.iter().copied().fold(0.0, f64::max);
        if !angles.is_empty() {
            assert!(low > known.angles.0 - 1e-6, "{}: only {low} degrees on a line", known.name);
            assert!(high < known.angles.1 + 1e-6, "{}: {high} degrees on a line", known.name);
        }
        for ((a, b), angle) in surface.angles_beside_lines() {
            let place = shape.vertices[a as usize];
            // At the tip of the cone the surface is a point.
            if known.name == "cone" && place.z.max(shape.vertices[b as usize].z) > 23.0 {
                continue;
            }
            assert!(
                angle < known.beside + 1e-6,
                "{}: {angle} degrees beside the lines at {place}",
                known.name
            );
        }
    }
}

#[test]
fn folds_have_their_angle_exactly() {
    for stated in [0.5, 5.0, 45.0, 90.0] {
        let sheet = shape(&format!("folds{stated}"), 1);
        let angles = Surface::new(&sheet).angles_on_lines();
        assert!(angles.len() > 4 * 20);
        assert!(angles.iter().all(|angle| (angle - stated).abs() < 1e-6), "{stated}: {angles:?}");
    }
}

#[test]
fn fading_creases_fade_and_end_where_they_are_weak() {
    // Both creases of the panel, and the edges of the loft: strong somewhere, weak at an end.
    for (name, lines, strong) in [("fading", 0..2, 25.0), ("loft", 0..4, 75.0)] {
        let whole = shape(name, 1);
        for line in lines {
            let one = Shape { lines: vec![whole.lines[line].clone()], ..whole.clone() };
            let angles = Surface::new(&one).angles_on_lines();
            let (low, high) = angles.iter().fold((180.0_f64, 0.0_f64), |(l, h), &a| (l.min(a), h.max(a)));
            // Triangles are some edges high: they see the crease a little before its end.
            assert!(low < 16.0 && high > strong, "{name} {line}: {low} to {high}");
        }
    }
}

#[test]
fn edges_are_as_long_as_asked_for() {
    for (edge, name) in [(0.3, "rounded"), (0.5, "cone"), (2.0, "terrain"), (0.7, "torus"), (0.5, "city1")] {
        let shape = named(name).build_in(&Style { edge, ..Style::PLAIN }, 1).unwrap();
        let mean = shape.mean_edge_length() / edge;
        assert!((0.95..1.05).contains(&mean), "{name} {edge}: {mean}");
    }
}

#[test]
fn a_graded_mesh_has_edges_of_all_the_lengths() {
    for name in ["box", "sphere", "torus", "terrain", "boss"] {
        let shape = named(name).build_in(&Style { density: 10.0, ..Style::PLAIN }, 1).unwrap();
        let (low, high) = shape.bounds();
        let mean_near = |corner: DVec3| {
            let near = |at: &DVec3| ((*at - corner) / (high - low)).abs().element_sum() < 1.1;
            let lengths: Vec<f64> =
                sides(&shape).into_iter().filter(|(_, at)| near(at)).map(|(length, _)| length).collect();
            lengths.iter().sum::<f64>() / lengths.len() as f64
        };
        let ratio = mean_near(high) / mean_near(low);
        assert!((2.0..8.0).contains(&ratio), "{name}: {ratio} between the halves of the shape");
        let mut lengths: Vec<f64> = sides(&shape).into_iter().map(|(length, _)| length).collect();
        lengths.sort_by(f64::total_cmp);
        let range = lengths[lengths.len() * 99 / 100] / lengths[lengths.len() / 100];
        // A round shape does not reach the corners of its box.
        assert!((4.0..40.0).contains(&range), "{name}: {range} between long and short edges");
        // At edges that must stay, the refinement leaves a cluster of small triangles here and there.
        let angles = smallest_angles(&shape);
        let flat = angles.iter().filter(|&&angle| angle < 15.0).count() as f64 / angles.len() as f64;
        let worst = angles.into_iter().fold(f64::INFINITY, f64::min);
        assert!(flat < 0.001 && worst > 1.0, "{name}: {flat} below 15 degrees, one has {worst}");
    }
}

#[test]
fn a_stretched_mesh_has_long_triangles() {
    // Of the edges of the sheet, how far they go along the folds and across.
    let sheet = named("folds10").build_in(&Style { stretch: 5.0, ..Style::PLAIN }, 1).unwrap();
    let (mut along, mut across) = (0.0, 0.0);
    for face in &sheet.faces {
        let [a, b, c] = sheet.triangle(*face);
        for step in [b - a, c - b, a - c] {
            along += step.y.abs();
            across += step.x.abs();
        }
    }
    let ratio: f64 = along / across;
    assert!((4.5..5.5).contains(&ratio), "{ratio}");
}

#[test]
fn cad_meshes_have_points_on_edges_and_arcs_only() {
    let cad = Style { cad: true, ..Style::PLAIN };
    let counts = [("box", 8, 12), ("stairs3", 44, 84), ("wall2", 16, 28), ("cylinder", 60, 116)];
    for (name, vertices, faces) in counts {
        let shape = named(name).build_in(&cad, 1).unwrap();
        assert_eq!((shape.vertices.len(), shape.faces.len()), (vertices, faces), "{name}");
    }
    // Slivers in the plate of the boss.
    let boss = named("boss").build_in(&cad, 1).unwrap();
    let slivers = smallest_angles(&boss).iter().filter(|&&angle| angle < 5.0).count();
    assert!(slivers > 20, "{slivers}");
}

#[test]
fn styles_that_make_no_sense_are_refused() {
    for style in [
        Style { edge: 0.0, ..Style::PLAIN },
        Style { edge: f64::NAN, ..Style::PLAIN },
        Style { stretch: 0.5, ..Style::PLAIN },
        Style { density: 100.0, ..Style::PLAIN },
    ] {
        assert!(ShapeName::Box.build_in(&style, 1).is_err(), "{style:?}");
    }
    let both = Style { edge: 0.5, stretch: 5.0, density: 10.0, cad: true };
    assert_eq!(both.to_string(), "--edge 0.5 --stretch 5 --density 10 --cad");
}

/// Root of the mean squared distance that the vertices moved, in mean edge lengths.
fn moved(clean: &Shape, noisy: &Shape) -> f64 {
    let squares: f64 = clean.vertices.iter().zip(&noisy.vertices).map(|(a, b)| a.distance_squared(*b)).sum();
    (squares / clean.vertices.len() as f64).sqrt() / clean.mean_edge_length()
}

#[test]
fn noise_has_the_stated_deviation() {
    let clean = shape("box", 1);
    let expected = [
        (NoiseKind::Normal, 1.0),
        (NoiseKind::Isotropic, 3.0_f64.sqrt()),
        (NoiseKind::Impulse, 0.1_f64.sqrt()),
        // Evenly distributed within a step, on walls; treads of the box are on steps or are not.
        (NoiseKind::Quantised, 1.0 / 12.0_f64.sqrt()),
    ];
    for (kind, factor) in expected {
        let mut noisy = clean.clone();
        noisy.add_noise_of(kind, 0.1, 5).unwrap();
        let deviation = moved(&clean, &noisy) / 0.1 / factor;
        let tolerance = if kind == NoiseKind::Quantised { 0.3 } else { 0.1 };
        assert!((deviation - 1.0).abs() < tolerance, "{kind}: {deviation} of what is stated");
        assert_eq!((&clean.lines, &clean.corners), (&noisy.lines, &noisy.corners));
        assert_eq!(kind.to_string().parse::<NoiseKind>().unwrap(), kind);
    }
    assert!("loud".parse::<NoiseKind>().is_err());
    for amount in [-0.1, f64::NAN, f64::INFINITY] {
        assert!(clean.clone().add_noise_of(NoiseKind::Normal, amount, 1).is_err());
    }
}

#[test]
fn impulses_move_one_vertex_in_ten() {
    let clean = shape("box", 1);
    let mut noisy = clean.clone();
    noisy.add_noise_of(NoiseKind::Impulse, 0.5, 2).unwrap();
    let changed = clean.vertices.iter().zip(&noisy.vertices).filter(|(a, b)| a != b).count();
    let part = changed as f64 / clean.vertices.len() as f64;
    assert!((0.085..0.115).contains(&part), "{part}");
}

#[test]
fn stripes_move_neighbours_together() {
    let clean = shape("terrain", 1);
    let mut noisy = clean.clone();
    noisy.add_noise_of(NoiseKind::Stripes, 0.2, 4).unwrap();
    let edge = clean.mean_edge_length();
    let deviation = moved(&clean, &noisy) / 0.2;
    // Three coordinates, a tilt of 1 at the edges, and the white part.
    assert!((1.0..2.6).contains(&deviation), "{deviation}");
    // In the middle of stripes there is no overlap: vertices differ by the white part and little of the tilt.
    let mut groups: BTreeMap<i64, Vec<DVec3>> = BTreeMap::new();
    for (a, b) in clean.vertices.iter().zip(&noisy.vertices) {
        let place = a.x / (10.0 * edge);
        if (place - libm::round(place)).abs() < 0.05 {
            groups.entry(libm::round(place) as i64).or_default().push((*b - *a) / (0.2 * edge));
        }
    }
    assert!(groups.len() >= 8);
    for moves in groups.values() {
        let mean = moves.iter().sum::<DVec3>() / moves.len() as f64;
        let spread = moves.iter().map(|step| step.distance_squared(mean)).sum::<f64>() / moves.len() as f64;
        assert!((0.25..0.4).contains(&spread.sqrt()), "{} within a stripe", spread.sqrt());
    }
}

#[test]
fn quantised_heights_are_steps() {
    let clean = shape("terrain", 1);
    let mut noisy = clean.clone();
    noisy.add_noise_of(NoiseKind::Quantised, 0.5, 1).unwrap();
    let step = 0.5 * clean.mean_edge_length();
    for (a, b) in clean.vertices.iter().zip(&noisy.vertices) {
        assert_eq!((a.x, a.y), (b.x, b.y));
        assert!((a.z - b.z).abs() <= 0.5 * step + 1e-12);
        assert!((b.z / step - libm::round(b.z / step)).abs() < 1e-9);
    }
}

#[test]
fn seeds_give_different_meshes_and_the_same_seed_the_same() {
    let bytes = |name: &str, style: &Style, seed: u64, kind: NoiseKind| {
        let mut shape = named(name).build_in(style, seed).unwrap();
        shape.add_noise_of(kind, 0.1, seed).unwrap();
        (mesh_bytes(&shape, Scalar::Double).unwrap(), line_bytes(&shape.lines).unwrap())
    };
    let graded = Style { density: 4.0, ..Style::PLAIN };
    let kinds = NoiseKind::ALL.iter().cycle();
    for (known, &kind) in KNOWN.iter().zip(kinds) {
        for style in [Style::PLAIN, graded] {
            let first = bytes(known.name, &style, 1, kind);
            assert_eq!(first, bytes(known.name, &style, 1, kind), "{} {kind}", known.name);
            assert_ne!(first.0, bytes(known.name, &style, 2, kind).0, "{} {kind}", known.name);
        }
    }
}

#[test]
fn a_moved_shape_takes_its_lines_and_corners_along() {
    let offset = DVec3::new(5e5, -6e6, 100.0);
    let still = shape("bracket", 1);
    let mut shape = still.clone();
    shape.translate(offset);
    for (a, b) in [(&still.vertices, &shape.vertices), (&still.corners, &shape.corners)] {
        assert!(a.iter().zip(b).all(|(a, b)| *a + offset == *b));
    }
    assert_eq!(still.lines[0][0] + offset, shape.lines[0][0]);
}

#[test]
fn a_permuted_mesh_has_the_same_triangles_in_another_order() {
    let triangles = |shape: &Shape| -> Vec<[[u64; 3]; 3]> {
        shape.faces.iter().map(|&face| shape.triangle(face).map(bits)).collect()
    };
    let shape = shape("folds20", 1);
    let mut permuted = shape.clone();
    permuted.permute(3);
    let (mut before, mut after) = (triangles(&shape), triangles(&permuted));
    assert_ne!(before, after);
    before.sort_unstable();
    after.sort_unstable();
    assert_eq!(before, after);
}
