//! The commands in README.md and docs/GUIDE.md do what they say: each is run as it stands there.
//!
//! A fenced block is run if the words behind its language say `run`: ```` ```sh run ````; `skip=WHY` says why one is for the
//! reader only. All blocks of a document run in one directory, in their order, with `crease` on the path and the meshes below. Python is that of the environment
//! variable CREASE_DOCS_PYTHON, which must have the packages that the blocks import; without it they are not run.

mod support;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use support::command::Place;
use support::fixture;

/// What the documents call the meshes that come with the project.
const MESHES: [(&str, &str); 4] = [
    ("scan.ply", "meshes/city.ply"),
    ("part.ply", "meshes/bracket_clean.ply"),
    ("tiles/north.ply", "meshes/folds10.ply"),
    ("tiles/south.ply", "meshes/folds20.ply"),
];

/// A fenced block.
struct Block {
    /// The line its fence is on, from 1.
    line: usize,
    language: String,
    words: Vec<String>,
    text: String,
}

impl Block {
    fn says(&self, word: &str) -> bool {
        self.words.iter().any(|w| w == word)
    }

    fn value(&self, name: &str) -> Option<&str> {
        self.words.iter().find_map(|word| word.strip_prefix(name)?.strip_prefix('='))
    }
}

/// The fenced blocks of a document.
fn blocks(text: &str) -> Vec<Block> {
    let mut found = Vec::new();
    let mut lines = text.lines().enumerate();
    while let Some((i, line)) = lines.next() {
        let Some(info) = line.strip_prefix("```") else { continue };
        let mut words = info.split_whitespace().map(str::to_owned);
        let language = words.next().unwrap_or_default();
        let words = words.collect();
        let body: Vec<&str> =
            lines.by_ref().map(|(_, line)| line).take_while(|line| !line.starts_with("```")).collect();
        found.push(Block { line: i + 1, language, words, text: body.join("\n") + "\n" });
    }
    found
}

fn document(name: &str) -> Vec<Block> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
    let text = fs::read_to_string(path).unwrap_or_else(|e| panic!("{name}: {e}"));
    let found = blocks(&text);
    let commands = found.iter().filter(|block| block.language == "sh");
    for block in commands.filter(|block| block.text.contains("crease ")) {
        let decided = block.says("run") || block.value("skip").is_some();
        assert!(decided, "{name}:{}: neither `run` nor `skip=WHY`", block.line);
    }
    found
}

/// A directory with the meshes, and `crease` in its folder `.bin`.
fn place() -> Place {
    let place = Place::new();
    for folder in ["tiles", ".bin"] {
        fs::create_dir(place.path(folder)).expect("create");
    }
    for (name, mesh) in MESHES {
        fs::copy(fixture(mesh), place.path(name)).expect("copy");
    }
    std::os::unix::fs::symlink(env!("CARGO_BIN_EXE_crease"), place.path(".bin/crease")).expect("link");
    place
}

fn run(name: &str) -> (usize, usize) {
    let place = place();
    let python = std::env::var_os("CREASE_DOCS_PYTHON").map(PathBuf::from);
    let (mut ran, mut skipped) = (0, 0);
    for block in document(name).iter().filter(|block| block.says("run")) {
        let at = format!("{name}:{}", block.line);
        let mut command = match (block.language.as_str(), &python) {
            ("sh", _) => {
                let mut bash = Command::new("bash");
                bash.args(["-euo", "pipefail", "-c"]);
                bash
            }
            ("python", Some(python)) => {
                let mut command = Command::new(python);
                command.arg("-c");
                command
            }
            ("python", None) => {
                println!("{at}: skipped: CREASE_DOCS_PYTHON not set");
                skipped += 1;
                continue;
            }
            (other, _) => panic!("{at}: nothing runs {other}"),
        };
        let home = place.path("");
        let path = std::env::var("PATH").unwrap_or_default();
        let path = format!("{}:{path}", place.path(".bin").display());
        command.arg(&block.text).current_dir(&home).env("HOME", &home).env("PATH", path);
        let output = command.env_remove("RUST_LOG").output().expect("it starts");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        assert!(
            output.status.success(),
            "{at}:\n{}\n{}\n{}",
            block.text,
            text(&output.stdout),
            text(&output.stderr)
        );
        ran += 1;
    }
    (ran, skipped)
}

#[test]
fn the_commands_of_the_readme_work() {
    let (ran, _) = run("README.md");
    assert!(ran >= 1, "{ran}");
}

#[test]
fn the_commands_of_the_guide_work() {
    let (ran, _) = run("docs/GUIDE.md");
    assert!(ran >= 13, "{ran}");
}

/// Options that a document names must be there.
#[test]
fn the_guide_names_only_options_that_there_are() {
    let place = Place::new();
    let commands =
        ["detect", "info", "diff", "clean", "plan", "tile", "stitch", "status", "completions", "man"];
    let help: String = commands.map(|command| place.does(&format!("{command} --help"))).concat();
    for block in document("docs/GUIDE.md") {
        if block.language != "sh" {
            continue;
        }
        for line in block.text.lines().filter(|line| line.contains("crease ")) {
            let (_, ours) = line.split_once("crease ").unwrap_or_default();
            let ours = ours.split(['|', ';', '#']).next().unwrap_or_default();
            for option in ours.split_whitespace().filter(|word| word.starts_with("--") && word.len() > 2) {
                let name = option.split('=').next().unwrap_or(option);
                assert!(help.contains(name), "docs/GUIDE.md:{}: {name}", block.line);
            }
        }
    }
}

#[test]
fn blocks_are_found_with_their_words() {
    let text = "a\n```sh run\nls\npwd\n```\nb\n```\nplain\n```\n";
    let found = blocks(text);
    assert_eq!((found.len(), found[0].line, found[0].text.as_str()), (2, 2, "ls\npwd\n"));
    assert!(found[0].says("run"));
    assert!(found[1].language.is_empty() && !found[1].says("run"));
}
