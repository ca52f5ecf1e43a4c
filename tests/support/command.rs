//! The real binary, run in a directory of its own, and meshes written for it.

use super::Mesh;
use assert_cmd::Command;
use crease::glam::DVec3;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::TempDir;

/// Longer than any of these runs takes on a slow machine; what hangs is a failed test, not a stuck one.
pub const PATIENCE: Duration = Duration::from_secs(300);

/// How a run ended.
#[derive(Debug)]
pub struct Ended {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

impl Ended {
    /// The one error line that a run that fails must end on.
    #[track_caller]
    pub fn error(&self) -> &str {
        let errors: Vec<&str> = self.err.lines().filter(|line| line.starts_with("crease: error: ")).collect();
        assert_eq!(errors.len(), 1, "{self:?}");
        assert_eq!(self.err.lines().last(), Some(errors[0]), "{self:?}");
        assert!(!self.err.contains("panicked") && !self.err.contains("bug"), "{self:?}");
        errors[0]
    }

    /// Sees to it that the run failed with `code`, and that its error has all `parts`.
    #[track_caller]
    pub fn refused(&self, code: i32, parts: &[&str]) {
        assert_eq!(self.code, Some(code), "{self:?}");
        let error = self.error();
        parts.iter().for_each(|part| assert!(error.contains(part), "{part:?} is not in {error}"));
    }
}

/// A directory to run the command in.
pub struct Place {
    directory: TempDir,
}

impl Place {
    pub fn new() -> Place {
        Place { directory: tempfile::tempdir().expect("a temporary directory") }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    pub fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        fs::write(self.path(name), bytes).expect("write");
        self.path(name)
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// Names of the files here, sorted.
    pub fn names(&self) -> Vec<String> {
        names(self.directory.path())
    }

    pub fn command(&self) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_crease"));
        command.current_dir(self.directory.path()).env_remove("RUST_LOG").timeout(PATIENCE);
        command
    }

    /// Runs the words of `line`.
    pub fn run(&self, line: &str) -> Ended {
        ended(self.command().args(line.split_whitespace()))
    }

    /// Runs the words of `line`, which must succeed, and returns what is said on standard output.
    #[track_caller]
    pub fn does(&self, line: &str) -> String {
        let ended = self.run(line);
        assert_eq!(ended.code, Some(0), "{line}: {ended:?}");
        ended.out
    }
}

/// Names of the files in a directory, sorted.
pub fn names(directory: &Path) -> Vec<String> {
    let entries = fs::read_dir(directory).expect("list");
    let mut names: Vec<String> =
        entries.map(|e| e.expect("entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Runs a command to its end.
pub fn ended(command: &mut Command) -> Ended {
    let output = command.output().expect("the command runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Ended { code: output.status.code(), out: text(&output.stdout), err: text(&output.stderr) }
}

impl Mesh {
    /// A gable roof over a grid of `n` by `n` squares, ridge along y.
    pub fn roof(n: u32) -> Mesh {
        let (side, half) = (n + 1, f64::from(n) / 2.0);
        let place = |i: u32| {
            let (x, y) = (f64::from(i % side), f64::from(i / side));
            DVec3::new(x, y, half - (x - half).abs())
        };
        let squares = (0..n).flat_map(|y| (0..n).map(move |x| y * side + x));
        Mesh {
            positions: (0..side * side).map(place).collect(),
            faces: squares.flat_map(|a| [[a, a + 1, a + side], [a + 1, a + side + 1, a + side]]).collect(),
        }
    }

    /// The mesh as a binary PLY file with coordinates of type `double` and indices of type `int`.
    pub fn ply(&self) -> Vec<u8> {
        let header = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
             property double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
            self.positions.len(),
            self.faces.len()
        );
        let mut bytes = header.into_bytes();
        self.positions.iter().flat_map(DVec3::to_array).for_each(|x| bytes.extend(x.to_le_bytes()));
        for face in &self.faces {
            bytes.push(3);
            face.iter().for_each(|corner| bytes.extend(corner.to_le_bytes()));
        }
        bytes
    }
}
