//! Files that are refused: with which error, and that nothing panics on the way.

use super::*;

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
const LIST: &str = "property list uchar int vertex_indices";

/// Three vertices at the origin.
fn mesh(face_lines: &str, faces: &[u8]) -> Vec<u8> {
    let mut payload = vec![0; 36];
    payload.extend_from_slice(faces);
    ply(&format!("element vertex 3\n{XYZ}{face_lines}"), &payload)
}

fn triangle(corners: [i32; 3]) -> Vec<u8> {
    let mut bytes = vec![3];
    bytes.extend(corners.iter().flat_map(|corner| corner.to_le_bytes()));
    bytes
}

#[test]
fn formats_that_are_not_read_say_why_and_what_to_do() {
    let good = triangle([0, 1, 2]);
    let face = format!("element face 1\n{LIST}");
    let swap = |from: &str, to: &str| {
        let text: Vec<u8> = mesh(&face, &good);
        let end = text.windows(11).position(|line| line == b"end_header\n").unwrap();
        let head = String::from_utf8(text[..end].to_vec()).unwrap();
        assert!(head.contains(from));
        [head.replacen(from, to, 1).into_bytes(), text[end..].to_vec()].concat()
    };
    let cases: Vec<(Vec<u8>, &str)> = vec![
        (Vec::new(), "empty"),
        (b"glTF".to_vec(), "not a PLY file"),
        (b"ply\nformat ascii 1.0\n".to_vec(), "end_header"),
        (swap("binary_little_endian", "ascii"), "re-save it as binary_little_endian"),
        (swap("binary_little_endian", "binary_big_endian"), "the file is binary_big_endian"),
        (swap("element vertex", "element point"), "no element `vertex`"),
        (swap("element face", "element polygon"), "must be meshed first"),
        (swap("element face 1", "element face 0"), "must be meshed first"),
        (swap("element face 1", "element tristrips 1"), "triangle strips"),
        (swap("float x", "float u"), "no number `x`"),
        (swap("float y", "float u"), "no number `y`"),
        (swap("float z", "float u"), "no number `z`"),
        (swap("property float z", "property list uchar float z"), "no number `z`"),
        (swap("float y", "float x"), "property `x` twice"),
        (swap("vertex_indices", "corners"), "no list `vertex_indices` or `vertex_index`"),
        (swap("property list uchar int", "property int"), "a single int, not a list"),
        (swap("list uchar int", "list uchar float"), "list of float"),
        (swap("list uchar int", "list float int"), "length of type float"),
        (swap("element face", "element vertex 0\nelement face"), "element `vertex` twice"),
        (
            swap("element vertex", "element tag 1\nproperty list double int t\nelement vertex"),
            "length of type double",
        ),
        (swap("property list uchar", "property list half"), "line 8"),
    ];
    for (bytes, expected) in cases {
        let error = open(&bytes).unwrap_err();
        assert!(matches!(error, InputError::Format { .. }), "{error:?}");
        let text = error.to_string();
        assert!(text.contains(expected), "{text:?} does not say {expected:?}");
        assert!(!text.contains('\n'), "{text:?}");
    }
}

#[test]
fn a_mesh_of_short_polygons_only_is_refused() {
    let error = open(&mesh(&format!("element face 2\n{LIST}"), &[0, 1, 0, 0, 0, 0])).unwrap_err();
    assert!(error.to_string().contains("there are no triangles"), "{error}");
}

#[test]
fn an_index_out_of_range_is_named_with_its_face() {
    for (bad, leading) in [(-1, 3), (3, 3), (i32::MIN, 3), (-1, 4), (i32::MAX, 4)] {
        // With a quad in front the faces are walked, without one they have a stride.
        let mut faces = triangle([0, 1, 2]);
        if leading == 4 {
            faces = vec![4, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0];
        }
        let before = faces.len() as u64;
        faces.extend(triangle([1, bad, 0]));
        let bytes = mesh(&format!("element face 2\n{LIST}"), &faces);
        let expected_offset = bytes.len() as u64 - faces.len() as u64 + before;
        match read_all(&bytes).unwrap_err() {
            InputError::IndexOutOfRange { face: 1, offset, index, vertices: 3, .. } => {
                assert_eq!((offset, index), (expected_offset, i64::from(bad)));
            }
            other => panic!("{other}"),
        }
    }
}

#[test]
fn lists_that_make_no_sense_are_named_with_their_record() {
    let negative =
        mesh("element face 2\nproperty list char uchar vertex_indices", &[3, 0, 1, 2, 0xff, 0, 1, 2]);
    let long = mesh(
        "element face 2\nproperty list uint uchar vertex_indices",
        &[3, 0, 0, 0, 0, 1, 2, 0xff, 0xff, 0xff, 0xff, 1, 2, 3],
    );
    for (bytes, record_size, expected) in
        [(negative, 4, "negative length -1"), (long, 7, "list of 4294967295 items")]
    {
        match open(&bytes).unwrap_err() {
            InputError::BadRecord { element, record: 1, offset, reason, .. } => {
                assert_eq!(element, "face");
                assert_eq!(offset, bytes.len() as u64 - record_size);
                assert!(reason.contains(expected), "{reason}");
            }
            other => panic!("{other}"),
        }
    }
}

#[test]
fn counts_that_do_not_fit_the_file_are_refused_before_anything_is_allocated() {
    let counts = [4u64, 1000, 1 << 40, u64::MAX / 12, u64::MAX / 12 + 1, u64::MAX];
    for count in counts {
        let bytes = ply(&format!("element vertex {count}\n{XYZ}element face 1\n{LIST}"), &[0; 37]);
        let start = bytes.len() as u64 - 37;
        match open(&bytes).unwrap_err() {
            InputError::Truncated { element, offset, needed, length, .. } => {
                assert_eq!((element.as_str(), offset, length), ("vertex", start, start + 37));
                assert_eq!(needed, count.saturating_mul(12));
            }
            other => panic!("{other}"),
        }
        let faces = count.max(15);
        let bytes = mesh(&format!("element face {faces}\n{LIST}"), &triangle([0, 1, 2]));
        match open(&bytes).unwrap_err() {
            InputError::Truncated { element, needed, .. } => {
                assert_eq!((element.as_str(), needed), ("face", faces))
            }
            other => panic!("{other}"),
        }
    }
}

#[test]
fn elements_without_bytes_may_have_any_count() {
    let bytes = ply(
        &format!("element nothing {}\nelement vertex 1\n{XYZ}element face 1\n{LIST}", u64::MAX),
        &[[0; 12].as_slice(), &triangle([0, 0, 0])].concat(),
    );
    assert_eq!(read_all(&bytes).unwrap().1, [[0, 0, 0]]);
}

#[test]
fn a_file_cut_off_anywhere_is_refused() {
    let walked = ply(
        "element camera 2\nproperty list uchar short view\nelement vertex 3\nproperty list uchar uchar tags\n\
         property short x\nproperty double y\nproperty char z\nelement face 2\nproperty uchar a\n\
         property list ushort ushort vertex_index\nproperty list uchar float uv\nproperty uchar b",
        &[
            &[1, 7, 7, 0][..],
            &[2, 5, 6, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1],
            &[0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1],
            &[1, 9, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1],
            &[8, 3, 0, 0, 0, 1, 0, 2, 0, 1, 0, 0, 0, 0, 8],
            &[8, 4, 0, 0, 0, 1, 0, 2, 0, 0, 0, 0, 8],
        ]
        .concat(),
    );
    let faces = [triangle([0, 1, 2]), triangle([2, 1, 0])].concat();
    let fixed = mesh(&format!("element face 2\n{LIST}"), &faces);
    for bytes in [walked, fixed] {
        read_all(&bytes).unwrap();
        for length in 0..bytes.len() {
            let outcome = read_all(&bytes[..length]);
            assert!(outcome.is_err(), "{length} of {} bytes", bytes.len());
        }
    }
}

#[test]
fn files_with_random_damage_never_panic() {
    let faces = [triangle([0, 1, 2]), vec![4, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0]].concat();
    let good = mesh(&format!("element face 2\n{LIST}"), &faces);
    let mut random = Random(1);
    for _ in 0..1500 {
        let mut bytes = good.clone();
        for _ in 0..=random.below(3) {
            let at = random.below(bytes.len() as u64) as usize;
            bytes[at] = random.pick(&[0, 1, b'9', b'\n', 0x7f, 0xff, bytes[at] ^ 1]);
        }
        // Coordinates may have become NaN, so nothing is compared.
        let (_dir, path) = file(&bytes);
        for mode in [IoMode::Map, IoMode::Read] {
            if let Ok(mesh) = PlySource::open(&path, mode) {
                let mut block = FaceBlock::default();
                for index in 0..mesh.block_count() {
                    let _ = mesh.read_block(index, &mut block);
                }
                mesh.read_positions(VertexId(0), mesh.vertex_count() as usize, &mut Vec::new()).unwrap();
            }
        }
    }
}

#[test]
fn asking_for_what_does_not_exist_is_an_error() {
    let (_dir, path) = file(&mesh(&format!("element face 1\n{LIST}"), &triangle([0, 1, 2])));
    for mode in MODES {
        let mesh = PlySource::open(&path, mode).unwrap();
        let (mut out, mut places) = (Vec::new(), Vec::new());
        let no_such = |outcome| assert!(matches!(outcome, Err(InputError::NoSuch { .. })), "{outcome:?}");
        no_such(mesh.read_block(1, &mut FaceBlock::default()));
        no_such(mesh.read_positions(VertexId(1), 3, &mut out));
        no_such(mesh.read_positions(VertexId(u64::MAX), 2, &mut out));
        no_such(mesh.gather_positions(&[VertexId(0), VertexId(3)], &mut out));
        no_such(mesh.corner_positions(&[[VertexId(0), VertexId(1), VertexId(u64::MAX)]], &mut places));
        assert_eq!(mesh.vertex_offset(VertexId(3)), None);
    }
}

#[test]
fn what_is_not_a_file_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    for mode in MODES {
        assert!(matches!(PlySource::open(dir.path(), mode), Err(InputError::NotAFile { .. })));
        let missing = PlySource::open(&dir.path().join("missing.ply"), mode);
        assert!(matches!(missing, Err(InputError::Io { .. })));
    }
}
