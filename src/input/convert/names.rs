//! New numbers of vertices, looked up.
//!
//! In: the new number of each vertex, in order. Out: those of any vertices, many at a time. The numbers lie in a temporary
//! file in blocks. Faces mostly name vertices that are near each other in the file: then the few blocks around them are
//! held. Where they do not, each block is read once for all that are looked up at a time.

use crate::input::InputError;
use crate::spill::{BlockReader, Extent, ScratchDir, SpillFile, SpillWriter};

/// Vertices of a block.
const BLOCK: usize = 1 << 16;

/// Takes new numbers, one vertex after the other.
pub struct NamesWriter {
    writer: SpillWriter,
    block: Vec<u8>,
    extents: Vec<Extent>,
}

impl NamesWriter {
    pub fn new(scratch: &ScratchDir) -> NamesWriter {
        let writer = SpillWriter::create(scratch, "new-names", 4 * BLOCK);
        NamesWriter { writer, block: Vec::with_capacity(4 * BLOCK), extents: Vec::new() }
    }

    pub fn push(&mut self, new: u32) -> Result<(), InputError> {
        self.block.extend(new.to_le_bytes());
        if self.block.len() == 4 * BLOCK { self.end_block() } else { Ok(()) }
    }

    fn end_block(&mut self) -> Result<(), InputError> {
        self.extents.push(self.writer.write_block(&self.block)?);
        self.block.clear();
        Ok(())
    }

    /// Ends the writing; looking up may hold `memory` bytes.
    pub fn finish(mut self, memory: u64) -> Result<Names, InputError> {
        if !self.block.is_empty() {
            self.end_block()?;
        }
        let reader = self.writer.finish().and_then(SpillFile::blocks)?;
        let most = usize::try_from(memory / (4 * BLOCK as u64)).unwrap_or(usize::MAX).max(2);
        Ok(Names {
            reader,
            extents: self.extents,
            most,
            held: Vec::new(),
            first: 0,
            order: Vec::new(),
            bytes: Vec::new(),
        })
    }
}

/// Finds new numbers.
pub struct Names {
    reader: BlockReader,
    extents: Vec<Extent>,
    /// Blocks that may be held.
    most: usize,
    /// Blocks that are, and the first of them.
    held: Vec<Vec<u32>>,
    first: usize,
    order: Vec<u32>,
    bytes: Vec<u8>,
}

impl Names {
    /// Replaces each of `ids`, which must exist, by its new number.
    pub fn look_up(&mut self, ids: &mut [u64]) -> Result<(), InputError> {
        let (Some(least), Some(largest)) = (ids.iter().min(), ids.iter().max()) else { return Ok(()) };
        let block_of = |id: u64| (id / BLOCK as u64) as usize;
        let (from, to) = (block_of(*least), block_of(*largest) + 1);
        if to - from <= self.most {
            self.hold(from, to)?;
            for id in ids {
                *id = self.name(*id);
            }
            return Ok(());
        }
        let mut order = std::mem::take(&mut self.order);
        order.clear();
        order.extend(0..ids.len() as u32);
        order.sort_unstable_by_key(|&i| ids[i as usize]);
        for &i in &order {
            let id = &mut ids[i as usize];
            let block = block_of(*id);
            self.hold(block, block + 1)?;
            *id = self.name(*id);
        }
        self.order = order;
        Ok(())
    }

    fn name(&self, id: u64) -> u64 {
        u64::from(self.held[(id / BLOCK as u64) as usize - self.first][(id % BLOCK as u64) as usize])
    }

    /// Has the blocks `from..to` in memory.
    fn hold(&mut self, from: usize, to: usize) -> Result<(), InputError> {
        if from >= self.first && to <= self.first + self.held.len() {
            return Ok(());
        }
        let (old, first) = (std::mem::take(&mut self.held), self.first);
        let mut kept: Vec<Option<Vec<u32>>> = old.into_iter().map(Some).collect();
        for block in from..to {
            let at = block.checked_sub(first).and_then(|i| kept.get_mut(i)).and_then(Option::take);
            let numbers = match at {
                Some(numbers) => numbers,
                None => {
                    self.reader.read(self.extents[block], &mut self.bytes)?;
                    let number = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
                    self.bytes.chunks_exact(4).map(number).collect()
                }
            };
            self.held.push(numbers);
        }
        self.first = from;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spill::ScratchPlace;

    #[test]
    fn near_and_far_numbers_are_found() {
        let parent = tempfile::tempdir().unwrap();
        let scratch = ScratchPlace::below(parent.path()).dir().unwrap();
        let mut writer = NamesWriter::new(&scratch);
        let new = |id: u64| (id * 7919 % 300_007) as u32;
        let count = 5 * BLOCK as u64 + 17;
        for id in 0..count {
            writer.push(new(id)).unwrap();
        }
        let mut names = writer.finish(2 * 4 * BLOCK as u64).unwrap();
        for ids in [
            (0..1000).collect::<Vec<u64>>(),
            (BLOCK as u64 - 5..BLOCK as u64 + 5).collect(),
            (0..2000).map(|i| i * 104_729 % count).collect(),
            vec![count - 1, 0, count - 1],
            vec![],
        ] {
            let mut found = ids.clone();
            names.look_up(&mut found).unwrap();
            assert_eq!(found, ids.iter().map(|&id| u64::from(new(id))).collect::<Vec<_>>());
        }
    }
}
