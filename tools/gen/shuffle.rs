//! The worst order: every record of a file at a place of its own choosing.
//!
//! In: how many records, a seed; out: a pseudo-random permutation that is a function of the place, and files that are
//! written in it without holding them. Records go to buckets first, each a temporary file for a run of places; then each
//! bucket is put in order in memory and written. Memory is that of one bucket and a buffer for each.

use super::random::Random;
use anyhow::{Context, Result};
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Seek, Write};
use std::path::Path;

/// Rounds of the network: four make a permutation that looks random (Luby and Rackoff).
const ROUNDS: usize = 4;
/// Buckets of a file, at most: open files and buffers are bounded, too.
const MOST_BUCKETS: u64 = 192;
/// Smallest bucket: smaller ones save nothing.
const LEAST_BUCKET: u64 = 1 << 16;
/// Bytes that are held back for each bucket.
const BUFFER: usize = 1 << 16;

/// A permutation of `0 .. count`: a Feistel network over the next power of four, walked until it stays inside.
#[derive(Clone, Debug)]
pub struct Permutation {
    count: u64,
    half_bits: u32,
    keys: [u64; ROUNDS],
}

impl Permutation {
    /// The one of a seed and a stream.
    pub fn new(count: u64, seed: u64, stream: &str) -> Self {
        let bits = u64::BITS - count.saturating_sub(1).leading_zeros();
        let mut random = Random::new(seed, stream);
        Self { count, half_bits: bits.div_ceil(2).max(1), keys: [(); ROUNDS].map(|()| random.next()) }
    }

    /// Where `index`, which must be below the count, goes.
    pub fn at(&self, index: u64) -> u64 {
        let mut walked = self.network(index);
        while walked >= self.count {
            walked = self.network(walked);
        }
        walked
    }

    fn network(&self, index: u64) -> u64 {
        let mask = (1 << self.half_bits) - 1;
        let (mut left, mut right) = (index >> self.half_bits, index & mask);
        for key in self.keys {
            (left, right) = (right, left ^ (Random::at(key, [right, 0, 0, 0]).next() & mask));
        }
        left << self.half_bits | right
    }
}

/// Records of one size on the way to their places.
#[derive(Debug)]
pub struct Buckets {
    record: usize,
    /// Places of a bucket.
    run: u64,
    count: u64,
    files: Vec<BufWriter<File>>,
}

impl Buckets {
    /// For `count` records of `record` bytes. Temporary files go to `directory` and have no name there.
    ///
    /// # Errors
    /// If they cannot be made.
    pub fn new(directory: &Path, count: u64, record: u64) -> Result<Self> {
        let run = count.div_ceil(MOST_BUCKETS).max(LEAST_BUCKET);
        let files = (0..count.div_ceil(run))
            .map(|_| Ok(BufWriter::with_capacity(BUFFER, tempfile::tempfile_in(directory)?)))
            .collect::<std::io::Result<_>>()
            .with_context(|| format!("cannot make temporary files in {}", directory.display()))?;
        Ok(Self { record: record as usize, run, count, files })
    }

    /// Takes the records in `bytes`; `places` says where each goes.
    ///
    /// # Errors
    /// If the disk is full.
    pub fn take(&mut self, places: &[u64], bytes: &[u8]) -> Result<()> {
        for (place, record) in places.iter().zip(bytes.chunks_exact(self.record)) {
            let file = &mut self.files[(place / self.run) as usize];
            let written = file
                .write_all(&((place % self.run) as u32).to_le_bytes())
                .and_then(|()| file.write_all(record));
            written.context("cannot write a temporary file")?;
        }
        Ok(())
    }

    /// Hands over all records in order, a bucket at a time, with the place of the first.
    ///
    /// # Errors
    /// If a bucket cannot be read, or `write` fails.
    pub fn finish(self, mut write: impl FnMut(u64, &[u8]) -> Result<()>) -> Result<()> {
        let failed = "cannot read a temporary file";
        let mut bytes = Vec::new();
        for (bucket, file) in (0..).zip(self.files) {
            let first = bucket * self.run;
            let places = self.run.min(self.count - first);
            let mut file = file.into_inner().context("cannot write a temporary file")?;
            file.rewind().context(failed)?;
            let mut file = BufReader::with_capacity(1 << 20, file);
            bytes.resize(places as usize * self.record, 0);
            for _ in 0..places {
                let mut place = [0; 4];
                file.read_exact(&mut place).context(failed)?;
                let at = u32::from_le_bytes(place) as usize * self.record;
                file.read_exact(&mut bytes[at..at + self.record]).context(failed)?;
            }
            write(first, &bytes)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_is_taken_once() {
        for count in [1, 2, 5, 1000, 4097] {
            let permutation = Permutation::new(count, 3, "test");
            let mut places: Vec<u64> = (0..count).map(|index| permutation.at(index)).collect();
            let neighbours = places.windows(2).filter(|pair| pair[0].abs_diff(pair[1]) < 10).count();
            assert!(count < 100 || neighbours < count as usize / 20, "{neighbours} of {count}");
            places.sort_unstable();
            assert!(places.iter().copied().eq(0..count));
        }
    }

    #[test]
    fn records_come_out_where_they_belong() {
        let count = 2 * LEAST_BUCKET + 77;
        let permutation = Permutation::new(count, 1, "test");
        let places: Vec<u64> = (0..count).map(|index| permutation.at(index)).collect();
        let bytes: Vec<u8> = (0..count).flat_map(|index| (index as u32).to_le_bytes()).collect();
        let mut buckets = Buckets::new(&std::env::temp_dir(), count, 4).unwrap();
        buckets.take(&places, &bytes).unwrap();
        let mut all = Vec::new();
        buckets
            .finish(|first, bytes| {
                assert_eq!(first as usize * 4, all.len());
                all.extend_from_slice(bytes);
                Ok(())
            })
            .unwrap();
        for (index, place) in places.iter().enumerate() {
            let at = *place as usize * 4;
            assert_eq!(all[at..at + 4], (index as u32).to_le_bytes());
        }
    }
}
