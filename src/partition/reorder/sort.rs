//! Second step: an external bucket sort of the faces along a space-filling curve.
//!
//! In: a source, the bounds and the sample of its scan. Out: a [`SpatialStore`]. Faces are distributed over buckets whose
//! limits are quantiles of the sample. A bucket that turns out too large is distributed again by a sample of its own; a pile
//! of faces in one place cannot be, and is taken in the order of the ids, a memoryful at a time.

use super::join::Joined;
use super::layout::{Face, Layout};
use super::store::{SpatialStore, encode};
use crate::input::{BLOCK, FaceBlock, InputError, MeshSource};
use crate::partition::curve::{Curve, cuts, piece};
use crate::partition::{BlockSummary, Bounds};
use crate::spill::{Buckets, Extent, ScratchDir, SpillFile, SpillWriter};
use glam::DVec3;
use rayon::prelude::*;

/// Blocks of the result at most, as for a file: the directory of the plan has an entry for each.
const MOST_BLOCKS: u64 = 1 << 18;
/// Keys that the limits of a bucket are found from: quantiles of so many are good to an eighth.
const KEYS_PER_BUCKET: usize = 512;
/// Times that a bucket is distributed again. Each time it shrinks to a few times the memory or is a pile; deeper there is
/// nothing to be gained.
const MOST_TIMES: u32 = 8;

/// Rewrites the faces of `source` in spatial order within `memory` bytes (and a few blocks of the source), using the current
/// thread pool. They are read from `joined`, if it was made, which is used up. `progress` is told of every face twice.
///
/// # Errors
/// If the source or a temporary file fails.
pub fn sort<'a>(
    source: &'a dyn MeshSource,
    joined: Option<Joined<'a>>,
    (bounds, sample): (&Bounds, &[DVec3]),
    scratch: &ScratchDir,
    memory: u64,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<SpatialStore<'a>, InputError> {
    let layout = Layout::of(source);
    let mut sorter = Sorter {
        layout,
        curve: Curve::new(bounds),
        scratch,
        memory,
        progress,
        block: source.face_count().div_ceil(MOST_BLOCKS).max(BLOCK) as usize,
        out: SpillWriter::create(scratch, "sorted", 0),
        extents: Vec::new(),
        summaries: Vec::new(),
    };
    let files = sorter.distribute(source, joined, sample)?;
    for file in files {
        sorter.settle(file, 1)?;
    }
    let Sorter { out, extents, summaries, .. } = sorter;
    Ok(SpatialStore { source, layout, blocks: out.finish()?.blocks()?, extents, summaries })
}

struct Sorter<'b> {
    layout: Layout,
    curve: Curve,
    scratch: &'b ScratchDir,
    memory: u64,
    progress: &'b (dyn Fn(u64) + Sync),
    /// Faces of a block of the result.
    block: usize,
    out: SpillWriter,
    extents: Vec<Extent>,
    summaries: Vec<BlockSummary>,
}

/// Faces of a block of the source: their buckets, and their records one after the other.
type Parsed = (Vec<u32>, Vec<u8>);

impl Sorter<'_> {
    fn key(&self, face: &Face) -> u128 {
        let [a, b, c] = face.places;
        self.curve.key((a + b + c) / 3.0)
    }

    /// Faces that are sorted at a time: their records and keys fill half of the memory.
    fn most_faces(&self) -> u64 {
        let face = self.layout.face_record() + size_of::<(u128, u32)>();
        (self.memory / 2 / face as u64).clamp(1, u64::from(u32::MAX))
    }

    /// Buckets for so many faces. A bucket is a little fuller or emptier than the sample says, hence the third.
    fn buckets_for(&self, faces: u64) -> usize {
        (faces + faces / 3).div_ceil(self.most_faces()).max(1) as usize
    }

    /// All faces of the source, by piece of the curve, each piece by ascending id.
    fn distribute(
        &self,
        source: &dyn MeshSource,
        joined: Option<Joined>,
        sample: &[DVec3],
    ) -> Result<Vec<SpillFile>, InputError> {
        let parts = self.buckets_for(source.face_count());
        let step = (sample.len() / (KEYS_PER_BUCKET * parts)).max(1);
        let mut keys: Vec<u128> = sample.iter().step_by(step).map(|&p| self.curve.key(p)).collect();
        let cuts = cuts(&mut keys, parts);
        let mut buckets = Buckets::create(self.scratch, "faces", cuts.len() + 1, self.memory / 2);
        let from = joined.as_ref().map_or(source, |joined| joined as &dyn MeshSource);
        let (blocks, batch) = (from.block_count(), 2 * rayon::current_num_threads());
        for start in (0..blocks).step_by(batch) {
            let end = blocks.min(start + batch);
            let parsed: Vec<Result<Parsed, InputError>> =
                (start..end).into_par_iter().map(|block| self.parse(from, block, &cuts)).collect();
            for parsed in parsed {
                let (pieces, records) = parsed?;
                for (&piece, record) in pieces.iter().zip(records.chunks_exact(self.layout.face_record())) {
                    buckets.write(piece as usize, record)?;
                }
                (self.progress)(pieces.len() as u64);
            }
            if let Some(joined) = &joined {
                joined.release_before(end);
            }
        }
        Ok(buckets.finish()?)
    }

    fn parse(&self, from: &dyn MeshSource, block: usize, cuts: &[u128]) -> Result<Parsed, InputError> {
        let (mut faces, mut places) = (FaceBlock::default(), Vec::new());
        from.read_placed(block, &mut faces, &mut places)?;
        let (mut pieces, mut records) = (Vec::with_capacity(places.len()), Vec::new());
        for (i, (&corners, &places)) in faces.corners.iter().zip(&places).enumerate() {
            let face = Face { id: faces.id(i), corners, places };
            pieces.push(piece(cuts, self.key(&face)) as u32);
            self.layout.put_face(&mut records, &face);
        }
        Ok((pieces, records))
    }

    /// Sorts one bucket into the result.
    fn settle(&mut self, file: SpillFile, times: u32) -> Result<(), InputError> {
        let width = self.layout.face_record();
        let faces = file.payload() / width as u64;
        if faces > self.most_faces() && times < MOST_TIMES {
            let cuts = self.cuts_of(&file)?;
            // One piece would be the same again.
            if !cuts.is_empty() {
                for part in self.distribute_again(file, &cuts)? {
                    self.settle(part, times + 1)?;
                }
                return Ok(());
            }
        }
        let most = faces.min(self.most_faces()) as usize * width;
        let mut records = Vec::with_capacity(most);
        let mut reader = file.reader()?;
        while let Some(block) = reader.next_block()? {
            for record in block.chunks_exact(width) {
                records.extend_from_slice(record);
                if records.len() == most {
                    self.write_sorted(&records)?;
                    records.clear();
                }
            }
        }
        self.write_sorted(&records)
    }

    /// Where to cut a bucket that is too large.
    fn cuts_of(&self, file: &SpillFile) -> Result<Vec<u128>, InputError> {
        let width = self.layout.face_record();
        let faces = file.payload() / width as u64;
        let parts = self.buckets_for(faces).max(2);
        let step = (faces / (KEYS_PER_BUCKET * parts) as u64).max(1);
        let (mut keys, mut index) = (Vec::new(), 0u64);
        let mut reader = file.reader()?;
        while let Some(block) = reader.next_block()? {
            for record in block.chunks_exact(width) {
                if index.is_multiple_of(step) {
                    keys.push(self.key(&self.layout.read_face(record)));
                }
                index += 1;
            }
        }
        let mut cuts = cuts(&mut keys, parts);
        // What lies below the least key of the sample is an empty piece, or nearly.
        cuts.retain(|&cut| keys.first().is_some_and(|&least| cut > least));
        Ok(cuts)
    }

    fn distribute_again(&self, file: SpillFile, cuts: &[u128]) -> Result<Vec<SpillFile>, InputError> {
        let mut buckets = Buckets::create(self.scratch, "faces", cuts.len() + 1, self.memory / 2);
        let mut reader = file.reader()?;
        while let Some(block) = reader.next_block()? {
            for record in block.chunks_exact(self.layout.face_record()) {
                buckets.write(piece(cuts, self.key(&self.layout.read_face(record))), record)?;
            }
        }
        Ok(buckets.finish()?)
    }

    /// Sorts `records`, which ascend by id, along the curve and writes them as blocks.
    fn write_sorted(&mut self, records: &[u8]) -> Result<(), InputError> {
        let width = self.layout.face_record();
        let face = |i: u32| self.layout.read_face(&records[i as usize * width..][..width]);
        let count = (records.len() / width) as u32;
        let mut order: Vec<(u128, u32)> =
            (0..count).into_par_iter().map(|i| (self.key(&face(i)), i)).collect();
        // Records in one place stay in the order of their ids; no two entries are equal.
        order.par_sort_unstable();
        let encoded = |faces: &[(u128, u32)]| {
            let mut faces: Vec<u32> = faces.iter().map(|entry| entry.1).collect();
            faces.sort_unstable();
            encode(&self.layout, &faces.into_iter().map(face).collect::<Vec<_>>())
        };
        let blocks: Vec<&[(u128, u32)]> = order.chunks(self.block).collect();
        for batch in blocks.chunks(2 * rayon::current_num_threads()) {
            let encoded: Vec<(Vec<u8>, BlockSummary)> = batch.par_iter().map(|b| encoded(b)).collect();
            for (payload, summary) in encoded {
                self.extents.push(self.out.write_block(&payload)?);
                self.summaries.push(summary);
                (self.progress)(u64::from(summary.faces));
            }
        }
        Ok(())
    }
}
