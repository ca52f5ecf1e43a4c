//! The committed fixtures are what the generator makes, and the defects are where the list says.

#[allow(dead_code, unused_imports, reason = "the generator serves the example `gen`, too")]
#[path = "../tools/gen/mod.rs"]
mod generator;

use generator::{fixtures, handmade};
use glam::DVec3;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// What all fixtures together may weigh in the repository.
const BUDGET: usize = 1_500_000;

fn fixture_directory() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures")
}

/// Files below `directory`, with `/` between names.
fn files_below(directory: &Path, prefix: &str, found: &mut BTreeSet<String>) {
    for entry in fs::read_dir(directory).unwrap() {
        let entry = entry.unwrap();
        let name = format!("{prefix}{}", entry.file_name().to_str().unwrap());
        if entry.file_type().unwrap().is_dir() {
            files_below(&entry.path(), &format!("{name}/"), found);
        } else {
            found.insert(name);
        }
    }
}

#[test]
fn committed_fixtures_are_what_the_generator_makes() {
    let hint = format!("to regenerate: {}", fixtures::COMMAND);
    let mut total = 0;
    for fixture in fixtures::all().unwrap() {
        let path = fixture_directory().join(&fixture.path);
        let committed = fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}; {hint}", path.display()));
        let difference = committed.iter().zip(&fixture.bytes).position(|(a, b)| a != b);
        assert!(
            committed == fixture.bytes,
            "{} differs: {} bytes instead of {}, first other byte at {difference:?}; {hint}",
            fixture.path,
            committed.len(),
            fixture.bytes.len(),
        );
        total += committed.len();
    }
    assert!(total <= BUDGET, "the fixtures take {total} bytes");
}

#[test]
fn there_are_no_other_fixtures() {
    let known: BTreeSet<String> = fixtures::all().unwrap().into_iter().map(|fixture| fixture.path).collect();
    let mut present = BTreeSet::new();
    files_below(&fixture_directory(), "", &mut present);
    // The golden results are those of tools/reference and have a test of their own.
    present.retain(|path| !path.starts_with("golden/"));
    let stray: Vec<_> = present.difference(&known).collect();
    assert!(stray.is_empty(), "not made by the generator: {stray:?}");
}

#[test]
fn writing_the_fixtures_writes_every_file() {
    let directory = tempfile::tempdir().unwrap();
    fixtures::write(directory.path()).unwrap();
    for fixture in fixtures::all().unwrap() {
        assert_eq!(
            fs::read(directory.path().join(&fixture.path)).unwrap(),
            fixture.bytes,
            "{}",
            fixture.path
        );
    }
}

#[test]
fn the_defects_are_where_the_list_says() {
    let shape = handmade::defects();
    let distinct = |face: [u32; 3]| BTreeSet::from(face).len();
    assert_eq!(shape.faces.len(), 133);
    assert_eq!(shape.faces[128], shape.faces[0]);
    assert_eq!(distinct(shape.faces[129]), 2);
    assert_eq!(distinct(shape.faces[130]), 3);
    assert_eq!(shape.area_normal(shape.faces[130]), DVec3::ZERO);
    let with_fin = shape.faces.iter().filter(|face| face.contains(&28) && face.contains(&29)).count();
    assert_eq!(with_fin, 3);
    let referenced: BTreeSet<u32> = shape.faces.iter().flatten().copied().collect();
    let unreferenced: Vec<u32> =
        (0..shape.vertices.len() as u32).filter(|i| !referenced.contains(i)).collect();
    assert_eq!(unreferenced, [82]);
    let flipped: Vec<usize> = (0..128).filter(|&i| shape.area_normal(shape.faces[i]).z < 0.0).collect();
    let listed: Vec<usize> = (72..78).chain(88..94).collect();
    assert_eq!(flipped, listed);
}
