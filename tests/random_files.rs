//! Bytes that are nearly a mesh: files that something happened to are read like any other, or refused in words. A short
//! run of what `tools/fuzz` does for hours, without anything that has to be installed.

mod support;
#[path = "support/walk.rs"]
mod walk;

use proptest::prelude::*;
use support::fixture;

/// What happens to a file. Places are shares of its length.
#[derive(Clone, Debug)]
enum Change {
    Overwrite(f64, Vec<u8>),
    Insert(f64, Vec<u8>),
    Remove(f64, usize),
    Cut(f64),
    /// A word of the header becomes another one.
    Word(usize, &'static str),
}

/// Words that headers are made of, and numbers that nobody has the bytes for.
const WORDS: [&str; 16] = [
    "list",
    "char",
    "uchar",
    "ushort",
    "int",
    "uint",
    "float",
    "double",
    "property",
    "element",
    "vertex",
    "face",
    "0",
    "-1",
    "4294967295",
    "18446744073709551615",
];

fn change() -> impl Strategy<Value = Change> {
    let bytes = || {
        prop_oneof![
            prop::collection::vec(any::<u8>(), 1..9),
            prop::sample::select(vec![vec![0xff; 4], vec![0x7f; 8], vec![0; 4], b"\n".to_vec()]),
        ]
    };
    prop_oneof![
        (0.0..1.0, bytes()).prop_map(|(at, bytes)| Change::Overwrite(at, bytes)),
        (0.0..1.0, bytes()).prop_map(|(at, bytes)| Change::Insert(at, bytes)),
        (0.0..1.0, 1usize..40).prop_map(|(at, count)| Change::Remove(at, count)),
        (0.0..1.0).prop_map(Change::Cut),
        (0usize..60, prop::sample::select(WORDS.to_vec())).prop_map(|(at, word)| Change::Word(at, word)),
    ]
}

fn changed(mut bytes: Vec<u8>, changes: &[Change]) -> Vec<u8> {
    for change in changes {
        let place = |share: &f64| (share * bytes.len() as f64) as usize;
        match change {
            Change::Overwrite(at, new) => {
                let at = place(at);
                bytes.iter_mut().skip(at).zip(new).for_each(|(old, new)| *old = *new);
            }
            Change::Insert(at, new) => {
                let at = place(at);
                bytes.splice(at..at, new.iter().copied());
            }
            Change::Remove(at, count) => {
                let at = place(at);
                bytes.drain(at..bytes.len().min(at + count));
            }
            Change::Cut(at) => bytes.truncate(place(at)),
            Change::Word(at, new) => bytes = with_word(&bytes, *at, new),
        }
    }
    bytes
}

/// The bytes with word `at` of the header replaced, if there are so many.
fn with_word(bytes: &[u8], at: usize, new: &str) -> Vec<u8> {
    let end = bytes.windows(10).position(|w| w == b"end_header").unwrap_or(0);
    let blank = |i: usize| i >= end || bytes[i].is_ascii_whitespace();
    let starts: Vec<usize> = (1..end).filter(|&i| blank(i - 1) && !blank(i)).collect();
    let Some(&start) = starts.get(at) else { return bytes.to_vec() };
    let stop = (start..end).find(|&i| blank(i)).unwrap_or(end);
    [&bytes[..start], new.as_bytes(), &bytes[stop..]].concat()
}

proptest! {
    // More of them: the environment variable PROPTEST_CASES.
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_are_read_or_refused(
        name in prop::sample::select(vec!["meshes/polygons.ply", "meshes/defects.ply", "broken/truncated.ply",
            "broken/nan_vertex.ply", "broken/index_out_of_range.ply", "meshes/ascii.ply"]),
        changes in prop::collection::vec(change(), 0..6),
    ) {
        let bytes = std::fs::read(fixture(name)).expect("a fixture");
        let directory = tempfile::tempdir().expect("a temporary directory");
        let path = directory.path().join("mesh.ply");
        std::fs::write(&path, changed(bytes, &changes)).expect("write");
        // A mesh or an error: what must hold is asserted on the way.
        let _ = walk::walk(&path);
    }
}

#[test]
fn whole_files_are_read() {
    for (name, faces) in [("polygons", 16), ("defects", 133)] {
        let (blocks, _) = walk::walk(&fixture(&format!("meshes/{name}.ply"))).expect("it is whole");
        assert_eq!(blocks.iter().map(Vec::len).sum::<usize>(), faces);
    }
}
