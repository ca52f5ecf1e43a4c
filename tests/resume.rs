//! A run that was killed goes on: the real program is killed at every point between two steps that change the disk, and at
//! times that nobody chose, and ends with the bytes of a run that nobody disturbed. `docs/RELIABILITY.md` has the promises.
//!
//! `CREASE_KILL_AT=NAME:N` has the program killed, by itself but without any chance to clean up, when it comes to a point for
//! the N-th time.

mod support;

use std::fs;
use std::io::{BufRead, BufReader};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};
use support::Mesh;
use tempfile::TempDir;

/// A job in a directory of its own, and what an undisturbed run makes of it.
struct Case {
    directory: TempDir,
    words: String,
    lines: Vec<u8>,
    table: Option<Vec<u8>>,
    /// Cells of the plan.
    tiles: u64,
    wall: Duration,
}

impl Case {
    /// Of `mesh.ply`, which `write` makes.
    fn new(write: impl FnOnce(&Path), words: &str) -> Case {
        let directory = tempfile::tempdir().expect("a temporary directory");
        write(&directory.path().join("mesh.ply"));
        let words = format!("detect mesh.ply -o lines.ply --threads 2 --progress plain {words}");
        let mut case =
            Case { directory, words, lines: Vec::new(), table: None, tiles: 0, wall: Duration::ZERO };
        let started = Instant::now();
        let output = case.command().output().expect("the program starts");
        case.wall = started.elapsed();
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        case.tiles = worked_on(&output);
        assert!(case.tiles >= 4, "{} tiles are not enough to be killed in", case.tiles);
        case.lines = case.read("lines.ply").expect("lines");
        case.table = case.read("table.ply");
        assert_eq!(case.table.is_some(), case.words.contains("table.ply"));
        case.clear();
        case
    }

    fn of_fixture(name: &str, words: &str) -> Case {
        let fixture = support::fixture(&format!("meshes/{name}.ply"));
        Case::new(|path| _ = fs::copy(fixture, path).expect("copy"), words)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    fn read(&self, name: &str) -> Option<Vec<u8>> {
        fs::read(self.path(name)).ok()
    }

    /// Removes everything but the mesh.
    fn clear(&self) {
        for entry in fs::read_dir(self.directory.path()).expect("list") {
            let path = entry.expect("entry").path();
            match path.is_dir() {
                true => fs::remove_dir_all(path).expect("remove"),
                false if path.ends_with("mesh.ply") => {}
                false => fs::remove_file(path).expect("remove"),
            }
        }
    }

    fn command(&self) -> Command {
        self.command_with("")
    }

    fn command_with(&self, more: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_crease"));
        command.args(self.words.split_whitespace()).args(more.split_whitespace());
        command.current_dir(self.directory.path()).env_remove("RUST_LOG").stdin(Stdio::null());
        command
    }

    /// Runs until the program kills itself at `point`, "NAME:N".
    #[track_caller]
    fn killed_at(&self, point: &str) {
        let output = self.command().env("CREASE_KILL_AT", point).output().expect("the program starts");
        assert_eq!(output.status.signal(), Some(9), "{point} was not reached: {}", said(&output));
        self.nothing_half();
    }

    /// Whatever has the name of an output is the whole output.
    #[track_caller]
    fn nothing_half(&self) {
        assert!(self.read("lines.ply").is_none_or(|bytes| bytes == self.lines), "half an output");
        assert!(self.read("table.ply").is_none_or(|bytes| Some(bytes) == self.table), "half an output");
    }

    /// Runs to the end, which must give the right bytes and leave nothing behind. Returns how many tiles were done before.
    #[track_caller]
    fn goes_on(&self, after: &str) -> u64 {
        let output = self.command().output().expect("the program starts");
        assert_eq!(output.status.code(), Some(0), "after {after}: {}", said(&output));
        self.is_done(after);
        let done = resumed(&output);
        assert_eq!(done + worked_on(&output), self.tiles, "after {after}: {}", said(&output));
        self.clear();
        done
    }

    #[track_caller]
    fn is_done(&self, after: &str) {
        assert!(self.read("lines.ply").as_ref() == Some(&self.lines), "after {after}: other lines");
        assert!(self.read("table.ply") == self.table, "after {after}: another table");
        let mut names: Vec<String> = fs::read_dir(self.directory.path())
            .expect("list")
            .map(|e| e.expect("entry").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        let table = self.table.as_ref().map(|_| "table.ply");
        let expected: Vec<&str> = ["lines.ply", "mesh.ply"].into_iter().chain(table).collect();
        assert_eq!(names, expected, "after {after}");
    }

    /// Starts a run and waits until it says `text`.
    fn started(&self, more: &str, text: &str) -> Child {
        let mut command = self.command_with(more);
        let mut child =
            command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program starts");
        let mut lines = BufReader::new(child.stderr.take().expect("a pipe")).lines();
        assert!(lines.any(|line| line.expect("text").contains(text)), "it never said {text}");
        // Somebody has to read on, or the program would wait.
        child.stderr = None;
        std::thread::spawn(move || lines.for_each(drop));
        child
    }
}

fn said(output: &Output) -> String {
    [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned()).concat()
}

/// The number in front of a line of the summary.
fn entry(output: &Output, name: &str) -> Option<u64> {
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let line =
        text.lines().find_map(|line| line.strip_prefix("  ")?.strip_prefix(name)?.strip_prefix("  "))?;
    line.split_whitespace().next()?.replace(',', "").parse().ok()
}

fn worked_on(output: &Output) -> u64 {
    entry(output, "tiles").unwrap_or_else(|| panic!("no tiles in {}", said(output)))
}

fn resumed(output: &Output) -> u64 {
    let done = entry(output, "resumed").unwrap_or(0);
    let text = format!("crease: resumed: {done} of");
    assert!(done == 0 || String::from_utf8_lossy(&output.stderr).contains(&text), "{}", said(output));
    done
}

fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill").args([name, &child.id().to_string()]).status().expect("kill");
    assert!(sent.success());
}

/// Numbers in no order, the same in every run.
struct Lottery(u64);

impl Lottery {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((u128::from(self.0) * n as u128) >> 64) as usize
    }
}

fn write(path: &Path, mesh: &Mesh) {
    let (n, m) = (mesh.positions.len(), mesh.faces.len());
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {n}\nproperty double x\nproperty double y\n\
         property double z\nelement face {m}\nproperty list uchar uint vertex_indices\nend_header\n"
    )
    .into_bytes();
    mesh.positions.iter().flat_map(|p| p.to_array()).for_each(|x| bytes.extend(x.to_le_bytes()));
    for face in &mesh.faces {
        bytes.push(3);
        face.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    }
    fs::write(path, bytes).expect("write");
}

/// The faces of a fixture in no order.
fn shuffled(path: &Path) {
    let mut mesh = Mesh::of_fixture("folds20");
    let mut lottery = Lottery(5);
    (1..mesh.faces.len()).rev().for_each(|i| mesh.faces.swap(i, lottery.below(i + 1)));
    write(path, &mesh);
}

/// A pleated sheet of 2 n^2 faces.
fn pleats(path: &Path, n: u32) {
    let mut mesh = Mesh { positions: Vec::new(), faces: Vec::new() };
    for (y, x) in (0..=n).flat_map(|y| (0..=n).map(move |x| (y, x))) {
        let height = f64::from((x % 40).abs_diff(20));
        mesh.positions.push([f64::from(x), f64::from(y), height].into());
    }
    for (y, x) in (0..n).flat_map(|y| (0..n).map(move |x| (y, x))) {
        let a = y * (n + 1) + x;
        mesh.faces.extend([[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]);
    }
    write(path, &mesh);
}

const TILED: &str = "--tile-faces 700 --attributes table.ply --boundaries";

/// How many tiles must be done if the program died at the point, in a pass whose results are numbered from 1.
fn done_at(point: &str) -> Option<u64> {
    let (name, n) = point.split_once(':').expect("a number");
    let n: u64 = n.parse().expect("a number");
    match name {
        "workspace-made" | "workspace-begun" | "joined" | "scanned" | "sorted" | "sorted-kept"
        | "job-begun" => Some(0),
        // It is there when it was written, synced or not; half of it is not there.
        "record-written" => Some(n),
        "record-begun" | "tile-computed" => Some(n - 1),
        _ => None,
    }
}

#[test]
fn a_run_that_is_killed_anywhere_goes_on() {
    let case = Case::of_fixture("folds20", TILED);
    let last = case.tiles;
    let early = ["workspace-made:1", "workspace-begun:1", "joined:1", "scanned:1"];
    let job = ["file-begun:1", "file-written:1", "file-renamed:1", "job-begun:1"];
    for point in early.into_iter().chain(job) {
        case.killed_at(point);
        assert_eq!(case.goes_on(point), 0, "{point}");
    }
    for name in ["tile-computed", "record-begun", "record-written"] {
        for n in [1, 2, 3, last] {
            let point = format!("{name}:{n}");
            case.killed_at(&point);
            assert_eq!(Some(case.goes_on(&point)), done_at(&point), "{point}");
        }
    }
    // All tiles are done; nothing is done twice.
    let late = ["stitching:1", "file-begun:2", "file-written:2", "file-renamed:2", "outputs-announced:1"];
    for point in late.into_iter().chain(["output-renamed:1", "output-renamed:2"]) {
        case.killed_at(point);
        assert_eq!(case.goes_on(point), last, "{point}");
    }
    // The outputs are there, and the workspace only half removed.
    for n in 1..=6 {
        case.killed_at(&format!("workspace-half-removed:{n}"));
        let output = case.command().output().expect("the program starts");
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        let mut clean = Command::new(env!("CARGO_BIN_EXE_crease"));
        clean.args(["clean", "lines.crease-work"]).current_dir(case.directory.path());
        assert!(clean.output().expect("the program starts").status.success());
        case.is_done("removal");
        case.clear();
    }
}

#[test]
fn a_mesh_that_was_rewritten_is_not_sorted_again() {
    let case = Case::new(shuffled, &format!("--order rewrite {TILED}"));
    for point in
        ["sorted:1", "sorted-kept:1", "file-written:1", "record-written:2", "record-begun:3", "stitching:1"]
    {
        case.killed_at(point);
        let kept = case.path("lines.crease-work/crease-sorted").exists();
        assert_eq!(kept, point != "sorted:1", "{point}");
        let output = case.command().output().expect("the program starts");
        assert_eq!(output.status.code(), Some(0), "after {point}: {}", said(&output));
        case.is_done(point);
        let sorted = String::from_utf8_lossy(&output.stderr).contains("order started");
        assert_eq!(sorted, matches!(done_at(point), Some(0)) || point == "file-written:1", "{point}");
        case.clear();
    }
    // What is damaged is found before it is used, and made again; tiles that are done stay done.
    case.killed_at("record-written:3");
    let path = case.path("lines.crease-work/crease-sorted");
    let mut bytes = fs::read(&path).expect("read");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&path, bytes).expect("write");
    let output =
        case.command().env("CREASE_KILL_AT", "record-written:1").output().expect("the program starts");
    assert!(said(&output).contains("is put in order again"), "{}", said(&output));
    assert_eq!(case.goes_on("damage"), 4);
}

#[test]
fn every_pass_of_the_paper_method_goes_on() {
    let case = Case::of_fixture("folds20", "--method paper --sigma 0 --tile-faces 700");
    let n = case.tiles;
    // Results of all passes are in one log.
    for results in [1, n, n + 2, 2 * n, 2 * n + 3, 3 * n] {
        let point = format!("record-written:{results}");
        case.killed_at(&point);
        let output = case.command().output().expect("the program starts");
        case.is_done(&point);
        let first = format!("crease: resumed: {} of {} tiles were done", results.min(2 * n), 2 * n);
        assert!(String::from_utf8_lossy(&output.stderr).contains(&first), "{}", said(&output));
        assert_eq!(resumed(&output), results.saturating_sub(2 * n));
        case.clear();
    }
}

#[test]
fn one_that_is_killed_again_and_again_comes_to_its_end() {
    let case = Case::of_fixture("folds20", TILED);
    for point in
        ["file-written:1", "record-written:2", "record-begun:2", "tile-computed:1", "record-written:1"]
    {
        case.killed_at(point);
    }
    assert_eq!(case.goes_on("five kills"), 2 + 1 + 1);
}

#[test]
fn any_time_is_a_time_to_be_killed() {
    let case = Case::of_fixture("folds20", TILED);
    let (mut lottery, mut kills) = (Lottery(7), 0);
    let most = case.wall.as_millis() as usize + 4;
    while kills < 24 {
        // Up to three in a row.
        for _ in 0..=lottery.below(3) {
            let mut child =
                case.command().stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("started");
            std::thread::sleep(Duration::from_millis(lottery.below(most) as u64));
            child.kill().expect("killed");
            child.wait().expect("ended");
            case.nothing_half();
            kills += 1;
            if case.read("lines.ply").is_some() {
                break;
            }
        }
        // The last output has its name: this one came too late.
        if case.read("lines.ply").is_none() {
            case.goes_on("a kill at any time");
        }
        case.clear();
    }
}

#[test]
fn memory_and_threads_may_change() {
    let case = Case::of_fixture("bracket", "--tile-faces 1600 --attributes table.ply");
    for more in ["--threads 1", "--io read --tile-faces 100000", "--memory 1GiB", "--in-core"] {
        case.killed_at("record-written:1");
        let words = case.words.replace("--threads 2", "").replace("--tile-faces 1600", "");
        let mut command = Command::new(env!("CARGO_BIN_EXE_crease"));
        command
            .args(words.split_whitespace())
            .args(more.split_whitespace())
            .current_dir(case.directory.path());
        let output = command.output().expect("the program starts");
        assert_eq!(output.status.code(), Some(0), "{more}: {}", said(&output));
        assert_eq!((resumed(&output), worked_on(&output)), (1, case.tiles - 1), "{more}");
        case.is_done(more);
        case.clear();
    }
}

/// Cells that have to be cut while they are loaded, because there is less memory than when they were planned.
#[test]
fn pieces_of_a_cell_are_done_when_all_of_them_are() {
    let case = Case::new(|path| pleats(path, 200), "--tile-faces 25000");
    case.killed_at("record-written:1");
    let little = "--memory 26MiB";
    let output =
        case.command_with(little).env("CREASE_KILL_AT", "record-written:2").output().expect("started");
    assert_eq!(output.status.signal(), Some(9), "{}", said(&output));
    let output = case.command_with(little).output().expect("the program starts");
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let (done, pieces) = (resumed(&output), worked_on(&output));
    assert!((1..=2).contains(&done) && pieces > case.tiles - done, "{done} done, {pieces} pieces");
    case.is_done("cuts");
}

#[test]
fn a_workspace_can_be_kept_and_given_up() {
    let case = Case::of_fixture("folds20", TILED);
    for (more, done) in [("--keep-workspace", 0), ("--keep-workspace --force", case.tiles)] {
        let output = case.command_with(more).output().expect("the program starts");
        assert_eq!((output.status.code(), resumed(&output)), (Some(0), done), "{}", said(&output));
        assert!(case.path("lines.crease-work").is_dir());
    }
    // Nobody asked for them to be replaced.
    assert_eq!(case.command().output().expect("the program starts").status.code(), Some(2));
    let clean = |directory: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_crease"));
        let output = command.args(["clean", directory]).current_dir(case.directory.path()).output();
        output.expect("the program starts")
    };
    let refused = clean(".");
    assert_eq!(refused.status.code(), Some(2));
    assert!(said(&refused).contains("not a workspace of crease"), "{}", said(&refused));
    assert_eq!(clean("lines.crease-work").status.code(), Some(0));
    case.is_done("clean");
}

#[test]
fn another_job_is_refused_by_name() {
    let case = Case::of_fixture("folds20", "--tile-faces 700");
    case.killed_at("record-written:2");
    let mesh = case.read("mesh.ply").expect("a mesh");
    let refused = |more: &str, name: &str| {
        let output = case.command_with(more).output().expect("the program starts");
        assert_eq!(output.status.code(), Some(5), "{more}: {}", said(&output));
        let text = said(&output);
        let error = text.lines().last().expect("an error");
        assert!(error.contains(name) && error.contains("crease clean"), "{more}: {error}");
    };
    refused("--min-angle 10", "--min-angle was 0 degrees and is 10 degrees");
    refused("--sigma-edges 4", "--sigma was 3 median edges and is 4 median edges");
    refused("--boundaries", "--boundaries was not given and is given");
    refused("--method paper", "--method was robust and is paper");
    refused("--attributes table.ply", "--attributes was not written");
    let mut changed = mesh.clone();
    let last = changed.len() - 1;
    changed.truncate(last);
    // A coordinate, in its lower bits.
    let at = changed.len() / 6;
    changed[at] ^= 4;
    changed.push(mesh[last]);
    fs::write(case.path("mesh.ply"), changed).expect("write");
    refused("", "the fingerprint of the mesh in the input");
    fs::write(case.path("mesh.ply"), mesh).expect("write");
    assert_eq!(case.goes_on("refusals"), 2);
}

#[test]
fn a_damaged_result_is_computed_again() {
    let case = Case::of_fixture("folds20", TILED);
    case.killed_at("record-written:3");
    let path = case.path("lines.crease-work/crease-tiles");
    let mut bytes = fs::read(&path).expect("read");
    bytes[1000] ^= 1;
    fs::write(&path, bytes).expect("write");
    let output = case.command().output().expect("the program starts");
    assert!(said(&output).contains("1 damaged: their tiles are done again"), "{}", said(&output));
    assert_eq!((resumed(&output), worked_on(&output)), (2, case.tiles - 2));
    case.is_done("damage");
}

#[test]
fn flipped_bytes_do_not_change_the_result() {
    let case = Case::new(shuffled, &format!("--order rewrite {TILED}"));
    case.killed_at("record-written:3");
    let directory = case.path("lines.crease-work");
    let files: Vec<(PathBuf, Vec<u8>)> = ["crease-workspace", "crease-job", "crease-sorted", "crease-tiles"]
        .map(|name| (directory.join(name), fs::read(directory.join(name)).expect("read")))
        .into();
    let mut lottery = Lottery(3);
    let mut refused = 0;
    for i in 0..24 {
        fs::create_dir_all(&directory).expect("create");
        files.iter().for_each(|(path, bytes)| fs::write(path, bytes).expect("write"));
        let (path, bytes) = &files[i % files.len()];
        let mut damaged = bytes.clone();
        damaged[lottery.below(bytes.len())] ^= 1 << lottery.below(8);
        fs::write(path, damaged).expect("write");
        let output = case.command().output().expect("the program starts");
        match output.status.code() {
            Some(0) => case.is_done("a flip"),
            code => {
                assert_eq!(code, Some(5), "{}", said(&output));
                assert!(case.read("lines.ply").is_none() && said(&output).contains("crease clean"));
                refused += 1;
            }
        }
        case.clear();
    }
    // The marker says of which version all else is; without it nothing can be believed.
    assert_eq!(refused, 6);
}

#[test]
fn two_runs_do_not_share() {
    let case = Case::new(|path| pleats(path, 200), "--tile-faces 4000");
    let mut first = case.started("", "tiles started");
    for more in ["", "-o other.ply --workspace lines.crease-work"] {
        let words =
            if more.is_empty() { case.words.clone() } else { case.words.replace("-o lines.ply", more) };
        let mut command = Command::new(env!("CARGO_BIN_EXE_crease"));
        let output = command.args(words.split_whitespace()).current_dir(case.directory.path()).output();
        let output = output.expect("the program starts");
        assert_eq!(output.status.code(), Some(5), "{}", said(&output));
        assert!(said(&output).contains("another run"), "{}", said(&output));
    }
    first.kill().expect("killed");
    first.wait().expect("ended");
    let mut again = case.command().spawn().expect("started");
    assert!(again.wait().expect("ended").success());
    case.is_done("a fight");
}

/// Seconds that a signal may take; two are promised, and the machine may be busy.
const SOON: Duration = Duration::from_secs(4);

#[test]
fn signals_end_a_run_that_can_go_on() {
    let case = Case::new(|path| pleats(path, 200), "--tile-faces 4000 --attributes table.ply");
    for (name, stage) in [("-INT", "scan started"), ("-TERM", "tiles started"), ("-INT", "tiles started")] {
        case.clear();
        let mut command = case.command();
        let mut child = command.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().expect("started");
        let mut lines = BufReader::new(child.stderr.take().expect("a pipe")).lines();
        assert!(lines.any(|line| line.expect("text").contains(stage)));
        std::thread::sleep(if stage == "scan started" { Duration::ZERO } else { case.wall / 4 });
        let sent = Instant::now();
        signal(&child, name);
        let text: String = lines.map(|line| line.expect("text") + "\n").collect();
        assert_eq!(child.wait().expect("ended").code(), Some(130), "{text}");
        assert!(sent.elapsed() < SOON, "{:?}", sent.elapsed());
        assert!(
            text.contains("crease: interrupted; ") && text.contains(" detect mesh.ply -o lines.ply"),
            "{text}"
        );
        assert!(!case.path("table.ply.part").exists() && case.read("lines.ply").is_none());
    }
    case.goes_on("signals");
}

#[test]
fn a_single_tile_ends_soon_too() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    pleats(&directory.path().join("mesh.ply"), 500);
    for signals in [1, 2] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_crease"));
        command.args(["detect", "mesh.ply", "--in-core", "--progress", "plain", "--attributes", "table.ply"]);
        command.current_dir(directory.path()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("started");
        let mut lines = BufReader::new(child.stderr.take().expect("a pipe")).lines();
        assert!(lines.any(|line| line.expect("text").contains("tiles started")));
        let sent = Instant::now();
        for _ in 0..signals {
            signal(&child, "-INT");
            // Two signals at once are one.
            std::thread::sleep(Duration::from_millis(50));
        }
        let text: String = lines.map(|line| line.expect("text") + "\n").collect();
        assert_eq!(child.wait().expect("ended").code(), Some(130), "{text}");
        assert!(sent.elapsed() < SOON, "{:?}", sent.elapsed());
        assert!(signals == 2 || text.contains("nothing was kept"), "{text}");
        assert!(!directory.path().join("mesh.creases.crease-work").exists());
    }
}
