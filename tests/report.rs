//! Reports: they agree with the summary and the lines, every field is documented, the page needs nothing else and cannot be
//! broken by a name, and it was built of the sources that are here.

mod support;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use crease::report::{Detail, Findings, Ground, Scene};
use flate2::read::GzDecoder;
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::collections::BTreeSet;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use support::command::Place;
use support::{Mesh, fixture};

/// A place with a mesh of some lines of several classes.
fn place_with_city() -> Place {
    let place = Place::new();
    fs::copy(fixture("meshes/city.ply"), place.path("city.ply")).expect("copy");
    place
}

fn json(place: &Place, name: &str) -> Value {
    serde_json::from_slice(&place.read(name)).expect("JSON")
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn list(value: &Value) -> &[Value] {
    value.as_array().unwrap_or_else(|| panic!("{value} is no list"))
}

/// `1234567` as `1,234,567`, as the summary writes it.
fn grouped(n: f64) -> String {
    let digits = n.to_string();
    let groups: Vec<&str> =
        digits.as_bytes().rchunks(3).rev().map(|g| std::str::from_utf8(g).expect("ASCII")).collect();
    groups.join(",")
}

/// A record of the element `line` of a file of lines: class, length, angle.
fn lines_of(bytes: &[u8]) -> Vec<(u8, f64, f64)> {
    let mark = b"end_header\n";
    let start = bytes.windows(mark.len()).position(|w| w == mark).expect("a header") + mark.len();
    let header = String::from_utf8_lossy(&bytes[..start]);
    let count = header.lines().find_map(|line| line.strip_prefix("element line ")).expect("lines");
    const RECORD: usize = 4 + 1 + 1 + 4 + 4 + 3 * 8 + 1;
    let records = &bytes[bytes.len() - RECORD * count.parse::<usize>().expect("a count")..];
    let double =
        |record: &[u8], at: usize| f64::from_le_bytes(record[at..at + 8].try_into().expect("8 bytes"));
    records.chunks_exact(RECORD).map(|r| (r[4], double(r, 14), double(r, 30))).collect()
}

/// What stands in the element `id` of a page.
fn element<'a>(page: &'a str, id: &str) -> &'a str {
    let start = page.find(&format!("id=\"{id}\">")).unwrap_or_else(|| panic!("no {id}")) + id.len() + 6;
    &page[start..start + page[start..].find("</script>").expect("an end")]
}

/// The head of a scene, and its numbers.
fn scene(page: &str) -> (Value, Vec<u8>) {
    let head = serde_json::from_str(element(page, "scene-data")).expect("JSON");
    let packed = STANDARD.decode(element(page, "numbers")).expect("base64");
    let mut bytes = Vec::new();
    GzDecoder::new(&packed[..]).read_to_end(&mut bytes).expect("gzip");
    (head, bytes)
}

fn array<const SIZE: usize>(scene: &(Value, Vec<u8>), name: &str) -> Vec<[u8; SIZE]> {
    let array = list(&scene.0["arrays"]).iter().find(|array| array["name"] == name).expect(name);
    let [offset, length] = ["offset", "length"].map(|key| array[key].as_u64().expect("a count") as usize);
    assert!(offset.is_multiple_of(SIZE), "{name} begins at {offset}");
    scene.1[offset..offset + SIZE * length]
        .chunks_exact(SIZE)
        .map(|c| c.try_into().expect("a number"))
        .collect()
}

#[test]
fn a_report_agrees_with_the_summary_and_the_lines() {
    let place = place_with_city();
    let summary =
        place.does("detect city.ply --boundaries --memory 1GiB --threads 2 --report r.json --report r.html");
    let report = json(&place, "r.json");
    let (found, lines) = (&report["found"], lines_of(&place.read("city.creases.ply")));
    assert_eq!(number(&found["lines"]), lines.len() as f64);
    let length: f64 = lines.iter().map(|line| line.1).sum();
    assert!((number(&found["length"]) - length).abs() < 1e-9 * length);
    let numbers = [("sharp", 2), ("weak", 1), ("boundary", 4)];
    for class in list(&found["classes"]) {
        let (name, code) = numbers.into_iter().find(|(name, _)| class["class"] == *name).expect("a class");
        let of_class: Vec<_> = lines.iter().filter(|line| line.0 == code).collect();
        assert_eq!(number(&class["lines"]), of_class.len() as f64, "{name}");
        assert!(summary.lines().any(|line| {
            let words: Vec<&str> = line.split_whitespace().collect();
            words.first() == Some(&name) && words[1] == grouped(of_class.len() as f64)
        }));
        match code {
            4 => assert!(class["mean_angle"].is_null()),
            _ => {
                let least = of_class.iter().map(|line| line.2).fold(f64::INFINITY, f64::min);
                assert_eq!(number(&class["least_angle"]), least, "{name}");
            }
        }
        for (histogram, bins) in report["histograms"].as_object().expect("an object") {
            let bounds = list(&bins["bounds"]).len();
            if let Some(series) = list(&bins["classes"]).iter().find(|series| series["class"] == name) {
                assert_eq!(list(&series["lines"]).len() + 1, bounds, "{histogram}");
                let sum: f64 = list(&series["lines"]).iter().map(number).sum();
                assert_eq!(sum, of_class.len() as f64, "{name} in {histogram}");
            } else {
                assert!(code == 4 && histogram != "length", "{name} in {histogram}");
            }
        }
    }
    for part in [
        format!(
            "{} faces, {} vertices",
            grouped(number(&report["mesh"]["faces"])),
            grouped(number(&report["mesh"]["vertices"]))
        ),
        format!("{} corners", grouped(number(&found["corners"]))),
        format!("{}  boundary edges", grouped(number(&report["defects"]["boundary_edges"]))),
        format!("{} tile", number(&report["work"]["tiles"])),
    ] {
        assert!(summary.contains(&part), "{part} is not in {summary}");
    }
    let stages: Vec<&str> =
        list(&report["work"]["stages"]).iter().map(|s| s["stage"].as_str().expect("text")).collect();
    assert_eq!(stages, ["scan", "tiles", "stitch", "write"]);
    assert_eq!(report["limits"]["memory_bytes"], 1u64 << 30);
    let words: Vec<&str> = list(&report["command"]).iter().filter_map(Value::as_str).collect();
    assert_eq!(words[1..4], ["detect", "city.ply", "--boundaries"]);
    // Sizes are those of the files; reports do not know theirs, the summary does.
    let outputs = list(&report["outputs"]);
    assert_eq!(outputs[0]["path"], "city.creases.ply");
    assert_eq!(outputs[0]["bytes"], place.read("city.creases.ply").len());
    assert!(outputs[1]["bytes"].is_null() && outputs[2]["bytes"].is_null());
    assert!(!summary.contains("r.html  not available"), "{summary}");
    // The page has the same report.
    let page = String::from_utf8(place.read("r.html")).expect("UTF-8");
    assert_eq!(serde_json::from_str::<Value>(element(&page, "report-data")).expect("JSON"), report);
}

#[test]
fn the_page_has_the_lines_and_the_surface() {
    let place = place_with_city();
    place.does("detect city.ply --quiet --report r.html");
    let page = String::from_utf8(place.read("r.html")).expect("UTF-8");
    let scene = scene(&page);
    let lines = lines_of(&place.read("city.creases.ply"));
    let head = &scene.0;
    assert_eq!(
        (head["lines"].as_u64(), head["all_lines"].as_u64()),
        (Some(lines.len() as u64), Some(lines.len() as u64))
    );
    assert_eq!((&head["segments"], &head["thinned_lines"]), (&head["all_segments"], &Value::from(0)));
    let ids: Vec<f64> = array::<8>(&scene, "id").into_iter().map(f64::from_le_bytes).collect();
    assert_eq!(ids, (0..lines.len()).map(|i| i as f64).collect::<Vec<_>>());
    let lengths: Vec<f64> = array::<8>(&scene, "length").into_iter().map(f64::from_le_bytes).collect();
    assert_eq!(lengths, lines.iter().map(|line| line.1).collect::<Vec<_>>());
    let classes: Vec<u8> = array::<1>(&scene, "class").into_iter().flatten().collect();
    assert_eq!(classes, lines.iter().map(|line| line.0).collect::<Vec<_>>());
    // The drawn lines are as long as they are said to be.
    let places: Vec<f64> =
        array::<4>(&scene, "place").into_iter().map(|b| f32::from_le_bytes(b).into()).collect();
    let mut points = places.chunks_exact(3);
    for (count, length) in array::<4>(&scene, "points").into_iter().map(u32::from_le_bytes).zip(lengths) {
        let line: Vec<&[f64]> = points.by_ref().take(count as usize).collect();
        let gap = |w: &[&[f64]]| (0..3).map(|i| (w[0][i] - w[1][i]).powi(2)).sum::<f64>().sqrt();
        let drawn: f64 = line.windows(2).map(gap).sum();
        assert!((drawn - length).abs() < 1e-4 * length, "{drawn} instead of {length}");
    }
    // A small mesh is there in full.
    assert_eq!(head["surface"], "mesh");
    let corners: Vec<u32> = array::<4>(&scene, "corner").into_iter().map(u32::from_le_bytes).collect();
    assert_eq!(Value::from(corners.len() / 3), head["all_faces"]);
    let vertices = array::<2>(&scene, "ground").len() / 3;
    assert!(corners.iter().all(|&v| (v as usize) < vertices));
}

#[test]
fn the_scene_does_not_depend_on_the_cut_nor_on_where_the_mesh_lies() {
    let place = place_with_city();
    place.does("detect city.ply --quiet --in-core --report whole.html");
    place.does("detect city.ply --quiet --tile-faces 1000 --threads 3 --force --report tiles.html");
    let read = |name: &str| scene(&String::from_utf8(place.read(name)).expect("UTF-8"));
    let whole = read("whole.html");
    assert_eq!(whole, read("tiles.html"));

    // Coordinates as on a map: nothing trembles.
    let mut far = Mesh::of_fixture("city");
    far.positions.iter_mut().for_each(|p| *p += crease::glam::DVec3::new(4e5, 5e6, 0.0));
    place.write("far.ply", &far.ply());
    place.does("detect far.ply --quiet --report far.html");
    let far = read("far.html");
    let places = |scene| array::<4>(scene, "place").into_iter().map(f32::from_le_bytes).collect::<Vec<_>>();
    let (near, far) = (places(&whole), places(&far));
    assert_eq!(near.len(), far.len());
    // The positions themselves are rounded to 1e-9 out there.
    assert!(near.iter().zip(&far).all(|(a, b)| (a - b).abs() < 1e-5));
}

#[test]
fn the_strongest_lines_are_shown_if_there_is_no_room_for_all() {
    let mesh = Mesh::of_fixture("city");
    let source = mesh.source();
    let params = crease::Params { boundaries: true, ..crease::Params::default() };
    let (found, _) = support::run(&source, params, support::in_core());
    let detail = Detail { segments: 200, surface: 500 };
    let Findings { chosen, .. } = Findings::of(&found.lines, found.scan.median_side, 200).expect("findings");
    let ground = Ground { source: &source, scan: &found.scan, scattered: false };
    let scene = Scene::of(&found.lines, &chosen, &ground, detail, || false).expect("a scene");
    let head = serde_json::to_value(scene.head()).expect("JSON");
    let edges: usize = found.lines.lines.iter().map(|line| line.vertices.len() - 1).sum();
    assert!(edges > 200 && number(&head["segments"]) <= 200.0 && number(&head["segments"]) > 100.0, "{head}");
    assert_eq!(head["all_segments"], edges);
    assert_eq!(head["lines"], chosen.ids.len());
    // The surface was thinned to what there is room for, and not much further.
    let corners = list(&head["arrays"]).iter().find(|array| array["name"] == "corner").expect("corners");
    assert!((3.0 * 60.0..=3.0 * 500.0).contains(&number(&corners["length"])), "{corners}");
    assert!(number(&head["cube"]) > number(&head["size"][0]) / 65536.0);
    // Nothing that was left out is worth more than what was chosen.
    let worth = |id: usize| found.lines.lines[id].strength * found.lines.lines[id].length;
    let chosen: Vec<usize> = chosen.ids.iter().map(|&id| id as usize).collect();
    let least = chosen.iter().map(|&id| worth(id)).fold(f64::INFINITY, f64::min);
    let others = (0..found.lines.lines.len()).filter(|id| !chosen.contains(id));
    assert!(others.map(worth).all(|worth| worth <= least));

    // Faces without order are not read one by one: vertices stand for them.
    let scattered = Ground { scattered: true, ..ground };
    let chosen = Findings::of(&found.lines, found.scan.median_side, 200).expect("findings").chosen;
    let scene = Scene::of(&found.lines, &chosen, &scattered, detail, || false).expect("a scene");
    assert_eq!(serde_json::to_value(scene.head()).expect("JSON")["surface"], "points");
}

#[test]
fn names_cannot_break_the_page() {
    let place = Place::new();
    let name = "a<\u{2028}script>&\"' --><!--.ply";
    place.write(name, &Mesh::of_fixture("bracket").ply());
    let run = place.command().args(["detect", name, "-o", "o.ply", "--report", "</script><b>.html"]).output();
    // A slash is no part of a name: the second is refused, and nothing is left behind.
    assert_eq!(run.expect("it runs").status.code(), Some(4));
    assert_eq!(place.names(), [name]);
    let run = place.command().args(["detect", name, "-o", "<script>.ply", "--report", "r.html"]).output();
    assert_eq!(run.expect("it runs").status.code(), Some(0));
    let page = String::from_utf8(place.read("r.html")).expect("UTF-8");
    let data = element(&page, "report-data");
    assert!(!data.contains(['<', '>', '&', '\u{2028}']));
    let report: Value = serde_json::from_str(data).expect("JSON");
    assert_eq!(
        (&report["input"]["name"], &report["outputs"][0]["path"]),
        (&Value::from(name), &Value::from("<script>.ply"))
    );
}

#[test]
fn the_page_asks_for_nothing() {
    let place = place_with_city();
    place.does("detect city.ply --quiet --report r.html");
    let page = String::from_utf8(place.read("r.html")).expect("UTF-8");
    assert!(page.starts_with("<!doctype html>\n<html lang=\"en\">"));
    assert!(page.contains("<title>") && page.contains("default-src 'none'"));
    // Two scripts would be one too many; links lead nowhere, images come from nowhere.
    for part in ["src=\"", "@import", "url(", "<iframe", "@@"] {
        let markup = &page[..page.find("<script").expect("data")];
        assert!(!markup.contains(part), "{part}");
    }
    assert!(
        page.contains("The MIT License") && page.contains("three.js authors"),
        "three.js wants to be named"
    );
}

#[test]
fn reports_appear_with_the_results_or_not_at_all() {
    let place = place_with_city();
    let refused = |line: &str, code: i32, part: &str| {
        place.run(line).refused(code, &[part]);
        assert_eq!(place.names(), ["city.ply"], "{line}");
    };
    refused("detect city.ply --report r.txt", 2, ".json or .html");
    refused("detect city.ply --report r.json --report ./r.json", 2, "is named for two outputs");
    refused("detect city.ply --report no/r.json", 4, "no directory no");
    refused("detect city.ply --sigma 1000 --report r.json --report r.html", 2, "sigma is");
    place.write("r.json", b"old");
    place.run("detect city.ply --report r.json").refused(2, &["r.json: exists already"]);
    assert_eq!(place.read("r.json"), b"old");
    assert_eq!(place.does("detect city.ply --report r.json --report R.HTML --force --quiet"), "");
    assert_eq!(place.names(), ["R.HTML", "city.creases.ply", "city.ply", "r.json"]);
    // What is written beside them does not change the results.
    place.does("detect city.ply --quiet -o plain.ply");
    assert_eq!(place.read("plain.ply"), place.read("city.creases.ply"));
}

/// The names of all fields below `value`, as `docs/REPORT.md` writes them.
fn fields(value: &Value, path: &str, found: &mut BTreeSet<String>) {
    match value {
        Value::Object(object) => {
            for (name, value) in object {
                fields(value, &format!("{path}{}{name}", if path.is_empty() { "" } else { "." }), found);
            }
        }
        Value::Array(elements) => {
            elements.iter().for_each(|element| fields(element, &format!("{path}[]"), found));
        }
        _ => _ = found.insert(path.to_owned()),
    }
}

#[test]
fn every_field_is_documented() {
    let place = place_with_city();
    place.does("detect city.ply --quiet --boundaries --report robust.json");
    place.does("detect city.ply --quiet --method paper --force --report paper.json");
    let mut found = BTreeSet::new();
    ["robust.json", "paper.json"].iter().for_each(|name| fields(&json(&place, name), "", &mut found));
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/REPORT.md"))
        .expect("the document");
    let documented: BTreeSet<String> = text
        .lines()
        .filter_map(|line| line.strip_prefix("| `"))
        .map(|line| line[..line.find('`').expect("an end")].to_owned())
        .collect();
    assert_eq!(found, documented);
    assert_eq!(json(&place, "robust.json")["schema"], crease::report::SCHEMA);
}

#[test]
fn the_page_was_built_of_the_sources_that_are_here() {
    let viewer = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/viewer");
    let mut names: Vec<String> =
        ["build.mjs", "package-lock.json", "package.json"].map(str::to_owned).to_vec();
    let sources: Vec<PathBuf> = fs::read_dir(viewer.join("src"))
        .expect("sources")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    names.extend(
        sources.iter().map(|path| format!("src/{}", path.file_name().expect("a name").to_string_lossy())),
    );
    names.sort();
    let mut digest = Sha256::new();
    for name in names {
        digest.update(format!("{name}\0"));
        digest.update(fs::read(viewer.join(&name)).expect("a source"));
        digest.update("\0");
    }
    let digest: String = digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    let page = include_str!("../src/report/viewer.html");
    assert!(
        page.contains(&format!("of sources with sha256 {digest}.")),
        "run tools/viewer/build: the sources have changed"
    );
}
