//! The same mesh in every format gives the same lines; a mesh cut into files gives those of the whole.

mod support;

use crease::glam::DVec3;
use crease::input::{Input, InputFiles, IoMode, MeshSource, OpenOptions, Progress, Weld, open_input};
use crease::output::write_ply;
use crease::{Detection, Params};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use support::{Mesh, fixture, in_core, open, run, tiled};

struct Nobody;

impl Progress for Nobody {
    fn advanced(&self, _: u64) {}
    fn grown(&self, _: u64) {}
}

/// A format, and a mesh in it. The coordinates of the mesh must be `f32`.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Little,
    Big,
    Ascii,
    Obj,
    Off,
    StlAscii,
    StlBinary,
}

impl Kind {
    fn extension(self) -> &'static str {
        match self {
            Kind::Little | Kind::Big | Kind::Ascii => "ply",
            Kind::Obj => "obj",
            Kind::Off => "off",
            Kind::StlAscii | Kind::StlBinary => "stl",
        }
    }

    fn bytes(self, mesh: &Mesh) -> Vec<u8> {
        match self {
            Kind::Little | Kind::Big | Kind::Ascii => self.ply(mesh),
            Kind::Obj => {
                let mut text = String::from("# a mesh\no mesh\n");
                mesh.positions.iter().for_each(|p| _ = writeln!(text, "v {}", numbers(*p)));
                for (i, [a, b, c]) in mesh.faces.iter().map(|face| face.map(|v| i64::from(v) + 1)).enumerate()
                {
                    let count = mesh.positions.len() as i64 + 1;
                    _ = match i % 3 {
                        0 => writeln!(text, "f {a} {b} {c}"),
                        1 => writeln!(text, "f {a}/7/7 {b}//7 {c}/7"),
                        _ => writeln!(text, "f {} {} \\\n{}", a - count, b - count, c - count),
                    };
                }
                text.into_bytes()
            }
            Kind::Off => {
                let mut text = format!("OFF\n{} {} 0\n", mesh.positions.len(), mesh.faces.len());
                mesh.positions.iter().for_each(|p| _ = writeln!(text, "{}", numbers(*p)));
                mesh.faces.iter().for_each(|[a, b, c]| _ = writeln!(text, "3 {a} {b} {c}"));
                text.into_bytes()
            }
            Kind::StlAscii => {
                let mut text = String::from("solid mesh\n");
                for face in &mesh.faces {
                    text.push_str("facet normal 0 0 0\nouter loop\n");
                    face.iter()
                        .for_each(|v| _ = writeln!(text, "vertex {}", numbers(mesh.positions[*v as usize])));
                    text.push_str("endloop\nendfacet\n");
                }
                text.push_str("endsolid mesh\n");
                text.into_bytes()
            }
            Kind::StlBinary => {
                let mut bytes = vec![0; 80];
                bytes.extend((mesh.faces.len() as u32).to_le_bytes());
                for face in &mesh.faces {
                    bytes.extend([0; 12]);
                    let corners = face.iter().flat_map(|v| mesh.positions[*v as usize].to_array());
                    corners.for_each(|x| bytes.extend((x as f32).to_le_bytes()));
                    bytes.extend([0; 2]);
                }
                bytes
            }
        }
    }

    fn ply(self, mesh: &Mesh) -> Vec<u8> {
        let encoding = match self {
            Kind::Little => "binary_little_endian",
            Kind::Big => "binary_big_endian",
            _ => "ascii",
        };
        let mut bytes = format!(
            "ply\r\nformat {encoding} 1.0\r\nelement vertex {}\r\nproperty float x\r\nproperty float y\r\nproperty float z\r\n\
             property list uchar short tags\r\nelement face {}\r\nproperty list uchar uint vertex_indices\r\nend_header\r\n",
            mesh.positions.len(),
            mesh.faces.len()
        )
        .into_bytes();
        for p in &mesh.positions {
            match self {
                Kind::Little => p.to_array().iter().for_each(|x| bytes.extend((*x as f32).to_le_bytes())),
                Kind::Big => p.to_array().iter().for_each(|x| bytes.extend((*x as f32).to_be_bytes())),
                _ => bytes.extend(format!("{} 1 5\r\n", numbers(*p)).into_bytes()),
            }
            match self {
                Kind::Little => bytes.extend([1, 5, 0]),
                Kind::Big => bytes.extend([1, 0, 5]),
                _ => {}
            }
        }
        for face in &mesh.faces {
            match self {
                Kind::Little => {
                    bytes.push(3);
                    face.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
                }
                Kind::Big => {
                    bytes.push(3);
                    face.iter().for_each(|v| bytes.extend(v.to_be_bytes()));
                }
                _ => bytes.extend(format!("3 {} {} {}\r\n", face[0], face[1], face[2]).into_bytes()),
            }
        }
        bytes
    }
}

/// As short as tells every `f32` from the others.
fn numbers(p: DVec3) -> String {
    let [x, y, z] = p.to_array().map(|x| x as f32);
    format!("{x} {y:e} {z:?}")
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).expect("memory");
    encoder.finish().expect("memory")
}

fn zstd(bytes: &[u8]) -> Vec<u8> {
    zstd::encode_all(bytes, 1).expect("memory")
}

fn opened(names: &[PathBuf], weld: Option<Weld>, workspace: &Path) -> Input {
    let files = InputFiles::find(names).unwrap_or_else(|e| panic!("{e}"));
    let options = OpenOptions {
        scratch: &workspace.into(),
        weld,
        memory: 32 << 20,
        io: IoMode::Auto,
        progress: &Nobody,
    };
    open_input(&files, &options).unwrap_or_else(|e| panic!("{e}"))
}

/// The lines of a mesh as the file that they would be written to.
fn lines_of(source: &dyn MeshSource, directory: &Path) -> (Vec<u8>, Detection) {
    let (found, _) = run(source, Params::default(), in_core());
    let path = directory.join("lines.out");
    write_ply(&path, &found.lines).expect("written");
    (std::fs::read(path).expect("read"), found)
}

/// Edges of the lines by the positions of their ends, with their classes.
fn geometry(found: &Detection) -> BTreeSet<(u8, [[u64; 3]; 2])> {
    let lines = &found.lines;
    let at = |v: u64| lines.vertices[v as usize].position.to_array().map(f64::to_bits);
    let edges = lines.lines.iter().flat_map(|line| {
        line.vertices.windows(2).map(|edge| {
            let mut ends = [at(edge[0].into()), at(edge[1].into())];
            ends.sort();
            (line.class as u8, ends)
        })
    });
    edges.collect()
}

#[test]
fn the_same_mesh_in_every_format_gives_the_same_lines() {
    let place = tempfile::tempdir().expect("a temporary directory");
    let mesh = Mesh::of_fixture("bracket");
    let (expected, found) = lines_of(&open(&fixture("meshes/bracket.ply")), place.path());
    let edges = geometry(&found);
    assert!(edges.len() > 100);
    let check = |name: String, bytes: Vec<u8>, soup: bool| {
        let path = place.path().join(&name);
        std::fs::write(&path, bytes).expect("written");
        let input = opened(std::slice::from_ref(&path), None, place.path());
        let (lines, found) = lines_of(input.mesh(), place.path());
        // Where triangles bring their own vertices, these get their ids in the order of the triangles.
        if soup {
            assert!(geometry(&found) == edges, "{name}");
        } else {
            assert!(lines == expected, "{name}");
        }
    };
    use Kind::{Ascii, Big, Little, Obj, Off, StlAscii, StlBinary};
    for kind in [Little, Big, Ascii, Obj, Off, StlAscii, StlBinary] {
        let (bytes, soup) = (kind.bytes(&mesh), matches!(kind, StlAscii | StlBinary));
        let name = format!("{kind:?}.{}", kind.extension());
        match kind {
            Little | StlBinary => check(format!("{name}.zst"), zstd(&bytes), soup),
            Obj => check(format!("{name}.gz"), gzip(&bytes), soup),
            // Known by its content.
            Off => check("mesh".to_owned(), gzip(&bytes), soup),
            _ => {}
        }
        check(name, bytes, soup);
    }
}

#[test]
fn polygons_stay_what_they_are() {
    let place = tempfile::tempdir().expect("a temporary directory");
    let original = open(&fixture("meshes/polygons.ply"));
    // Welding takes the way through the conversion; no two vertices are equal here.
    let input = opened(&[fixture("meshes/polygons.ply")], Some(Weld::Exact), place.path());
    let all = |source: &dyn MeshSource| {
        let (mut positions, mut block) = (Vec::new(), Default::default());
        source
            .read_positions(crease::mesh::VertexId(0), source.vertex_count() as usize, &mut positions)
            .expect("read");
        source.read_block(0, &mut block).expect("read");
        (positions, block)
    };
    assert!(input.is_converted() && input.mesh().polygon_count() == 7);
    assert_eq!(all(input.mesh()), all(&original));
}

/// The faces of `mesh` in 4 times 3 tiles, each with its own vertices.
fn tiles(mesh: &Mesh) -> Vec<Mesh> {
    let inf = DVec3::splat(f64::INFINITY);
    let (min, max) = mesh.positions.iter().fold((inf, -inf), |(min, max), p| (min.min(*p), max.max(*p)));
    let mut tiles = vec![Mesh { positions: Vec::new(), faces: Vec::new() }; 12];
    let mut names = vec![std::collections::BTreeMap::new(); 12];
    for face in &mesh.faces {
        let middle = face.iter().map(|v| mesh.positions[*v as usize]).sum::<DVec3>() / 3.0;
        let share = (middle - min) / (max - min);
        let tile = (share.x * 3.999) as usize + 4 * (share.y * 2.999) as usize;
        let (part, names) = (&mut tiles[tile], &mut names[tile]);
        let corners = face.map(|v| {
            *names.entry(v).or_insert_with(|| {
                part.positions.push(mesh.positions[v as usize]);
                part.positions.len() as u32 - 1
            })
        });
        part.faces.push(corners);
    }
    tiles
}

#[test]
fn a_scan_cut_into_files_gives_the_lines_of_the_whole_in_any_order() {
    let place = tempfile::tempdir().expect("a temporary directory");
    let mesh = Mesh::of_fixture("city");
    let (_, whole) = lines_of(&mesh.source(), place.path());
    let folder = place.path().join("tiles");
    std::fs::create_dir(&folder).expect("created");
    let kinds = [Kind::Little, Kind::Big, Kind::Ascii, Kind::Obj, Kind::Off, Kind::StlBinary, Kind::StlAscii];
    let mut names = Vec::new();
    for (i, tile) in tiles(&mesh).iter().enumerate() {
        assert!(!tile.faces.is_empty());
        let kind = kinds[i % kinds.len()];
        names.push(folder.join(format!("tile_{i}.{}", kind.extension())));
        std::fs::write(&names[i], kind.bytes(tile)).expect("written");
    }
    // A tile with nothing in it is no harm.
    let nothing = Mesh { positions: Vec::new(), faces: Vec::new() };
    std::fs::write(folder.join("void.ply"), Kind::Ascii.bytes(&nothing)).expect("written");

    let input = opened(std::slice::from_ref(&folder), None, place.path());
    assert_eq!((input.files().len(), input.mesh().face_count()), (13, mesh.faces.len() as u64));
    let (lines, found) = lines_of(input.mesh(), place.path());
    assert!(geometry(&found) == geometry(&whole), "the lines of the whole");
    let used: BTreeSet<u32> = mesh.faces.iter().flatten().copied().collect();
    assert_eq!(input.mesh().vertex_count(), used.len() as u64);

    for step in [5, 7, 11] {
        names.push(folder.join("void.ply"));
        let order: Vec<PathBuf> = (0..13).map(|i| names[i * step % 13].clone()).collect();
        names.pop();
        let again = opened(&order, None, place.path());
        let (other, _) = run(again.mesh(), Params::default(), tiled(2000, 2));
        let path = place.path().join("again.out");
        write_ply(&path, &other.lines).expect("written");
        assert!(std::fs::read(&path).expect("read") == lines, "another order, another result");
    }
    // Without welding, every tile ends at its border.
    let apart = opened(&[folder], Some(Weld::None), place.path());
    let (_, found) = lines_of(apart.mesh(), place.path());
    assert!(found.defects.boundary_edges > 2 * whole.defects.boundary_edges);
}

#[test]
fn no_temporary_file_outlives_its_input() {
    let place = tempfile::tempdir().expect("a temporary directory");
    let mesh = place.path().join("mesh.obj");
    std::fs::write(&mesh, Kind::Obj.bytes(&Mesh::of_fixture("folds10"))).expect("written");
    let entries = || std::fs::read_dir(place.path()).expect("list").count();
    let input = opened(&[mesh], None, place.path());
    assert_eq!(entries(), 2);
    drop(input);
    assert_eq!(entries(), 1);
}

#[test]
fn real_meshes_of_other_programs_are_read() {
    let Some(data) = std::env::var_os("CREASE_DATA") else {
        println!("skipped: CREASE_DATA not set");
        return;
    };
    let place = tempfile::tempdir().expect("a temporary directory");
    let corpus = Path::new(&data).join("ply-corpus");
    let read = |name: &str| {
        let input = opened(&[corpus.join(name)], None, place.path());
        let mut positions = Vec::new();
        let mesh = input.mesh();
        mesh.read_positions(crease::mesh::VertexId(0), mesh.vertex_count() as usize, &mut positions)
            .expect("read");
        let mut block = Default::default();
        mesh.read_block(0, &mut block).expect("read");
        (positions, block)
    };
    // The same shelf in three encodings, as another library wrote it.
    let shelf = read("happly__platonic_shelf.ply");
    assert_eq!(read("happly__platonic_shelf_big_endian.ply"), shelf);
    let ascii = read("happly__platonic_shelf_ascii.ply");
    assert_eq!(ascii.1, shelf.1);
    let farthest = ascii.0.iter().zip(&shelf.0).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
    assert!(farthest < 1e-5, "printed with six digits: {farthest}");
    for (name, vertices, faces) in [
        ("trimesh__fuze_ascii.ply", 502, 1000),
        ("trimesh__suzanne.ply", 1966, 968),
        ("draco__test_extra_whitespace.ply", 3, 1),
        ("assimp__cube_binary_header_with_RN_newline.ply", 8, 12),
        ("assimp__Wuson.ply", 11184, 3732),
    ] {
        let (positions, block) = read(name);
        assert_eq!((positions.len(), block.corners.len()), (vertices, faces), "{name}");
    }
}
