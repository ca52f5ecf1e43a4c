//! What the program is on a terminal and for a shell: completions, manual pages, presets, colours, `info` for people and for
//! programs.

mod support;

use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use support::command::{Place, ended, names};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/meshes").join(name)
}

fn with(names: &[&str]) -> Place {
    let place = Place::new();
    for name in names {
        fs::copy(fixture(name), place.path(name)).expect("copy");
    }
    place
}

/// Long options of all commands, as the help has them.
fn options(place: &Place) -> Vec<(&'static str, Vec<String>)> {
    let commands =
        ["detect", "info", "diff", "clean", "plan", "tile", "stitch", "status", "completions", "man"];
    commands
        .map(|command| {
            let help = place.does(&format!("{command} --help"));
            let words = help.lines().filter(|line| line.trim_start().starts_with('-'));
            let option = |line: &str| {
                let word = line.split_whitespace().find(|word| word.starts_with("--"))?;
                Some(word.trim_end_matches(',').to_owned())
            };
            (command, words.filter_map(option).collect())
        })
        .into()
}

/// Whether a program can be run.
fn there_is(program: &str) -> bool {
    let run = Command::new(program).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    if run.is_err() {
        println!("skipped in part: there is no {program}");
    }
    run.is_ok()
}

#[test]
fn completions_know_all_options() {
    let place = Place::new();
    let options = options(&place);
    assert!(options.iter().map(|(_, options)| options.len()).sum::<usize>() > 30, "{options:?}");
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = place.does(&format!("completions {shell}"));
        for (command, options) in &options {
            assert!(script.contains(command), "{shell}: {command}");
            // Fish names them without dashes.
            let known = |option: &String| script.contains(option.trim_start_matches('-'));
            assert!(options.iter().all(known), "{shell}: {command} {options:?}");
        }
        place.write(shell, script.as_bytes());
    }
    for shell in ["bash", "zsh", "fish"].into_iter().filter(|shell| there_is(shell)) {
        let checked = Command::new(shell).arg("-n").arg(place.path(shell)).output().expect("a shell");
        assert!(checked.status.success() && checked.stderr.is_empty(), "{shell}: {checked:?}");
    }
    place.run("completions tcsh").refused(2, &["tcsh"]);
}

#[test]
fn manual_pages_name_all_options_and_can_be_rendered() {
    let place = Place::new();
    assert!(place.does("man").contains(".TH crease 1"));
    assert_eq!(place.does("man --out new/man1"), "");
    let options = options(&place);
    let pages = names(&place.path("new/man1"));
    assert_eq!(pages.len(), options.len() + 1, "{pages:?}");
    for (command, options) in options {
        let page = String::from_utf8(place.read(&format!("new/man1/crease-{command}.1"))).expect("text");
        let page = page.replace("\\-", "-");
        options.iter().for_each(|option| assert!(page.contains(option), "{command} {option}"));
    }
    assert!(pages.contains(&"crease.1".to_owned()));
    if there_is("groff") {
        for name in pages {
            let mut groff = Command::new("groff");
            groff.args(["-man", "-Tutf8", "-ww"]).arg(place.path("new/man1").join(&name));
            let rendered = groff.output().expect("groff");
            assert!(rendered.status.success() && rendered.stderr.is_empty(), "{name}: {rendered:?}");
            assert!(rendered.stdout.len() > 1000, "{name}: {rendered:?}");
        }
    }
    // A file is in the way of the directory.
    place.write("file", b"");
    place.run("man --out file/man1").refused(4, &["file/man1", "cannot write"]);
}

/// Number of lines of a result, and whether they were fitted.
fn lines(place: &Place, name: &str) -> (u64, bool) {
    let bytes = place.read(name);
    let end = bytes.windows(10).position(|w| w == b"end_header").expect("a header");
    let header = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let count = header.lines().find_map(|line| line.strip_prefix("element line ")).expect("lines");
    (count.parse().expect("a number"), header.contains("geometry fitted"))
}

#[test]
fn a_preset_is_the_same_as_its_options_and_gives_way_to_others() {
    let place = with(&["bracket.ply"]);
    let same = [
        ("", "--preset scan"),
        ("--preset cad", "--sigma-edges 2 --boundaries --geometry fitted"),
        ("--preset terrain", "--sigma-edges 2.5 --min-length 6 --geometry fitted"),
        ("--preset cad --geometry vertices --sigma-edges 3", "--boundaries"),
        ("--preset terrain --min-length 0", "--sigma-edges 2.5 --min-length 0 --geometry fitted"),
    ];
    for (a, b) in same {
        place.does(&format!("detect bracket.ply -q --force -o a.ply {a}"));
        place.does(&format!("detect bracket.ply -q --force -o b.ply {b}"));
        assert!(place.read("a.ply") == place.read("b.ply"), "{a} is not {b}");
    }
    place.does("detect bracket.ply -q --force -o a.ply --preset cad");
    assert!(lines(&place, "a.ply").1);
    place.does("detect bracket.ply -q --force -o b.ply");
    assert!(place.read("a.ply") != place.read("b.ply") && !lines(&place, "b.ply").1);
    let said = |words: &str| place.does(&format!("detect bracket.ply --force -o a.ply {words}"));
    assert!(!said("").contains("preset"));
    let line = "  preset            cad: --sigma-edges 2 --boundaries --geometry fitted\n";
    assert!(said("--preset cad").contains(line));
    // What was given is not what the preset set.
    assert!(
        said("--preset cad --sigma 3").contains("  preset            cad: --boundaries --geometry fitted\n")
    );
    let sigma = |words: &str| {
        let info: Value =
            serde_json::from_str(&place.does(&format!("info bracket.ply --json {words}"))).expect("JSON");
        info["plan"]["sigma_median_edges"].as_f64().expect("a number")
    };
    assert!((sigma("--preset cad") - 2.0).abs() < 1e-9);
    assert!((sigma("--preset cad --sigma-edges 4") - 4.0).abs() < 1e-9);
}

#[test]
fn colours_are_for_terminals_and_for_those_who_ask() {
    let place = with(&["bracket.ply"]);
    let has = |line: &str, name: &str, value: &str| {
        let mut command = place.command();
        command.args(line.split_whitespace()).env_remove("CLICOLOR_FORCE").env_remove("NO_COLOR");
        if !name.is_empty() {
            command.env(name, value);
        }
        let ended = ended(&mut command);
        (ended.out + &ended.err).contains('\u{1b}')
    };
    for line in ["info bracket.ply", "info none.ply", "--help", "detect bracket.ply -o a.ply --force"] {
        assert!(!has(line, "", ""), "{line}: nobody sees colours in a file");
        assert!(!has(&format!("--color never {line}"), "CLICOLOR_FORCE", "1"), "{line}");
    }
    for line in ["info bracket.ply", "info none.ply", "--help"] {
        assert!(has(&format!("{line} --color always"), "NO_COLOR", "1"), "{line}: what is asked for wins");
        assert!(has(&format!("{line} --color=auto"), "CLICOLOR_FORCE", "1"), "{line}");
    }
    place.run("info bracket.ply --color sometimes").refused(2, &["--color"]);
    // JSON is never in colours.
    assert!(!has("info bracket.ply --json --progress none --color always", "", ""));
}

/// The paths of all fields of a JSON value; elements of lists count as one.
fn fields(value: &Value, path: &str, found: &mut Vec<String>) {
    match value {
        Value::Object(map) => {
            for (name, value) in map {
                let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
                found.push(path.clone());
                fields(value, &path, found);
            }
        }
        Value::Array(items) => items.iter().for_each(|item| fields(item, &format!("{path}[]"), found)),
        _ => {}
    }
}

#[test]
fn info_says_the_same_to_programs_and_to_people() {
    let place = with(&["city.ply", "ascii.ply"]);
    let json = place.does("info city.ply --json --tile-faces 2000");
    let info: Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!((&info["schema_version"], &info["mesh"]["faces"]), (&1.into(), &9640.into()));
    assert_eq!(info["input"]["elements"][0]["properties"][0]["name"], "x");
    assert_eq!((&info["input"]["converted"], &info["plan"]["tiles"]), (&false.into(), &8.into()));
    assert!(info["time"]["guess"]["total_seconds"].as_f64().expect("a guess") > 0.0, "{json}");
    let text = place.does("info city.ply --tile-faces 2000");
    for part in [
        "\nmesh\n",
        "\nplan\n",
        "\ntime\n",
        "9,640 triangles",
        "  tiles             8, ",
        "  detect            about ",
    ] {
        assert!(text.contains(part), "{part:?} is not in {text}");
    }
    let converted: Value = serde_json::from_str(&place.does("info ascii.ply --json")).expect("JSON");
    assert_eq!(converted["input"]["files"][0]["format"], "PLY");
    assert!(converted["time"]["conversion_seconds"].is_f64() && converted["input"]["encoding"].is_null());

    // Every field is documented, and every documented field is there.
    let mut found = Vec::new();
    fields(&info, "", &mut found);
    fields(&converted, "", &mut found);
    // A coordinate that is no number: something to count.
    let mut broken = place.read("city.ply");
    let vertices = broken.windows(11).position(|w| w == b"end_header\n").expect("a header") + 11;
    broken[vertices..vertices + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    place.write("broken.ply", &broken);
    let broken = place.does("info broken.ply --json --bad-faces skip");
    fields(&serde_json::from_str(&broken).expect("JSON"), "", &mut found);
    found.sort();
    found.dedup();
    let formats =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/FORMATS.md")).expect("read");
    let (_, section) = formats.split_once("<!-- info fields -->").expect("the table of the fields");
    let (section, _) = section.split_once("<!-- end of info fields -->").expect("its end");
    let mut documented: Vec<String> = section
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split_once('`'))
        .map(|(name, _)| name.to_owned())
        .collect();
    documented.sort();
    assert_eq!(found, documented);
}

#[test]
fn info_leaves_nothing_and_takes_nothing_away() {
    let place = with(&["ascii.ply"]);
    fs::create_dir(place.path("elsewhere")).expect("create");
    // What an interrupted run has kept would be here.
    fs::create_dir(place.path("ascii.creases.crease-work")).expect("create");
    place.write("ascii.creases.crease-work/crease-job", b"kept");
    for words in ["info ascii.ply", "info ascii.ply --workspace elsewhere", "info ascii.ply --json"] {
        place.does(words);
        assert_eq!(place.names(), ["ascii.creases.crease-work", "ascii.ply", "elsewhere"], "{words}");
        assert!(names(&place.path("elsewhere")).is_empty(), "{words}");
    }
    assert_eq!(place.read("ascii.creases.crease-work/crease-job"), b"kept");
    place.write("torn.ply", &place.read("ascii.ply")[..250]);
    place.run("info torn.ply").refused(3, &["torn.ply"]);
    assert_eq!(place.names(), ["ascii.creases.crease-work", "ascii.ply", "elsewhere", "torn.ply"]);
}

#[test]
fn progress_tells_memory_and_what_is_left() {
    let place = with(&["city.ply"]);
    let run = place.run("detect city.ply --progress json --tile-faces 500 --memory 512MiB");
    let events: Vec<Value> = run.err.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let finished = events.iter().filter(|event| event["event"] == "finished").count();
    assert_eq!(finished, 4, "{events:?}");
    for event in &events {
        assert!(event["allocated_bytes"].as_u64().expect("bytes") > 0, "{event}");
        assert_eq!(event["allowed_bytes"], 512 << 20, "{event}");
        assert!(
            event["remaining_seconds"].is_null() || event["remaining_seconds"].as_f64().expect("s") >= 0.0
        );
    }
}
