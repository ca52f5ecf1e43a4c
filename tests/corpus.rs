//! Files of all kinds, whole and cut off: every one of them is understood or refused in words, by a run that ends, does not
//! panic and stays small.

mod support;

use assert_cmd::Command;
use std::fs;
use std::path::{Path, PathBuf};
use support::command::{Ended, PATIENCE, Place, ended};
use support::fixture;

/// What a run may take for data, in KiB: 64 MiB allocated, and the stacks of its threads, 2 MiB each and 8 for the first.
const DATA_LIMIT: u64 = (64 + 8 + 10 * 2) << 10;

/// Runs the binary in `place` with so little memory that whoever believes a wrong number in a header dies of it.
fn run(place: &Place, words: &[&str]) -> Ended {
    let mut command = Command::new("sh");
    let limited = format!("ulimit -d {DATA_LIMIT}; exec \"$@\"");
    command.args(["-c", &limited, "sh", env!("CARGO_BIN_EXE_crease")]).args(words);
    ended(command.current_dir(place.path("")).env_remove("RUST_LOG").timeout(PATIENCE))
}

/// Sees to it that `mesh` is understood in all ways of working with the same result, or refused in all of them with the
/// same words. Says which.
#[track_caller]
fn understood_or_refused(place: &Place, mesh: &Path) -> bool {
    let name = mesh.to_str().expect("a name");
    let info = run(place, &["info", name]);
    let ways: [&[&str]; 3] = [
        &["--in-core"],
        &["--tile-faces", "300", "--threads", "2"],
        &["--io", "read", "--tile-faces", "1000"],
    ];
    let mut first: Option<Result<Vec<u8>, String>> = None;
    for way in ways {
        let words = [&["detect", name, "-o", "out.ply", "--boundaries", "--force"], way].concat();
        let ended = run(place, &words);
        let outcome = match ended.code {
            Some(0) => {
                assert!(peak_megabytes(&ended.out) <= 64.0, "{name} {way:?}: {}", ended.out);
                Ok(place.read("out.ply"))
            }
            Some(3) => {
                assert!(ended.error().contains(name), "{name} {way:?}: {ended:?}");
                assert!(!place.path("out.ply").exists(), "{name} {way:?} left a result");
                Err(ended.error().to_owned())
            }
            _ => panic!("{name} {way:?}: {ended:?}"),
        };
        assert_eq!(info.code, ended.code, "{name}: info {info:?}, detect {way:?} {ended:?}");
        match &first {
            None => first = Some(outcome),
            Some(first) => assert!(*first == outcome, "{name} {way:?}: {ended:?}"),
        }
        let _ = fs::remove_file(place.path("out.ply"));
    }
    assert_eq!(place.names(), Vec::<String>::new(), "{name} left something behind");
    matches!(first, Some(Ok(_)))
}

/// What a summary says about the most that was allocated, in megabytes.
fn peak_megabytes(summary: &str) -> f64 {
    let line = summary.lines().find(|line| line.contains("peak memory")).expect("a line about memory");
    let words: Vec<&str> = line.split_whitespace().collect();
    let number: f64 = words[2].parse().expect("a number");
    number
        * match words[3] {
            "B" | "bytes" => 1e-6,
            "kB" => 1e-3,
            "MB" => 1.0,
            unit => panic!("{unit} in {line}"),
        }
}

fn files(directory: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(directory).unwrap_or_else(|e| panic!("{}: {e}", directory.display()));
    let mut files: Vec<PathBuf> = entries.map(|e| e.expect("entry").path()).collect();
    files.sort();
    files
}

#[test]
fn files_from_elsewhere() {
    let Some(data) = std::env::var_os("CREASE_DATA") else {
        eprintln!("skipped: CREASE_DATA not set");
        return;
    };
    let directory = Path::new(&data).join("ply-corpus");
    if !directory.is_dir() {
        eprintln!("skipped: {} is not there", directory.display());
        return;
    }
    let place = Place::new();
    let files = files(&directory);
    let understood = files.iter().filter(|file| understood_or_refused(&place, file)).count();
    eprintln!("{understood} of {} files were understood", files.len());
    assert!(understood >= 10, "only {understood} of {} files were understood", files.len());
}

#[test]
fn fixtures_good_and_bad() {
    let place = Place::new();
    for file in files(&fixture("broken")) {
        // Some of them are good meshes in a form that not every reader knows.
        let understood = understood_or_refused(&place, &file);
        let name = file.file_name().expect("a name").to_string_lossy().into_owned();
        assert!(!understood || name == "ascii.ply", "{name} was understood");
    }
    for name in ["defects", "polygons", "bracket_clean"] {
        assert!(understood_or_refused(&place, &fixture(&format!("meshes/{name}.ply"))), "{name} was refused");
    }
}

#[test]
fn files_that_are_cut_off_anywhere() {
    for (fixture_name, extra) in [("polygons", 0), ("defects", 0), ("defects", 100)] {
        let whole = fs::read(fixture(&format!("meshes/{fixture_name}.ply"))).expect("a fixture");
        // Bytes behind the last record are nobody's business.
        let bytes = [whole.as_slice(), &vec![7; extra]].concat();
        let place = Place::new();
        let mesh = place.write("cut.ply", &bytes);
        assert_eq!(run(&place, &["detect", "cut.ply", "-q", "-o", "whole.ply"]).code, Some(0));
        let expected = place.read("whole.ply");
        let cuts = 200.min(bytes.len());
        for cut in 0..cuts {
            let length = cut * bytes.len() / cuts;
            fs::write(&mesh, &bytes[..length]).expect("write");
            let io = if cut % 2 == 0 { "map" } else { "read" };
            let ended = run(&place, &["detect", "cut.ply", "-q", "-o", "out.ply", "--force", "--io", io]);
            if length >= whole.len() {
                assert_eq!(ended.code, Some(0), "{length} bytes: {ended:?}");
                assert!(place.read("out.ply") == expected, "{length} bytes give another result");
            } else {
                ended.refused(3, &["cut.ply: "]);
                assert_eq!(place.names(), ["cut.ply", "whole.ply"], "{length} bytes left something behind");
            }
            let _ = fs::remove_file(place.path("out.ply"));
        }
    }
}
