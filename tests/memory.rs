//! The memory that was allowed is kept, also where the mesh is hard to cut, and nothing of it can be seen in the result.
//!
//! The real program runs, because it counts what it allocates. In optimised builds it also runs in a memory cgroup, where
//! the kernel ends whoever takes more, on meshes that are made to be hard.

#[cfg(not(debug_assertions))]
#[allow(dead_code, reason = "the benchmark uses more of it")]
#[path = "../tools/bench/scale/cgroup.rs"]
mod cgroup;
#[allow(dead_code, unused_imports, reason = "the generator serves the example `gen`, too")]
#[path = "../tools/gen/mod.rs"]
mod generator;

use generator::noise::NoiseKind;
use generator::scan::CityScan;
use generator::scan::write::{Style, write};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// What a run writes: lines, also as a database, the table, the annotated mesh.
const OUTPUTS: [(&str, &str); 4] = [
    ("-o", "lines.ply"),
    ("-o", "lines.gpkg"),
    ("--attributes", "table.ply"),
    ("--annotate", "annotated.ply"),
];

/// The bytes of these.
type Written = Vec<Vec<u8>>;

/// A directory with a mesh.
struct Place {
    directory: TempDir,
    mesh: PathBuf,
}

impl Place {
    /// With what `make` writes.
    fn with(make: impl FnOnce(&Path)) -> Place {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let mesh = directory.path().join("mesh.ply");
        make(&mesh);
        Place { directory, mesh }
    }

    fn city(triangles: u64) -> Place {
        Place::with(|mesh| {
            let city = CityScan::new(triangles, 7).expect("a city");
            let city = city.with_noise(NoiseKind::Normal, 0.03).expect("noise");
            let style = Style { mesh, truth: None, offset: None, shuffle: None };
            write(&city, &style).expect("written");
        })
    }

    /// Runs `crease detect` with the options `words` as `command` does, and gives what it wrote.
    fn detect(&self, mut command: Command, words: &str) -> (Output, Option<Written>) {
        let files = OUTPUTS.map(|(_, name)| self.directory.path().join(name));
        command.arg("detect").arg(&self.mesh);
        OUTPUTS.iter().zip(&files).for_each(|((option, _), file)| _ = command.arg(option).arg(file));
        let output = command.args(words.split_whitespace()).output().expect("the program runs");
        let read = |file: &PathBuf| {
            let bytes = std::fs::read(file).ok()?;
            std::fs::remove_file(file).ok()?;
            Some(bytes)
        };
        // Each is removed, whether the others are there or not.
        let written: Vec<Option<Vec<u8>>> = files.iter().map(read).collect();
        (output, written.into_iter().collect())
    }
}

fn crease() -> Command {
    Command::new(env!("CARGO_BIN_EXE_crease"))
}

/// Whole megabytes that the summary says were allocated at the peak, rounded up, and the tiles it says there were.
fn used(output: &Output) -> (u64, u64) {
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let line = |name: &str| {
        let found = text.lines().find_map(|line| line.trim_start().strip_prefix(name));
        found.unwrap_or_else(|| panic!("no {name} in {text}")).trim().to_owned()
    };
    let peak = line("peak memory");
    let (number, rest) = peak.split_once(' ').expect("a unit");
    assert!(rest.starts_with("MB of "), "{peak}");
    let tiles = line("tiles");
    let tiles = tiles.split_once(' ').expect("a number of tiles").0.replace(',', "");
    (number.parse::<f64>().expect("a number").ceil() as u64, tiles.parse().expect("a number"))
}

#[test]
fn no_more_is_allocated_than_allowed() {
    let place = Place::city(if cfg!(debug_assertions) { 160_000 } else { 300_000 });
    let (_, whole) = place.detect(crease(), "--in-core --progress none");
    let whole = whole.expect("a result");
    // Odd numbers of threads, mapped and read.
    for (memory, words) in [(40, "--threads 1 --io read"), (40, "--threads 3"), (60, "--threads 2 --io read")]
    {
        let (output, result) =
            place.detect(crease(), &format!("--memory {memory}MB --progress none {words}"));
        assert!(output.status.success(), "{output:?}");
        let (peak, tiles) = used(&output);
        assert!(peak <= memory, "{peak} MB of {memory} MB, {words}");
        assert!(tiles > 1, "{memory} MB hold all of it");
        assert!(result.as_ref() == Some(&whole), "{memory} MB, {words}: another result");
    }
}

#[test]
fn what_cannot_fit_is_refused() {
    let place = Place::city(60_000);
    for (words, part) in [
        ("--memory 8MiB", "are needed to plan a mesh of this size"),
        ("--memory 24MiB --in-core", "depend on each other; to work on them takes"),
    ] {
        let (output, result) = place.detect(crease(), &format!("{words} --threads 4 --progress none"));
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(4), "{words}: {error}");
        assert!(error.contains(part) && error.contains("--memory"), "{words}: {error}");
        assert!(result.is_none(), "{words}: something was written");
    }
}

/// Under a hard limit of the kernel; some seconds of work with optimisation.
#[cfg(not(debug_assertions))]
mod gate {
    use super::generator::adversarial::Adversary;
    use super::generator::ply::Scalar;
    use super::*;

    /// Megabytes: what the program is told, and what the kernel allows.
    const LITTLE: [u64; 2] = [64, 160];

    /// What the program wrote within the limit, or its error; nothing where no group can be made.
    fn limited(place: &Place, [memory, limit]: [u64; 2]) -> Option<(Output, Option<Written>)> {
        match cgroup::Cgroup::create(Some(limit << 20)) {
            Ok(group) => {
                let command = group.command(env!("CARGO_BIN_EXE_crease"));
                let found = place.detect(command, &format!("--memory {memory}MiB --progress none"));
                assert_eq!(group.kills().unwrap_or(0), 0, "the kernel ended it");
                Some(found)
            }
            Err(error) => {
                println!("skipped: {error:#}");
                None
            }
        }
    }

    fn same_as_in_core(name: &str, place: &Place, memory: [u64; 2]) {
        let Some((output, within)) = limited(place, memory) else { return };
        assert!(output.status.success(), "{name}: {output:?}");
        let (peak, _) = used(&output);
        assert!((peak - 1) * 1_000_000 <= memory[0] << 20, "{name}: {peak} MB");
        let (_, whole) = place.detect(crease(), "--in-core --progress none");
        assert!(within.is_some() && within == whole, "{name}: another result");
    }

    #[test]
    fn a_city_of_two_million_triangles() {
        same_as_in_core("city", &Place::city(2_000_000), LITTLE);
    }

    fn adversary(kind: Adversary, faces: u64) -> Place {
        Place::with(|mesh| {
            kind.describe(faces, 3).and_then(|mesh_| mesh_.write(mesh, Scalar::Float)).expect("written");
        })
    }

    #[test]
    fn meshes_that_are_hard_to_cut() {
        for (kind, faces) in [
            (Adversary::Coincident, 100_000),
            (Adversary::Fan, 20_000),
            // Slivers lead from everywhere to everywhere: they fit or they do not.
            (Adversary::Needles, 100_000),
            (Adversary::Pile, 1_000_000),
            (Adversary::Giants, 100_000),
            (Adversary::Corners, 300_000),
        ] {
            same_as_in_core(&kind.to_string(), &adversary(kind, faces), LITTLE);
        }
    }

    #[test]
    fn a_fan_of_a_million_faces_fits_where_its_faces_do() {
        same_as_in_core("fan", &adversary(Adversary::Fan, 1_000_000), [512, 768]);
    }

    #[test]
    fn what_depends_on_too_much_is_said_with_its_place() {
        for kind in [Adversary::Coincident, Adversary::Fan, Adversary::Needles] {
            let Some((output, written)) = limited(&adversary(kind, 1_000_000), LITTLE) else { return };
            let error = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(4), "{kind}: {error}");
            assert!(
                error.contains("faces or more around (") && error.contains("allow more"),
                "{kind}: {error}"
            );
            assert!(written.is_none(), "{kind}: something was written");
        }
    }
}
