//! The committed fixtures are what the generator makes, and its shapes are what they claim to be.

#[allow(dead_code, reason = "the generator serves the example `gen`, too")]
#[path = "../tools/gen/mod.rs"]
mod generator;

use generator::shape::Shape;
use generator::{ShapeName, fixtures, handmade};
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// What all fixtures together may weigh in the repository.
const BUDGET: usize = 1_500_000;

fn fixture_directory() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures")
}

fn shape(name: &str, seed: u64) -> Shape {
    name.parse::<ShapeName>().unwrap().build(seed).unwrap()
}

/// How often each directed edge occurs.
fn directed_edges(shape: &Shape) -> BTreeMap<(u32, u32), usize> {
    let mut edges = BTreeMap::new();
    for &[a, b, c] in &shape.faces {
        for edge in [(a, b), (b, c), (c, a)] {
            *edges.entry(edge).or_default() += 1;
        }
    }
    edges
}

/// Directed edges without their opposite. Asserts that no two faces see an edge in the same direction.
fn open_edges(shape: &Shape) -> Vec<(u32, u32)> {
    let edges = directed_edges(shape);
    assert!(edges.values().all(|&count| count == 1), "an edge has two faces on the same side");
    edges.keys().copied().filter(|&(a, b)| !edges.contains_key(&(b, a))).collect()
}

/// Distance of `point` from the nearest edge of the mesh.
fn distance_to_edges(shape: &Shape, point: DVec3) -> f64 {
    let distance = |&(a, b): &(u32, u32)| {
        let (a, b) = (shape.vertices[a as usize], shape.vertices[b as usize]);
        let t = (point - a).dot(b - a) / a.distance_squared(b);
        point.distance(a + (b - a) * t.clamp(0.0, 1.0))
    };
    directed_edges(shape).keys().map(distance).fold(f64::INFINITY, f64::min)
}

/// For each segment of the true lines that is an edge of the mesh: the angle between its two faces, in degrees.
fn angles_along_lines(shape: &Shape) -> Vec<f64> {
    let mut normal_left_of = BTreeMap::new();
    for &face in &shape.faces {
        let [a, b, c] = face;
        for edge in [(a, b), (b, c), (c, a)] {
            normal_left_of.insert(edge, shape.area_normal(face).normalize());
        }
    }
    let bits = |point: DVec3| point.to_array().map(f64::to_bits);
    let index: BTreeMap<_, u32> = shape.vertices.iter().map(|&vertex| bits(vertex)).zip(0..).collect();
    let mut angles = Vec::new();
    for segment in shape.lines.iter().flat_map(|line| line.windows(2)) {
        let [a, b] = [segment[0], segment[1]].map(|point| index[&bits(point)]);
        let (left, right): (DVec3, DVec3) = (normal_left_of[&(a, b)], normal_left_of[&(b, a)]);
        angles.push(libm::atan2(left.cross(right).length(), left.dot(right)).to_degrees());
    }
    angles
}

/// The smallest angle of all triangles, in degrees.
fn smallest_angle(shape: &Shape) -> f64 {
    let angle = |a: DVec3, b: DVec3, c: DVec3| {
        let (u, v) = (b - a, c - a);
        libm::atan2(u.cross(v).length(), u.dot(v)).to_degrees()
    };
    let smallest = |&face: &[u32; 3]| {
        let [a, b, c] = shape.triangle(face);
        angle(a, b, c).min(angle(b, c, a)).min(angle(c, a, b))
    };
    shape.faces.iter().map(smallest).fold(f64::INFINITY, f64::min)
}

/// Files below `directory`, with `/` between names.
fn files_below(directory: &Path, prefix: &str, found: &mut BTreeSet<String>) {
    for entry in fs::read_dir(directory).unwrap() {
        let entry = entry.unwrap();
        let name = format!("{prefix}{}", entry.file_name().to_str().unwrap());
        if entry.file_type().unwrap().is_dir() {
            files_below(&entry.path(), &format!("{name}/"), found);
        } else {
            found.insert(name);
        }
    }
}

#[test]
fn committed_fixtures_are_what_the_generator_makes() {
    let hint = format!("to regenerate: {}", fixtures::COMMAND);
    let mut total = 0;
    for fixture in fixtures::all().unwrap() {
        let path = fixture_directory().join(&fixture.path);
        let committed = fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}; {hint}", path.display()));
        let difference = committed.iter().zip(&fixture.bytes).position(|(a, b)| a != b);
        assert!(
            committed == fixture.bytes,
            "{} differs: {} bytes instead of {}, first other byte at {difference:?}; {hint}",
            fixture.path,
            committed.len(),
            fixture.bytes.len(),
        );
        total += committed.len();
    }
    assert!(total <= BUDGET, "the fixtures take {total} bytes");
}

#[test]
fn there_are_no_other_fixtures() {
    let known: BTreeSet<String> = fixtures::all().unwrap().into_iter().map(|fixture| fixture.path).collect();
    let mut present = BTreeSet::new();
    files_below(&fixture_directory(), "", &mut present);
    // The golden results are those of tools/reference and have a test of their own.
    present.retain(|path| !path.starts_with("golden/"));
    let stray: Vec<_> = present.difference(&known).collect();
    assert!(stray.is_empty(), "not made by the generator: {stray:?}");
}

#[test]
fn writing_the_fixtures_writes_every_file() {
    let directory = tempfile::tempdir().unwrap();
    fixtures::write(directory.path()).unwrap();
    for fixture in fixtures::all().unwrap() {
        assert_eq!(
            fs::read(directory.path().join(&fixture.path)).unwrap(),
            fixture.bytes,
            "{}",
            fixture.path
        );
    }
}

#[test]
fn the_defects_are_where_the_list_says() {
    let shape = handmade::defects();
    let distinct = |face: [u32; 3]| BTreeSet::from(face).len();
    assert_eq!(shape.faces.len(), 133);
    assert_eq!(shape.faces[128], shape.faces[0]);
    assert_eq!(distinct(shape.faces[129]), 2);
    assert_eq!(distinct(shape.faces[130]), 3);
    assert_eq!(shape.area_normal(shape.faces[130]), DVec3::ZERO);
    let with_fin = shape.faces.iter().filter(|face| face.contains(&28) && face.contains(&29)).count();
    assert_eq!(with_fin, 3);
    let referenced: BTreeSet<u32> = shape.faces.iter().flatten().copied().collect();
    let unreferenced: Vec<u32> =
        (0..shape.vertices.len() as u32).filter(|i| !referenced.contains(i)).collect();
    assert_eq!(unreferenced, [82]);
    let flipped: Vec<usize> = (0..128).filter(|&i| shape.area_normal(shape.faces[i]).z < 0.0).collect();
    let listed: Vec<usize> = (72..78).chain(88..94).collect();
    assert_eq!(flipped, listed);
}

#[test]
fn the_bracket_is_closed_with_one_hole_through_it() {
    for seed in 1..=3 {
        let bracket = shape("bracket", seed);
        assert_eq!(open_edges(&bracket), []);
        let edges = directed_edges(&bracket).len() / 2;
        let euler = bracket.vertices.len() as i64 - edges as i64 + bracket.faces.len() as i64;
        assert_eq!(euler, 0);
        // Six times the volume by the divergence theorem; positive only if normals point outwards.
        let volume: f64 = bracket
            .faces
            .iter()
            .map(|&face| {
                let [a, b, c] = bracket.triangle(face);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        let expected = 10.0 * (32.0 * 12.0 + 20.0 * 12.0 - std::f64::consts::PI * 3.5 * 3.5);
        assert!((volume / expected - 1.0).abs() < 0.01, "{volume} instead of {expected}");
    }
}

#[test]
fn open_shapes_have_one_border_and_no_gaps() {
    for name in ["city1", "city2", "city4", "folds20", "folds10"] {
        let shape = shape(name, 1);
        // One border loop of a disk: as many border vertices as border edges, and Euler's number is 1.
        let border = open_edges(&shape);
        let starts: BTreeSet<u32> = border.iter().map(|&(a, _)| a).collect();
        assert_eq!(starts.len(), border.len(), "{name}");
        let edges = (directed_edges(&shape).len() + border.len()) / 2;
        assert_eq!(shape.vertices.len() + shape.faces.len(), edges + 1, "{name}");
    }
}

#[test]
fn true_lines_lie_on_edges_of_the_mesh() {
    for name in ["city2", "bracket", "folds20"] {
        let shape = shape(name, 2);
        assert!(!shape.lines.is_empty());
        for &point in shape.lines.iter().flatten() {
            let distance = distance_to_edges(&shape, point);
            assert!(distance < 1e-9, "{name}: {point} is {distance} away");
        }
    }
}

#[test]
fn folds_have_the_angle_they_claim() {
    for stated in [5.0, 10.0, 20.0, 45.0, 90.0] {
        let sheet = shape(&format!("folds{stated}"), 1);
        let angles = angles_along_lines(&sheet);
        assert!(angles.len() > 4 * 20);
        for angle in angles {
            assert!((angle - stated).abs() < 1e-6, "{angle} instead of {stated}");
        }
    }
}

#[test]
fn lines_of_solids_and_houses_are_sharp() {
    for (name, smallest) in [("bracket", 80.0), ("city4", 40.0)] {
        for angle in angles_along_lines(&shape(name, 1)) {
            assert!(angle > smallest, "{name}: {angle} degrees");
        }
    }
}

#[test]
fn triangles_are_well_shaped_and_of_the_stated_size() {
    for name in ["city", "bracket", "folds20"] {
        for seed in 1..=3 {
            let shape = shape(name, seed);
            let (angle, length) = (smallest_angle(&shape), shape.mean_edge_length());
            assert!(angle > 20.0, "{name} {seed}: smallest angle {angle}");
            assert!((0.95..1.05).contains(&length), "{name} {seed}: mean edge {length}");
        }
    }
}

#[test]
fn noise_has_the_stated_deviation() {
    let clean = shape("folds20", 1);
    let mut noisy = clean.clone();
    noisy.add_noise(0.1, 5);
    let squares: f64 = clean.vertices.iter().zip(&noisy.vertices).map(|(a, b)| a.distance_squared(*b)).sum();
    let deviation = (squares / clean.vertices.len() as f64).sqrt() / clean.mean_edge_length();
    assert!((0.09..0.11).contains(&deviation), "{deviation}");
    assert_eq!(clean.lines, noisy.lines);
}

#[test]
fn a_permuted_mesh_has_the_same_triangles_in_another_order() {
    let triangles = |shape: &Shape| -> Vec<[[u64; 3]; 3]> {
        let bits = |point: DVec3| point.to_array().map(f64::to_bits);
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

#[test]
fn seeds_give_different_meshes_and_the_same_seed_the_same() {
    for name in ["city2", "bracket", "folds20"] {
        assert_eq!(shape(name, 1), shape(name, 1));
        assert_ne!(shape(name, 1), shape(name, 2));
    }
}
