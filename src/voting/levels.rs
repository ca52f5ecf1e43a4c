//! Local levels: a quantile of some quantity over the 27 lattice cubes around a point (`level(x, q)` in ALGORITHM.md).
//!
//! In: samples (position, value). Out: a level for each cube asked about. The histograms are integers with eight bins
//! an octave, so that neither the order of the samples nor the tile they came from matters. A cube keeps its samples'
//! bins rather than a histogram: most cubes hold a few dozen samples and a histogram would be far larger.

use crate::partition::{Cube, CubeBox, Lattice};
use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Bins an octave, as a power of two: the top mantissa bits that a bin keeps.
const OCTAVE_BITS: u32 = 3;
/// Smallest binary exponent that is told apart; everything below reads as zero. A chord or an angle of 2^-30 is rounding.
const LEAST_EXPONENT: i64 = -30;
/// Exponents from 2^-30 to 2^9: wider than any chord or angle.
const BINS: usize = 40 << OCTAVE_BITS;

/// The samples of each cube, ready for quantiles.
pub struct Levels {
    slots: FxHashMap<Cube, u32>,
    /// Samples of slot i are `bins[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    bins: Vec<u16>,
}

impl Levels {
    /// Sorts `samples` (position, value of at least 0) into cubes.
    pub fn new(lattice: &Lattice, samples: impl Iterator<Item = (DVec3, f64)>) -> Levels {
        let mut slots: FxHashMap<Cube, u32> = FxHashMap::default();
        // Neighbouring samples mostly share a cube.
        let mut last: Option<(Cube, u32)> = None;
        let keyed: Vec<(u32, u16)> = samples
            .map(|(position, value)| {
                let cube = lattice.cube_of(position);
                let slot = match last {
                    Some((c, slot)) if c == cube => slot,
                    _ => {
                        let next = slots.len() as u32;
                        *slots.entry(cube).or_insert(next)
                    }
                };
                last = Some((cube, slot));
                (slot, bin(value))
            })
            .collect();
        let mut starts = vec![0u32; slots.len() + 1];
        keyed.iter().for_each(|(slot, _)| starts[*slot as usize + 1] += 1);
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut bins = vec![0u16; keyed.len()];
        for (slot, bin) in keyed {
            bins[next[slot as usize] as usize] = bin;
            next[slot as usize] += 1;
        }
        Levels { slots, starts, bins }
    }

    /// The `quantile` of all samples in the 27 cubes around `cube`; 0 if there are none.
    pub fn at(&self, cube: Cube, quantile: f64) -> f64 {
        let mut histogram = [0u32; BINS];
        let mut count = 0u64;
        for slot in CubeBox::around(cube).cubes().filter_map(|c| self.slots.get(&c)) {
            let samples =
                &self.bins[self.starts[*slot as usize] as usize..self.starts[*slot as usize + 1] as usize];
            samples.iter().for_each(|&b| histogram[b as usize] += 1);
            count += samples.len() as u64;
        }
        if count == 0 {
            return 0.0;
        }
        let rank = (quantile * (count - 1) as f64) as u64;
        let mut below = 0u64;
        let found = histogram.iter().position(|&n| {
            below += u64::from(n);
            below > rank
        });
        found.map_or(0.0, centre)
    }

    /// Levels at many cubes at once: the level of `cubes[i]` is in the result's i-th place.
    pub fn at_each(&self, cubes: &[Cube], quantile: f64) -> Vec<f64> {
        each_distinct(cubes, |c| self.at(c, quantile))
    }
}

/// `value` at each of `cubes`, worked out once for each distinct one.
pub(super) fn each_distinct<T: Copy + Send + Sync>(
    cubes: &[Cube],
    value: impl Fn(Cube) -> T + Sync,
) -> Vec<T> {
    // Neighbouring elements mostly share a cube: what is left after the first pass is short enough to sort.
    let mut distinct: Vec<Cube> = cubes.chunk_by(|a, b| a == b).map(|same| same[0]).collect();
    distinct.par_sort_unstable();
    distinct.dedup();
    let values: Vec<(Cube, T)> = distinct.par_iter().map(|&c| (c, value(c))).collect();
    let table: FxHashMap<Cube, T> = values.into_iter().collect();
    let looked_up = |of_last: &mut Option<(Cube, T)>, &cube: &Cube| match of_last {
        Some((last, value)) if *last == cube => *value,
        _ => of_last.insert((cube, table[&cube])).1,
    };
    cubes.par_iter().with_min_len(4096).map_init(|| None, looked_up).collect()
}

/// Bin of a value: binary exponent and top mantissa bits.
fn bin(x: f64) -> u16 {
    let smallest = f64::from_bits(((1023 + LEAST_EXPONENT) as u64) << 52);
    let bits = x.max(smallest).to_bits();
    // The exponent of a mantissa in [1/2, 1), as `frexp` gives it: one more than that of a mantissa in [1, 2).
    let exponent = (bits >> 52) as i64 - 1023 + 1 - LEAST_EXPONENT;
    let top = (bits >> (52 - OCTAVE_BITS)) as i64 & ((1 << OCTAVE_BITS) - 1);
    ((exponent << OCTAVE_BITS) + top).min(BINS as i64 - 1) as u16
}

/// Centre of a bin; the lowest reads as zero.
fn centre(bin: usize) -> f64 {
    let octave = 1usize << OCTAVE_BITS;
    if bin <= octave {
        return 0.0;
    }
    let mantissa = 0.5 + ((bin % octave) as f64 + 0.5) / (2 * octave) as f64;
    mantissa * f64::from_bits((1023 + (bin / octave) as i64 + LEAST_EXPONENT) as u64 * (1 << 52))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_hold_their_centres() {
        for x in [1.0, 0.9999, 0.001, 2.0, 1.125, 1.12499] {
            let c = centre(bin(x) as usize);
            assert!((c / x - 1.0).abs() <= 1.0 / 16.0 + 1e-9, "{x} {c}");
        }
        assert_eq!(centre(bin(0.0) as usize), 0.0);
        assert_eq!(centre(bin(1e-10) as usize), 0.0);
        assert_eq!(centre(bin(1.0) as usize), 1.0625);
    }

    #[test]
    fn levels_are_quantiles_of_the_neighbourhood() {
        let lattice = Lattice { origin: DVec3::ZERO, edge: 1.0 };
        let samples = (0..100).map(|i| (DVec3::splat(0.01 * f64::from(i)), f64::from(i)));
        let levels = Levels::new(&lattice, samples.chain([(DVec3::splat(3.5), 1000.0)]));
        // The 50th of 0..=99 is 49, in the bin from 48 to 52.
        assert_eq!(levels.at([0; 3], 0.5), 50.0);
        assert_eq!(levels.at([1; 3], 0.5), 50.0);
        assert_eq!(levels.at([9; 3], 0.5), 0.0);
        assert_eq!(levels.at_each(&[[1; 3], [9; 3], [0; 3]], 0.5), [50.0, 0.0, 50.0]);
    }
}
