//! What is kept comes back as it was, or not at all.

use super::*;
use crate::config::{NO_LIMIT, Params};
use crate::input::MemorySource;
use crate::partition::{Cell, scan};
use glam::DVec3;
use std::fs;
use std::path::Path;

/// Numbers in no order, the same in every run.
struct Lottery(u64);

impl Lottery {
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((u128::from(self.0) * u128::from(n)) >> 64) as u64
    }
}

type Payload = Vec<(u64, f64)>;

/// The result of a piece of a cell: as many numbers as its label says, some of them none.
fn payload(label: &Label) -> Payload {
    let numbers = u64::from(label.cell * 7 % 50 + label.piece);
    let number = |i| if i % 9 == 0 { f64::NAN } else { 1.0 / (i + u64::from(label.cell)) as f64 };
    (0..numbers).map(|i| (i * i, number(i))).collect()
}

fn label(pass: u8, cell: u32, piece: u32, last: bool) -> Label {
    Label { pass, cell, session: 0, piece, last }
}

fn job() -> JobRecord {
    let positions = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let source = MemorySource::new(&positions, &[[0, 1, 2]]).expect("a triangle");
    let identity = Identity::of(&source, &Params::default(), true);
    let scan = scan(&source, NO_LIMIT, &|_| {}).expect("a scan");
    let cells = (0..40).map(Cell::everything).collect();
    JobRecord { identity, scan, cells, rounds: 3, mesh: MeshRecord::File }
}

/// A job of 40 cells in two passes, some of them in three pieces, as an earlier process has left it; and their labels.
fn begun(directory: &Path) -> Vec<Label> {
    let workspace = Workspace::at(directory);
    assert!(!workspace.enter().expect("nothing is there"));
    workspace.begin_job(&job()).expect("begun");
    assert!(workspace.results(&[]).expect("a log").is_empty());
    let mut labels = Vec::new();
    for (pass, cell) in [0, 2].into_iter().flat_map(|pass| (0..40).map(move |cell| (pass, cell))) {
        let pieces = if cell % 8 == 3 { 3 } else { 1 };
        labels.extend((0..pieces).map(|piece| label(pass, cell, piece, piece + 1 == pieces)));
    }
    for label in &labels {
        workspace.keep(*label, &payload(label)).expect("kept");
    }
    workspace.announce(&["/somewhere/lines.ply".into()]).expect("announced");
    workspace.sync().expect("synced");
    assert!(workspace.is_worth_keeping());
    labels
}

fn same(a: &Payload, b: &Payload) -> bool {
    let bits = |p: &Payload| p.iter().map(|(i, x)| (*i, x.to_bits())).collect::<Vec<_>>();
    bits(a) == bits(b)
}

/// The labels of all results that are there, each of which is what was kept.
fn found(workspace: &Workspace) -> Vec<Label> {
    let places = workspace.results(&[]).expect("a log");
    let labels: Vec<Label> = places.iter().map(|place| place.label).collect();
    for place in &places {
        let result: Payload = workspace.result(place).expect("whole");
        assert!(same(&result, &payload(&place.label)), "{:?} is not what was kept", place.label);
    }
    labels
}

/// Cells of which some but not all pieces are there.
fn torn(labels: &[Label], all: &[Label]) -> bool {
    let pieces = |of: &[Label], l: &Label| of.iter().filter(|x| (x.pass, x.cell) == (l.pass, l.cell)).count();
    labels.iter().any(|label| pieces(labels, label) != pieces(all, label))
}

#[test]
fn what_is_kept_comes_back() {
    let parent = tempfile::tempdir().expect("a temporary directory");
    let directory = parent.path().join("work");
    let labels = begun(&directory);
    let workspace = Workspace::at(&directory);
    assert!(workspace.has_announced("/somewhere/lines.ply".as_ref()));
    assert!(!workspace.has_announced("/somewhere/else.ply".as_ref()));
    assert!(workspace.enter().expect("ours"));
    assert_eq!(workspace.job().expect("readable"), Some(job()));
    assert_eq!(found(&workspace), labels);
    workspace.remove().expect("removed");
    assert!(!directory.exists());
}

#[test]
fn a_second_process_is_refused() {
    let parent = tempfile::tempdir().expect("a temporary directory");
    let (first, second) = (Workspace::at(parent.path()), Workspace::at(parent.path()));
    first.begin().expect("begun");
    assert!(matches!(second.enter(), Err(WorkspaceError::InUse { .. })));
    assert!(matches!(second.begin(), Err(WorkspaceError::InUse { .. })));
    assert!(matches!(clean(parent.path()), Err(WorkspaceError::InUse { .. })));
    first.remove().expect("removed");
    // The directory was there before.
    assert!(parent.path().is_dir() && !second.enter().expect("nothing is there"));
}

#[test]
fn only_our_own_files_go() {
    let parent = tempfile::tempdir().expect("a temporary directory");
    let at = |name: &str| parent.path().join(name);
    assert!(matches!(clean(parent.path()), Err(WorkspaceError::Foreign { .. })));
    begun(parent.path());
    for name in ["crease-other", "notes.txt", "crease-tiles.old"] {
        fs::write(at(name), "mine").expect("write");
    }
    fs::create_dir(at("crease-scratch-7-1")).expect("create");
    fs::write(at("crease-scratch-7-1").join("faces-0"), "bytes").expect("write");
    clean(parent.path()).expect("cleaned");
    let mut left: Vec<_> =
        fs::read_dir(parent.path()).expect("list").map(|e| e.expect("entry").file_name()).collect();
    left.sort();
    assert_eq!(left, ["crease-other", "crease-tiles.old", "notes.txt"]);
    assert!(matches!(clean(parent.path()), Err(WorkspaceError::Foreign { .. })));
}

#[test]
fn pieces_of_two_sessions_are_not_mixed() {
    let parent = tempfile::tempdir().expect("a temporary directory");
    let pieces = |pieces: &[(u32, u32, bool)]| {
        let workspace = Workspace::at(parent.path());
        workspace.begin().expect("begun");
        if workspace.job().expect("readable").is_none() {
            workspace.begin_job(&job()).expect("begun");
        }
        workspace.results(&[]).expect("a log");
        for &(cell, piece, last) in pieces {
            let label = label(2, cell, piece, last);
            workspace.keep(label, &payload(&label)).expect("kept");
        }
        let labels = found(&workspace);
        labels.iter().map(|l| (l.cell, l.session, l.piece)).collect::<Vec<_>>()
    };
    // Dies before the last piece of cell 1; the next run cuts it elsewhere.
    assert_eq!(pieces(&[(0, 0, true), (1, 0, false), (1, 1, false)]), [(0, 0, 0)]);
    assert_eq!(pieces(&[(1, 0, false)]), [(0, 0, 0)]);
    assert_eq!(pieces(&[(1, 0, false), (1, 1, true)]), [(0, 0, 0), (1, 2, 0), (1, 2, 1)]);
    // A log is of one job.
    let mut other = job();
    other.cells.pop();
    let workspace = Workspace::at(parent.path());
    workspace.begin_job(&other).expect("begun");
    assert!(workspace.results(&[]).expect("a log").is_empty());
}

#[test]
fn a_log_that_was_cut_off_anywhere_loses_its_end_only() {
    let parent = tempfile::tempdir().expect("a temporary directory");
    let directory = parent.path().join("work");
    let labels = begun(&directory);
    let path = directory.join("crease-tiles");
    let whole = fs::read(&path).expect("read");
    for length in (0..whole.len()).rev().step_by(97) {
        // Some bytes of the next frame may be zeros, if the power went.
        for zeros in [0, 40] {
            fs::write(&path, [&whole[..length], &vec![0; zeros]].concat()).expect("write");
            let workspace = Workspace::at(&directory);
            workspace.enter().expect("ours");
            workspace.job().expect("readable");
            let left = found(&workspace);
            assert!(labels.starts_with(&left) && !torn(&left, &labels), "{length}");
            // Going on where it was cut off.
            let more = label(1, 39, 0, true);
            workspace.keep(more, &payload(&more)).expect("kept");
            let after = found(&workspace);
            assert_eq!(after.len(), left.len() + 1);
        }
    }
}

/// The promise that nothing wrong is ever believed.
#[test]
fn no_flipped_byte_is_believed() {
    let parent = tempfile::tempdir().expect("a temporary directory");
    let directory = parent.path().join("work");
    let labels = begun(&directory);
    let files: Vec<_> = ["crease-workspace", "crease-job", "crease-tiles", "crease-outputs"]
        .map(|name| (directory.join(name), fs::read(directory.join(name)).expect("read")))
        .into();
    let mut lottery = Lottery(1);
    let (mut refused, mut restarted, mut redone) = (0, 0, 0);
    for _ in 0..1000 {
        for (path, bytes) in &files {
            fs::write(path, bytes).expect("write");
        }
        // The log has most of the bytes and half of the damage.
        let file = if lottery.below(2) == 0 { 2 } else { lottery.below(4) };
        let (path, bytes) = &files[file as usize];
        let mut damaged = bytes.clone();
        let at = lottery.below(bytes.len() as u64) as usize;
        damaged[at] ^= 1 + lottery.below(255) as u8;
        fs::write(path, damaged).expect("write");

        let workspace = Workspace::at(&directory);
        match workspace.enter() {
            Ok(there) => assert!(there),
            Err(error) => {
                assert!(matches!(error, WorkspaceError::Damaged { .. }), "{error}");
                refused += 1;
                continue;
            }
        }
        let announced = workspace.has_announced("/somewhere/lines.ply".as_ref());
        assert!(announced || path.ends_with("crease-outputs"), "byte {at} of {}", path.display());
        let Some(read) = workspace.job().expect("readable") else {
            restarted += 1;
            continue;
        };
        assert_eq!(read, job());
        let left = found(&workspace);
        assert!(!torn(&left, &labels) && left.len() + 3 >= labels.len());
        redone += usize::from(left.len() < labels.len());
    }
    assert!(refused > 20 && restarted > 20 && redone > 400, "{refused} {restarted} {redone}");
}
