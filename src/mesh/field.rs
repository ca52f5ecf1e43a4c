//! A value per vertex or face of a tile, known only where the halo allowed it to be computed.
//!
//! In builds with debug assertions every read of an unknown value panics: a halo that is too thin is then a failed test
//! and not a wrong line. Release builds carry no trace of this.

use rayon::prelude::*;

/// A value for each local index, some of them unknown.
#[derive(Clone, Debug)]
pub struct Field<T> {
    values: Vec<T>,
    #[cfg(debug_assertions)]
    known: Vec<bool>,
}

impl<T: Copy + Default + Send + Sync> Field<T> {
    /// Computes the value at each index of `at` (in parallel) in an array of `len`; the rest stays unknown.
    pub fn compute(len: usize, at: &[u32], value: impl Fn(u32) -> T + Sync) -> Field<T> {
        let known = Known::new(len, at);
        let values = (0..len as u32)
            .into_par_iter()
            .with_min_len(256)
            .map(|i| if known.has(i) { value(i) } else { T::default() })
            .collect();
        Field {
            values,
            #[cfg(debug_assertions)]
            known: (0..len as u32).map(|i| known.has(i)).collect(),
        }
    }

    /// Makes a new value of the old one at each index of `at` (in parallel), where it must be known.
    pub fn revise(&mut self, at: &[u32], value: impl Fn(T, u32) -> T + Sync) {
        let asked = Known::new(self.values.len(), at);
        #[cfg(debug_assertions)]
        at.iter().for_each(|&i| _ = self.get(i));
        self.values.par_iter_mut().with_min_len(256).enumerate().for_each(|(i, slot)| {
            if asked.has(i as u32) {
                *slot = value(*slot, i as u32);
            }
        });
    }

    /// From here on only values at `at` count as known.
    pub fn restrict(&mut self, at: &[u32]) {
        #[cfg(debug_assertions)]
        {
            let asked = Known::new(self.values.len(), at);
            self.known.iter_mut().zip(0..).for_each(|(known, i)| *known &= asked.has(i));
        }
        // Release builds carry no trace of what is known.
        let _ = at;
    }

    /// The value at local index `i`.
    #[inline]
    #[track_caller]
    pub fn get(&self, i: u32) -> T {
        #[cfg(debug_assertions)]
        assert!(self.known[i as usize], "local index {i} lies outside what the halo covers");
        self.values[i as usize]
    }

    /// The largest known value by `key`, 0 if there is none.
    pub fn max_over(&self, at: &[u32], key: impl Fn(T) -> f64) -> f64 {
        at.iter().map(|&i| key(self.get(i))).fold(0.0, f64::max)
    }
}

/// Where values are asked for. A bit for each index: what is asked for is most of a tile, and walking along the tile is
/// faster than following a list, and needs no second array to collect into.
struct Known {
    words: Vec<u64>,
    /// All of them.
    all: bool,
}

impl Known {
    fn new(len: usize, at: &[u32]) -> Known {
        // Lists hold no index twice.
        if at.len() == len {
            return Known { words: Vec::new(), all: true };
        }
        let mut words = vec![0u64; len.div_ceil(64)];
        at.iter().for_each(|&i| words[i as usize / 64] |= 1 << (i % 64));
        Known { words, all: false }
    }

    #[inline]
    fn has(&self, i: u32) -> bool {
        self.all || self.words[i as usize / 64] >> (i % 64) & 1 == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values_are_read_back() {
        let mut field = Field::compute(5, &[1, 3], |i| i * 10);
        assert_eq!((field.get(1), field.get(3)), (10, 30));
        field.revise(&[3], |old, i| old + i);
        assert_eq!((field.get(1), field.get(3)), (10, 33));
        assert_eq!(Field::compute(3, &[0, 1, 2], |i| i).get(2), 2);
    }

    #[cfg(debug_assertions)]
    #[test]
    #[should_panic(expected = "halo")]
    fn what_a_field_is_restricted_from_is_not_read() {
        let mut field = Field::compute(5, &[1, 3], |i| i);
        field.restrict(&[1]);
        field.get(3);
    }

    #[cfg(debug_assertions)]
    #[test]
    #[should_panic(expected = "halo")]
    fn unknown_values_are_not() {
        Field::compute(5, &[1, 3], |i| i).get(2);
    }
}
