//! Lists of lists in two arrays (compressed sparse rows).

use super::pieces::{filled, pieces};
use rayon::prelude::*;

/// Rows handled by one parallel task.
const ROWS: usize = 4096;
/// Items whose rows are looked at together.
const ITEMS: usize = 4096;
/// Tasks that share the rows when items are counted. Few: where items have no order, each of them looks at all.
const TASKS: usize = 4;

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

    /// Inverts "item -> three rows" to "row -> ascending items" by counting, in parallel. Tasks share the rows, not the items:
    /// each looks at those chunks of items that name one of its rows. Where items have some order that is its share of them.
    pub fn invert(rows: usize, triples: &[[u32; 3]]) -> Csr {
        let chunks: Vec<Chunk> = triples.par_chunks(ITEMS).enumerate().map(Chunk::new).collect();
        let per_task = rows.div_ceil(TASKS).max(ROWS);
        let mut offsets = filled(rows + 1, 0u32);
        offsets[1..].par_chunks_mut(per_task).enumerate().for_each(|(task, counts)| {
            named(&chunks, task * per_task, counts.len(), |_, row| counts[row] += 1);
        });
        for i in 0..rows {
            offsets[i + 1] += offsets[i];
        }
        let mut items = filled(3 * triples.len(), 0u32);
        let ends = || (0..rows).step_by(per_task).map(|first| offsets[rows.min(first + per_task)] as usize);
        let lengths = ends().scan(0, |begin, end| Some(end - std::mem::replace(begin, end)));
        let tasks = pieces(&mut items, lengths).into_par_iter().zip(offsets.par_chunks(per_task)).enumerate();
        tasks.for_each(|(task, (items, offsets))| {
            let mut next: Vec<u32> = offsets.iter().map(|offset| offset - offsets[0]).collect();
            named(&chunks, task * per_task, per_task.min(rows - task * per_task), |item, row| {
                items[next[row] as usize] = item;
                next[row] += 1;
            });
        });
        Csr { offsets, items }
    }

    /// Sorts each row by `key`, in parallel.
    pub fn sort_rows_by_key<K: Ord>(&mut self, key: impl Fn(u32) -> K + Sync) {
        let rows = self.offsets.len().saturating_sub(1);
        let chunks = (0..rows).step_by(ROWS).map(|first| &self.offsets[first..=rows.min(first + ROWS)]);
        let chunks: Vec<&[u32]> = chunks.collect();
        let length = |offsets: &&[u32]| (offsets[offsets.len() - 1] - offsets[0]) as usize;
        let items = pieces(&mut self.items, chunks.iter().map(length));
        items.into_par_iter().zip(chunks).for_each(|(mut items, offsets)| {
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

/// Consecutive items, and the lowest and the highest row that they name.
struct Chunk<'a> {
    first: u32,
    triples: &'a [[u32; 3]],
    low: usize,
    high: usize,
}

impl Chunk<'_> {
    fn new((number, triples): (usize, &[[u32; 3]])) -> Chunk<'_> {
        let rows = || triples.as_flattened().iter().copied();
        let [low, high] = [rows().min(), rows().max()].map(|row| row.unwrap_or(0) as usize);
        Chunk { first: (number * ITEMS) as u32, triples, low, high }
    }
}

/// Calls `visit` with each item that names one of `count` rows from `first` on, and the row, counted from there.
fn named(chunks: &[Chunk], first: usize, count: usize, mut visit: impl FnMut(u32, usize)) {
    for chunk in chunks.iter().filter(|chunk| chunk.low < first + count && chunk.high >= first) {
        for (item, triple) in (chunk.first..).zip(chunk.triples) {
            for row in triple {
                let row = (*row as usize).wrapping_sub(first);
                if row < count {
                    visit(item, row);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_name_the_items_that_name_them() {
        // In some order, and in none.
        for jump in [1, 7919] {
            let rows = 40_000u32;
            let triple = |item: u32| [0, 1, 2].map(|i| (item + 3 * i) * jump % rows);
            let triples: Vec<[u32; 3]> = (0..2 * rows).map(triple).collect();
            let mut expected = vec![Vec::new(); rows as usize];
            for (item, triple) in (0..).zip(&triples) {
                triple.iter().for_each(|row| expected[*row as usize].push(item));
            }
            let inverted = Csr::invert(rows as usize, &triples);
            assert!((0..rows).all(|row| inverted.row(row) == expected[row as usize]));
        }
        assert_eq!(Csr::invert(3, &[]).rows(), 3);
        assert_eq!(Csr::invert(0, &[]).rows(), 0);
    }

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
