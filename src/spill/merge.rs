//! Several sorted sources as one.
//!
//! In: records in memory, in temporary files, and in runs of others, each in order. Out: all of them in order. A heap holds
//! the next record of each source, so that hundreds of sources cost little more than two.

use super::run::{KeptReader, KeptRun, read_record};
use super::sorter::Record;
use super::{SpillError, SpillFile, SpillReader};
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::collections::binary_heap::PeekMut;

/// Where records come from.
enum Source<'a, R> {
    Memory(std::slice::Iter<'a, R>),
    File(SpillReader<'a>, &'a SpillFile),
    Kept(KeptReader<'a, R>),
}

/// The next record of a source; the first record is the greatest, as a heap wants it.
struct Head<R> {
    record: R,
    source: usize,
}

impl<R: Record> Ord for Head<R> {
    fn cmp(&self, other: &Self) -> Ordering {
        other.record.order(&self.record).then(other.source.cmp(&self.source))
    }
}

impl<R: Record> PartialOrd for Head<R> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<R: Record> PartialEq for Head<R> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl<R: Record> Eq for Head<R> {}

/// Several sorted sources as one.
pub struct Merge<'a, R> {
    sources: Vec<Source<'a, R>>,
    heads: BinaryHeap<Head<R>>,
    bytes: Vec<u8>,
    failed: bool,
}

impl<'a, R: Record> Merge<'a, R> {
    pub(super) fn new(
        memory: &'a [R],
        files: &'a [SpillFile],
        kept: &'a [KeptRun],
    ) -> Result<Merge<'a, R>, SpillError> {
        let mut sources = vec![Source::Memory(memory.iter())];
        for file in files {
            sources.push(Source::File(file.reader()?, file));
        }
        sources.extend(kept.iter().map(|run| Source::Kept(run.records())));
        let heads = BinaryHeap::with_capacity(sources.len());
        let mut merge = Merge { sources, heads, bytes: Vec::new(), failed: false };
        for source in 0..merge.sources.len() {
            if let Some(record) = merge.read(source)? {
                merge.heads.push(Head { record, source });
            }
        }
        Ok(merge)
    }

    /// The next record of a source.
    fn read(&mut self, source: usize) -> Result<Option<R>, SpillError> {
        match &mut self.sources[source] {
            Source::Memory(records) => Ok(records.next().cloned()),
            Source::File(reader, file) => read_record(reader, file, &mut self.bytes),
            Source::Kept(reader) => reader.read(),
        }
    }

    fn step(&mut self) -> Result<Option<R>, SpillError> {
        let Some(source) = self.heads.peek().map(|head| head.source) else { return Ok(None) };
        let next = self.read(source)?;
        let Some(mut first) = self.heads.peek_mut() else { return Ok(None) };
        Ok(Some(match next {
            Some(record) => std::mem::replace(&mut first.record, record),
            None => PeekMut::pop(first).record,
        }))
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
