//! The command as a user meets it: exit codes, one-line errors, nothing left behind, and texts that say what they should.

use assert_cmd::Command;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Output, Stdio};
use tempfile::TempDir;

/// A directory to run the command in.
struct Place {
    directory: TempDir,
}

impl Place {
    fn new() -> Place {
        Place { directory: tempfile::tempdir().expect("a temporary directory") }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    /// Copies a fixture here, so that messages and default names are about a name without directories.
    fn with(self, fixture: &str) -> Place {
        let name = Path::new(fixture).file_name().expect("a name");
        fs::copy(fixture_path(fixture), self.directory.path().join(name)).expect("copy");
        self
    }

    fn run(&self, words: &str) -> Output {
        self.command().args(words.split_whitespace()).output().expect("the command runs")
    }

    fn command(&self) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_crease"));
        command.current_dir(self.directory.path()).env_remove("RUST_LOG");
        command
    }

    /// Names of the files here.
    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.directory.path()).expect("list");
        let mut names: Vec<String> =
            entries.map(|e| e.expect("entry").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// Runs `words`, which must fail with `code`, say one line that contains all `parts`, and leave nothing behind.
    #[track_caller]
    fn refuses(&self, words: &str, code: i32, parts: &[&str]) {
        let before = self.names();
        let output = self.run(words);
        let (out, err) = texts(&output);
        assert_eq!(output.status.code(), Some(code), "{words}: {err}");
        assert_eq!(out, "", "{words}");
        // Progress may come first; the error is the last line and the only one of its kind.
        let errors: Vec<&str> = err.lines().filter(|line| line.starts_with("crease: error: ")).collect();
        assert_eq!(errors.len(), 1, "{words}: {err}");
        assert_eq!(err.lines().last(), Some(errors[0]), "{words}: {err}");
        for part in parts {
            assert!(errors[0].contains(part), "{words}: {part:?} is not in {err}");
        }
        assert!(!err.contains("panicked") && !err.contains("bug"), "{words}: {err}");
        assert_eq!(self.names(), before, "{words} left something behind");
    }

    /// Runs `words`, which must succeed, and returns standard output and standard error.
    #[track_caller]
    fn does(&self, words: &str) -> (String, String) {
        let output = self.run(words);
        let (out, err) = texts(&output);
        assert_eq!(output.status.code(), Some(0), "{words}: {err}");
        (out, err)
    }
}

fn fixture_path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

fn texts(output: &Output) -> (String, String) {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("UTF-8");
    (text(&output.stdout), text(&output.stderr))
}

#[test]
fn bad_inputs_are_3_and_say_why() {
    let place = Place::new();
    fs::create_dir(place.path("folder.ply")).expect("create");
    fs::write(place.path("zero.ply"), "").expect("write");
    place.refuses("detect missing.ply", 3, &["missing.ply: ", "No such file"]);
    place.refuses("detect folder.ply", 3, &["folder.ply: there is no mesh in this folder"]);
    place.refuses("detect /dev/null", 3, &["/dev/null: not a regular file"]);
    place.refuses("detect *.obj", 3, &["*.obj: there is no such file"]);
    place.refuses("detect zero.ply", 3, &["zero.ply: ", "empty"]);
    let cases = [
        ("text.txt", "no mesh that is read here"),
        ("truncated.ply", "runs past the end of the file"),
        ("index_out_of_range.ply", "face 7 at byte"),
        ("nan_vertex.ply", "vertex 3 at byte"),
        ("no_faces.ply", "Poisson reconstruction"),
        ("empty.ply", "there are no faces"),
    ];
    for (name, reason) in cases {
        let place = Place::new().with(&format!("broken/{name}"));
        let parts = [&format!("{name}: ") as &str, reason];
        place.refuses(&format!("detect {name}"), 3, &parts);
        place.refuses(&format!("detect {name} -o out.ply --attributes table.ply --io read"), 3, &parts);
        place.refuses(&format!("info {name}"), 3, &parts);
        // A file that cannot be used does not even cost the result of an earlier run.
        fs::write(place.path("out.ply"), "earlier").expect("write");
        place.refuses(&format!("detect {name} -o out.ply --force"), 3, &parts);
        assert_eq!(fs::read(place.path("out.ply")).expect("read"), b"earlier");
    }
}

#[test]
fn impossible_command_lines_are_2() {
    let place = Place::new().with("meshes/bracket.ply");
    let cases = [
        ("detect", "<INPUT>"),
        ("detect bracket.ply --sigmma 3", "--sigmma"),
        ("detekt bracket.ply", "detekt"),
        ("detect bracket.ply --weld some", "`exact`, `none`, or a length above 0"),
        ("detect bracket.ply --weld -1", "above 0"),
        ("detect bracket.ply --sigma x", "not a number"),
        ("detect bracket.ply --sigma -1", "above 0"),
        ("detect bracket.ply --sigma-edges 99", "between 1 and 30"),
        ("detect bracket.ply --sigma 1 --sigma-edges 3", "--sigma-edges"),
        ("detect bracket.ply --min-angle 200", "between 0 and 180"),
        ("detect bracket.ply --method best", "--method"),
        ("detect bracket.ply --salience 0.2", "--salience needs --method paper"),
        ("detect bracket.ply --edge-l2 0.2", "--edge-l2 needs --method paper"),
        ("detect bracket.ply --corner-l3 0.2", "--corner-l3 needs --method paper"),
        ("detect bracket.ply --sigma 0", "a sigma of 0 needs --method paper"),
        ("info bracket.ply --sigma 0", "a sigma of 0 needs detect --method paper"),
        ("detect bracket.ply --method paper --min-angle 10", "--min-angle needs --method robust"),
        ("detect bracket.ply --method paper --salience 2", "between 0 and 1"),
        ("detect bracket.ply --method paper --edge-l2 0", "above 0"),
        ("detect bracket.ply --tile-faces 0", "--tile-faces"),
        ("detect bracket.ply --in-core --tile-faces 9", "--in-core"),
        ("detect bracket.ply --io pipe", "--io"),
        ("diff bracket.ply", "<B>"),
    ];
    for (words, part) in cases {
        place.refuses(words, 2, &[part]);
    }
}

#[test]
fn a_sigma_that_does_not_suit_the_mesh_is_2() {
    let place = Place::new().with("meshes/bracket.ply");
    for words in ["detect bracket.ply --sigma 1000 --attributes table.ply", "info bracket.ply --sigma 1000"] {
        place.refuses(words, 2, &["bracket.ply: sigma is", "between 1 and 30"]);
    }
}

#[test]
fn outputs_that_would_destroy_something_are_2() {
    let place = Place::new().with("meshes/bracket.ply");
    fs::write(place.path("old.ply"), "old").expect("write");
    fs::write(place.path("bracket.creases.ply"), "old").expect("write");
    fs::create_dir(place.path("folder.ply")).expect("create");
    place.refuses("detect bracket.ply", 2, &["bracket.creases.ply: exists already", "--force"]);
    place.refuses("detect bracket.ply -o old.ply", 2, &["old.ply: exists already"]);
    place.refuses("detect bracket.ply -o o.ply --attributes old.ply", 2, &["old.ply: exists already"]);
    place.refuses("detect bracket.ply -o bracket.ply --force", 2, &["bracket.ply: is the input"]);
    place.refuses("detect bracket.ply -o ./bracket.ply --force", 2, &["bracket.ply: is the input"]);
    place.refuses("detect bracket.ply -o o.ply --attributes bracket.ply --force", 2, &["is the input"]);
    place.refuses(
        "detect bracket.ply -o o.ply --attributes ./o.ply",
        2,
        &["o.ply: is named for two outputs"],
    );
    place.refuses("detect bracket.ply -o folder.ply --force", 2, &["folder.ply: is a directory"]);
    place.refuses("detect bracket.ply -o lines.shp", 2, &["lines.shp: its name does not say", ".ply, .obj"]);
    for name in ["old.ply", "bracket.creases.ply"] {
        assert_eq!(fs::read(place.path(name)).expect("read"), b"old");
    }
    let original = fs::read(fixture_path("meshes/bracket.ply")).expect("read");
    assert_eq!(fs::read(place.path("bracket.ply")).expect("read"), original);
}

#[test]
fn outputs_that_cannot_be_written_are_4() {
    let place = Place::new().with("meshes/bracket.ply");
    place.refuses("detect bracket.ply -o no/lines.ply", 4, &["no/lines.ply: ", "no directory no"]);
    place.refuses("detect bracket.ply --attributes no/table.ply", 4, &["no/table.ply: ", "no directory no"]);
    if cfg!(target_os = "linux") {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("the full device");
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_crease"));
        let child = command.args(["info", "bracket.ply"]).current_dir(place.directory.path());
        let output = child.stdout(full).stderr(Stdio::piped()).output().expect("the command runs");
        assert_eq!(output.status.code(), Some(4));
        assert!(texts(&output).1.contains("crease: error: standard output: "), "{}", texts(&output).1);
    }
}

#[test]
fn detect_writes_the_default_name_and_a_summary() {
    let place = Place::new();
    let input = fixture_path("meshes/bracket.ply");
    let output = place.command().arg("detect").arg(&input).output().expect("the command runs");
    let (out, err) = texts(&output);
    assert_eq!(output.status.code(), Some(0), "{err}");
    assert_eq!(place.names(), ["bracket.creases.ply"]);
    for part in [
        "bracket.ply\n",
        "6,534 faces, 3,267 vertices",
        "median edge",
        "sigma",
        " lines, ",
        "sharp",
        "100.0 %",
        "closed loop",
        "corner",
        "defects seen: none",
        "1 tile,",
        "wall time",
        "peak memory",
        "bracket.creases.ply",
        " kB",
    ] {
        assert!(out.contains(part), "{part:?} is not in {out}");
    }
    // Not a terminal, so lines.
    for part in ["crease: scan started, faces: 6,534", "crease: tiles done", "crease: write done"] {
        assert!(err.contains(part), "{part:?} is not in {err}");
    }
}

#[test]
fn the_paper_method_surveys_and_finds_other_lines() {
    let place = Place::new().with("meshes/bracket.ply");
    place.does("detect bracket.ply -o robust.ply");
    let words = "detect bracket.ply --method paper --sigma 0 --tile-faces 900 --progress plain";
    let (out, err) = place.does(&format!("{words} -o paper.ply"));
    assert!(err.contains("crease: survey started, tiles: "), "{err}");
    for part in ["method            paper, salience from 0.1", "survey", "corners"] {
        assert!(out.contains(part), "{part} is not in {out}");
    }
    place.does(&format!("{words} --salience 0.1 --edge-l2 0.02 --corner-l3 0.065 -o same.ply"));
    place.does("diff paper.ply same.ply");
    let robust = fs::read(place.path("robust.ply")).expect("read");
    assert_ne!(robust, fs::read(place.path("paper.ply")).expect("read"));
    place.does(&format!("{words} --salience 0.9 -o strict.ply"));
    assert_ne!(
        fs::read(place.path("strict.ply")).expect("read"),
        fs::read(place.path("paper.ply")).expect("read")
    );
}

#[test]
fn tiles_do_not_show_in_the_outputs() {
    let place = Place::new().with("meshes/bracket.ply");
    let (_, err) = place.does("detect bracket.ply --attributes t1.ply -o l1.ply --in-core --quiet");
    assert_eq!(err, "");
    let words = "detect bracket.ply --attributes t2.ply -o l2.ply --tile-faces 700 --io read --threads 2 --progress none";
    let (out, err) = place.does(words);
    assert!(out.contains("halo overhead") && out.contains("t2.ply"), "{out}");
    assert_eq!(err, "");
    assert_eq!(place.names(), ["bracket.ply", "l1.ply", "l2.ply", "t1.ply", "t2.ply"]);
    assert_eq!(place.does("diff l1.ply l2.ply").0, "identical\n");
    assert_eq!(place.does("diff t1.ply t2.ply").0, "identical\n");
}

#[test]
fn force_replaces_and_defects_are_named() {
    let place = Place::new().with("meshes/defects.ply");
    fs::write(place.path("defects.creases.ply"), "old").expect("write");
    let (out, _) = place.does("detect defects.ply --force --boundaries");
    for part in [
        "1  face without area",
        "1  face that names a vertex twice",
        "1  duplicate of another face",
        "boundary edges, with one face only",
        "1  non-manifold edge",
        "12  edges between faces of opposite winding",
        "1  vertex that no face uses",
        "  boundary  ",
        "  non-manifold  ",
    ] {
        assert!(out.contains(part), "{part:?} is not in {out}");
    }
    assert!(fs::read(place.path("defects.creases.ply")).expect("read").starts_with(b"ply\n"));
    let (out, _) = place.does("detect defects.ply -o none.ply --min-angle 179");
    assert!(out.contains("found no lines") && out.contains("--min-angle below 179"), "{out}");
}

#[test]
fn diff_finds_a_changed_byte() {
    let place = Place::new().with("meshes/bracket.ply");
    place.does("detect bracket.ply --quiet -o a.ply");
    let mut bytes = fs::read(place.path("a.ply")).expect("read");
    let end = b"end_header\n";
    let payload = bytes.windows(end.len()).position(|w| w == end).expect("a header") + end.len();
    // The upper byte of y in the second record: three doubles, source, two doubles, class are 45 bytes.
    bytes[payload + 45 + 15] ^= 0x80;
    fs::write(place.path("b.ply"), &bytes).expect("write");
    assert_eq!(place.does("diff a.ply a.ply").0, "identical\n");
    let output = place.run("diff a.ply b.ply");
    let (out, err) = texts(&output);
    assert_eq!((output.status.code(), err.as_str()), (Some(1), ""));
    assert!(
        out.starts_with("the files differ, first in element `vertex`, record 1, property `y`: "),
        "{out}"
    );
    assert!(out.contains("vertex.y") && out.contains("largest difference"), "{out}");

    let output = place.run("diff a.ply bracket.ply");
    assert_eq!(output.status.code(), Some(1));
    assert!(texts(&output).0.contains("the headers differ"));
    bytes.truncate(bytes.len() - 1);
    fs::write(place.path("short.ply"), &bytes).expect("write");
    place.refuses("diff a.ply short.ply", 3, &["short.ply: the file is truncated"]);
    place.refuses("diff a.ply missing.ply", 3, &["missing.ply: "]);
    place.refuses("diff missing.ply a.ply", 3, &["missing.ply: "]);
}

#[test]
fn info_describes_the_file_and_the_plan() {
    let place = Place::new().with("meshes/city.ply").with("meshes/polygons.ply");
    let (out, _) = place.does("info city.ply --tile-faces 2000 --threads 3");
    for part in [
        "binary_little_endian",
        "9,640 triangles",
        "4,923",
        "extent",
        "median",
        "precision",
        "steps of a float",
        "tiles             8, up to 3 at a time\n",
        "halo overhead     about",
        "locality",
        "allowed\n",
        "counted by detect",
    ] {
        assert!(out.contains(part), "{part:?} is not in {out}");
    }
    let (out, _) = place.does("info polygons.ply");
    assert!(out.contains("16 triangles, cut from 7 polygons as fans"), "{out}");
    assert_eq!(place.names(), ["city.ply", "polygons.ply"]);
}

#[test]
fn info_warns_of_coarse_coordinates() {
    let place = Place::new();
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
                  property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n";
    let mut bytes = header.as_bytes().to_vec();
    // A square metre in a national grid: a float has steps of half a metre there.
    for (x, y) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
        [500_000.0 + x, 5_800_000.0 + y, 0.0f32].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    }
    for face in [[0u32, 1, 2], [0, 2, 3]] {
        bytes.push(3);
        face.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    }
    fs::write(place.path("far.ply"), bytes).expect("write");
    let (out, _) = place.does("info far.ply");
    assert!(out.contains("warning: the coordinates are stored too coarsely"), "{out}");
}

#[test]
fn several_files_are_one_mesh_named_after_their_folder() {
    let place = Place::new();
    let tiles = place.path("tiles");
    fs::create_dir(&tiles).expect("create");
    for name in ["bracket", "folds20"] {
        fs::copy(fixture_path(&format!("meshes/{name}.ply")), tiles.join(format!("{name}.ply")))
            .expect("copy");
    }
    let (out, _) = place.does("detect tiles --progress none");
    assert!(out.contains("tiles (2 files)\n") && out.contains("11,302 faces"), "{out}");
    assert!(out.contains("; the input was converted\n") && out.contains("\n  convert "), "{out}");
    let lines = fs::read(place.path("tiles.creases.ply")).expect("read");
    for words in ["tiles/folds20.ply tiles/bracket.ply", "tiles/*.ply", "tiles/bracket.ply tiles"] {
        place.does(&format!("detect {words} -o again.ply --force --progress none"));
        assert!(fs::read(place.path("again.ply")).expect("read") == lines, "{words}");
    }
    assert_eq!(place.names(), ["again.ply", "tiles", "tiles.creases.ply"]);
    let (out, _) = place.does("info tiles --progress none");
    assert!(
        out.contains("files             2 PLY, ") && out.contains("converted to be read in place"),
        "{out}"
    );
    place.refuses("detect tiles -o tiles/bracket.ply --force", 2, &["bracket.ply: is the input"]);
}

#[test]
fn text_is_converted_where_temporary_files_go() {
    let place = Place::new().with("meshes/ascii.ply");
    let (out, err) = place.does("info ascii.ply --progress json");
    assert!(out.contains("file              PLY, 299 bytes") && out.contains("12 triangles"), "{out}");
    assert!(
        err.contains(r#"{"event":"started","stage":"convert","unit":"bytes","done":0,"total":299"#),
        "{err}"
    );
    assert_eq!(place.names(), ["ascii.ply"]);
    place.refuses(
        "info ascii.ply --workspace missing",
        4,
        &["missing/ascii.crease-info-", "cannot create the directory"],
    );
}

#[test]
fn json_progress_can_be_parsed() {
    let place = Place::new().with("meshes/bracket.ply");
    let (_, err) = place.does("detect bracket.ply --progress json --tile-faces 2000");
    let events: Vec<serde_json::Value> =
        err.lines().map(|line| serde_json::from_str(line).expect("an object")).collect();
    let of = |kind: &str| -> Vec<&str> {
        events.iter().filter(|e| e["event"] == kind).filter_map(|e| e["stage"].as_str()).collect()
    };
    assert_eq!(of("started"), ["scan", "tiles", "stitch", "write"]);
    assert_eq!(of("finished"), ["scan", "tiles", "stitch", "write"]);
    let end = events.iter().find(|e| e["event"] == "finished" && e["stage"] == "tiles").expect("an end");
    assert_eq!((&end["done"], &end["total"]), (&end["total"], &4.into()));
}

#[test]
fn the_log_goes_to_standard_error() {
    let place = Place::new().with("meshes/bracket.ply");
    let (out, _) = place.does("detect bracket.ply --verbose --progress bar");
    assert!(out.starts_with("bracket.ply\n"), "{out}");
}

#[test]
fn helps_exist() {
    let place = Place::new();
    for (words, parts) in [
        ("--help", ["detect", "info", "diff", "Exit codes:"]),
        ("detect --help", ["What is detected:", "How the work is done", "Output:", "Examples:"]),
        ("info --help", ["What is detected:", "--tile-faces <N>", "--io <MODE>", "<INPUT>..."]),
        ("diff --help", ["<A>", "<B>", "identical", "Usage: crease diff"]),
        ("help detect", ["--sigma <LENGTH>", "degrees", "--min-angle <DEG>", "median edge lengths"]),
    ] {
        let (out, _) = place.does(words);
        for part in parts {
            assert!(out.contains(part), "{words}: {part:?} is not in {out}");
        }
    }
    assert!(place.does("--version").0.starts_with("crease "));
    let output = place.run("");
    assert_eq!(output.status.code(), Some(2));
    assert!(texts(&output).1.contains("Usage: crease [OPTIONS] <COMMAND>"));
}

#[test]
fn a_reader_that_hangs_up_is_no_failure() {
    let place = Place::new().with("meshes/bracket.ply");
    for words in [&["info", "bracket.ply"][..], &["detect", "bracket.ply"], &["--help"]] {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_crease"));
        command.args(words).current_dir(place.directory.path());
        let mut child =
            command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the command starts");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("the command ends");
        let (_, err) = texts(&output);
        assert_eq!(output.status.code(), Some(0), "{err}");
        assert!(!err.contains("panicked") && !err.contains("error"), "{err}");
    }
}
