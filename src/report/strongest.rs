//! Which lines a page shows if it cannot show all.
//!
//! In: all lines, one at a time. Out: as many whole lines as there is room for: creases by strength times length, then other
//! lines by length; of equals, the first. Whoever is left out is worth less than all that are chosen, whatever the order they
//! came in. No more is held than is chosen.

use super::data::is_crease;
use crate::stitch::Measures;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Lines by worth; of equals, the one with the lower id is worth more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Worth {
    crease: bool,
    /// Bits of a number that is not negative: they are ordered as it is.
    bits: u64,
    id: Reverse<u64>,
}

/// Takes lines and keeps the strongest.
pub struct Strongest {
    room: u64,
    taken: u64,
    /// The most that a line was worth that had to go: one that is worth less does not come in where there is room again.
    floor: Option<Worth>,
    /// The least worth on top, each with what it takes.
    kept: BinaryHeap<Reverse<(Worth, u64)>>,
}

/// Lines that are shown.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Chosen {
    /// Their ids, ascending.
    pub ids: Vec<u64>,
    /// Most edges of a line; longer ones are drawn through some of their vertices.
    pub most_edges: u64,
}

impl Strongest {
    /// Keeps no more than `room` edges.
    pub fn new(room: u64) -> Strongest {
        Strongest { room, taken: 0, floor: None, kept: BinaryHeap::new() }
    }

    /// One more line.
    pub fn offer(&mut self, id: u64, edges: u64, line: &Measures) {
        if self.room == 0 {
            return;
        }
        let crease = is_crease(line.class);
        let worth = if crease { line.length * line.strength } else { line.length };
        let worth = Worth { crease, bits: worth.max(0.0).to_bits(), id: Reverse(id) };
        if self.floor.is_some_and(|floor| worth < floor) {
            return;
        }
        let takes = edges.min(self.room);
        self.taken += takes;
        self.kept.push(Reverse((worth, takes)));
        while self.taken > self.room
            && let Some(Reverse((worth, takes))) = self.kept.pop()
        {
            self.taken -= takes;
            self.floor = self.floor.max(Some(worth));
        }
    }

    /// What was kept.
    pub fn finish(self) -> Chosen {
        let mut ids: Vec<u64> = self.kept.into_iter().map(|Reverse((worth, _))| worth.id.0).collect();
        ids.sort_unstable();
        Chosen { ids, most_edges: self.room }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refine::Bend;
    use crate::stitch::Class;

    fn chosen(room: u64, lines: &[(Class, f64, f64, u64)]) -> Vec<u64> {
        let mut strongest = Strongest::new(room);
        for (id, &(class, length, strength, edges)) in (0..).zip(lines) {
            let bend = Bend::Unknown;
            strongest.offer(
                id,
                edges,
                &Measures { class, closed: false, length, strength, angle: 0.0, bend },
            );
        }
        assert!(strongest.taken <= room);
        strongest.finish().ids
    }

    #[test]
    fn the_strongest_stay() {
        let lines = [
            (Class::Weak, 10.0, 0.1, 10),
            (Class::Sharp, 10.0, 0.9, 10),
            (Class::Boundary, 99.0, 0.0, 10),
            (Class::Weak, 10.0, 0.1, 10),
            (Class::Boundary, 100.0, 0.0, 10),
        ];
        assert_eq!(chosen(50, &lines), [0, 1, 2, 3, 4]);
        assert_eq!(chosen(49, &lines), [0, 1, 3, 4]);
        assert_eq!(chosen(30, &lines), [0, 1, 3]);
        assert_eq!(chosen(29, &lines), [0, 1]);
        // The short line does not get in where a stronger one had to go.
        let crowd = [(Class::Sharp, 9.0, 0.9, 90), (Class::Sharp, 8.0, 0.9, 20), (Class::Weak, 1.0, 0.1, 1)];
        assert_eq!(chosen(100, &crowd), [0]);
        assert_eq!(chosen(9, &lines), [1], "a line of more edges than there is room for takes all of it");
        assert_eq!(chosen(0, &lines), [0u64; 0]);
    }
}
