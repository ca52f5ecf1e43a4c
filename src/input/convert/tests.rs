//! What converting promises, on files written by the tests.

use super::*;
use crate::input::{FaceBlock, InputFiles, IoMode, MeshSource, OpenOptions, open_input};
use crate::mesh::VertexId;
use glam::DVec3;
use std::cell::Cell;

struct Nobody;

impl Progress for Nobody {
    fn advanced(&self, _: u64) {}
    fn grown(&self, _: u64) {}
}

type Mesh = (Vec<DVec3>, Vec<[u64; 3]>, usize);

/// Positions, triangles, and the width of a coordinate; nothing may stay behind.
fn read(names: &[PathBuf], weld: Option<Weld>, memory: u64) -> Result<Mesh, String> {
    let workspace = tempfile::tempdir().unwrap();
    let found = (|| {
        let files = InputFiles::find(names)?;
        let options = OpenOptions {
            scratch: &workspace.path().into(),
            weld,
            memory,
            io: IoMode::Read,
            progress: &Nobody,
        };
        let input = open_input(&files, &options)?;
        let mesh = input.mesh();
        let (mut positions, mut triangles, mut block) = (Vec::new(), Vec::new(), FaceBlock::default());
        mesh.read_positions(VertexId(0), mesh.vertex_count() as usize, &mut positions)?;
        for index in 0..mesh.block_count() {
            mesh.read_block(index, &mut block)?;
            triangles.extend(block.corners.iter().map(|face| face.map(|id| id.0)));
        }
        Ok((positions, triangles, mesh.coordinate_bytes()))
    })();
    assert_eq!(fs_entries(workspace.path()), 0, "temporary files were left behind");
    found.map_err(|error: InputError| error.to_string())
}

fn fs_entries(path: &Path) -> usize {
    std::fs::read_dir(path).unwrap().count()
}

fn one(name: &str, content: &[u8]) -> Result<Mesh, String> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    std::fs::write(&path, content).unwrap();
    let error = read(std::slice::from_ref(&path), None, 64 << 20);
    // Tests compare what is said, not where the file was.
    error.map_err(|text| text.replace(&format!("{}: ", path.display()), ""))
}

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                   element face 1\nproperty list uchar int vertex_indices\nend_header\n";

#[test]
fn obj_statements_of_all_kinds_are_read() {
    let text = "\u{feff}# a comment\r\nmtllib a.mtl\ng part one\nv 0 0 0 1.0 0.5 0.5 0.5\nv 1 0 0\nvt 0 0\nvn 0 0 1\n\
                s 1\nusemtl stone\nf 1//1 2//1 4//1 # later\nv\t1 1 0\nf -3/1/1 -2/1/1 -1/1/1\nv 0 1 \\\n 0\n\
                l 1 2\np 1\nf 1 2/1 \\\r\n  3/1 \\\n -1\nf 1 2\nv 2 2 2";
    let (positions, triangles, bytes) = one("mesh.obj", text.as_bytes()).unwrap();
    assert_eq!(positions.len(), 5);
    assert_eq!((positions[3], positions[4]), (DVec3::Y, DVec3::splat(2.0)));
    assert_eq!(triangles, [[0, 1, 3], [0, 1, 2], [0, 1, 2], [0, 2, 3]]);
    assert_eq!(bytes, 4);
}

#[test]
fn off_files_of_all_kinds_are_read() {
    for text in [
        "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
        "OFF 3 1 0\n# comment\n\n0 0 0\r\n1 0 0\r\n0 1 0\r\n\r\n3 0 1 2 0.1 0.2 0.3\r\n",
        "COFF\n3 1\n0 0 0 255 0 0 255\n1 0 0 255 0 0 255\n0 1 0 255 0 0 255\n3 0 1 2",
        "NOFF # normals\n3 1 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2",
        "3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2",
    ] {
        let (positions, triangles, _) = one("mesh.off", text.as_bytes()).unwrap();
        assert_eq!(
            (positions.as_slice(), triangles.as_slice()),
            (&[DVec3::ZERO, DVec3::X, DVec3::Y][..], &[[0, 1, 2]][..]),
            "{text}"
        );
    }
}

#[test]
fn stl_triangles_share_the_corners_that_are_equal() {
    let text = "solid two\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   VERTEX 0 1 -0.0\n\
                endloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex 1 0 -0\nvertex 1 1 0\nvertex 0 1 0\nendloop\n\
                endfacet\nendsolid two\nsolid empty\nendsolid\n";
    let (positions, triangles, _) = one("mesh.stl", text.as_bytes()).unwrap();
    assert_eq!((positions.len(), triangles), (4, vec![[0, 1, 2], [1, 3, 2]]));
    let mut binary = vec![b' '; 80];
    binary.extend(1u32.to_le_bytes());
    let corners = [0.0f32, 0.0, 9.0, 0.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    corners.iter().for_each(|x| binary.extend(x.to_le_bytes()));
    binary.extend([1, 2]);
    let (positions, triangles, bytes) = one("mesh", &binary).unwrap();
    assert_eq!((positions[0].z, triangles, bytes), (f64::from(0.1f32), vec![[0, 1, 2]], 4));
}

#[test]
fn coordinates_are_as_wide_as_they_were_printed() {
    let mesh = |kind: &str, x: &str| {
        let text = format!("{PLY}{x} 0.1 0\n1 0 0\n0 1 0\n\n3 0 1 2\n").replace("float", kind);
        let (positions, _, bytes) = one("mesh.ply", text.as_bytes()).unwrap();
        (positions[0].x, positions[0].y, bytes)
    };
    let tenth = f64::from(0.1f32);
    assert_eq!(mesh("float", "0.1"), (tenth, tenth, 4));
    assert_eq!(mesh("float", "0.100000001490116"), (tenth, tenth, 4));
    // One that needs more makes all of them wide.
    assert_eq!(mesh("float", "500123.45"), (500_123.45, 0.1, 8));
    assert_eq!(mesh("double", "0.1"), (0.1, 0.1, 8));
    assert_eq!(mesh("double", "7").2, 8);
    assert_eq!(mesh("int", "16777217"), (16_777_217.0, 0.1, 8));
}

#[test]
fn what_cannot_be_read_is_refused_with_its_place() {
    let ply = |from: &str, to: &str| PLY.replace(from, to);
    let body = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let cases: Vec<(&str, Vec<u8>, &str)> = vec![
        (
            "a.obj",
            b"v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 9\nf 1 2 3\n".to_vec(),
            "line 4: a face names vertex 8, counted from 0, but the file has 3",
        ),
        ("a.obj", b"v 0 0 0\nf 1 2 -2\n".to_vec(), "line 2: a face names vertex -2, but only 1 vertices"),
        ("a.obj", b"v 0 0 0\nf 0 1 1\n".to_vec(), "line 2: a face names vertex 0;"),
        ("a.obj", b"v 0 0 0\nf 1 x 1\n".to_vec(), "line 2: `x` is no corner"),
        ("a.obj", b"v 0 0\n".to_vec(), "line 1: a vertex has less than three"),
        ("a.obj", b"v 0 0,5 0\n".to_vec(), "`0,5` is no coordinate; numbers must have a decimal point"),
        ("a.obj", b"v 0 nan 0\nv 0 0 0\nf 1 1 1\n".to_vec(), "line 1: vertex 0 has the position (0, NaN, 0)"),
        ("a.obj", b"v 0 1e80 0\n".to_vec(), "below 1e75"),
        ("a.obj", b"v 0 0 0\nv 1 1 1\n".to_vec(), "must be meshed first"),
        ("a.obj", b"v 0 0 0\nv 1 1 1\nf 1 2\n".to_vec(), "there are no triangles"),
        (
            "a.off",
            b"OFF\n3 1 0\n0 0 0\n1 0 0\n".to_vec(),
            "line 4: the file ends here, but only 2 of 3 vertices",
        ),
        ("a.off", b"OFF\n1 1 0\n0 0 0\n3 0 0\n".to_vec(), "line 4: a face of 3 corners names only 2"),
        ("a.off", b"OFF\n18446744073709551615 1 0\n0 0 0\n".to_vec(), "where the numbers of vertices"),
        (
            "a.off",
            b"OFF\n9223372036854775807 1 0\n0 0 0\n".to_vec(),
            "only 1 of 9223372036854775807 vertices",
        ),
        ("a.off", b"OFF\n1 1 0\n0 0 0\n9000000000000000000 0 0\n".to_vec(), "names only 2"),
        ("a.off", b"OFF\n1 1 0\n0 0 0\n-3 0 0\n".to_vec(), "`-3` is no number of corners"),
        ("a.off", b"4OFF\n1 1 0\n".to_vec(), "three dimensions"),
        ("a.off", b"OFF BINARY\n".to_vec(), "re-save it as text"),
        ("a.off", b"OFF\n".to_vec(), "are missing"),
        (
            "a.stl",
            b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0 0 1\n".to_vec(),
            "line 5: the file ends here, but a facet",
        ),
        (
            "a.stl",
            b"solid a\nouter loop\nvertex 0 0 0\nendloop\n".to_vec(),
            "line 4: a facet ends after 1 corners",
        ),
        ("a.stl", b"solid a\nfacet\nvertex 0 0 0\n".to_vec(), "line 3: `vertex` is not expected"),
        ("a.stl", b"solid a\nendsolid\n".to_vec(), "there are no faces"),
        ("a.stl", vec![0; 60], "84 bytes before its triangles"),
        (
            // All corners are there, and of the two bytes behind them one.
            "a.stl",
            [vec![0; 80], vec![1, 0, 0, 0], vec![0; 49]].concat(),
            "byte 84: the file ends in triangle 0 of 1",
        ),
        (
            "a.stl",
            [vec![0; 80], vec![2, 0, 0, 0], vec![0; 70]].concat(),
            "byte 134: the file ends in triangle 1 of 2",
        ),
        (
            "a.ply",
            format!("{PLY}0 0 0\n1 0\n").into_bytes(),
            "line 11: the line ends before the value of `z`",
        ),
        ("a.ply", format!("{PLY}0 0 0\n1 0 x\n").into_bytes(), "line 11: `x` is no coordinate"),
        ("a.ply", format!("{PLY}0 0 0\n1 0 0\n").into_bytes(), "only 2 of 3 records of element `vertex`"),
        (
            "a.ply",
            format!("{PLY}{}", body.replace("3 0", "3 7")).into_bytes(),
            "line 13: a face names vertex 7",
        ),
        (
            "a.ply",
            format!("{PLY}{}", body.replace("3 0", "3 -1")).into_bytes(),
            "line 13: `-1` is no value for `vertex_indices`",
        ),
        ("a.ply", format!("{PLY}{}", body.replace("3 0", "4 0")).into_bytes(), "line 13: the line ends"),
        (
            "a.ply",
            format!("{}{body}", ply("face 1", "face 99999999999")).into_bytes(),
            "only 1 of 99999999999 records of element `face`",
        ),
        ("a.ply", format!("{}{body}", ply("float y", "float w")).into_bytes(), "no number `y`"),
        (
            "a.ply",
            [ply("ascii", "binary_big_endian").into_bytes(), vec![0; 30]].concat(),
            "the file is truncated: record 2 of element `vertex`, of 3, needs 12 bytes or more, and 6 are left",
        ),
        (
            "a.ply",
            [
                ply("ascii", "binary_big_endian").replace("uchar", "uint").into_bytes(),
                vec![0; 36],
                vec![255; 40],
            ]
            .concat(),
            "the file is truncated: record 0 of element `face`, of 1, needs 17179869184 bytes",
        ),
    ];
    for (name, content, part) in cases {
        let error = one(name, &content).unwrap_err();
        assert!(error.contains(part) && !error.contains('\n'), "{part:?} is not in {error:?}");
    }
}

#[test]
fn surplus_values_behind_a_record_are_passed_over() {
    let text = format!("{PLY}0 0 0 255 255\n1 0 0\n0 1 0\n3 0 1 2 9 1 1\n");
    assert_eq!(one("mesh.ply", text.as_bytes()).unwrap().1, [[0, 1, 2]]);
}

#[test]
fn damaged_files_never_panic() {
    let big = [
        PLY.replace("ascii", "binary_big_endian").into_bytes(),
        [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_be_bytes()).collect(),
        vec![3, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 2],
    ]
    .concat();
    assert_eq!(one("mesh.ply", &big).unwrap().1, [[0, 1, 2]]);
    let good: [(&str, Vec<u8>); 4] = [
        ("mesh.ply", big),
        ("mesh.ply", format!("{PLY}0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").into_bytes()),
        ("mesh.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1//2 2 \\\n-1\n".to_vec()),
        ("mesh.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n".to_vec()),
    ];
    let mut seed = 1u64;
    let mut next = |end: usize| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize % end
    };
    for (name, content) in good {
        for _ in 0..150 {
            let mut bytes = content.clone();
            for _ in 0..=next(3) {
                let at = next(bytes.len());
                bytes[at] = [0, 1, b'9', b'\n', b'-', b' ', 0x7f, 0xff][next(8)];
            }
            bytes.truncate(bytes.len() - next(2) * next(bytes.len()));
            let _ = one(name, &bytes);
        }
    }
}

/// Points near a few places, some equal, as triangles of three in a row in several OBJ files.
fn clusters(seed: u64, count: usize) -> Vec<DVec3> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as u32
    };
    let mut coordinate = || f64::from(next() % 6) + f64::from(next() % 5) * 0.0625 - 2.0;
    (0..count).map(|_| DVec3::new(coordinate(), coordinate(), coordinate())).collect()
}

fn obj(points: &[DVec3]) -> String {
    let vertices: String = points.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z)).collect();
    vertices
        + &(1..points.len()).step_by(3).map(|i| format!("f {i} {} {}\n", i + 1, i + 2)).collect::<String>()
}

/// Which corners become which positions, by the files cut at `cuts`, welded within `memory`.
fn corners(points: &[DVec3], cuts: &[usize], weld: Weld, memory: u64, reverse: bool) -> Vec<[DVec3; 3]> {
    let dir = tempfile::tempdir().unwrap();
    let mut names = Vec::new();
    let ends = cuts.iter().copied().chain([points.len()]);
    let mut from = 0;
    for (i, end) in ends.enumerate() {
        names.push(dir.path().join(format!("{i:03}.obj")));
        std::fs::write(&names[i], obj(&points[from..end])).unwrap();
        from = end;
    }
    if reverse {
        names.reverse();
    }
    let (positions, triangles, _) = read(&names, Some(weld), memory).unwrap();
    triangles.iter().map(|face| face.map(|v| positions[v as usize])).collect()
}

#[test]
fn near_vertices_are_one_by_the_stated_rule_however_little_memory_there_is() {
    let points = clusters(5, 3000);
    let distance = 0.13;
    let along = |p: &DVec3| {
        (p.x * 0.754_877_666_246_692_7 + p.y * 0.569_840_290_998_053_2) + p.z * 0.324_717_957_244_746
    };
    // The rule, word for word.
    let mut sorted = points.clone();
    sorted.sort_by(|a, b| {
        let order = along(a).total_cmp(&along(b));
        order.then(a.x.total_cmp(&b.x)).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z))
    });
    let mut kept: Vec<DVec3> = Vec::new();
    let nearest = |kept: &[DVec3], p: DVec3| {
        let near = kept.iter().filter(|k| (**k - p).length_squared() <= distance * distance);
        near.copied()
            .reduce(|best, k| if (k - p).length_squared() < (best - p).length_squared() { k } else { best })
    };
    for &p in &sorted {
        // Equal ones are the same question.
        if !kept.contains(&p) && nearest(&kept, p).is_none() {
            kept.push(p);
        }
    }
    let whole = corners(&points, &[], Weld::Within(distance), 64 << 20, false);
    assert_eq!(whole.len(), 1000);
    let (mut moved, mut distinct) = (0, std::collections::BTreeSet::new());
    for (i, place) in whole.iter().flatten().enumerate() {
        assert!(kept.contains(place) && (*place - points[i]).length() <= distance);
        moved += usize::from(*place != points[i]);
        distinct.insert(place.to_array().map(f64::to_bits));
    }
    assert!(
        moved > 100 && distinct.len() == kept.len(),
        "{moved} moved, {} of {} kept",
        distinct.len(),
        kept.len()
    );
    for (cuts, memory, reverse) in [(&[300, 1500][..], 64 << 20, true), (&[999, 1002], 400 << 10, false)] {
        assert!(corners(&points, cuts, Weld::Within(distance), memory, reverse) == whole);
    }
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.obj");
    std::fs::write(&path, obj(&points)).unwrap();
    let error = read(&[path], Some(Weld::Within(0.05)), 1 << 10).map(|_| ()).unwrap_err();
    assert!(error.contains("weld within less"), "{error}");
}

#[test]
fn equal_vertices_are_one_however_little_memory_there_is() {
    let points = clusters(9, 30_000);
    let plain = |points: &[DVec3]| points.chunks(3).map(|p| [p[0], p[1], p[2]]).collect::<Vec<_>>();
    for memory in [64 << 20, 300 << 10] {
        assert!(corners(&points, &[9000], Weld::Exact, memory, false) == plain(&points));
    }
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.obj");
    std::fs::write(&path, obj(&points)).unwrap();
    let large = read(std::slice::from_ref(&path), Some(Weld::Exact), 64 << 20).unwrap();
    let small = read(std::slice::from_ref(&path), Some(Weld::Exact), 300 << 10).unwrap();
    assert!(large == small);
    let distinct: std::collections::BTreeSet<_> =
        points.iter().map(|p| p.to_array().map(f64::to_bits)).collect();
    assert_eq!(large.0.len(), distinct.len());
    assert_eq!(read(&[path], None, 64 << 20).unwrap().0, points);
}

#[test]
fn progress_adds_up() {
    struct Sum(Cell<u64>, Cell<u64>);
    impl Progress for Sum {
        fn advanced(&self, bytes: u64) {
            self.0.set(self.0.get() + bytes);
        }
        fn grown(&self, bytes: u64) {
            self.1.set(self.1.get() + bytes);
        }
    }
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("a.obj"), obj(&clusters(1, 90_000))).unwrap();
    let files = InputFiles::find(&[dir.path().to_owned()]).unwrap();
    let sum = Sum(Cell::new(0), Cell::new(0));
    for weld in [None, Some(Weld::Exact)] {
        let options = OpenOptions {
            scratch: &dir.path().into(),
            weld,
            memory: 64 << 20,
            io: IoMode::Auto,
            progress: &sum,
        };
        let total = crate::input::bytes_to_convert(&files, weld, 64 << 20).unwrap();
        let input = open_input(&files, &options).unwrap();
        assert_eq!(sum.0.take(), total + sum.1.take());
        assert_eq!((input.files()[0].vertices, input.files()[0].polygons), (90_000, 30_000));
        assert!(input.is_converted() && input.temporary_bytes().0 > 0);
    }
}
