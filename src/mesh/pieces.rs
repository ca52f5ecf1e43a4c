//! Arrays that are put together from parts by many tasks at once.
//!
//! The first touch of a page of memory costs more than writing it, so that one thread alone must not make a long array.

use rayon::prelude::*;

/// Elements handled by one parallel task: some pages.
const CHUNK: usize = 1 << 14;

/// `count` times `value`.
pub fn filled<T: Copy + Send + Sync>(count: usize, value: T) -> Vec<T> {
    rayon::iter::repeat_n(value, count).with_min_len(CHUNK).collect()
}

/// All of `parts`, one after the other.
pub fn concat<T: Copy + Default + Send + Sync>(parts: &[Vec<T>]) -> Vec<T> {
    let mut all = filled(parts.iter().map(Vec::len).sum(), T::default());
    let pieces = pieces(&mut all, parts.iter().map(Vec::len));
    pieces.into_par_iter().zip(parts).for_each(|(piece, part)| piece.copy_from_slice(part));
    all
}

/// Consecutive pieces of `all` with these lengths, which must not add up to more than there is.
pub fn pieces<T>(all: &mut [T], lengths: impl Iterator<Item = usize>) -> Vec<&mut [T]> {
    let mut rest = all;
    let mut next = |length| {
        let (piece, behind) = std::mem::take(&mut rest).split_at_mut(length);
        rest = behind;
        piece
    };
    lengths.map(&mut next).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_come_one_after_the_other() {
        let parts: Vec<Vec<u32>> = (0..200).map(|part| (0..part * 7 % 500).collect()).collect();
        assert_eq!(concat(&parts), parts.concat());
        assert!(concat::<u32>(&[]).is_empty());
    }

    #[test]
    fn pieces_are_those_asked_for() {
        let mut all = [1, 2, 3, 4, 5];
        assert_eq!(pieces(&mut all, [2, 0, 1].into_iter()), [&[1, 2][..], &[], &[3]]);
    }
}
