//! Lists of lists in two arrays (compressed sparse rows).

use rayon::prelude::*;

/// Rows handled by one parallel task.
const ROWS: usize = 4096;

/// Row i is `items[offsets[i]..offsets[i + 1]]`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Csr {
    offsets: Vec<u32>,
    items: Vec<u32>,
}

impl Csr {
    /// From the length of each row and all items, row after row.
    ///
    /// # Panics
    /// If the lengths do not add up to the number of items, or that number exceeds 32 bits; tiles are kept below that.
    pub fn from_rows(lengths: impl Iterator<Item = u32>, items: Vec<u32>) -> Csr {
        let mut offsets = vec![0u32];
        let mut end = 0u32;
        offsets.extend(lengths.map(|n| {
            end = end.checked_add(n).expect("a tile has fewer than 2^32 adjacencies");
            end
        }));
        assert_eq!(end as usize, items.len());
        Csr { offsets, items }
    }

    /// Inverts "item -> three rows" to "row -> ascending items" by counting.
    pub fn invert(rows: usize, triples: &[[u32; 3]]) -> Csr {
        let mut offsets = vec![0u32; rows + 1];
        for v in triples.iter().flatten() {
            offsets[*v as usize + 1] += 1;
        }
        for i in 0..rows {
            offsets[i + 1] += offsets[i];
        }
        let mut next = offsets.clone();
        let mut items = vec![0u32; 3 * triples.len()];
        for (f, triple) in triples.iter().enumerate() {
            for v in triple {
                let slot = &mut next[*v as usize];
                items[*slot as usize] = f as u32;
                *slot += 1;
            }
        }
        Csr { offsets, items }
    }

    /// Sorts each row by `key`, in parallel.
    pub fn sort_rows_by_key<K: Ord>(&mut self, key: impl Fn(u32) -> K + Sync) {
        let mut rest = self.items.as_mut_slice();
        let chunks: Vec<(&[u32], &mut [u32])> = (0..self.offsets.len().saturating_sub(1))
            .step_by(ROWS)
            .map(|first| {
                let offsets = &self.offsets[first..(first + ROWS + 1).min(self.offsets.len())];
                let length = (offsets[offsets.len() - 1] - offsets[0]) as usize;
                let (items, others) = std::mem::take(&mut rest).split_at_mut(length);
                rest = others;
                (offsets, items)
            })
            .collect();
        chunks.into_par_iter().for_each(|(offsets, mut items)| {
            for span in offsets.windows(2) {
                let (row, others) = items.split_at_mut((span[1] - span[0]) as usize);
                row.sort_unstable_by_key(|&item| key(item));
                items = others;
            }
        });
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    /// The items of row `i`.
    #[inline]
    pub fn row(&self, i: u32) -> &[u32] {
        &self.items[self.span(i)]
    }

    /// Where row `i` lies in the item array, for arrays that run parallel to it.
    #[inline]
    pub fn span(&self, i: u32) -> std::ops::Range<usize> {
        self.offsets[i as usize] as usize..self.offsets[i as usize + 1] as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_sorted_each_for_itself() {
        let lengths = [3u32, 0, 2, 4];
        let rows: u32 = 3 * ROWS as u32 + 5;
        let lengths: Vec<u32> = (0..rows).map(|row| lengths[row as usize % 4]).collect();
        let items: Vec<u32> = (0..lengths.iter().sum()).collect();
        let mut sorted = Csr::from_rows(lengths.iter().copied(), items);
        let before = sorted.clone();
        sorted.sort_rows_by_key(std::cmp::Reverse);
        for row in 0..rows {
            let expected: Vec<u32> = before.row(row).iter().rev().copied().collect();
            assert_eq!(sorted.row(row), expected);
        }
    }
}
