//! Sorting more records than memory holds.
//!
//! In: records in any order. Out: the same records in the order of their keys, as often as one likes. Records are kept until
//! they fill the memory; then they are sorted and written as a *run*. [`FAN_IN`] runs of one level are merged into one of
//! the next, so that few files are open at a time and every record is rewritten a few times only.

use super::{ScratchPlace, SpillError, SpillFile, SpillReader, SpillWriter};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::cmp::Ordering;
use std::io::{ErrorKind, Read};

/// A record that can be written, and the order it is sorted in. Records that compare equal must be equal.
pub trait Record: Clone + Serialize + DeserializeOwned {
    /// The order.
    fn order(&self, other: &Self) -> Ordering;

    /// Bytes that it takes on the heap, beside its own.
    fn heap(&self) -> usize {
        0
    }
}

/// Runs that are merged at a time.
const FAN_IN: usize = 16;

/// Takes records.
#[derive(Debug)]
pub struct Sorter<R> {
    name: &'static str,
    scratch: ScratchPlace,
    /// Bytes for records that are not written yet.
    memory: u64,
    /// Size of the blocks of a run.
    block: usize,
    pending: Vec<R>,
    heap: u64,
    /// Runs, each with its level; levels descend.
    runs: Vec<(u32, SpillFile)>,
}

impl<R: Record> Sorter<R> {
    /// Sorts within about `memory` bytes, half of them for records and half for reading runs back. `name` is what its files
    /// begin with.
    pub fn new(name: &'static str, memory: u64, scratch: &ScratchPlace) -> Sorter<R> {
        Sorter {
            name,
            scratch: scratch.clone(),
            memory: memory / 2,
            block: usize::try_from(memory / (4 * FAN_IN as u64)).unwrap_or(usize::MAX),
            pending: Vec::new(),
            heap: 0,
            runs: Vec::new(),
        }
    }

    /// Takes a record.
    ///
    /// # Errors
    /// If a run cannot be written.
    pub fn push(&mut self, record: R) -> Result<(), SpillError> {
        let capacity = self.pending.capacity();
        // When a list grows, the old and the new one are there together.
        let slots = if self.pending.len() == capacity { 3 * capacity.max(1) } else { capacity };
        let more = record.heap() as u64;
        if !self.pending.is_empty() && (slots * size_of::<R>()) as u64 + self.heap + more > self.memory {
            self.write_run()?;
        }
        self.heap += more;
        self.pending.push(record);
        Ok(())
    }

    /// Bytes that are held.
    pub fn bytes(&self) -> u64 {
        (self.pending.capacity() * size_of::<R>()) as u64 + self.heap
    }

    /// Ends the input.
    ///
    /// # Errors
    /// If runs cannot be merged.
    pub fn finish(mut self) -> Result<Sorted<R>, SpillError> {
        self.pending.sort_unstable_by(R::order);
        self.pending.shrink_to_fit();
        while self.runs.len() > FAN_IN {
            self.merge_last(FAN_IN)?;
        }
        let bytes = self.bytes();
        let runs = self.runs.into_iter().map(|(_, run)| run).collect();
        Ok(Sorted { pending: self.pending, runs, bytes })
    }

    fn write_run(&mut self) -> Result<(), SpillError> {
        self.pending.sort_unstable_by(R::order);
        let mut run = self.writer()?;
        let mut bytes = Vec::new();
        self.pending.iter().try_for_each(|record| write(&mut run, record, &mut bytes))?;
        self.pending.clear();
        self.heap = 0;
        self.runs.push((0, run.finish()?));
        let same_level = |runs: &[(u32, SpillFile)]| {
            runs.iter().rev().take_while(|run| run.0 == runs[runs.len() - 1].0).count()
        };
        while same_level(&self.runs) >= FAN_IN {
            self.merge_last(FAN_IN)?;
        }
        Ok(())
    }

    /// Merges the last `count` runs into one, a level above the first of them.
    fn merge_last(&mut self, count: usize) -> Result<(), SpillError> {
        let last = self.runs.split_off(self.runs.len() - count);
        let level = last[0].0 + 1;
        let mut run = self.writer()?;
        let mut bytes = Vec::new();
        Merge::<R>::new(&[], last.iter().map(|(_, file)| file))?
            .try_for_each(|record| write(&mut run, &record?, &mut bytes))?;
        self.runs.push((level, run.finish()?));
        Ok(())
    }

    fn writer(&self) -> Result<SpillWriter, SpillError> {
        Ok(SpillWriter::create(&self.scratch.dir()?, self.name, self.block))
    }
}

/// Records in order.
#[derive(Debug)]
pub struct Sorted<R> {
    pending: Vec<R>,
    runs: Vec<SpillFile>,
    bytes: u64,
}

impl<R: Record> Sorted<R> {
    /// All records.
    ///
    /// # Errors
    /// If a run cannot be read.
    pub fn iter(&self) -> Result<Merge<'_, R>, SpillError> {
        Merge::new(&self.pending, self.runs.iter())
    }

    /// Bytes that are held, and that reading takes.
    pub fn bytes(&self) -> u64 {
        self.bytes + self.runs.iter().map(|run| run.reader_bytes() as u64).sum::<u64>()
    }

    /// Whether anything was written to a file.
    pub fn spilled(&self) -> bool {
        !self.runs.is_empty()
    }
}

/// A record with its length before it.
fn write<R: Record>(run: &mut SpillWriter, record: &R, bytes: &mut Vec<u8>) -> Result<(), SpillError> {
    bytes.clear();
    bytes.extend([0; 4]);
    // Records are plain numbers and lists of them: there is none that cannot be encoded.
    *bytes = postcard::to_extend(record, std::mem::take(bytes)).expect("a plain record");
    let length = (bytes.len() - 4) as u32;
    bytes[..4].copy_from_slice(&length.to_le_bytes());
    run.write(bytes)
}

/// Several sorted sources as one.
pub struct Merge<'a, R> {
    memory: std::slice::Iter<'a, R>,
    readers: Vec<(SpillReader<'a>, &'a SpillFile)>,
    /// The next record of each reader, then that of the memory.
    heads: Vec<Option<R>>,
    bytes: Vec<u8>,
    failed: bool,
}

impl<'a, R: Record> Merge<'a, R> {
    fn new(memory: &'a [R], runs: impl Iterator<Item = &'a SpillFile>) -> Result<Merge<'a, R>, SpillError> {
        let readers = runs.map(|run| Ok((run.reader()?, run))).collect::<Result<Vec<_>, SpillError>>()?;
        let mut merge =
            Merge { memory: memory.iter(), readers, heads: Vec::new(), bytes: Vec::new(), failed: false };
        for source in 0..=merge.readers.len() {
            let head = merge.read(source)?;
            merge.heads.push(head);
        }
        Ok(merge)
    }

    /// The next record of a source.
    fn read(&mut self, source: usize) -> Result<Option<R>, SpillError> {
        let Some((reader, file)) = self.readers.get_mut(source) else {
            return Ok(self.memory.next().cloned());
        };
        let mut length = [0; 4];
        match reader.read(&mut length[..1]).map_err(|e| damaged(file, e))? {
            0 => return Ok(None),
            _ => reader.read_exact(&mut length[1..]).map_err(|e| damaged(file, e))?,
        }
        self.bytes.resize(u32::from_le_bytes(length) as usize, 0);
        reader.read_exact(&mut self.bytes).map_err(|e| damaged(file, e))?;
        postcard::from_bytes(&self.bytes).map(Some).map_err(|_| cut(file))
    }

    fn step(&mut self) -> Result<Option<R>, SpillError> {
        // Few sources: looking at all is as fast as keeping them in order.
        let first = (0..self.heads.len()).filter(|&i| self.heads[i].is_some()).reduce(|best, i| {
            let less = match (&self.heads[i], &self.heads[best]) {
                (Some(a), Some(b)) => a.order(b).is_lt(),
                _ => false,
            };
            if less { i } else { best }
        });
        let Some(first) = first else { return Ok(None) };
        let next = self.read(first)?;
        Ok(std::mem::replace(&mut self.heads[first], next))
    }
}

impl<R: Record> Iterator for Merge<'_, R> {
    type Item = Result<R, SpillError>;

    /// Ends after an error.
    fn next(&mut self) -> Option<Result<R, SpillError>> {
        if self.failed {
            return None;
        }
        let step = self.step();
        self.failed = step.is_err();
        step.transpose()
    }
}

/// What a reader says through [`Read`], as what it is.
fn damaged(file: &SpillFile, error: std::io::Error) -> SpillError {
    let kind = error.kind();
    match error.downcast::<SpillError>() {
        Ok(error) => error,
        Err(_) if kind == ErrorKind::UnexpectedEof => cut(file),
        Err(source) => SpillError::Io { path: file.path().to_owned(), action: "cannot read", source },
    }
}

fn cut(file: &SpillFile) -> SpillError {
    SpillError::Corrupt { path: file.path().to_owned(), offset: 0, reason: "a record is cut off" }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    impl Record for Vec<u64> {
        fn order(&self, other: &Self) -> Ordering {
            self.cmp(other)
        }

        fn heap(&self) -> usize {
            size_of_val(&self[..])
        }
    }

    fn sorted(memory: u64, records: &[Vec<u64>], scratch: &ScratchPlace) -> Sorted<Vec<u64>> {
        let mut sorter = Sorter::new("test", memory, scratch);
        for record in records {
            sorter.push(record.clone()).expect("room");
            let largest = records.iter().map(|r| r.heap() + 24).max().unwrap_or(0) as u64;
            assert!(sorter.bytes() <= (memory / 2).max(4 * 24 + largest), "{} bytes", sorter.bytes());
        }
        sorter.finish().expect("room")
    }

    #[test]
    fn many_runs_are_merged_in_levels() {
        let parent = tempfile::tempdir().expect("a temporary directory");
        let scratch = ScratchPlace::below(parent.path());
        // Some records are longer than a block.
        let records: Vec<Vec<u64>> =
            (0..3000u64).map(|i| vec![i * 7919 % 3001; if i % 500 == 0 { 400 } else { 3 }]).collect();
        let all = sorted(100, &records, &scratch);
        assert!(all.spilled() && all.runs.len() <= FAN_IN, "{} runs", all.runs.len());
        let mut expected = records;
        expected.sort();
        for _ in 0..2 {
            let read: Vec<Vec<u64>> = all.iter().and_then(|merge| merge.collect()).expect("readable");
            assert_eq!(read, expected);
        }
        drop((all, scratch));
        assert_eq!(std::fs::read_dir(parent.path()).expect("list").count(), 0);
    }

    #[test]
    fn what_fits_makes_no_files() {
        let scratch = ScratchPlace::below("/nowhere".as_ref());
        let all = sorted(1 << 20, &[vec![3], vec![1, 2], vec![]], &scratch);
        let read: Vec<Vec<u64>> = all.iter().and_then(|merge| merge.collect()).expect("readable");
        assert!(read == [vec![], vec![1, 2], vec![3]] && !all.spilled());
        let mut sorter = Sorter::new("test", 0, &scratch);
        sorter.push(vec![1]).expect("there is one place");
        assert!(matches!(sorter.push(vec![2]), Err(SpillError::Io { .. })));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn any_memory_gives_the_same(records in prop::collection::vec(prop::collection::vec(0u64..9, 0..5), 0..200), memory in 0u64..6000) {
            let parent = tempfile::tempdir().expect("a temporary directory");
            let all = sorted(memory, &records, &ScratchPlace::below(parent.path()));
            let read: Vec<Vec<u64>> = all.iter().and_then(|merge| merge.collect()).expect("readable");
            let mut expected = records;
            expected.sort();
            prop_assert_eq!(read, expected);
        }
    }
}
