//! Local levels: a quantile of some quantity over the 27 lattice cubes around a point (`level(x, q)` in ALGORITHM.md).
//!
//! In: samples (position, value). Out: a level for each cube asked about. The histograms are integers with eight bins
//! an octave, so that neither the order of the samples nor the tile they came from matters. A cube holds a few dozen samples
//! and keeps only those bins that are not empty: adding up 27 of these lists is several times faster than counting their
//! samples, and takes less memory.

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

/// A histogram for each cube, ready for quantiles.
pub struct Levels {
    /// Numbers of the cubes with samples.
    numbers: FxHashMap<Cube, u32>,
    /// Samples were counted in chunks; chunks `parts[starts[i]..starts[i + 1]]` have some in cube i.
    starts: Vec<u32>,
    parts: Vec<Part>,
    chunks: Vec<Histograms>,
}

/// A part of the histogram of a cube: that with this number among those of a chunk.
#[derive(Clone, Copy, Default)]
struct Part {
    chunk: u32,
    number: u32,
}

impl Levels {
    /// Sorts samples (position, value of at least 0) into cubes: those of each of `chunks` by itself, in parallel.
    pub fn new<S: Iterator<Item = (DVec3, f64)>>(
        lattice: &Lattice,
        chunks: impl IndexedParallelIterator<Item = S>,
    ) -> Levels {
        let of_chunk = |samples: S| {
            let mut numbers = Numbers::default();
            let keyed: Vec<(u32, u16)> = samples
                .map(|(position, value)| (numbers.of(lattice.cube_of(position)), bin(value)))
                .collect();
            (Histograms::new(numbers.cubes.len(), &keyed), numbers.cubes)
        };
        let (chunks, cubes): (Vec<Histograms>, Vec<Vec<Cube>>) = chunks.map(of_chunk).unzip();
        let mut numbers = Numbers::default();
        let of_chunks: Vec<Vec<u32>> = cubes.iter().map(|cubes| numbers.of_all(cubes)).collect();
        let mut starts = vec![0u32; numbers.cubes.len() + 1];
        of_chunks.iter().flatten().for_each(|&i| starts[i as usize + 1] += 1);
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut parts = vec![Part::default(); starts[starts.len() - 1] as usize];
        for (chunk, of_chunk) in (0..).zip(&of_chunks) {
            for (number, &i) in (0..).zip(of_chunk) {
                parts[next[i as usize] as usize] = Part { chunk, number };
                next[i as usize] += 1;
            }
        }
        Levels { numbers: numbers.known, starts, parts, chunks }
    }

    /// The `quantile` of all samples in the 27 cubes around `cube`; 0 if there are none.
    pub fn at(&self, cube: Cube, quantile: f64) -> f64 {
        let mut histogram = [0u32; BINS];
        let mut count = 0u64;
        for i in CubeBox::around(cube).cubes().filter_map(|c| self.numbers.get(&c)) {
            for part in &self.parts[self.starts[*i as usize] as usize..self.starts[*i as usize + 1] as usize]
            {
                for &(bin, n) in self.chunks[part.chunk as usize].of(part.number) {
                    histogram[bin as usize] += n;
                    count += u64::from(n);
                }
            }
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

    /// Levels at many points at once: that of `point(i)` is in the result's i-th place, for each i below `count`.
    pub fn at_each(
        &self,
        lattice: &Lattice,
        count: usize,
        point: impl Fn(usize) -> DVec3 + Sync,
        quantile: f64,
    ) -> Vec<f64> {
        at_each(lattice, count, point, |cube| self.at(cube, quantile))
    }
}

/// Points numbered by one parallel task: many times more than there are in a cube.
const CHUNK: usize = 4096;

/// `value` of the cube of each of `count` points, worked out once for each cube.
pub(super) fn at_each<T: Copy + Send + Sync>(
    lattice: &Lattice,
    count: usize,
    point: impl Fn(usize) -> DVec3 + Sync,
    value: impl Fn(Cube) -> T + Sync,
) -> Vec<T> {
    let of_chunk = |chunk: usize| {
        let mut numbers = Numbers::default();
        let points = chunk * CHUNK..count.min((chunk + 1) * CHUNK);
        let keyed: Vec<u32> = points.map(|i| numbers.of(lattice.cube_of(point(i)))).collect();
        (numbers.cubes, keyed)
    };
    let chunks: Vec<Numbered> = (0..count.div_ceil(CHUNK)).into_par_iter().map(of_chunk).collect();
    let mut numbers = Numbers::default();
    let slots: Vec<Vec<u32>> = chunks.iter().map(|(cubes, _)| numbers.of_all(cubes)).collect();
    let values: Vec<T> = numbers.cubes.par_iter().map(|&cube| value(cube)).collect();
    let Some(&any) = values.first() else { return Vec::new() };
    let mut all = vec![any; count];
    all.par_chunks_mut(CHUNK).zip(&chunks).zip(&slots).for_each(|((all, (_, keyed)), slots)| {
        let of_cubes: Vec<T> = slots.iter().map(|&slot| values[slot as usize]).collect();
        all.iter_mut().zip(keyed).for_each(|(one, &number)| *one = of_cubes[number as usize]);
    });
    all
}

/// Histograms of some cubes by number: bins that are not empty, and how many samples are in each.
struct Histograms {
    /// Where that of each cube ends.
    ends: Vec<u32>,
    counts: Vec<(u16, u32)>,
}

impl Histograms {
    /// Those of `cubes` cubes with these samples, each a number of a cube and a bin.
    fn new(cubes: usize, samples: &[(u32, u16)]) -> Histograms {
        let mut starts = vec![0u32; cubes + 1];
        samples.iter().for_each(|(number, _)| starts[*number as usize + 1] += 1);
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut bins = vec![0u16; samples.len()];
        for (number, bin) in samples {
            let next = &mut next[*number as usize];
            bins[*next as usize] = *bin;
            *next += 1;
        }
        let mut histogram = [0u32; BINS];
        let (mut ends, mut counts) = (Vec::with_capacity(cubes), Vec::new());
        for span in starts.windows(2) {
            let first = counts.len();
            for &bin in &bins[span[0] as usize..span[1] as usize] {
                let count = &mut histogram[bin as usize];
                *count += 1;
                if *count == 1 {
                    counts.push((bin, 0));
                }
            }
            counts[first..]
                .iter_mut()
                .for_each(|(bin, n)| *n = std::mem::take(&mut histogram[*bin as usize]));
            ends.push(counts.len() as u32);
        }
        Histograms { ends, counts }
    }

    fn of(&self, number: u32) -> &[(u16, u32)] {
        let first = number.checked_sub(1).map_or(0, |before| self.ends[before as usize]);
        &self.counts[first as usize..self.ends[number as usize] as usize]
    }
}

/// The cubes of one chunk of points, by number, and the number of the cube of each point.
type Numbered = (Vec<Cube>, Vec<u32>);

/// Numbers of cubes, in the order in which they are met.
#[derive(Default)]
struct Numbers {
    cubes: Vec<Cube>,
    known: FxHashMap<Cube, u32>,
    last: Option<(Cube, u32)>,
}

impl Numbers {
    /// The number of `cube`; a new one if it is met for the first time.
    #[inline]
    fn of(&mut self, cube: Cube) -> u32 {
        // Neighbours mostly share a cube.
        match self.last {
            Some((last, number)) if last == cube => number,
            _ => self.look_up(cube),
        }
    }

    fn look_up(&mut self, cube: Cube) -> u32 {
        let next = self.cubes.len() as u32;
        let number = *self.known.entry(cube).or_insert(next);
        if number == next {
            self.cubes.push(cube);
        }
        self.last = Some((cube, number));
        number
    }

    fn of_all(&mut self, cubes: &[Cube]) -> Vec<u32> {
        cubes.iter().map(|&cube| self.of(cube)).collect()
    }
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
        let samples: Vec<(DVec3, f64)> = samples.chain([(DVec3::splat(3.5), 1000.0)]).collect();
        let levels = Levels::new(&lattice, samples.par_chunks(7).map(|chunk| chunk.iter().copied()));
        // The 50th of 0..=99 is 49, in the bin from 48 to 52.
        assert_eq!(levels.at([0; 3], 0.5), 50.0);
        assert_eq!(levels.at([1; 3], 0.5), 50.0);
        assert_eq!(levels.at([9; 3], 0.5), 0.0);
        let points = [1.5, 9.5, 0.5].map(DVec3::splat);
        assert_eq!(levels.at_each(&lattice, 3, |i| points[i], 0.5), [50.0, 0.0, 50.0]);
        let many = levels.at_each(&lattice, 3 * CHUNK, |i| points[i % 3], 0.5);
        assert!((0..many.len()).all(|i| many[i] == [50.0, 0.0, 50.0][i % 3]));
    }
}
