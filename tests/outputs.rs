//! Every output says the same: formats for lines agree with the PLY file, the annotated mesh is the mesh, all of them have the
//! same bytes under any tiling, and all of them appear or none.

#[path = "support/read_lines.rs"]
mod read_lines;
mod support;

use crease::glam::DVec3;
use crease::input::{IoMode, PlySource};
use crease::output::{Annotation, FieldSink, LineFormat, write_lines};
use crease::pipeline::{Job, Silent};
use crease::stitch::{Counts, Geometry, LineSource, LineVertex, Polyline, Stream};
use crease::{Limits, Order, Params, Tiling};
use read_lines::Line;
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::process::Command;
use support::command::Place;
use support::{Mesh, fixture};

const KINDS: [&str; 7] = ["ply", "obj", "vtp", "dxf", "geojson", "gpkg", "csv"];

/// A place with a fixture as `mesh.ply`.
fn with(name: &str) -> Place {
    let place = Place::new();
    fs::copy(fixture(&format!("meshes/{name}.ply")), place.path("mesh.ply")).expect("copy");
    place
}

/// Words that ask for all formats, as `NAME.KIND`.
fn all_formats(name: &str) -> String {
    KINDS.iter().map(|kind| format!(" -o {name}.{kind}")).collect()
}

fn text(place: &Place, name: &str) -> String {
    String::from_utf8(place.read(name)).expect("text")
}

/// The lines of every format, by kind.
fn read_all(place: &Place, name: &str) -> BTreeMap<&'static str, Vec<Line>> {
    KINDS
        .into_iter()
        .map(|kind| {
            let file = format!("{name}.{kind}");
            let lines = match kind {
                "ply" => read_lines::ply_lines(&place.path(&file)),
                "obj" => read_lines::obj(&text(place, &file)),
                "vtp" => read_lines::vtp(&place.read(&file)).0,
                "dxf" => read_lines::dxf(&text(place, &file)),
                "geojson" => read_lines::geojson(&text(place, &file)),
                "gpkg" => read_lines::gpkg(&place.path(&file)).0,
                _ => read_lines::csv(&text(place, &file)),
            };
            (kind, lines)
        })
        .collect()
}

/// `line` without what a format of this kind does not hold.
fn held(kind: &str, line: &Line) -> Line {
    let Line { points, class, closed, .. } = line.clone();
    match kind {
        "obj" => Line { points, class, ..Line::default() },
        "dxf" => Line { points, class, closed, ..Line::default() },
        _ => line.clone(),
    }
}

#[test]
fn every_format_says_what_ply_says() {
    let mut seen = BTreeMap::new();
    for (mesh, options) in [
        ("city", "--boundaries"),
        ("city", "--geometry fitted --crs EPSG:7415"),
        ("defects", "--boundaries --min-length 0"),
        ("folds10", ""),
        ("city", "--min-angle 179"),
    ] {
        let place = with(mesh);
        place.does(&format!("detect mesh.ply --quiet {options} {}", all_formats("lines")));
        let all = read_all(&place, "lines");
        let expected = &all["ply"];
        assert_eq!(expected.is_empty(), options.contains("179"), "{mesh} {options}");
        for (kind, lines) in &all {
            let expected: Vec<Line> = expected.iter().map(|line| held(kind, line)).collect();
            assert_eq!(lines.len(), expected.len(), "{mesh} {options}: {kind}");
            for (i, (line, expected)) in lines.iter().zip(&expected).enumerate() {
                assert_eq!(line, expected, "{mesh} {options}: {kind}, line {i}");
            }
        }
        for line in expected {
            let sum: f64 = line.points.windows(2).map(|edge| edge[0].distance(edge[1])).sum();
            let [length, ..] = line.measures.expect("measures");
            assert!((sum - length).abs() <= 1e-9 * length, "{sum} and {length}");
            assert_eq!(line.closed, Some(line.points.first() == line.points.last()));
            *seen.entry(line.class.clone()).or_insert(0) += 1;
            *seen.entry(format!("closed: {:?}", line.closed)).or_insert(0) += 1;
            *seen.entry(format!("continued in OBJ: {}", line.points.len() > 32)).or_insert(0) += 1;
        }
        let vertices = &read_lines::ply(&place.path("lines.ply"))["vertex"];
        let (_, points) = read_lines::vtp(&place.read("lines.vtp"));
        for name in ["saliency", "angle", "class", "bend", "source"] {
            assert_eq!(
                points.get(name).cloned().unwrap_or_default(),
                vertices.get(name).cloned().unwrap_or_default()
            );
        }
    }
    // All that there is was there to be compared.
    assert_eq!(seen.len(), 4 + 2 + 2, "{seen:?}");
}

#[test]
fn coordinates_keep_their_bits() {
    // National coordinates with millimetres, and digits that no short decimal has.
    let mut mesh = Mesh::roof(24);
    for (i, p) in mesh.positions.iter_mut().enumerate() {
        *p += DVec3::new(512_345.678_901_234_5, 6_123_456.789, -0.001) + DVec3::splat((i % 7) as f64 * 1e-9);
    }
    let place = Place::new();
    place.write("mesh.ply", &mesh.ply());
    place.does(&format!("detect mesh.ply --quiet --geometry fitted {}", all_formats("lines")));
    let all = read_all(&place, "lines");
    assert!(!all["ply"].is_empty());
    for (kind, lines) in &all {
        let points = |lines: &[Line]| lines.iter().map(|line| line.points.clone()).collect::<Vec<_>>();
        assert_eq!(points(lines), points(&all["ply"]), "{kind}");
    }
}

#[test]
fn a_geopackage_is_one() {
    let place = with("city");
    place.does("detect mesh.ply --quiet -o a.gpkg -o b.gpkg --crs epsg:28992 -o c.geojson -o a.ply");
    assert_eq!(place.read("a.gpkg"), place.read("b.gpkg"));
    assert_eq!(read_lines::gpkg(&place.path("a.gpkg")).1, 28992);
    let database = rusqlite::Connection::open(place.path("a.gpkg")).expect("a database");
    let one = |sql: &str| -> rusqlite::types::Value {
        database.query_row(sql, [], |row| row.get(0)).unwrap_or_else(|e| panic!("{sql}: {e}"))
    };
    let lines = read_lines::ply_lines(&place.path("a.ply"));
    for (sql, expected) in [
        ("PRAGMA integrity_check", "ok".to_owned().into()),
        ("PRAGMA application_id", i64::from(u32::from_be_bytes(*b"GPKG")).into()),
        ("PRAGMA user_version", 10300.into()),
        ("SELECT count(*) FROM pragma_foreign_key_check", 0.into()),
        ("SELECT count(*) FROM gpkg_spatial_ref_sys WHERE srs_id IN (-1, 0, 4326, 28992)", 4.into()),
        (
            "SELECT organization || organization_coordsys_id FROM gpkg_spatial_ref_sys WHERE srs_id = 28992",
            "EPSG28992".to_owned().into(),
        ),
        ("SELECT rtreecheck('rtree_creases_geom')", "ok".to_owned().into()),
        ("SELECT count(*) FROM rtree_creases_geom", (lines.len() as i64).into()),
        ("SELECT count(*) FROM sqlite_master WHERE type = 'trigger'", 6.into()),
        ("SELECT last_change FROM gpkg_contents", "1970-01-01T00:00:00.000Z".to_owned().into()),
    ] {
        assert_eq!(one(sql), expected, "{sql}");
    }
    let points = || lines.iter().flat_map(|line| &line.points);
    let [low, high] = [f64::min, f64::max]
        .map(|pick| points().fold([f64::NAN; 2], |[x, y], p| [pick(x, p.x), pick(y, p.y)]));
    for (name, expected) in [("min_x", low[0]), ("min_y", low[1]), ("max_x", high[0]), ("max_y", high[1])] {
        assert_eq!(one(&format!("SELECT {name} FROM gpkg_contents")), expected.into(), "{name}");
    }
    // A window through the index: no line is missed.
    let middle = (low[0] + high[0]) / 2.0;
    let found: i64 = database
        .query_row("SELECT count(*) FROM rtree_creases_geom WHERE minx <= ?1", [middle], |row| row.get(0))
        .expect("a window");
    let expected = lines.iter().filter(|line| line.points.iter().any(|p| p.x <= middle)).count();
    assert!((found as usize) >= expected && found < lines.len() as i64, "{found} of {expected}");
    let geojson: serde_json::Value = serde_json::from_str(&text(&place, "c.geojson")).expect("JSON");
    assert_eq!(geojson["crs"]["properties"]["name"], "urn:ogc:def:crs:EPSG::28992");
}

#[test]
fn tiles_do_not_show_in_any_output() {
    let place = with("city");
    let words = |name: &str| {
        format!("{} --annotate {name}.mesh.ply --attributes {name}.table.ply", all_formats(name))
    };
    let common = "detect mesh.ply --quiet --boundaries --crs EPSG:25832";
    place.does(&format!("{common} --in-core --threads 1 {}", words("whole")));
    for (name, options) in [
        ("tiles", "--tile-faces 500 --threads 3"),
        ("order", "--tile-faces 2000 --order rewrite --io read"),
        ("little", "--memory 24MiB --threads 1"),
    ] {
        place.does(&format!("{common} {options} {}", words(name)));
        for kind in KINDS.into_iter().chain(["mesh.ply", "table.ply"]) {
            let [whole, tiles] = ["whole", name].map(|name| place.read(&format!("{name}.{kind}")));
            assert!(whole == tiles, "{kind} differs with {options}");
        }
    }
    let left = place.names();
    assert_eq!(left.len(), 1 + 4 * (KINDS.len() + 2), "{left:?}");
}

/// A PLY file with all that a copy must keep: comments, ends of lines, further properties, lists and elements.
fn odd_mesh() -> (Vec<u8>, Vec<std::ops::Range<usize>>) {
    let mesh = Mesh::roof(24);
    let (vertices, faces) = (mesh.positions.len(), mesh.faces.len());
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment made by hand\nelement camera 2\nproperty uchar k\n\
         element vertex {vertices}\r\nproperty uchar red\nproperty list uchar short seen\nproperty double y\nproperty double x\n\
         property float quality\nproperty double z\r\ncomment between\nelement face {faces}\n\
         property list uchar int vertex_indices\nproperty float weight\nobj_info x\nelement edge 1\nproperty int a\nend_header\n"
    );
    let mut bytes = header.into_bytes();
    bytes.extend([7, 8]);
    let mut records = Vec::new();
    for (i, p) in mesh.positions.iter().enumerate() {
        let start = bytes.len();
        let seen = i % 4;
        bytes.extend([i as u8, seen as u8]);
        bytes.extend(vec![1; 2 * seen]);
        [p.y, p.x].iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend((i as f32).to_le_bytes());
        bytes.extend(p.z.to_le_bytes());
        records.push(start..bytes.len());
    }
    for face in &mesh.faces {
        bytes.push(3);
        face.iter().for_each(|corner| bytes.extend(corner.to_le_bytes()));
        bytes.extend(0.5f32.to_le_bytes());
    }
    bytes.extend([1, 2, 3, 4]);
    bytes.extend(b"what nobody announced");
    (bytes, records)
}

#[test]
fn the_annotated_mesh_is_the_mesh() {
    let (mesh, records) = odd_mesh();
    let place = Place::new();
    place.write("mesh.ply", &mesh);
    place.does("detect mesh.ply --quiet -o lines.ply --annotate out.ply --attributes table.ply");
    place.does("detect mesh.ply --quiet -o lines2.ply --annotate out2.ply --tile-faces 200 --io read");
    let out = place.read("out.ply");
    assert!(out == place.read("out2.ply"), "tiles show");
    let added = "property double saliency\r\nproperty uchar class\r\nproperty int line\r\n";
    let behind = "property double z\r\n";
    let at =
        mesh.windows(behind.len()).position(|w| w == behind.as_bytes()).expect("it is there") + behind.len();
    let lines = read_lines::ply_lines(&place.path("lines.ply"));
    assert!(!lines.is_empty());
    let table = support::read_vertices(&place.path("table.ply"));
    let first = first_lines(&place, "lines.ply");
    let mut expected = [&mesh[..at], added.as_bytes(), &mesh[at..records[0].start]].concat();
    for (id, record) in records.iter().enumerate() {
        expected.extend(&mesh[record.clone()]);
        expected.extend(table["saliency"][id].to_le_bytes());
        expected.push(table["class"][id] as u8);
        expected.extend(first.get(&id).copied().unwrap_or(-1).to_le_bytes());
    }
    expected.extend(&mesh[records[records.len() - 1].end..]);
    assert!(out == expected, "not the mesh with three properties more");
    assert!(!first.is_empty() && first.len() < records.len());
    // It is a mesh like any other, and says so only once.
    place.does("detect out.ply --quiet -o again.ply");
    assert!(place.read("again.ply") == place.read("lines.ply"));
    place
        .run("detect out.ply -o no.ply --annotate no.mesh.ply")
        .refused(2, &["out.ply", "`saliency`", "rename"]);
    assert!(!place.names().iter().any(|name| name.starts_with("no.")), "{:?}", place.names());
}

/// The first line through each vertex of the mesh, by the PLY file of the lines.
fn first_lines(place: &Place, name: &str) -> BTreeMap<usize, i32> {
    let file = read_lines::ply(&place.path(name));
    let (vertex, edge) = (&file["vertex"], &file["edge"]);
    let mut first = BTreeMap::new();
    for (i, line) in edge["line"].iter().enumerate() {
        for end in ["vertex1", "vertex2"] {
            let source = vertex["source"][edge[end][i] as usize] as usize;
            // Edges of the first line come first.
            first.entry(source).or_insert(*line as i32);
        }
    }
    first
}

#[test]
fn a_converted_mesh_is_annotated_as_converted() {
    let mesh = Mesh::roof(24);
    let place = Place::new();
    let mut obj = String::from("# a comment that is lost\n");
    mesh.positions
        .iter()
        .for_each(|p| obj.push_str(&format!("v {:?} {:?} {:?} 0.5 0.5 0.5\n", p.x, p.y, p.z)));
    mesh.faces.iter().for_each(|f| obj.push_str(&format!("f {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1)));
    place.write("roof.obj", obj.as_bytes());
    place.does("detect roof.obj --quiet --annotate out.ply");
    let vertex = &read_lines::ply(&place.path("out.ply"))["vertex"];
    assert_eq!(vertex.keys().collect::<Vec<_>>(), ["class", "line", "saliency", "x", "y", "z"]);
    for (i, p) in mesh.positions.iter().enumerate() {
        assert_eq!([vertex["x"][i], vertex["y"][i], vertex["z"][i]], p.to_array());
    }
    let first = first_lines(&place, "roof.creases.ply");
    assert!(!first.is_empty());
    for (id, line) in vertex["line"].iter().enumerate() {
        assert_eq!(*line as i32, first.get(&id).copied().unwrap_or(-1), "vertex {id}");
    }
    let packed = with("city");
    packed.does("detect mesh.ply --quiet -o a.ply --annotate a.mesh.ply");
    let zipped = zstd::encode_all(&packed.read("mesh.ply")[..], 0).expect("packed");
    packed.write("packed.ply.zst", &zipped);
    packed.does("detect packed.ply.zst --quiet -o b.ply --annotate b.mesh.ply");
    assert!(packed.read("a.mesh.ply") == packed.read("b.mesh.ply"));
}

/// Rows that go to buckets, places that are sorted on disk: the same bytes as where all fits.
#[test]
fn an_annotation_needs_no_memory() {
    let mesh = Mesh::scattered();
    let place = Place::new();
    let path = place.write("mesh.ply", &mesh.ply());
    let source = PlySource::open(&path, IoMode::Read).expect("a mesh");
    let mut all = Vec::new();
    for (name, faces, memory) in [("whole.ply", 1 << 20, 32 << 20), ("tiles.ply", 400, 1 << 10)] {
        let limits = Limits { tiling: Tiling::Faces(faces), order: Order::Rewrite, ..Limits::default() };
        let scratch = place.path("").as_path().into();
        let mut annotation =
            Annotation::create(&place.path(name), &source, scratch).expect("a part").with_memory(memory);
        let sink: &mut dyn FieldSink = &mut annotation;
        let job = Job::new(&source, Params::default(), limits, &Silent).expect("a job");
        let found = job.with_scratch(&place.path(""), false).run_stored(Some(sink)).expect("a result");
        annotation.stage(&found.lines).and_then(|part| Ok(part.commit()?)).expect("written");
        all.push(place.read(name));
    }
    assert!(all[0] == all[1], "memory shows");
    assert_eq!(place.names(), ["mesh.ply", "tiles.ply", "whole.ply"]);
}

/// More lines than anybody can write in a test.
struct Many;

impl LineSource for Many {
    fn geometry(&self) -> Geometry {
        Geometry::Vertices
    }

    fn largest_salience(&self) -> f64 {
        1.0
    }

    fn counts(&self) -> Counts {
        Counts { lines: 1 << 31, vertices: 1 << 33, ..Counts::default() }
    }

    fn vertices(&self) -> Stream<'_, LineVertex> {
        Box::new(std::iter::empty())
    }

    fn lines(&self) -> Stream<'_, Polyline> {
        Box::new(std::iter::empty())
    }
}

#[test]
fn what_a_format_cannot_count_is_refused() {
    let place = with("city");
    let source = PlySource::open(&place.path("mesh.ply"), IoMode::Auto).expect("a mesh");
    let scratch = place.path("").as_path().into();
    let annotation = Annotation::create(&place.path("a.ply"), &source, scratch).expect("a part");
    let refusal = annotation.stage(&Many).err().expect("too many lines").to_string();
    assert!(refusal.contains("a.ply: 2147483648 lines are more than"), "{refusal}");
    let refusal = write_lines(&place.path("b.ply"), LineFormat::Ply, &Many, None).expect_err("too many");
    assert!(refusal.to_string().contains("8589934592 vertices are more than"), "{refusal}");
    assert_eq!(place.names(), ["mesh.ply"]);
}

#[test]
fn what_cannot_be_written_is_refused_by_name() {
    let place = with("bracket");
    place.write("old.dxf", b"old");
    for (words, parts) in [
        ("-o a.shp", &["a.shp: ", ".ply, .obj, .vtp, .dxf, .geojson, .gpkg, .csv"][..]),
        ("-o a.ply -o lines", &["lines: ", "must end in .ply"]),
        ("-o a.obj -o ./a.obj", &["a.obj: is named for two outputs"]),
        ("-o a.ply -o b.obj --annotate a.ply", &["a.ply: is named for two outputs"]),
        ("-o a.obj --annotate a.gpkg", &["a.gpkg: ", ".ply"]),
        ("-o a.obj --attributes a.csv", &["a.csv: ", ".ply"]),
        ("-o a.obj -o old.dxf -o b.csv", &["old.dxf: exists already", "--force"]),
        ("-o a.obj --annotate mesh.ply --force", &["mesh.ply: is the input"]),
        ("--crs EPSG:28992", &["--crs: no output can hold it", ".gpkg"]),
        ("-o a.obj -o b.dxf --crs EPSG:28992", &["--crs: no output can hold it", ".geojson"]),
    ] {
        place.run(&format!("detect mesh.ply --progress none {words}")).refused(2, parts);
    }
    for (crs, part) in
        [("28992", "EPSG:28992"), ("EPSG:1", "EPSG:1 is not among"), ("EPSG:4978", "geocentric")]
    {
        place.run(&format!("detect mesh.ply -o a.gpkg --crs {crs}")).refused(2, &["--crs", part]);
    }
    assert_eq!(place.names(), ["mesh.ply", "old.dxf"]);
    let warned = place.run("detect mesh.ply --quiet -o a.geojson");
    assert!(warned.code == Some(0) && warned.err.contains("longitude and latitude"), "{warned:?}");
}

/// Killed between the names of two outputs, or between two tiles, the same command gives all of them theirs.
#[test]
fn a_run_that_dies_is_completed() {
    let place = with("city");
    let words = "detect mesh.ply --quiet --tile-faces 3000 -o a.gpkg -o a.obj -o a.vtp --annotate a.ply";
    place.does(words);
    let names = ["a.gpkg", "a.obj", "a.vtp", "a.ply"];
    let whole = names.map(|name| place.read(name));
    for (point, there) in
        [("record-written:2", 0), ("output-renamed:1", 1), ("output-renamed:2", 2), ("output-renamed:3", 3)]
    {
        names.iter().for_each(|name| fs::remove_file(place.path(name)).expect("remove"));
        let output = Command::new(env!("CARGO_BIN_EXE_crease"))
            .args(words.split_whitespace())
            .current_dir(place.path(""))
            .env("CREASE_KILL_AT", point)
            .output()
            .expect("it runs");
        assert_eq!(output.status.signal(), Some(9), "{point}: {output:?}");
        assert_eq!(names.iter().filter(|name| place.path(name).exists()).count(), there, "{point}");
        place.does(words);
        for (name, whole) in names.iter().zip(&whole) {
            assert!(place.read(name) == *whole, "{point}: {name}");
        }
        assert_eq!(place.names().len(), 1 + names.len(), "{point}: {:?}", place.names());
    }
}
