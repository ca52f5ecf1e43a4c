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
            let (f, rows) = (f as u32, [a, b, c].map(|v| faces_around.row(v)));
            if rows.iter().any(|row| row.len() > LONG) {
                let sides = [(0, 1), (1, 2), (2, 0)];
                return sides.map(|(i, j)| shared(rows[i], rows[j], f));
            }
            // The faces around two corners know the neighbours over all three sides.
            let mut found = [Found::default(); 3];
            for &g in rows[0] {
                let others = &corners[g as usize];
                found[0].meet(g, g != f && others.contains(&b));
                found[2].meet(g, g != f && others.contains(&c));
            }
            for &g in rows[1] {
                found[1].meet(g, g != f && corners[g as usize].contains(&c));
            }
            found.map(Found::told)
        };
        Across { over: corners.par_iter().enumerate().with_min_len(1024).map(beside).collect() }
    }

    /// Whether some face may have the same corners as another: only if they share more than one side.
    pub fn may_repeat(&self) -> bool {
        let repeats = |&[a, b, c]: &[u32; 3]| {
            let several = a == SEVERAL || b == SEVERAL || c == SEVERAL;
            several || (a == b && a != NOTHING)
        };
        self.over.par_iter().with_min_len(1024).any(repeats)
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

/// What was found beyond a side so far. Met without branches: which way they go cannot be guessed.
#[derive(Clone, Copy, Default)]
struct Found {
    last: u32,
    count: u32,
}

impl Found {
    #[inline]
    fn meet(&mut self, g: u32, here: bool) {
        self.last = if here { g } else { self.last };
        self.count += u32::from(here);
    }

    fn told(self) -> u32 {
        match self.count {
            0 => NOTHING,
            1 => self.last,
            _ => SEVERAL,
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
