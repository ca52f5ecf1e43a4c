//! An input that is cut off, replaced or written to while it is read ends the run with an error that says so: never with a
//! result, never with a signal.

mod support;

use crease::input::{ByteSource, IoMode, exit_on_bus_error, say_on_bus_error};
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::SystemTime;
use support::Mesh;
use support::command::{Ended, Place};

/// Runs `detect` on a mesh of many tiles and does `change` to its file when `stage` has begun.
fn changed_while_read(io: &str, stage: &str, words: &str, change: fn(&Path)) -> (Place, Ended) {
    let place = Place::new();
    let mesh = place.write("roof.ply", &Mesh::roof(220).ply());
    let mut child = Command::new(env!("CARGO_BIN_EXE_crease"))
        .args(["detect", "roof.ply", "-o", "out.ply", "--progress", "json", "--threads", "1", "--io", io])
        .args(words.split_whitespace())
        .current_dir(mesh.parent().expect("a directory"))
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command runs");
    let mut lines = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut err = String::new();
    let begun = format!("\"stage\":\"{stage}\"");
    while !err.contains(&begun) {
        assert!(lines.read_line(&mut err).expect("text") > 0, "the run was over before it began: {err}");
    }
    change(&mesh);
    lines.read_to_string(&mut err).expect("text");
    let code = child.wait().expect("it ends").code();
    (place, Ended { code, out: String::new(), err })
}

const TILES: (&str, &str) = ("tiles", "--tile-faces 1500");

#[track_caller]
fn refused(change: fn(&Path), (stage, words): (&str, &str), parts: &[&str]) {
    for io in ["map", "read"] {
        let (place, ended) = changed_while_read(io, stage, words, change);
        assert_eq!(ended.code, Some(3), "{io}: {ended:?}");
        let error = ended.error();
        assert!(
            error.contains("roof.ply: ") && error.contains(&format!("found in stage `{stage}`")),
            "{io}: {error}"
        );
        // Whoever comes first, the handler or the look between tiles, says it.
        assert!(parts.iter().any(|part| error.contains(part)), "{io}: {error}");
        assert!(!place.names().contains(&"out.ply".to_owned()), "{io}: {:?}", place.names());
    }
}

#[test]
fn a_file_that_is_cut_off() {
    let cut = |path: &Path| File::options().write(true).open(path).expect("open").set_len(5000).expect("cut");
    refused(cut, TILES, &["has 5000", "a part of the file is gone"]);
}

#[test]
fn a_file_that_is_replaced() {
    let replace = |path: &Path| {
        let new = path.with_extension("new");
        fs::copy(path, &new).expect("copy");
        fs::rename(new, path).expect("rename");
    };
    refused(replace, TILES, &["another file has taken its place"]);
    refused(replace, ("survey", "--tile-faces 1500 --method paper"), &["another file has taken its place"]);
}

#[test]
fn a_file_that_is_written_to() {
    let touch = |path: &Path| {
        let file = File::options().write(true).open(path).expect("open");
        file.set_modified(SystemTime::UNIX_EPOCH).expect("touch");
    };
    refused(touch, TILES, &["was written to"]);
    // With one tile, there is only the look at its end.
    refused(touch, ("tiles", "--in-core"), &["was written to"]);
}

#[test]
fn a_file_that_is_removed() {
    refused(|path| fs::remove_file(path).expect("remove"), TILES, &["was removed"]);
}

/// Where [`loses_its_page`] finds its file; without it, there is nothing to do.
const CHILD: &str = "CREASE_TEST_LOSES_ITS_PAGE";

#[test]
fn loses_its_page() {
    let Some(path) = std::env::var_os(CHILD).map(PathBuf::from) else { return };
    let source = ByteSource::open(&path, IoMode::Map).expect("it is there");
    exit_on_bus_error(3).expect("a handler");
    say_on_bus_error("not this\n".to_owned());
    say_on_bus_error("the page is gone\n".to_owned());
    File::options().write(true).open(&path).expect("open").set_len(0).expect("cut");
    // Several threads meet the hole, one says so.
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| source.mapped().map(|bytes| bytes.iter().map(|&b| u64::from(b)).sum::<u64>()));
        }
    });
    unreachable!("the handler ends the process");
}

#[test]
fn a_page_that_is_gone_ends_the_process_with_the_message_that_was_prepared() {
    let place = Place::new();
    let file = place.write("pages", &[7; 1 << 16]);
    let output = Command::new(std::env::current_exe().expect("this test"))
        .args(["--exact", "loses_its_page", "--nocapture"])
        .env(CHILD, &file)
        .output()
        .expect("it runs");
    let err = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{err}");
    assert_eq!(err.matches("the page is gone\n").count(), 1, "{err}");
    assert!(!err.contains("not this"), "{err}");
}
