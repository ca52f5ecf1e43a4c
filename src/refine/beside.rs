//! Which of a few faces share an edge.
//!
//! In: the corners of some faces. Out: for each the others that have an edge in common with it, edge by edge, ascending: all
//! of them where an edge is not manifold. Edges meet in a small table of chains, whose memory is used again: patches are
//! made for every vertex of a line.

/// Faces of a patch that share an edge.
#[derive(Default)]
pub(super) struct Beside {
    /// First side of each chain, and the next one of each side; [`END`] behind the last.
    heads: Vec<u32>,
    sides: Vec<Side>,
    /// Pairs of a side and a face, as they were found.
    pairs: Vec<(u32, u32)>,
    /// The faces beside side i are `items[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    items: Vec<u32>,
}

/// One side of a face; its number is three times that of the face, and that within the face.
struct Side {
    /// Both ends, the lower one first.
    edge: (u32, u32),
    next: u32,
}

/// Behind the last side of a chain.
const END: u32 = u32::MAX;
/// The least number of chains.
const CHAINS: usize = 64;

impl Beside {
    /// Looks which of the faces with these corners share edges.
    pub fn build(&mut self, faces: impl ExactSizeIterator<Item = [u32; 3]>) {
        let Beside { heads, sides, pairs, .. } = self;
        let chains = (3 * faces.len()).next_power_of_two().max(CHAINS);
        heads.clear();
        heads.resize(chains, END);
        sides.clear();
        pairs.clear();
        for (f, [a, b, c]) in faces.enumerate() {
            for (a, b) in [(a, b), (b, c), (c, a)] {
                let edge = (a.min(b), a.max(b));
                let number = sides.len() as u32;
                let head = &mut heads[chain_of(edge, chains)];
                let mut at = *head;
                while at != END {
                    let side = &sides[at as usize];
                    if side.edge == edge && at / 3 != f as u32 {
                        pairs.extend([(at, f as u32), (number, at / 3)]);
                    }
                    at = side.next;
                }
                sides.push(Side { edge, next: *head });
                *head = number;
            }
        }
        self.sort();
    }

    /// Pairs by side; those of a side by face.
    fn sort(&mut self) {
        let Beside { sides, pairs, starts, items, .. } = self;
        starts.clear();
        starts.resize(sides.len() + 1, 0);
        pairs.iter().for_each(|(side, _)| starts[*side as usize + 1] += 1);
        for i in 0..sides.len() {
            starts[i + 1] += starts[i];
        }
        items.clear();
        items.resize(pairs.len(), END);
        for &(side, face) in &*pairs {
            // Insertion into its row: rows have one item wherever the mesh is manifold.
            let row = &mut items[starts[side as usize] as usize..starts[side as usize + 1] as usize];
            let filled = row.partition_point(|&f| f != END);
            let at = row[..filled].partition_point(|&f| f < face);
            row[at..=filled].rotate_right(1);
            row[at] = face;
        }
    }

    /// The faces beside face `i`: those over its first edge, its second, its third.
    pub fn of(&self, i: u32) -> &[u32] {
        let first = 3 * i as usize;
        &self.items[self.starts[first] as usize..self.starts[first + 3] as usize]
    }
}

/// The chain of an edge. Ends of neighbouring edges have neighbouring numbers: a product spreads them.
fn chain_of((a, b): (u32, u32), chains: usize) -> usize {
    let key = u64::from(a) << 32 | u64::from(b);
    (key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as usize & (chains - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_know_their_neighbours_edge_by_edge() {
        let mut beside = Beside::default();
        // A fan of three faces at the edge 0-1, and one beside the second.
        for _ in 0..2 {
            beside.build([[0, 1, 2], [1, 0, 3], [4, 0, 1], [3, 0, 9]].into_iter());
            assert_eq!(beside.of(0), [1, 2]);
            assert_eq!(beside.of(1), [0, 2, 3]);
            assert_eq!(beside.of(2), [0, 1]);
            assert_eq!(beside.of(3), [1]);
        }
        beside.build([[7, 8, 9]].into_iter());
        assert_eq!(beside.of(0), [0; 0]);
    }
}
