//! What was written comes back, or an error does.

use super::*;
use std::fs;
use std::io::Read;

fn scratch() -> (tempfile::TempDir, ScratchDir) {
    let parent = tempfile::tempdir().expect("a temporary directory");
    let dir = ScratchDir::create(parent.path()).expect("create");
    (parent, dir)
}

/// A file of `count` records of 24 bytes in blocks of the smallest size.
fn written(dir: &ScratchDir, count: u64) -> SpillFile {
    let mut writer = SpillWriter::create(dir, "test", 0);
    for i in 0..count {
        let record: Vec<u8> = [i, i * i, !i].iter().flat_map(|x| x.to_le_bytes()).collect();
        writer.write(&record).expect("write");
        assert_eq!(writer.payload(), 24 * (i + 1));
    }
    writer.finish().expect("finish")
}

#[test]
fn records_come_back_whole_and_in_order() {
    let (_parent, dir) = scratch();
    let file = written(&dir, 1000);
    assert_eq!(file.payload(), 24_000);
    assert_eq!(
        (dir.bytes(), fs::metadata(file.path()).expect("a file").len()),
        (file.length(), file.length())
    );
    let mut reader = file.reader().expect("open");
    let (mut next, mut blocks) = (0u64, 0);
    while let Some(block) = reader.next_block().expect("read") {
        assert!(block.len().is_multiple_of(24) && block.len() <= file.reader_bytes());
        for record in block.chunks_exact(24) {
            assert_eq!(record[..8], next.to_le_bytes());
            next += 1;
        }
        blocks += 1;
    }
    assert_eq!((next, blocks), (1000, 24), "42 records a block");
    let mut bytes = Vec::new();
    file.reader().expect("open").read_to_end(&mut bytes).expect("read");
    assert_eq!(bytes.len(), 24_000);
    assert_eq!(bytes[23_976..23_984], 999u64.to_le_bytes());
    let path = file.path().to_owned();
    drop(file);
    assert!(!path.exists());
    assert_eq!(dir.bytes(), 0);
    assert!(dir.peak_bytes() > 24_000);
}

#[test]
fn records_longer_than_a_block_are_cut() {
    let (_parent, dir) = scratch();
    let long: Vec<u8> = (0..5000u32).map(|i| i as u8).collect();
    let mut writer = SpillWriter::create(&dir, "test", 0);
    writer.write(b"short").expect("write");
    writer.write(&long).expect("write");
    writer.write(&[]).expect("write");
    let file = writer.finish().expect("finish");
    let mut bytes = Vec::new();
    file.reader().expect("open").read_to_end(&mut bytes).expect("read");
    assert_eq!(bytes, [b"short".as_slice(), &long].concat());
    assert!(file.reader_bytes() <= SMALLEST_BLOCK);
}

#[test]
fn an_empty_file_takes_nothing() {
    let (_parent, dir) = scratch();
    let file = SpillWriter::create(&dir, "test", 0).finish().expect("finish");
    assert!(!file.path().exists());
    assert!(file.reader().expect("open").next_block().expect("read").is_none());
    let blocks = file.blocks().expect("open");
    assert!(matches!(blocks.read(Extent::default(), &mut Vec::new()), Err(SpillError::Corrupt { .. })));
}

#[test]
fn single_blocks_are_found_again() {
    let (_parent, dir) = scratch();
    let mut writer = SpillWriter::create(&dir, "test", 0);
    let payload = |i: u32| vec![i as u8; 700 * i as usize];
    let extents: Vec<Extent> = (0..20).map(|i| writer.write_block(&payload(i)).expect("write")).collect();
    let blocks = writer.finish().expect("finish").blocks().expect("open");
    let mut out = vec![1, 2, 3];
    for i in (0..20).rev() {
        blocks.read(extents[i as usize], &mut out).expect("read");
        assert_eq!(out, payload(i));
    }
    let beyond = Extent { offset: blocks.file().length(), bytes: 1 };
    let shifted = Extent { offset: extents[3].offset + 1, ..extents[3] };
    for wrong in [beyond, shifted, Extent { offset: u64::MAX, bytes: 9 }] {
        assert!(matches!(blocks.read(wrong, &mut out), Err(SpillError::Corrupt { .. })), "{wrong:?}");
    }
}

/// What `damage` does to a file of many blocks must show when it is read.
fn assert_detected(damage: impl Fn(&mut Vec<u8>)) {
    let (_parent, dir) = scratch();
    let file = written(&dir, 500);
    let mut bytes = fs::read(file.path()).expect("read");
    damage(&mut bytes);
    fs::write(file.path(), bytes).expect("write");
    let mut reader = file.reader().expect("open");
    let error = loop {
        match reader.next_block() {
            Ok(Some(_)) => {}
            Ok(None) => panic!("not detected"),
            Err(error) => break error,
        }
    };
    assert!(matches!(&error, SpillError::Corrupt { path, .. } if path == file.path()), "{error}");
    let mut out = Vec::new();
    let error = file.reader().expect("open").read_to_end(&mut out).expect_err("not detected");
    assert!(error.to_string().contains("damaged"), "{error}");
}

#[test]
fn damage_is_detected() {
    // A block of 42 records has 1008 bytes and a head of 12.
    assert_detected(|bytes| bytes[5000] ^= 1);
    assert_detected(|bytes| bytes[3] ^= 0x80);
    assert_detected(|bytes| bytes[1020] = 0);
    assert_detected(|bytes| bytes.truncate(4000));
    assert_detected(|bytes| bytes.truncate(4080));
    assert_detected(|bytes| {
        let (first, second) = bytes.split_at_mut(1020);
        first.swap_with_slice(&mut second[..1020]);
    });
    assert_detected(|bytes| bytes.fill(0));
}

#[test]
fn buckets_hold_what_they_were_given() {
    let (_parent, dir) = scratch();
    for count in [1usize, 7, 500] {
        let mut buckets = Buckets::create(&dir, "bucket", count, 64 << 10);
        for i in 0..20_000u64 {
            buckets.write((i * i % count as u64) as usize, &i.to_le_bytes()).expect("write");
        }
        let total: u64 = (0..count).map(|b| buckets.payload(b)).sum();
        assert_eq!(total, 160_000);
        let files = buckets.finish().expect("finish");
        for (bucket, file) in files.iter().enumerate() {
            let mut reader = file.reader().expect("open");
            let mut last = None;
            while let Some(block) = reader.next_block().expect("read") {
                for record in block.chunks_exact(8) {
                    let i = u64::from_le_bytes(record.try_into().expect("8 bytes"));
                    assert_eq!((i * i % count as u64) as usize, bucket);
                    assert!(last < Some(i));
                    last = Some(i);
                }
            }
        }
        assert_eq!(files.iter().map(SpillFile::payload).sum::<u64>(), 160_000);
        drop(files);
        assert_eq!((dir.bytes(), fs::read_dir(dir.path()).expect("list").count()), (0, 0));
    }
    assert_eq!(Buckets::most(1 << 20, 64 << 10), 16);
}
