//! The lines that the program finds on generated shapes must not become worse. Runs the program as `tools/quality` does and
//! scores with its metric; the tests of that metric, of the baselines and of what they are built from run here too.

#[path = "../tools/quality/mod.rs"]
#[allow(dead_code, reason = "the benchmark uses more of it")]
mod quality;

use quality::generator::ShapeName;
use quality::generator::ply::{Scalar, mesh_bytes};
use quality::lines_file;
use quality::mesh::Mesh;
use quality::metric::{Lines, Score, Truth, score};
use quality::program::{Answer, Program};
use std::path::Path;

/// Runs the program on a shape with a seed that nothing was tuned on.
fn run(name: &str, noise: f64) -> Score {
    const SEED: u64 = 11;
    let mut shape = name.parse::<ShapeName>().unwrap().build(SEED).unwrap();
    shape.add_noise(noise, SEED);
    let place = tempfile::tempdir().unwrap();
    let (input, output) = (place.path().join("mesh.ply"), place.path().join("lines.ply"));
    std::fs::write(&input, mesh_bytes(&shape, Scalar::Double).unwrap()).unwrap();
    let program = Program::find(Some(Path::new(env!("CARGO_BIN_EXE_crease"))), "").unwrap();
    assert_eq!(program.detect(&input, &output, &[]).unwrap(), Answer::Done);
    let found = lines_file::read(&output).unwrap();
    let truth = Truth::with_corners(Lines::of_polylines(&shape.lines), &shape.corners);
    let mesh = Mesh { positions: shape.vertices, faces: shape.faces };
    score(&found, &truth, mesh.median_side().unwrap())
}

/// F1 at 1h and the number of false components may not fall behind these. The floors are a little below what was
/// measured when they were written, so that another equally good choice of vertices does not fail.
#[test]
fn lines_are_as_good_as_they_were() {
    let floors = [
        ("bracket", 0.0, 0.96),
        ("bracket", 0.1, 0.98),
        ("city4", 0.0, 0.97),
        ("city4", 0.1, 0.98),
        ("folds20", 0.0, 0.96),
        ("folds20", 0.1, 0.97),
    ];
    for (name, noise, floor) in floors {
        let score = run(name, noise);
        assert!(score.at_1h.f1 >= floor, "{name} with noise {noise}: {score:#?}");
        assert!(score.at_2h.f1 >= score.at_1h.f1, "{name} with noise {noise}: {score:#?}");
        assert_eq!(score.false_components, 0, "{name} with noise {noise}: {score:#?}");
    }
}

#[test]
fn a_program_that_does_not_know_a_method_is_heard() {
    let place = tempfile::tempdir().unwrap();
    let input = place.path().join("mesh.ply");
    let shape = "folds20".parse::<ShapeName>().unwrap().build(1).unwrap();
    std::fs::write(&input, mesh_bytes(&shape, Scalar::Float).unwrap()).unwrap();
    let program = Program::find(Some(Path::new(env!("CARGO_BIN_EXE_crease"))), "").unwrap();
    let answer = program.detect(&input, &place.path().join("lines.ply"), &["--no-such-option"]).unwrap();
    let Answer::Refused(reason) = answer else { panic!("{answer:?}") };
    assert!(reason.contains("--no-such-option"), "{reason}");
    // A mesh that cannot be read is no matter of the method.
    let error = program.detect(&place.path().join("none.ply"), &place.path().join("lines.ply"), &[]);
    assert!(error.is_err());
}
