//! Meshes with everything that can be wrong with one. What is refused says where and what to do; what is left out or kept
//! is counted, and the result is the same bytes in core, in tiles and from a mesh that was rewritten
//! (`docs/RELIABILITY.md`, "Bad input").

mod support;

use crease::glam::DVec3;
use support::Mesh;
use support::command::Place;

/// Sizes of the test meshes: several tiles of 200 faces.
const SIDE: u32 = 24;
const VERTICES: u32 = (SIDE + 1) * (SIDE + 1);

/// Runs `detect` in core, in tiles, and rewritten, and returns the summary of the first; all outputs have the same bytes.
#[track_caller]
fn same_in_all_ways(place: &Place, mesh: &str, words: &str) -> String {
    let run = |name: &str, how: &str| {
        place.does(&format!(
            "detect {mesh} --boundaries {words} {how} -o {name}.ply --attributes {name}.fields.ply"
        ))
    };
    let summary = run("core", "--in-core");
    for (name, how) in [
        ("tiles", "--tile-faces 200 --threads 2"),
        ("read", "--tile-faces 90 --io read"),
        ("sorted", "--tile-faces 200 --order rewrite"),
    ] {
        let tiled = run(name, how);
        assert!(place.read(&format!("{name}.ply")) == place.read("core.ply"), "{words} {how}: lines differ");
        assert!(
            place.read(&format!("{name}.fields.ply")) == place.read("core.fields.ply"),
            "{words} {how}: fields differ"
        );
        assert_eq!(defects(&tiled), defects(&summary), "{words} {how}");
    }
    summary
}

/// The part of a summary about defects.
fn defects(summary: &str) -> &str {
    let from = summary.find("defects seen").expect("defects");
    let to = summary.find("how it was done").expect("work");
    &summary[from..to]
}

/// Writes a mesh and finds its lines in all ways; the summary has all `parts`.
#[track_caller]
fn kept(mesh: &Mesh, parts: &[&str]) -> String {
    let place = Place::new();
    place.write("mesh.ply", &mesh.ply());
    let summary = same_in_all_ways(&place, "mesh.ply", "");
    parts.iter().for_each(|part| assert!(summary.contains(part), "{part:?} is not in {summary}"));
    summary
}

/// What `change` makes of a mesh is refused with `reason`. With `--bad-faces skip` it gives the bytes of the mesh without
/// the faces of which `bad` says that they are, and the summary and `info` have all `counts`.
#[track_caller]
fn refused_or_left_out(
    change: impl Fn(&mut Mesh),
    bad: impl Fn(&Mesh, &[u32; 3]) -> bool,
    reason: &str,
    counts: &[&str],
) {
    let place = Place::new();
    let mut mesh = Mesh::roof(SIDE);
    change(&mut mesh);
    place.write("bad.ply", &mesh.ply());
    for words in ["detect bad.ply --in-core", "detect bad.ply --tile-faces 200 --io read", "info bad.ply"] {
        place.run(words).refused(3, &["bad.ply: ", reason, "--bad-faces skip"]);
    }
    assert_eq!(place.names(), ["bad.ply"]);

    let summary = same_in_all_ways(&place, "bad.ply", "--bad-faces skip");
    let info = place.does("info bad.ply --bad-faces skip");
    for count in counts {
        assert!(summary.contains(count), "{count:?} is not in {summary}");
        // One line in `info`, a table in the summary.
        let count = count.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(info.contains(&count), "{count:?} is not in {info}");
    }
    let mut good = mesh.clone();
    good.faces.retain(|face| !bad(&mesh, face));
    // The table of attributes repeats positions as they are, but the scan refuses them: any will do for unused vertices.
    good.positions.iter_mut().filter(|p| !p.is_finite()).for_each(|p| *p = DVec3::ZERO);
    place.write("good.ply", &good.ply());
    place.does("detect good.ply --boundaries --in-core -o good.creases.ply");
    assert!(
        place.read("good.creases.ply") == place.read("core.ply"),
        "it is not the mesh without the bad faces"
    );
}

fn not_finite(mesh: &Mesh, face: &[u32; 3]) -> bool {
    face.iter().any(|&v| !mesh.positions[v as usize].is_finite())
}

#[test]
fn coordinates_that_are_not_finite() {
    refused_or_left_out(
        |mesh| mesh.positions[107].y = f64::NAN,
        not_finite,
        "vertex 107 at byte",
        &["6  faces left out: they have coordinates", "1  vertex with coordinates that are not finite"],
    );
    refused_or_left_out(
        |mesh| {
            mesh.positions[0].x = f64::INFINITY;
            mesh.positions[300].z = f64::NEG_INFINITY;
            mesh.positions[301].z = f64::NAN;
        },
        not_finite,
        "vertex 0 at byte",
        &["faces left out: they have coordinates", "3  vertices with coordinates"],
    );
}

#[test]
fn a_vertex_that_nobody_uses_may_not_be_nan_unless_that_is_said() {
    refused_or_left_out(
        |mesh| mesh.positions.push(DVec3::NAN),
        not_finite,
        "must be finite",
        &["1  vertex with coordinates that are not finite", "1  vertex that no face uses"],
    );
}

#[test]
fn indices_of_vertices_that_do_not_exist() {
    refused_or_left_out(
        |mesh| {
            mesh.faces[7][1] = VERTICES;
            mesh.faces[500] = [u32::MAX; 3];
        },
        |_, face| face.iter().any(|&v| v >= VERTICES),
        "face 7 at byte",
        &["2  faces left out: they name vertices that do not exist"],
    );
}

#[test]
fn a_polygon_loses_only_the_triangles_that_cannot_be_used() {
    let place = Place::new();
    let polygons = |faces: &[&[u8]]| {
        let mut bytes =
            b"ply\nformat binary_little_endian 1.0\nelement vertex 6\nproperty char x\nproperty char y\n\
                          property char z\n"
                .to_vec();
        bytes.extend(format!("element face {}\n", faces.len()).bytes());
        bytes.extend(b"property list uchar uchar vertex_indices\nend_header\n");
        bytes.extend([0, 0, 0, 2, 0, 0, 3, 2, 0, 1, 3, 0, 0, 2, 0, 1, 1, 2]);
        faces.iter().for_each(|face| {
            bytes.push(face.len() as u8);
            bytes.extend_from_slice(face);
        });
        bytes
    };
    place.write("bad.ply", &polygons(&[&[0, 1, 9, 3, 4], &[0, 1, 5], &[1, 9]]));
    place.write("good.ply", &polygons(&[&[0, 3, 4], &[0, 1, 5]]));
    place.run("detect bad.ply").refused(3, &["face 0 at byte", "names vertex 9"]);
    let summary = same_in_all_ways(&place, "bad.ply", "--bad-faces skip");
    assert!(summary.contains("2  faces left out: they name vertices that do not exist"), "{summary}");
    place.does("detect good.ply --boundaries --in-core -o good.creases.ply");
    assert_eq!(place.read("good.creases.ply"), place.read("core.ply"));
}

#[test]
fn a_mesh_of_bad_faces_only_is_refused_all_the_same() {
    let place = Place::new();
    let mut mesh = Mesh::roof(4);
    mesh.faces.iter_mut().for_each(|face| face[2] = 9_000);
    place.write("bad.ply", &mesh.ply());
    place.run("detect bad.ply --bad-faces skip").refused(3, &["no face can be used: 32 name vertices"]);
    let mut mesh = Mesh::roof(4);
    mesh.positions.iter_mut().for_each(|p| p.x = f64::NAN);
    place.write("bad.ply", &mesh.ply());
    place.run("detect bad.ply --bad-faces skip").refused(3, &["32 have coordinates that are not finite"]);
}

#[test]
fn faces_without_area_are_kept_and_do_not_vote() {
    let mut mesh = Mesh::roof(SIDE);
    // Three vertices in a row, and two in one place.
    mesh.faces.push([0, 1, 2]);
    mesh.positions[60] = mesh.positions[61];
    kept(&mesh, &["faces without area"]);
}

#[test]
fn faces_that_name_a_vertex_twice_are_left_out() {
    let mut mesh = Mesh::roof(SIDE);
    mesh.faces.extend([[5, 5, 6], [7, 8, 7], [9, 9, 9]]);
    kept(&mesh, &["3  faces that name a vertex twice"]);
}

#[test]
fn duplicates_are_left_out_whatever_their_direction() {
    let mut mesh = Mesh::roof(SIDE);
    let [a, b, c] = mesh.faces[10];
    mesh.faces.extend([[a, b, c], [c, b, a], [b, c, a]]);
    kept(&mesh, &["3  duplicates of other faces"]);
}

#[test]
fn edges_with_many_faces_are_kept() {
    let mut mesh = Mesh::roof(SIDE);
    for i in 0..5 {
        mesh.positions.push(DVec3::new(12.0, 12.0 + f64::from(i), 20.0));
        mesh.faces.push([12 + 12 * (SIDE + 1), 12 + 13 * (SIDE + 1), VERTICES + i]);
    }
    kept(&mesh, &["1  non-manifold edge, with three or more faces"]);
}

#[test]
fn vertices_that_nobody_uses_are_kept() {
    let mut mesh = Mesh::roof(SIDE);
    mesh.positions.extend([DVec3::splat(1e9), DVec3::ZERO]);
    kept(&mesh, &["2  vertices that no face uses"]);
}

#[test]
fn winding_need_not_agree() {
    let mut mesh = Mesh::roof(SIDE);
    mesh.faces.iter_mut().skip(100).step_by(7).for_each(|face| face.swap(0, 1));
    let summary = kept(&mesh, &["edges between faces of opposite winding"]);
    assert!(summary.contains("found"), "{summary}");
}

#[test]
fn pieces_need_not_hang_together() {
    let mut mesh = Mesh::roof(SIDE);
    for i in 0..3 {
        let (first, far) = (mesh.positions.len() as u32, DVec3::splat(1e4 * f64::from(i - 1)));
        mesh.positions.extend([far, far + DVec3::X, far + DVec3::Y]);
        mesh.faces.push([first, first + 1, first + 2]);
    }
    kept(&mesh, &["boundary edges"]);
}

#[test]
fn a_vertex_may_have_very_many_faces() {
    let spokes = 600;
    let mut mesh = Mesh { positions: vec![DVec3::ZERO], faces: Vec::new() };
    for i in 0..spokes {
        let turn = f64::from(i) / f64::from(spokes) * 4.0 - 2.0;
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        mesh.positions.push(DVec3::new(turn, side * (4.0 - turn * turn), 0.1 * turn));
    }
    mesh.faces.extend((1..spokes as u32).map(|i| [0, i, i + 1]));
    kept(&mesh, &[]);
}

#[test]
fn a_mesh_without_extent_has_no_lines() {
    let mut point = Mesh::roof(4);
    point.positions.iter_mut().for_each(|p| *p = DVec3::new(3.0, -1.0, 7.0));
    let summary = kept(&point, &["32  faces without area"]);
    assert!(summary.contains("found no lines") || summary.contains("boundary"), "{summary}");
    let mut line = Mesh::roof(4);
    line.positions.iter_mut().for_each(|p| *p = DVec3::new(p.x, 0.0, 0.0));
    kept(&line, &["without area"]);
}

#[test]
fn units_and_places_may_be_anything() {
    for (scale, shift) in [(1e-30, 0.0), (1e-3, 5e6), (1.0, 1e15), (1e30, 0.0), (1e70, 1e73), (1.0, 1e74)] {
        let mut mesh = Mesh::roof(SIDE);
        mesh.positions.iter_mut().for_each(|p| *p = *p * scale + DVec3::new(shift, -shift, shift / 10.0));
        kept(&mesh, &[]);
    }
}

#[test]
fn a_mesh_without_faces_or_vertices_is_refused() {
    let place = Place::new();
    let nothing = Mesh { positions: Vec::new(), faces: Vec::new() };
    let points = Mesh { positions: vec![DVec3::ZERO; 3], faces: Vec::new() };
    let faces = Mesh { positions: Vec::new(), faces: vec![[0, 1, 2]] };
    for (mesh, reason) in [(nothing, "no faces"), (points, "no faces"), (faces, "names vertex 0")] {
        place.write("bad.ply", &mesh.ply());
        for words in ["detect bad.ply", "detect bad.ply --tile-faces 7 --io read", "info bad.ply"] {
            place.run(words).refused(3, &["bad.ply: ", reason]);
        }
    }
    assert_eq!(place.names(), ["bad.ply"]);
}
