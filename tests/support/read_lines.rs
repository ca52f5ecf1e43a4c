//! Small readers of the formats for lines, each written from the format's description alone, so that they share no mistake
//! with what writes them.

use crease::glam::DVec3;
use std::collections::BTreeMap;
use std::path::Path;

/// A line as a reader finds it; what a format does not hold is `None`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Line {
    /// The last is the first if the line is closed.
    pub points: Vec<DVec3>,
    pub class: String,
    pub closed: Option<bool>,
    /// Length, strength, angle.
    pub measures: Option<[f64; 3]>,
    pub bend: Option<String>,
    pub id: Option<u64>,
}

/// The word for a class.
pub fn class(number: f64) -> String {
    ["face", "weak", "sharp", "corner", "boundary", "non-manifold"][number as usize].to_owned()
}

/// The word for a bend.
pub fn bend(number: f64) -> String {
    ["", "convex", "concave"][number as usize].to_owned()
}

/// An element of a PLY file of single numbers, column by column.
pub type Table = BTreeMap<String, Vec<f64>>;

/// The elements of a binary little-endian PLY file, up to the first with a list.
pub fn ply(path: &Path) -> BTreeMap<String, Table> {
    let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let end = b"end_header\n";
    let start = bytes.windows(end.len()).position(|w| w == end).expect("a header") + end.len();
    // Name, number of records, properties with their types.
    type Element = (String, usize, Vec<(String, String)>);
    let mut elements: Vec<Element> = Vec::new();
    for line in String::from_utf8_lossy(&bytes[..start]).lines() {
        match line.split_ascii_whitespace().collect::<Vec<_>>()[..] {
            ["element", name, count] => {
                elements.push((name.to_owned(), count.parse().expect("a count"), Vec::new()));
            }
            ["property", ref kind @ .., name] => {
                elements.last_mut().expect("an element").2.push((kind.join(" "), name.to_owned()));
            }
            _ => {}
        }
    }
    let (mut found, mut at) = (BTreeMap::new(), start);
    for (name, count, properties) in elements {
        if properties.iter().any(|(kind, _)| kind.starts_with("list")) {
            break;
        }
        let mut table = Table::new();
        for _ in 0..count {
            for (kind, property) in &properties {
                let x = number(kind, &bytes, &mut at);
                table.entry(property.clone()).or_default().push(x);
            }
        }
        found.insert(name, table);
    }
    found
}

fn number(kind: &str, bytes: &[u8], at: &mut usize) -> f64 {
    macro_rules! read {
        ($type:ty) => {{
            let size = size_of::<$type>();
            *at += size;
            <$type>::from_le_bytes(bytes[*at - size..*at].try_into().expect("bytes")) as f64
        }};
    }
    match kind {
        "uchar" | "uint8" => read!(u8),
        "ushort" => read!(u16),
        "int" => read!(i32),
        "uint" => read!(u32),
        "float" => read!(f32),
        "double" => read!(f64),
        other => panic!("{other}"),
    }
}

/// The lines of the PLY file that all others are compared with.
pub fn ply_lines(path: &Path) -> Vec<Line> {
    let file = ply(path);
    let [vertex, edge, line] = ["vertex", "edge", "line"].map(|name| &file[name]);
    let count = line.get("id").map_or(0, Vec::len);
    let point = |v: f64| {
        let [x, y, z] = ["x", "y", "z"].map(|axis| vertex[axis][v as usize]);
        DVec3::new(x, y, z)
    };
    let of = |i: usize| {
        let [first, edges] = ["first_edge", "edges"].map(|name| line[name][i] as usize);
        let start = edge["vertex1"][first];
        let rest = &edge["vertex2"][first..first + edges];
        Line {
            points: std::iter::once(&start).chain(rest).map(|&v| point(v)).collect(),
            class: class(line["class"][i]),
            closed: Some(line["closed"][i] == 1.0),
            measures: Some(["length", "strength", "angle"].map(|name| line[name][i])),
            bend: Some(bend(line["bend"][i])),
            id: Some(line["id"][i] as u64),
        }
    };
    (0..count).map(of).collect()
}

pub fn obj(text: &str) -> Vec<Line> {
    let (mut points, mut lines, mut group) = (Vec::new(), Vec::new(), String::new());
    for line in text.replace("\\\n", "").lines() {
        let (word, rest) = line.split_once(' ').expect("a word and more");
        let numbers = || rest.split_ascii_whitespace();
        match word {
            "v" => points.push(vector(numbers())),
            "g" => group = rest.to_owned(),
            "l" => {
                let index = |n: &str| points[n.parse::<usize>().expect("an index") - 1];
                let points = numbers().map(index).collect();
                lines.push(Line { points, class: group.clone(), ..Line::default() });
            }
            "#" => {}
            other => panic!("{other}"),
        }
    }
    lines
}

fn vector<'a>(words: impl Iterator<Item = &'a str>) -> DVec3 {
    let numbers: Vec<f64> = words.map(|word| word.parse().expect("a number")).collect();
    DVec3::from_slice(&numbers)
}

pub fn dxf(text: &str) -> Vec<Line> {
    let all: Vec<&str> = text.lines().collect();
    let pairs: Vec<(u16, &str)> =
        all.chunks_exact(2).map(|pair| (pair[0].parse().expect("a group code"), pair[1])).collect();
    assert_eq!((all.len() % 2, pairs.last()), (0, Some(&(0, "EOF"))));
    // Every reader needs to know the layers before they are used.
    let entities = pairs.iter().position(|p| *p == (2, "ENTITIES")).expect("entities");
    let layers: Vec<&str> = pairs[..entities]
        .windows(2)
        .filter(|pair| pair[0] == (0, "LAYER") && pair[1].0 == 2)
        .map(|pair| pair[1].1)
        .collect();
    let mut lines: Vec<Line> = Vec::new();
    let mut entity = "";
    for &(code, value) in &pairs[entities + 1..] {
        match (code, entity) {
            (0, _) => {
                entity = value;
                match entity {
                    "POLYLINE" => lines.push(Line::default()),
                    "VERTEX" => lines.last_mut().expect("a polyline").points.push(DVec3::NAN),
                    _ => {}
                }
            }
            (8, "POLYLINE" | "VERTEX") => {
                assert!(layers.contains(&value), "{value} is not in {layers:?}");
                let word = value.strip_prefix("CREASE_").expect("a layer of ours").to_lowercase();
                lines.last_mut().expect("a polyline").class = word.replace("nonm", "non-m");
            }
            (70, "POLYLINE") => {
                let flags: u8 = value.parse().expect("flags");
                assert_eq!(flags & !1, 8, "not a 3D polyline");
                lines.last_mut().expect("a polyline").closed = Some(flags & 1 == 1);
            }
            (10 | 20 | 30, "VERTEX") => {
                let point = lines.last_mut().and_then(|line| line.points.last_mut()).expect("a vertex");
                point[usize::from(code / 10 - 1)] = value.parse().expect("a number");
            }
            _ => {}
        }
    }
    for line in lines.iter_mut().filter(|line| line.closed == Some(true)) {
        line.points.push(line.points[0]);
    }
    lines
}

pub fn geojson(text: &str) -> Vec<Line> {
    let file: serde_json::Value = serde_json::from_str(text).expect("JSON");
    assert_eq!(file["type"], "FeatureCollection");
    let feature = |feature: &serde_json::Value| {
        assert_eq!(
            (&feature["type"], &feature["geometry"]["type"]),
            (&"Feature".into(), &"LineString".into())
        );
        let of = &feature["properties"];
        assert_eq!(feature["id"], of["id"]);
        let number = |value: &serde_json::Value| value.as_f64().expect("a number");
        let point = |p: &serde_json::Value| DVec3::new(number(&p[0]), number(&p[1]), number(&p[2]));
        Line {
            points: feature["geometry"]["coordinates"]
                .as_array()
                .expect("a list")
                .iter()
                .map(point)
                .collect(),
            class: of["class"].as_str().expect("a word").to_owned(),
            closed: of["closed"].as_bool(),
            measures: Some(["length", "strength", "angle"].map(|name| number(&of[name]))),
            bend: Some(of["bend"].as_str().unwrap_or_default().to_owned()),
            id: of["id"].as_u64(),
        }
    };
    file["features"].as_array().expect("a list").iter().map(feature).collect()
}

pub fn csv(text: &str) -> Vec<Line> {
    let mut rows = text.lines();
    assert_eq!(rows.next(), Some("WKT,id,class,length,strength,angle,bend,closed"));
    let row = |row: &str| {
        let (wkt, rest) = row.strip_prefix('"').and_then(|row| row.split_once("\",")).expect("quotes");
        let points = wkt.strip_prefix("LINESTRING Z (").and_then(|wkt| wkt.strip_suffix(')')).expect("WKT");
        let [id, class, length, strength, angle, bend, closed] =
            rest.split(',').collect::<Vec<_>>().try_into().expect("seven more");
        let number = |word: &str| word.parse::<f64>().expect("a number");
        Line {
            points: points.split(',').map(|p| vector(p.split(' '))).collect(),
            class: class.to_owned(),
            closed: Some(closed == "1"),
            measures: Some([length, strength, angle].map(number)),
            bend: Some(bend.to_owned()),
            id: Some(id.parse().expect("an id")),
        }
    };
    rows.map(row).collect()
}

/// Lines, and the arrays of the points by name.
pub fn vtp(bytes: &[u8]) -> (Vec<Line>, Table) {
    let mark = b"<AppendedData encoding=\"raw\">\n_";
    let start = bytes.windows(mark.len()).position(|w| w == mark).expect("data") + mark.len();
    let xml = std::str::from_utf8(&bytes[..start]).expect("text");
    assert!(bytes.ends_with(b"\n</AppendedData>\n</VTKFile>\n"));
    let attribute = |line: &str, name: &str| {
        let from =
            line.find(&format!(" {name}=\"")).unwrap_or_else(|| panic!("{name} in {line}")) + name.len() + 3;
        line[from..from + line[from..].find('"').expect("a quote")].to_owned()
    };
    let (mut element, mut arrays) = (String::new(), BTreeMap::new());
    for line in xml.lines() {
        if !line.starts_with("<DataArray") {
            element = line.trim_matches(['<', '>', '/']).split(' ').next().unwrap_or_default().to_owned();
            continue;
        }
        let kind = match attribute(line, "type").as_str() {
            "Float64" => "double",
            "UInt8" => "uchar",
            "Int64" => "long",
            other => panic!("{other}"),
        };
        let mut at = start + attribute(line, "offset").parse::<usize>().expect("an offset");
        let length = u64::from_le_bytes(bytes[at..at + 8].try_into().expect("8 bytes")) as usize;
        at += 8;
        let end = at + length;
        let mut numbers = Vec::new();
        while at < end {
            numbers.push(match kind {
                "long" => {
                    at += 8;
                    i64::from_le_bytes(bytes[at - 8..at].try_into().expect("8 bytes")) as f64
                }
                kind => number(kind, bytes, &mut at),
            });
        }
        assert_eq!(at, end);
        arrays.insert((element.clone(), attribute(line, "Name")), numbers);
    }
    let get = |element: &str, name: &str| &arrays[&(element.to_owned(), name.to_owned())];
    let points: Vec<DVec3> = get("Points", "Points").chunks_exact(3).map(DVec3::from_slice).collect();
    let (corners, ends) = (get("Lines", "connectivity"), get("Lines", "offsets"));
    let of = |i: usize| {
        let from = if i > 0 { ends[i - 1] as usize } else { 0 };
        Line {
            points: corners[from..ends[i] as usize].iter().map(|&v| points[v as usize]).collect(),
            class: class(get("CellData", "class")[i]),
            closed: Some(get("CellData", "closed")[i] == 1.0),
            measures: Some(["length", "strength", "angle"].map(|name| get("CellData", name)[i])),
            bend: Some(bend(get("CellData", "bend")[i])),
            id: Some(get("CellData", "id")[i] as u64),
        }
    };
    let lines = (0..ends.len()).map(of).collect();
    let of_points = arrays.iter().filter(|((element, _), _)| element == "PointData");
    (lines, of_points.map(|((_, name), numbers)| (name.clone(), numbers.clone())).collect())
}

/// Lines, and the number of their system of coordinates, which all places that name it agree on.
pub fn gpkg(path: &Path) -> (Vec<Line>, i32) {
    let flags = rusqlite::OpenFlags::SQLITE_OPEN_READ_ONLY;
    let database = rusqlite::Connection::open_with_flags(path, flags).expect("a database");
    let srs: i32 = database
        .query_row(
            "SELECT c.srs_id FROM gpkg_contents c JOIN gpkg_geometry_columns g USING (table_name, srs_id) \
             JOIN gpkg_spatial_ref_sys s USING (srs_id) WHERE g.z = 1 AND g.m = 0",
            [],
            |row| row.get(0),
        )
        .expect("a system");
    let mut select = database
        .prepare("SELECT geom, class, closed, length, strength, angle, bend, id FROM creases ORDER BY fid")
        .expect("a table");
    let line = |row: &rusqlite::Row<'_>| {
        let bend: Option<String> = row.get(6)?;
        let id: i64 = row.get(7)?;
        Ok(Line {
            points: geometry(row.get_ref(0)?.as_blob().expect("a blob"), srs),
            class: row.get(1)?,
            closed: row.get(2)?,
            measures: Some([row.get(3)?, row.get(4)?, row.get(5)?]),
            bend: Some(bend.unwrap_or_default()),
            id: Some(id as u64),
        })
    };
    let lines = select.query_map([], line).expect("rows").collect::<Result<_, _>>().expect("rows");
    (lines, srs)
}

fn geometry(blob: &[u8], srs: i32) -> Vec<DVec3> {
    assert_eq!((&blob[..4], &blob[4..8]), (&b"GP\x00\x05"[..], &srs.to_le_bytes()[..]));
    // Six numbers of a box, the byte order, the kind, the number of points.
    let (envelope, wkb) = blob[8..].split_at(48);
    assert_eq!(wkb[..5], [1, 0xea, 3, 0, 0]);
    let numbers = |bytes: &[u8]| -> Vec<f64> {
        bytes.chunks_exact(8).map(|x| f64::from_le_bytes(x.try_into().expect("8 bytes"))).collect()
    };
    let points: Vec<DVec3> = numbers(&wkb[9..]).chunks_exact(3).map(DVec3::from_slice).collect();
    assert_eq!(points.len() as u32, u32::from_le_bytes(wkb[5..9].try_into().expect("4 bytes")));
    let low = points.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = points.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    assert_eq!(numbers(envelope), [low.x, high.x, low.y, high.y, low.z, high.z]);
    points
}
