//! Sorting more records than memory holds.
//!
//! In: records in any order. Out: the same records in the order of their keys, as often as one likes. Records are kept until
//! they fill the memory; then they are sorted and written as a *run*. [`FAN_IN`] runs of one level are merged into one of
//! the next, so that few files are open at a time and every record is rewritten a few times only. What others have sorted
//! before is taken as it is ([`Run`]), and is rewritten only if there are more of them than can be read at a time.

use super::merge::Merge;
use super::run::{KeptRun, write_record};
use super::{ScratchPlace, SpillError, SpillFile, SpillWriter};
use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::cmp::Ordering;

/// A record that can be written, and the order it is sorted in. Records that compare equal must be equal.
pub trait Record: Clone + Send + Serialize + DeserializeOwned {
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
    /// Runs of others.
    kept: Vec<KeptRun>,
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
            kept: Vec::new(),
        }
    }

    /// Takes records that are in order already, wherever they are. Nothing is read of them before the end of the input.
    pub fn adopt(&mut self, run: KeptRun) {
        self.kept.push(run);
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
        sort(&mut self.pending);
        self.pending.shrink_to_fit();
        while self.runs.len() > FAN_IN {
            self.merge_last(FAN_IN)?;
        }
        // Readers of the own runs have a half of what is there for reading, those of others the other half.
        while self.kept.len() > 1 && kept_bytes(&self.kept) > self.memory / 2 {
            let few = self.kept.split_off(self.kept.len().saturating_sub(FAN_IN));
            let run = self.merged(Merge::new(&[], &[], &few)?)?;
            self.runs.push((0, run));
            while self.runs.len() > FAN_IN {
                self.merge_last(FAN_IN)?;
            }
        }
        let bytes = self.bytes();
        let runs = self.runs.into_iter().map(|(_, run)| run).collect();
        Ok(Sorted { pending: self.pending, runs, kept: self.kept, bytes })
    }

    fn write_run(&mut self) -> Result<(), SpillError> {
        sort(&mut self.pending);
        let mut run = self.writer()?;
        let mut bytes = Vec::new();
        self.pending.iter().try_for_each(|record| write_record(&mut run, record, &mut bytes))?;
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
        let files: Vec<SpillFile> = last.into_iter().map(|(_, file)| file).collect();
        let run = self.merged(Merge::new(&[], &files, &[])?)?;
        self.runs.push((level, run));
        Ok(())
    }

    /// All of `records` as one run.
    fn merged(&self, mut records: Merge<'_, R>) -> Result<SpillFile, SpillError> {
        let mut run = self.writer()?;
        let mut bytes = Vec::new();
        records.try_for_each(|record| write_record(&mut run, &record?, &mut bytes))?;
        run.finish()
    }

    fn writer(&self) -> Result<SpillWriter, SpillError> {
        Ok(SpillWriter::create(&self.scratch.dir()?, self.name, self.block))
    }
}

/// Sorts with the threads of the pool that this is one of; outside of all pools, alone.
fn sort<R: Record>(records: &mut [R]) {
    match rayon::current_thread_index() {
        Some(_) => records.par_sort_unstable_by(R::order),
        None => records.sort_unstable_by(R::order),
    }
}

/// What reading all of `runs` at a time takes.
fn kept_bytes(runs: &[KeptRun]) -> u64 {
    runs.iter().map(|run| run.reader_bytes()).sum()
}

/// Records in order.
#[derive(Debug)]
pub struct Sorted<R> {
    pending: Vec<R>,
    runs: Vec<SpillFile>,
    kept: Vec<KeptRun>,
    bytes: u64,
}

impl<R: Record> Sorted<R> {
    /// All records.
    ///
    /// # Errors
    /// If a run cannot be read.
    pub fn iter(&self) -> Result<Merge<'_, R>, SpillError> {
        Merge::new(&self.pending, &self.runs, &self.kept)
    }

    /// Bytes that are held, and that reading takes.
    pub fn bytes(&self) -> u64 {
        self.bytes
            + self.runs.iter().map(|run| run.reader_bytes() as u64).sum::<u64>()
            + kept_bytes(&self.kept)
    }

    /// Whether anything was written to a file.
    pub fn spilled(&self) -> bool {
        !self.runs.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spill::blocks_of_records;
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

    fn run_of(mut records: Vec<Vec<u64>>) -> KeptRun {
        records.sort();
        let mut blocks = Vec::new();
        let take = |bytes: &[u8]| {
            blocks.push(bytes.to_vec());
            Ok::<_, SpillError>(())
        };
        blocks_of_records(records.into_iter().map(Ok), 40, take).expect("blocks");
        KeptRun::in_memory(blocks)
    }

    #[test]
    fn runs_of_others_are_merged_with_the_own_ones() {
        let parent = tempfile::tempdir().expect("a temporary directory");
        let scratch = ScratchPlace::below(parent.path());
        let records: Vec<Vec<u64>> = (0..3000u64).map(|i| vec![i * 7919 % 3001; (i % 5) as usize]).collect();
        let mut expected = records.clone();
        expected.sort();
        for (memory, spills) in [(1 << 20, false), (2000, true)] {
            let mut sorter = Sorter::new("test", memory, &scratch);
            let (own, others) = records.split_at(600);
            others.chunks(60).for_each(|chunk| sorter.adopt(run_of(chunk.to_vec())));
            sorter.adopt(run_of(Vec::new()));
            own.iter().for_each(|record| sorter.push(record.clone()).expect("room"));
            let all = sorter.finish().expect("room");
            assert_eq!((all.spilled(), all.kept.len() == 41), (spills, !spills));
            assert!(kept_bytes(&all.kept) <= memory / 4, "{} readers", all.kept.len());
            for _ in 0..2 {
                let read: Vec<Vec<u64>> = all.iter().and_then(|merge| merge.collect()).expect("readable");
                assert_eq!(read, expected);
            }
        }
    }

    #[test]
    fn a_run_that_is_no_run_is_an_error() {
        let mut sorter: Sorter<Vec<u64>> =
            Sorter::new("test", 1 << 20, &ScratchPlace::below("/nowhere".as_ref()));
        sorter.adopt(KeptRun::in_memory(vec![vec![3, 1, 2]]));
        let all = sorter.finish().expect("nothing is read");
        assert!(matches!(all.iter(), Err(SpillError::Changed { offset: 0, .. })));
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
