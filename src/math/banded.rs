//! Symmetric positive definite systems whose entries lie near the diagonal, solved by Cholesky's method.
//!
//! Without pivoting and without fill outside the band: the operations and their order depend on the size alone.

/// The lower half of a banded symmetric matrix.
#[derive(Clone, Debug)]
pub struct Banded {
    /// Entries below the diagonal in each row.
    below: usize,
    /// Row after row: the entries before the diagonal, from the farthest on, then the diagonal.
    entries: Vec<f64>,
}

impl Banded {
    /// A matrix of zeros with `rows` rows; row i has entries in columns i - `below` to i.
    pub fn new(rows: usize, below: usize) -> Banded {
        Banded { below, entries: vec![0.0; rows * (below + 1)] }
    }

    fn place(&self, row: usize, column: usize) -> usize {
        row * (self.below + 1) + self.below - (row - column)
    }

    /// Adds to the entry in `row` and `column`; entries above the diagonal are those below it and are passed over.
    ///
    /// # Panics
    /// If the entry lies outside the band.
    pub fn add(&mut self, row: usize, column: usize, x: f64) {
        if row >= column {
            assert!(row - column <= self.below, "entry {row}, {column} lies outside the band");
            let place = self.place(row, column);
            self.entries[place] += x;
        }
    }

    /// Solves for `x`, the right side, in place.
    pub fn solve(mut self, x: &mut [f64]) {
        for i in 0..x.len() {
            let first = i.saturating_sub(self.below);
            for j in first..=i {
                let from = first.max(j.saturating_sub(self.below));
                let mut sum = self.entries[self.place(i, j)];
                for k in from..j {
                    sum -= self.entries[self.place(i, k)] * self.entries[self.place(j, k)];
                }
                let place = self.place(i, j);
                self.entries[place] = if i == j { sum.sqrt() } else { sum / self.entries[self.place(j, j)] };
            }
            let known = (first..i).fold(x[i], |sum, k| sum - self.entries[self.place(i, k)] * x[k]);
            x[i] = known / self.entries[self.place(i, i)];
        }
        for i in (0..x.len()).rev() {
            x[i] /= self.entries[self.place(i, i)];
            for k in i.saturating_sub(self.below)..i {
                x[k] -= self.entries[self.place(i, k)] * x[i];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_nalgebra() {
        let (rows, below) = (40, 5);
        let entry = |i: usize, j: usize| match i.abs_diff(j) {
            0 => 9.0 + (i % 3) as f64,
            d if d <= below => libm::sin((i * j) as f64) / d as f64,
            _ => 0.0,
        };
        let mut banded = Banded::new(rows, below);
        (0..rows).for_each(|i| {
            (i.saturating_sub(below)..rows.min(i + below)).for_each(|j| banded.add(i, j, entry(i, j)))
        });
        let dense = nalgebra::DMatrix::from_fn(rows, rows, entry);
        let right = nalgebra::DVector::from_fn(rows, |i, _| libm::cos(i as f64));
        let expected = dense.cholesky().expect("a positive definite matrix").solve(&right);
        let mut x: Vec<f64> = right.iter().copied().collect();
        banded.solve(&mut x);
        for (x, y) in x.iter().zip(expected.iter()) {
            assert!((x - y).abs() < 1e-12, "{x} {y}");
        }
    }
}
