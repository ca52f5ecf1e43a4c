//! A temporary file whose bytes the disk has changed: reading it ends, with what was written or with an error, and holds
//! no more than a block.
#![no_main]

mod place;

use arbitrary::Arbitrary;
use crease::spill::{ScratchDir, SpillWriter};
use libfuzzer_sys::fuzz_target;
use std::fs;

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
    block: u16,
    records: Vec<Vec<u8>>,
    /// Which of them are blocks of their own, by bit.
    single: u64,
    changes: Vec<Change>,
}

fuzz_target!(|case: Case| {
    let scratch = ScratchDir::create(&place::DIRECTORY).expect("a directory");
    let mut writer = SpillWriter::create(&scratch, "file", case.block.into());
    let (mut written, mut extents) = (Vec::new(), Vec::new());
    for (i, record) in case.records.iter().enumerate() {
        if case.single >> (i % 64) & 1 == 1 {
            extents.push((writer.write_block(record).expect("write"), record));
        } else {
            writer.write(record).expect("write");
        }
        written.extend_from_slice(record);
    }
    let file = writer.finish().expect("finish");
    if file.length() == 0 {
        return;
    }
    let before = fs::read(file.path()).expect("read");
    let mut bytes = before.clone();
    for change in &case.changes {
        match change {
            Change::Overwritten(at, new) => {
                bytes.iter_mut().skip((*at).into()).zip(new).for_each(|(old, new)| *old = *new);
            }
            Change::Cut(at) => bytes.truncate((*at).into()),
            Change::Appended(new) => bytes.extend_from_slice(new),
            Change::Replaced(new) => bytes = new.clone(),
        }
    }
    fs::write(file.path(), &bytes).expect("write");
    // A checksum is no signature: bytes that were made up to agree with theirs are read. Bytes that are missing never are.
    let forged = case.changes.iter().any(|change| !matches!(change, Change::Cut(_)));
    let mut reader = file.reader().expect("it is there");
    let mut read = Vec::new();
    while let Ok(Some(block)) = reader.next_block() {
        read.extend_from_slice(block);
    }
    assert!(forged || written.starts_with(&read), "what was not written was read");
    assert!(read == written || !bytes.starts_with(&before), "what was written was not read");
    drop(reader);
    let blocks = file.blocks().expect("it is there");
    let mut block = Vec::new();
    for (extent, record) in extents {
        if blocks.read(extent, &mut block).is_ok() {
            assert!(forged || &block == record, "another block was read");
            assert_eq!(block.len(), record.len());
        }
    }
});
