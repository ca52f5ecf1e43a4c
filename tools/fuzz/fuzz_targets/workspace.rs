//! A workspace whose files the disk has changed: entering it, reading its job and its results ends with what was kept or
//! without it, whatever stands there, and nothing is allocated for a length that is not true.
#![no_main]

mod place;

use arbitrary::Arbitrary;
use crease::config::{NO_LIMIT, Params};
use crease::glam::DVec3;
use crease::input::MemorySource;
use crease::partition::{Cell, scan};
use crease::workspace::{Identity, JobRecord, Label, MeshRecord, Workspace, clean};
use libfuzzer_sys::fuzz_target;
use std::fs;
use std::path::PathBuf;
use std::sync::LazyLock;

#[derive(Arbitrary, Debug)]
enum Change {
    /// These bytes stand at that place.
    Overwritten(u16, Vec<u8>),
    /// The file ends there.
    Cut(u16),
    /// These bytes come after the end.
    Appended(Vec<u8>),
    /// Another file stands in the place of this one.
    Replaced(Vec<u8>),
}

#[derive(Arbitrary, Debug)]
struct Case {
    /// Which file, and what becomes of it.
    changes: Vec<(u8, Change)>,
}

/// What a result of this cell holds.
fn payload(cell: u32) -> Vec<u64> {
    (0..u64::from(cell % 23)).map(|i| i * i + u64::from(cell)).collect()
}

/// The files of a workspace with a job of eight cells, of which five are done, one of them in two pieces.
static KEPT: LazyLock<Vec<(String, Vec<u8>)>> = LazyLock::new(|| {
    let directory = place::DIRECTORY.join("kept");
    let source = MemorySource::new(&[DVec3::ZERO, DVec3::X, DVec3::Y], &[[0, 1, 2]]).expect("a triangle");
    let identity = Identity::of(&source, &Params::default(), true);
    let scan = scan(&source, NO_LIMIT, &|_| {}).expect("a scan");
    let cells = (0..8).map(Cell::everything).collect();
    let workspace = Workspace::at(&directory);
    workspace
        .begin_job(&JobRecord { identity, scan, cells, rounds: 3, mesh: MeshRecord::File })
        .expect("begun");
    workspace.results(&[]).expect("a log");
    for (cell, piece, last) in
        [(3, 0, true), (0, 0, false), (0, 1, true), (5, 0, true), (6, 0, true), (7, 0, true)]
    {
        let label = Label { pass: 2, cell, session: 0, piece, last };
        workspace.keep(label, &payload(cell)).expect("kept");
    }
    workspace.announce(&["/somewhere/lines.ply".into()]).expect("announced");
    let entries = fs::read_dir(&directory).expect("list");
    let mut files: Vec<(String, Vec<u8>)> = entries
        .map(|entry| entry.expect("entry"))
        .map(|e| (e.file_name().to_string_lossy().into_owned(), fs::read(e.path()).expect("read")))
        .collect();
    files.sort();
    files
});

fn changed(bytes: &mut Vec<u8>, change: &Change) {
    match change {
        Change::Overwritten(at, new) => {
            bytes.iter_mut().skip((*at).into()).zip(new).for_each(|(old, new)| *old = *new);
        }
        Change::Cut(at) => bytes.truncate((*at).into()),
        Change::Appended(new) => bytes.extend_from_slice(new),
        Change::Replaced(new) => bytes.clone_from(new),
    }
}

fuzz_target!(|case: Case| {
    let directory: PathBuf = place::DIRECTORY.join("work");
    fs::create_dir_all(&directory).expect("a directory");
    let mut files = KEPT.clone();
    let many = files.len();
    case.changes.iter().for_each(|(file, change)| changed(&mut files[usize::from(*file) % many].1, change));
    files.iter().for_each(|(name, bytes)| fs::write(directory.join(name), bytes).expect("write"));
    let workspace = Workspace::at(&directory);
    workspace.has_announced("/somewhere/lines.ply".as_ref());
    if let Ok(true) = workspace.enter()
        && let Ok(Some(_)) = workspace.job()
        && let Ok(places) = workspace.results(&[])
    {
        for place in places {
            let result = workspace.result::<Vec<u64>>(&place);
            // A checksum is no signature: bytes that were made up to agree with theirs are read.
            let forged = case.changes.iter().any(|(_, change)| !matches!(change, Change::Cut(_)));
            assert!(forged || result.is_ok_and(|found| found == payload(place.label.cell)));
        }
    }
    drop(workspace);
    // Whatever it was, it can be given up, or is refused.
    let _ = clean(&directory);
    let _ = fs::remove_dir_all(&directory);
});
