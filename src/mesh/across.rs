//! Which face lies on the other side of each side of a face.
//!
//! In: corners and the faces around each vertex. Out: for each face and each of its sides the one other face there. Where an
//! edge has more than two faces, that is said, and they are looked up when they are asked for.

use super::Csr;
use rayon::prelude::*;

/// The faces beside each face, side by side; side i runs from corner i to the next.
#[derive(Debug, Default)]
pub struct Across {
    over: Vec<[u32; 3]>,
}

/// What lies beyond a side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beyond {
    /// Nothing that was loaded.
    Nothing,
    /// One face.
    One(u32),
    /// Several.
    Several,
}

const NOTHING: u32 = u32::MAX;
const SEVERAL: u32 = u32::MAX - 1;
/// Rows longer than this are searched rather than walked along.
const LONG: usize = 48;

impl Across {
    /// From all faces; in parallel.
    pub fn new(corners: &[[u32; 3]], faces_around: &Csr) -> Across {
        let beside = |(f, &[a, b, c]): (usize, &[u32; 3])| {
            let rows = [a, b, c].map(|v| faces_around.row(v));
            [
                shared(rows[0], rows[1], f as u32),
                shared(rows[1], rows[2], f as u32),
                shared(rows[2], rows[0], f as u32),
            ]
        };
        Across { over: corners.par_iter().enumerate().with_min_len(1024).map(beside).collect() }
    }

    /// What lies beyond side `side` of face `f`.
    #[inline]
    pub fn beyond(&self, f: u32, side: usize) -> Beyond {
        match self.over[f as usize][side] {
            NOTHING => Beyond::Nothing,
            SEVERAL => Beyond::Several,
            g => Beyond::One(g),
        }
    }
}

/// The one face but `f` that two ascending rows have in common.
fn shared(a: &[u32], b: &[u32], f: u32) -> u32 {
    let mut found = NOTHING;
    let (short, long) = if a.len() <= b.len() { (a, b) } else { (b, a) };
    if long.len() > LONG {
        for g in short.iter().filter(|&&g| g != f && long.binary_search(&g).is_ok()) {
            if found != NOTHING {
                return SEVERAL;
            }
            found = *g;
        }
        return found;
    }
    let (mut i, mut j) = (0, 0);
    while i < a.len() && j < b.len() {
        let (x, y) = (a[i], b[j]);
        if x == y && x != f {
            if found != NOTHING {
                return SEVERAL;
            }
            found = x;
        }
        i += usize::from(x <= y);
        j += usize::from(y <= x);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_side_knows_what_lies_beyond() {
        let corners = [[0, 1, 2], [1, 0, 3], [3, 0, 4], [5, 1, 2], [2, 1, 6]];
        let across = Across::new(&corners, &Csr::invert(7, &corners));
        assert_eq!(
            [0, 1, 2].map(|i| across.beyond(0, i)),
            [Beyond::One(1), Beyond::Several, Beyond::Nothing]
        );
        assert_eq!(across.beyond(1, 1), Beyond::One(2));
        assert_eq!(across.beyond(2, 0), Beyond::One(1));
        assert_eq!(across.beyond(3, 1), Beyond::Several);
    }

    #[test]
    fn around_a_vertex_of_many_faces_sides_are_found_too() {
        let n = 200;
        let fan: Vec<[u32; 3]> = (1..n).map(|i| [0, i, i + 1]).collect();
        let across = Across::new(&fan, &Csr::invert(n as usize + 1, &fan));
        assert_eq!(across.beyond(0, 0), Beyond::Nothing);
        for f in 1..n - 1 {
            assert_eq!(across.beyond(f, 0), Beyond::One(f - 1));
            assert_eq!(across.beyond(f - 1, 2), Beyond::One(f));
        }
    }
}
