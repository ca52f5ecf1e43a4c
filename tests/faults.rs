//! A disk that fails, once at each place where a run asks it for something: the run ends with an error that names the file
//! and says what to do, leaves no half of a result, and the next run gives the bytes of one that nothing happened to.
//!
//! `tests/support/fault_shim.rs` stands between the program and the disk. A run without faults counts the places. To cover
//! more of the program, add its words to a test; which calls may fail without harm is in [`harmless`].
#![cfg(target_os = "linux")]

mod support;

use crease::input::{IoMode, PlySource};
use crease::output::{AttributeFile, stage_ply};
use crease::stitch::{LineMemory, LineSource};
use crease::{Error, Job, Limits, Order, Params, Silent, Tiling};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use support::command::{Ended, PATIENCE, Place, ended};
use support::{Mesh, fixture};

/// Errors of a disk, as the system numbers them, and what a message about each must say.
const ERRORS: [(i32, &str); 4] =
    [(28, "No space left"), (5, "Input/output error"), (30, "Read-only file system"), (122, "quota")];

/// The compiled shim, and the directory that it goes with.
fn shim() -> &'static Path {
    static SHIM: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    let (_, path) = SHIM.get_or_init(|| {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let path = directory.path().join("shim.so");
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/support/fault_shim.rs");
        let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
        let built = Command::new(rustc)
            .args(["--crate-type", "cdylib", "--edition", "2024", "-O", "-o"])
            .args([&path, &source])
            .output()
            .expect("the compiler runs");
        assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
        (directory, path)
    });
    path
}

/// A call that the run made: its name and the path.
type Site = (String, String);

/// Which program a scene is played in.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Program {
    /// The real one.
    Binary,
    /// [`in_little_memory`], which reaches what the binary does on meshes that are too large for a test.
    Library,
}

/// What is run: `words` after `detect INPUT`, in a directory of its own, with the input in another.
struct Scene {
    input: Place,
    work: Place,
    words: String,
    /// Whether it is the input that fails, and not what is written.
    reading: bool,
    program: Program,
    /// The outputs of a run without faults.
    expected: Vec<(String, Vec<u8>)>,
}

impl Scene {
    /// `{}` in the words stands for the directory that is worked in.
    fn in_work(mesh: &str, words: &str, reading: bool) -> Scene {
        let (input, work) = (Place::new(), Place::new());
        let words = words.replace("{}", work.path("").to_str().expect("a path").trim_end_matches('/'));
        std::fs::copy(fixture(&format!("meshes/{mesh}.ply")), input.path("mesh.ply")).expect("copy");
        Scene { input, work, words, reading, program: Program::Binary, expected: Vec::new() }.begun()
    }

    /// A mesh in no order, and hardly any memory for anything.
    fn in_little_memory() -> Scene {
        let (input, work) = (Place::new(), Place::new());
        input.write("mesh.ply", &Mesh::scattered().ply());
        let (words, program) = (String::new(), Program::Library);
        Scene { input, work, words, reading: false, program, expected: Vec::new() }.begun()
    }

    /// The scene with what a run without faults writes.
    fn begun(mut self) -> Scene {
        let scene = &mut self;
        let good = scene.command().ended();
        assert_eq!(good.code, Some(0), "{good:?}");
        scene.expected = scene.outputs();
        assert!(!scene.expected.is_empty());
        self
    }

    fn outputs(&self) -> Vec<(String, Vec<u8>)> {
        self.work.names().into_iter().map(|name| (name.clone(), self.work.read(&name))).collect()
    }

    fn clear(&self) {
        for name in self.work.names() {
            let path = self.work.path(&name);
            let _ = if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
        }
    }

    fn command(&self) -> Run {
        if self.program == Program::Library {
            let mut command = assert_cmd::Command::new(std::env::current_exe().expect("this test"));
            command.args(["--exact", "in_little_memory", "--nocapture"]).timeout(PATIENCE);
            command.env(CHILD, self.work.path("")).env(CHILD_INPUT, self.input.path("mesh.ply"));
            return Run(command);
        }
        let mut command = self.work.command();
        command.args(["detect", "--progress", "none", "--threads", "1"]);
        command.arg(self.input.path("mesh.ply")).args(self.words.split_whitespace());
        Run(command)
    }

    /// Runs with the `at`-th call failing; none if that is 0. Returns how it ended and the calls that were made.
    fn with_fault(&self, at: usize, error: i32) -> (Ended, Vec<Site>) {
        let log = Place::new();
        let below = if self.reading { self.input.path("") } else { self.work.path("") };
        // The name of a directory, and of what is in it: both begin with it once the slash is gone.
        let below = below.to_str().expect("a path").trim_end_matches('/').to_owned();
        let mut run = self.command();
        run.0
            .env("LD_PRELOAD", shim())
            .env("FAULT_BELOW", below)
            .env("FAULT_LOG", log.path("log"))
            .env("FAULT_AT", at.to_string())
            .env("FAULT_ERRNO", error.to_string());
        let ended = run.ended();
        let sites = String::from_utf8(log.read("log")).expect("text");
        let site = |line: &str| {
            let mut words = line.splitn(3, ' ').skip(1).map(str::to_owned);
            (words.next().unwrap_or_default(), words.next().unwrap_or_default())
        };
        (ended, sites.lines().map(site).collect())
    }

    /// One run for each call, which fails in it.
    fn each_call_fails_once(&self) {
        self.clear();
        let (good, sites) = self.with_fault(0, 0);
        assert_eq!(good.code, Some(0), "{good:?}");
        assert!(self.outputs() == self.expected, "the shim alone changes the result");
        assert!(sites.len() >= 2, "{sites:?}");
        println!("{} calls, of which {} fail", sites.len(), self.chosen(&sites).len());
        for at in self.chosen(&sites) {
            let (error, said) = ERRORS[at % ERRORS.len()];
            self.clear();
            let (ended, sites) = self.with_fault(at, error);
            // Threads make the order of calls vary a little; what failed is what the log says.
            let Some(site) = sites.get(at - 1) else { continue };
            let what = format!("call {at}, {site:?}, fails with {error}: {ended:?}, {:?}", self.work.names());
            assert!(!ended.err.contains("panicked") && !ended.err.contains("bug"), "{what}");
            if ended.code == Some(0) {
                assert!(harmless(site), "{what}");
                self.has_exactly_what_was_expected(&what);
                continue;
            }
            assert_eq!(ended.code, Some(if self.reading { 3 } else { 4 }), "{what}");
            let line = ended.error();
            assert!(line.contains(said), "{what}");
            assert!(self.names_the_file(line), "{what}");
            if matches!(error, 28 | 122) && !self.reading && self.program == Program::Binary {
                assert!(line.contains("make room"), "{what}");
            }
            // What is done is kept for the next run, and nothing else is.
            let kept = |name: &String| name.ends_with(".crease-work");
            assert!(self.work.names().iter().all(kept), "{what}");
            let again = self.command().ended();
            assert_eq!(again.code, Some(0), "{what}, and then {again:?}");
            self.has_exactly_what_was_expected(&what);
        }
    }

    /// The calls that fail, one at a time: all of them, or of many the first, the middle and the last of each kind, by name
    /// and file.
    fn chosen(&self, sites: &[Site]) -> Vec<usize> {
        if self.program == Program::Binary {
            return (1..=sites.len()).collect();
        }
        let mut kinds: BTreeMap<(&str, String), Vec<usize>> = BTreeMap::new();
        for (at, (call, path)) in (1..).zip(sites) {
            let file: String = path.chars().filter(|c| !c.is_ascii_digit()).collect();
            kinds.entry((call, file)).or_default().push(at);
        }
        let three = |at: &Vec<usize>| [at[0], at[at.len() / 2], at[at.len() - 1]];
        kinds.values().flat_map(three).collect::<BTreeSet<_>>().into_iter().collect()
    }

    fn names_the_file(&self, line: &str) -> bool {
        let place = if self.reading { &self.input } else { &self.work };
        line.contains(place.path("").to_str().expect("a path").trim_end_matches('/'))
    }

    /// All outputs, whole; what could not be removed may be there too.
    #[track_caller]
    fn has_exactly_what_was_expected(&self, what: &str) {
        for (name, bytes) in &self.expected {
            assert!(self.work.read(name) == *bytes, "{name} has other bytes: {what}");
        }
        let stuck = |name: &String| name.starts_with("crease-scratch-") || name.ends_with(".crease-work");
        let known = |name: &String| self.expected.iter().any(|(expected, _)| expected == name);
        assert!(self.work.names().iter().all(|name| known(name) || stuck(name)), "{what}");
    }
}

struct Run(assert_cmd::Command);

impl Run {
    fn ended(mut self) -> Ended {
        let mut ended = ended(&mut self.0);
        // A test that does what it should succeeds, also where the run inside of it fails.
        if ended.code == Some(0) && ended.err.contains("crease: error: ") {
            ended.code = Some(4);
        }
        ended
    }
}

/// Whether a run can do without: temporary files that cannot be removed stay, and what cannot be mapped is read.
fn harmless((call, path): &Site) -> bool {
    match call.as_str() {
        "unlink" | "unlinkat" => true,
        // Whether an earlier run was giving its outputs their names, nobody needs to know for a result.
        "open" => path.ends_with("/crease-outputs"),
        "openat" => path.contains("crease-scratch-"),
        "mmap" => true,
        _ => false,
    }
}

/// Where [`in_little_memory`] works, and on what; without them, there is nothing to do.
const CHILD: &str = "CREASE_TEST_IN_LITTLE_MEMORY";
const CHILD_INPUT: &str = "CREASE_TEST_INPUT";

#[test]
fn in_little_memory() {
    let variable = |name| std::env::var_os(name).map(PathBuf::from);
    let (Some(work), Some(input)) = (variable(CHILD), variable(CHILD_INPUT)) else { return };
    let run = || -> Result<(), Error> {
        let source = PlySource::open(&input, IoMode::Read)?;
        let limits =
            Limits { tiling: Tiling::Faces(900), threads: 1, order: Order::Rewrite, ..Limits::default() };
        let params = Params { boundaries: true, ..Params::default() };
        let mut fields = AttributeFile::create(&work.join("fields.ply"), &source)?.with_memory(1);
        let found = Job::new(&source, params, limits, &Silent)?
            .with_scratch(&work, false)
            .with_order_memory(1)
            .with_line_memory(LineMemory { lines: 1 << 12, ..LineMemory::UNBOUNDED })
            .run_stored(Some(&mut fields))?;
        assert!(found.work.rewritten && found.lines.spilled(), "this tests nothing");
        let largest = found.lines.largest_salience();
        let lines = stage_ply(&work.join("lines.ply"), &found.lines)?;
        fields.finish(largest)?;
        Ok(lines.commit().inspect_err(|_| drop(std::fs::remove_file(work.join("fields.ply"))))?)
    };
    if let Err(error) = run() {
        eprintln!("crease: error: {error}");
    }
}

#[test]
fn everything_that_goes_to_temporary_files() {
    Scene::in_little_memory().each_call_fails_once();
}

#[test]
fn outputs() {
    let words = "--tile-faces 100 --boundaries -o {}/lines.ply --attributes {}/fields.ply";
    Scene::in_work("defects", words, false).each_call_fails_once();
}

#[test]
fn outputs_for_other_programs() {
    let words = "--tile-faces 100 --boundaries -o {}/a.gpkg -o {}/a.vtp -o {}/a.csv --annotate {}/mesh.ply";
    Scene::in_work("defects", words, false).each_call_fails_once();
}

#[test]
fn temporary_files_of_a_mesh_that_is_rewritten() {
    let words = "--tile-faces 100 --order rewrite -o {}/lines.ply --attributes {}/fields.ply";
    Scene::in_work("defects", words, false).each_call_fails_once();
}

#[test]
fn inputs() {
    Scene::in_work("defects", "--tile-faces 100 -o {}/lines.ply", true).each_call_fails_once();
    Scene::in_work("polygons", "--io read -o {}/lines.ply", true).each_call_fails_once();
}
