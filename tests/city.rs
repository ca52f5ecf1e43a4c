//! The city of the generator is one conforming surface with true lines, whatever wrote it in whatever order; meshes that
//! are hard to work on are what they say.

#[allow(dead_code, unused_imports, reason = "the generator serves the example `gen`, too")]
#[path = "../tools/gen/mod.rs"]
mod generator;
mod support;

use crease::glam::DVec3;
use crease::input::MeshSource;
use crease::mesh::VertexId;
use generator::adversarial::Adversary;
use generator::noise::NoiseKind;
use generator::ply::Scalar;
use generator::scan::write::{Style, write};
use generator::scan::{CityScan, Counts, MEAN_EDGE};
use generator::shape::Shape;
use generator::stream::{Links, StreamedPly};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use support::Mesh;

fn city(triangles: u64, seed: u64) -> CityScan {
    CityScan::new(triangles, seed).unwrap()
}

fn places(city: &CityScan) -> impl Iterator<Item = [u64; 2]> + use<> {
    let [columns, rows] = city.size();
    (0..rows).flat_map(move |y| (0..columns).map(move |x| [x, y]))
}

/// All blocks of a city as one mesh.
fn whole(city: &CityScan) -> Shape {
    let mut first = BTreeMap::new();
    let mut vertices = 0;
    for place in places(city) {
        first.insert(place, vertices);
        vertices += city.counts(place).vertices;
    }
    let mut shape = Shape::default();
    for [x, y] in places(city) {
        let block = city.block([x, y]);
        let own = block.positions.len();
        let id = |corner: u32| match (corner as usize).checked_sub(own) {
            None => first[&[x, y]] as u32 + corner,
            Some(ghost) => {
                let ghost = block.ghosts[ghost];
                first[&[x + ghost.step[0], y + ghost.step[1]]] as u32 + ghost.index
            }
        };
        shape.faces.extend(block.faces.iter().map(|face| face.map(id)));
        shape.vertices.extend(&block.positions);
        shape.lines.extend(block.lines);
    }
    shape
}

/// The faces at each edge, under both ends in ascending order, each with whether it runs along the edge upwards.
fn edges(shape: &Shape) -> BTreeMap<[u32; 2], Vec<(usize, bool)>> {
    let mut edges: BTreeMap<[u32; 2], Vec<(usize, bool)>> = BTreeMap::new();
    for (face, &[a, b, c]) in shape.faces.iter().enumerate() {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            edges.entry([from.min(to), from.max(to)]).or_default().push((face, from < to));
        }
    }
    edges
}

#[test]
fn a_city_is_one_conforming_surface() {
    for (triangles, seed) in [(5_000, 1), (30_000, 2), (90_000, 3)] {
        let shape = whole(&city(triangles, seed));
        let edges = edges(&shape);
        for (edge, faces) in &edges {
            match faces[..] {
                [_] => {}
                [(_, up), (_, other)] => assert_ne!(up, other, "{edge:?} is traversed in one direction"),
                _ => panic!("{} faces at {edge:?}", faces.len()),
            }
        }
        // A disc: houses are bumps.
        let euler = shape.vertices.len() as i64 - edges.len() as i64 + shape.faces.len() as i64;
        assert_eq!(euler, 1, "{triangles} triangles, seed {seed}");
        let used: BTreeSet<u32> = shape.faces.iter().flatten().copied().collect();
        assert_eq!(used.len(), shape.vertices.len());
        for &face in &shape.faces {
            let normal = shape.area_normal(face);
            assert!(normal.length() > 0.05, "a face without area: {:?}", shape.triangle(face));
            assert!(normal.z > -1e-9, "a face looks down: {:?}", shape.triangle(face));
        }
    }
}

#[test]
fn its_creases_are_the_true_lines() {
    let shape = whole(&city(60_000, 5));
    let bits = |p: DVec3| p.to_array().map(f64::to_bits);
    let vertex: BTreeMap<_, u32> = (0..).zip(&shape.vertices).map(|(i, &p)| (bits(p), i)).collect();
    let mut on_lines = BTreeSet::new();
    for segment in shape.lines.iter().flat_map(|line| line.windows(2)) {
        let [a, b] = [vertex[&bits(segment[0])], vertex[&bits(segment[1])]];
        assert!(on_lines.insert([a.min(b), a.max(b)]), "two lines run along one edge");
    }
    let edges = edges(&shape);
    let normal = |face: usize| shape.area_normal(shape.faces[face]).normalize();
    let (mut least, mut most) = (f64::INFINITY, 0.0f64);
    for (edge, faces) in edges.iter().filter(|(_, faces)| faces.len() == 2) {
        let angle = normal(faces[0].0).angle_between(normal(faces[1].0)).to_degrees();
        if on_lines.remove(edge) {
            least = least.min(angle);
        } else {
            most = most.max(angle);
        }
    }
    assert!(on_lines.is_empty(), "{} segments are not edges", on_lines.len());
    assert!(least > 30.0, "a line folds by {least} degrees only");
    assert!(most < 12.0, "beside the lines the surface folds by {most} degrees");
}

#[test]
fn counts_are_known_before_a_block_is_made() {
    let city = city(600_000, 7).with_noise(NoiseKind::Isotropic, 0.1).unwrap();
    let mut sum = 0;
    for place in places(&city) {
        let counts = city.counts(place);
        sum += counts.faces;
        assert_eq!(city.block(place).counts(), counts, "{place:?}");
    }
    assert!((sum as f64 / 600_000.0 - 1.0).abs() < 0.03, "{sum}");
}

#[test]
fn sizes_are_those_asked_for() {
    for (triangles, tolerance) in [(1e4, 0.1), (1e5, 0.05), (3e6, 0.03), (1e9, 0.03), (8e9, 0.03)] {
        let city = city(triangles as u64, 1);
        let [columns, rows] = city.size();
        // The mean of a few blocks spread over the city.
        let step = (columns * rows).div_ceil(2000);
        let sampled: Vec<u64> = (0..columns * rows)
            .step_by(step as usize)
            .map(|block| city.counts([block % columns, block / columns]).faces)
            .collect();
        let mean = sampled.iter().sum::<u64>() as f64 / sampled.len() as f64;
        let all = mean * (columns * rows) as f64;
        assert!((all / triangles - 1.0).abs() < tolerance, "{triangles}: {all}");
    }
    let error = CityScan::new(1000, 1).unwrap_err().to_string();
    assert!(error.contains("5000 triangles"), "{error}");
}

#[test]
fn noise_is_as_strong_as_asked_for() {
    let clean = city(60_000, 4);
    let shape = whole(&clean);
    let mean = shape.mean_edge_length();
    assert!((mean / MEAN_EDGE - 1.0).abs() < 0.02, "the mean edge is {mean}");
    let normals = shape.vertex_normals();
    for (kind, dimensions) in [(NoiseKind::Normal, 1.0), (NoiseKind::Isotropic, 3.0)] {
        let noisy = whole(&clean.with_noise(kind, 0.2).unwrap());
        assert_eq!(noisy.faces, shape.faces);
        assert_eq!(noisy.lines, shape.lines);
        let moves: Vec<DVec3> = noisy.vertices.iter().zip(&shape.vertices).map(|(a, b)| *a - *b).collect();
        let square: f64 = moves.iter().map(|m| m.length_squared()).sum();
        let deviation = (square / moves.len() as f64 / dimensions).sqrt();
        assert!((deviation / (0.2 * MEAN_EDGE) - 1.0).abs() < 0.02, "{kind}: {deviation}");
        let aside: f64 = moves.iter().zip(&normals).map(|(m, n)| m.reject_from(*n).length_squared()).sum();
        // Only at the borders of blocks is the normal that of the ground, not that of the faces.
        assert_eq!(kind == NoiseKind::Normal, aside < 0.01 * square, "{kind}: {}", aside / square);
    }
    assert!(clean.with_noise(NoiseKind::Quantised, 0.1).is_err());
    assert!(clean.with_noise(NoiseKind::Normal, -0.1).is_err());
}

/// Writes a city and returns the bytes of the mesh and of the lines.
fn written(city: &CityScan, threads: usize, offset: Option<DVec3>, shuffle: Option<u64>) -> [Vec<u8>; 2] {
    let place = tempfile::tempdir().unwrap();
    let [mesh, truth] = ["mesh.ply", "truth.ply"].map(|name| place.path().join(name));
    let style = Style { mesh: &mesh, truth: Some(&truth), offset, shuffle };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| write(city, &style)).unwrap();
    let names = fs::read_dir(place.path()).unwrap().count();
    assert_eq!(names, 2, "something was left behind");
    [mesh, truth].map(|path| fs::read(path).unwrap())
}

#[test]
fn files_are_the_blocks_in_order_for_any_number_of_threads() {
    let city = city(90_000, 6).with_noise(NoiseKind::Normal, 0.03).unwrap();
    let offset = DVec3::new(5e5, -4e6, 100.0);
    let [mesh, truth] = written(&city, 1, Some(offset), None);
    for shuffle in [None, Some(2)] {
        let one = written(&city, 1, Some(offset), shuffle);
        assert!(one == written(&city, 3, Some(offset), shuffle), "shuffled by {shuffle:?}");
    }
    let mut shape = whole(&city);
    shape.translate(offset);
    assert!(mesh == generator::ply::mesh_bytes(&shape, Scalar::Double).unwrap());
    assert!(truth == generator::ply::line_bytes(&shape.lines).unwrap());
}

/// Triangles as the bits of their corners, each rotated to begin with its least.
fn triangles(path: &Path) -> Vec<[[u64; 3]; 3]> {
    let mesh = mesh_of(path);
    let corners = |face: &[u32; 3]| face.map(|v| mesh.positions[v as usize].to_array().map(f64::to_bits));
    mesh.faces
        .iter()
        .map(|face| {
            let mut corners = corners(face);
            let least = (0..3).min_by_key(|&k| corners[k]).unwrap();
            corners.rotate_left(least);
            corners
        })
        .collect()
}

fn mesh_of(path: &Path) -> Mesh {
    let source = support::open(path);
    let mut mesh = Mesh { positions: Vec::new(), faces: Vec::new() };
    source.read_positions(VertexId(0), source.vertex_count() as usize, &mut mesh.positions).unwrap();
    let mut block = crease::input::FaceBlock::default();
    for index in 0..source.block_count() {
        source.read_block(index, &mut block).unwrap();
        mesh.faces.extend(block.corners.iter().map(|face| face.map(|id| id.0 as u32)));
    }
    mesh
}

#[test]
fn a_shuffled_file_holds_the_same_triangles() {
    let city = city(50_000, 8);
    let place = tempfile::tempdir().unwrap();
    let [plain, shuffled] = ["plain.ply", "shuffled.ply"].map(|name| place.path().join(name));
    let style = |mesh, shuffle| Style { mesh, truth: None, offset: None, shuffle };
    let counts: [Counts; 2] =
        [style(&plain, None), style(&shuffled, Some(3))].map(|style| write(&city, &style).unwrap());
    assert_eq!(counts[0], counts[1]);
    let [mut a, mut b] = [triangles(&plain), triangles(&shuffled)];
    assert_eq!(a.len() as u64, counts[0].faces);
    assert_ne!(a, b);
    a.sort_unstable();
    b.sort_unstable();
    assert!(a == b, "the triangles differ");
    // Neighbours in the file are far apart, vertices and faces alike.
    let mesh = mesh_of(&shuffled);
    let extent = Shape { vertices: mesh.positions.clone(), ..Shape::default() }.bounds();
    let far = 0.2 * (extent.1 - extent.0).length();
    let apart = |a: DVec3, b: DVec3| usize::from(a.distance(b) > far);
    let vertices: usize = mesh.positions.windows(2).map(|pair| apart(pair[0], pair[1])).sum();
    assert!(2 * vertices > mesh.positions.len(), "{vertices}");
    let first = |face: &[u32; 3]| mesh.positions[face[0] as usize];
    let faces: usize = mesh.faces.windows(2).map(|pair| apart(first(&pair[0]), first(&pair[1]))).sum();
    assert!(2 * faces > mesh.faces.len(), "{faces}");
}

#[test]
fn headers_know_the_limits_of_ply() {
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("mesh.ply");
    for (vertices, word) in [(1 << 31, "int"), ((1 << 31) + 1, "uint"), (1 << 32, "uint")] {
        StreamedPly::create(&path, Scalar::Float, vertices, Links::Faces, 9_000_000_000).unwrap();
        let header = fs::read_to_string(&path).unwrap();
        assert!(header.contains(&format!("property list uchar {word} vertex_indices\n")), "{header}");
        assert!(header.contains("element face 9000000000\n"), "{header}");
    }
    fs::remove_file(&path).unwrap();
    let refused = StreamedPly::create(&path, Scalar::Float, (1 << 32) + 1, Links::Faces, 1).unwrap_err();
    assert!(refused.to_string().contains("2^32"), "{refused}");
    assert!(!path.exists());
}

#[test]
fn hard_meshes_are_hard_for_their_reasons() {
    let place = tempfile::tempdir().unwrap();
    for name in Adversary::ALL {
        let described = name.describe(3000, 1).unwrap();
        let path = place.path().join(format!("{name}.ply"));
        described.write(&path, Scalar::Double).unwrap();
        let mesh = mesh_of(&path);
        assert_eq!(mesh.positions.len() as u64, described.vertices, "{name}");
        assert_eq!(mesh.faces.len() as u64, described.faces, "{name}");
        assert!((2700..3200).contains(&mesh.faces.len()), "{name}: {}", mesh.faces.len());
        let of = |face: &[u32; 3]| face.map(|v| mesh.positions[v as usize]);
        let longest = |face: &[u32; 3]| {
            let [a, b, c] = of(face);
            a.distance(b).max(b.distance(c)).max(c.distance(a))
        };
        let shape = Shape { vertices: mesh.positions.clone(), ..Shape::default() };
        let (low, high) = shape.bounds();
        let width = high.x - low.x;
        let as_wide = mesh.faces.iter().filter(|face| longest(face) > 0.9 * width).count();
        match name {
            Adversary::Coincident => assert_eq!(low, high),
            Adversary::Fan => {
                assert!(mesh.faces.iter().all(|face| face.contains(&0)));
                assert!(mesh.positions[1].distance(mesh.positions[0]) > 100.0);
            }
            Adversary::Needles => assert!(as_wide >= 30, "{as_wide}"),
            Adversary::Pile => {
                let inside = mesh.positions.iter().filter(|p| p.length() < 2e-6 * width).count();
                assert_eq!(inside, mesh.positions.len() - 24);
            }
            Adversary::Giants => {
                let large = mesh.faces.iter().filter(|face| longest(face) > 0.3 * width).count();
                assert_eq!(large, 18);
            }
            Adversary::Corners => {
                let apart = |pair: &[DVec3]| pair[0].distance(pair[1]) > 0.8 * width;
                assert!(mesh.positions.windows(2).all(apart));
                let next = |pair: &[[u32; 3]]| of(&pair[0])[0].distance(of(&pair[1])[0]) > 0.8 * width;
                assert!(mesh.faces.windows(2).all(next));
            }
        }
        assert!(!name.purpose().is_empty());
        assert_eq!(name.to_string().parse::<Adversary>().unwrap(), name);
    }
    assert!(Adversary::Fan.describe(10, 1).is_err());
    assert!("giant".parse::<Adversary>().is_err());
}
