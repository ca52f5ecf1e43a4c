//! Small files by hand: what is read from each, and where blocks begin.

use super::*;

/// Four vertices of type `float`, one after the other.
fn square() -> Vec<u8> {
    let corners = [[0.0, 0.0, 0.5], [1.0, 0.0, 0.5], [1.0, 1.0, 0.5], [0.0, 1.0, 0.5f32]];
    corners.as_flattened().iter().flat_map(|value| value.to_le_bytes()).collect()
}

const SQUARE: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";

#[test]
fn a_polygon_is_cut_into_the_fan_of_its_first_corner() {
    let mut payload = square();
    payload.extend([4, 3, 0, 1, 2, 2, 0, 1, 3, 1, 2, 3, 0]);
    let lines = format!("{SQUARE}element face 4\nproperty list uchar char vertex_indices");
    let mesh = open(&ply(&lines, &payload)).unwrap();
    assert_eq!((mesh.polygon_count(), mesh.short_polygons(), mesh.face_count()), (4, 2, 3));
    let (positions, triangles) = read_all(&ply(&lines, &payload)).unwrap();
    assert_eq!(triangles, [[3, 0, 1], [3, 1, 2], [1, 2, 3]]);
    assert_eq!(positions[2], DVec3::new(1.0, 1.0, 0.5));
}

#[test]
fn bytes_after_the_last_element_are_ignored() {
    let mut payload = square();
    payload.extend([3, 0, 1, 2, 3, 0, 2, 3]);
    let lines = format!("{SQUARE}element face 2\nproperty list uchar uchar vertex_index");
    let expected = read_all(&ply(&lines, &payload)).unwrap();
    payload.extend([0; 100]);
    assert_eq!(read_all(&ply(&lines, &payload)).unwrap(), expected);
    // Nor does an element behind the mesh matter, whether it is there or not.
    let lines = format!("{lines}\nelement blob 9\nproperty list float double numbers");
    assert_eq!(read_all(&ply(&lines, &payload)).unwrap(), expected);
}

#[test]
fn a_crlf_header_and_a_payload_of_line_ends() {
    let mut bytes = ply(
        "element vertex 11\r\nproperty uchar x\r\nproperty uchar y\r\nproperty uchar z\r\n\
         element face 1\r\nproperty list uchar uchar vertex_indices\r",
        &[b'\n'; 33],
    );
    bytes.extend([3, b'\n', 0, 1]);
    let text = String::from_utf8(bytes).unwrap().replacen("end_header\n", "end_header\r\n", 1);
    let (positions, triangles) = read_all(text.as_bytes()).unwrap();
    assert_eq!(triangles, [[10, 0, 1]]);
    assert_eq!(positions, [DVec3::splat(10.0); 11]);
}

#[test]
fn blocks_hold_4096_polygons_each() {
    let mut payload = square();
    let mut triangles = 0;
    for polygon in 0..10_000 {
        // Triangles first, then a pentagon in every block but the first.
        if polygon % 4096 == 17 && polygon > 4096 {
            payload.extend([5, 0, 1, 2, 3, 0]);
            triangles += 3;
        } else {
            payload.extend([3, 0, 1, 2]);
            triangles += 1;
        }
    }
    let lines = format!("{SQUARE}element face 10000\nproperty list uchar uchar vertex_indices");
    let mesh_bytes = ply(&lines, &payload);
    let (_dir, path) = file(&mesh_bytes);
    for mode in MODES {
        let mesh = PlySource::open(&path, mode).unwrap();
        assert_eq!((mesh.block_count(), mesh.face_count()), (3, triangles));
        let mut block = FaceBlock::default();
        let mut shape = Vec::new();
        for index in [2, 0, 1] {
            mesh.read_block(index, &mut block).unwrap();
            shape.push((block.first.0, block.corners.len()));
        }
        assert_eq!(shape, [(8194, 1810), (0, 4096), (4096, 4098)]);
    }
}

#[test]
fn far_apart_vertices_are_gathered_in_runs() {
    let (mut payload, mut expected) = (Vec::new(), Vec::new());
    for id in 0..60_000u32 {
        expected.push(DVec3::splat(f64::from(id)));
        for value in [id, id, id] {
            payload.extend(f64::from(value).to_le_bytes());
        }
    }
    payload.extend([3, 0, 0, 1, 0, 2, 0]);
    let lines = "element vertex 60000\nproperty double x\nproperty double y\nproperty double z\n\
                 element face 1\nproperty list uchar ushort vertex_indices";
    let (_dir, path) = file(&ply(lines, &payload));
    let mesh = PlySource::open(&path, IoMode::Read).unwrap();
    let mut random = Random(5);
    let mut out = Vec::new();
    for step in [1, 3, 100, 171, 172, 173, 5000] {
        let (mut ids, mut id) = (Vec::new(), random.below(step));
        while id < 60_000 {
            ids.push(VertexId(id));
            id += 1 + random.below(2 * step);
        }
        mesh.gather_positions(&ids, &mut out).unwrap();
        let wanted: Vec<DVec3> = ids.iter().map(|id| expected[id.0 as usize]).collect();
        assert_eq!(out, wanted);
    }
    mesh.gather_positions(&[], &mut out).unwrap();
    assert!(out.is_empty());
    mesh.read_positions(VertexId(0), 60_000, &mut out).unwrap();
    assert_eq!(out, expected);
    let corners = [[59_999, 0, 7].map(VertexId), [7, 7, 30_000].map(VertexId)];
    let mut places = Vec::new();
    mesh.corner_positions(&corners, &mut places).unwrap();
    assert_eq!(places[1], [expected[7], expected[7], expected[30_000]]);
}

#[test]
fn the_header_can_be_asked_for() {
    let mut payload = square();
    payload.extend([3, 0, 1, 2]);
    let lines = format!("{SQUARE}element face 1\nproperty list uchar uchar vertex_indices");
    let bytes = ply(&lines, &payload);
    let mesh = open(&bytes).unwrap();
    assert_eq!(mesh.header().encoding.to_string(), "binary_little_endian");
    assert_eq!(mesh.header().elements[1].properties[0].kind.to_string(), "list uchar uchar");
    assert_eq!(mesh.file_len(), bytes.len() as u64);
    assert_eq!(mesh.name(), mesh.path().display().to_string());
}
