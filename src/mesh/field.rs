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
        // The whole tile, in order, needs no scatter.
        if at.len() == len && at.iter().enumerate().all(|(i, &v)| i == v as usize) {
            let values = (0..len as u32).into_par_iter().with_min_len(256).map(&value).collect();
            return Field {
                values,
                #[cfg(debug_assertions)]
                known: vec![true; len],
            };
        }
        let computed: Vec<T> = at.par_iter().with_min_len(256).map(|&i| value(i)).collect();
        let mut values = vec![T::default(); len];
        for (&i, x) in at.iter().zip(computed) {
            values[i as usize] = x;
        }
        Field {
            values,
            #[cfg(debug_assertions)]
            known: {
                let mut known = vec![false; len];
                at.iter().for_each(|&i| known[i as usize] = true);
                known
            },
        }
    }

    /// Overwrites the values at `at`, which become known.
    pub fn update(&mut self, at: &[u32], value: impl Fn(&Field<T>, u32) -> T + Sync) {
        let computed: Vec<T> = at.par_iter().with_min_len(256).map(|&i| value(self, i)).collect();
        for (&i, x) in at.iter().zip(computed) {
            self.values[i as usize] = x;
            #[cfg(debug_assertions)]
            {
                self.known[i as usize] = true;
            }
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values_are_read_back() {
        let mut field = Field::compute(5, &[1, 3], |i| i * 10);
        assert_eq!((field.get(1), field.get(3)), (10, 30));
        field.update(&[3], |old, i| old.get(i) + 1);
        assert_eq!(field.get(3), 31);
        assert_eq!(Field::compute(3, &[0, 1, 2], |i| i).get(2), 2);
    }

    #[cfg(debug_assertions)]
    #[test]
    #[should_panic(expected = "halo")]
    fn unknown_values_are_not() {
        Field::compute(5, &[1, 3], |i| i).get(2);
    }
}
