//! The region of space that a tile has loaded: a box of cubes, and single cubes where the mesh reached beyond it.
//!
//! Certificate: a vertex whose position lies in the region is *complete*, because every face that touches it has a cube
//! in common with the region and was loaded. Edges can be long, so rings are never assumed to fit a margin; where one
//! runs out, the region grows.

use super::lattice::{Cube, CubeBox};
use std::cmp::Reverse;
use std::collections::HashSet;

/// A set of cubes.
#[derive(Clone, Debug)]
pub struct Region {
    main: CubeBox,
    /// What it grew by.
    boxes: Vec<CubeBox>,
    /// The cubes of those boxes that lie outside the main one: for asking about a single cube.
    extra: HashSet<Cube>,
}

/// A place where the loaded region is too small.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Gap {
    /// A cube that must be loaded.
    pub cube: Cube,
    /// How many cubes around it may be asked for next: a guess that saves coming back, not a condition.
    pub margin: u32,
}

/// Gaps beyond the first margin are mostly tentacles: a few long edges that lead far out, into places with few faces.
/// Fetching a wide surrounding at once is cheaper there than coming back for every edge; wider than this, it is not.
const MOST_MARGIN: u32 = 16;
/// Cubes beyond the main box, some 40 MB of them, after which nothing more is guessed: on a mesh with long edges to
/// everywhere, wide surroundings of all their ends would take more memory than the mesh. A tile that needs more cubes is
/// loaded more often, and gets them.
const MOST_GUESSED: usize = 1 << 20;
/// The margin from there on: the cubes of a level, which are needed in any case.
const LEAST_MARGIN: i64 = 1;

impl Region {
    /// A region of one box.
    pub fn new(main: CubeBox) -> Region {
        Region { main, boxes: Vec::new(), extra: HashSet::new() }
    }

    /// Whether it is all there is, so that nothing lies outside.
    pub fn is_everything(&self) -> bool {
        self.main == CubeBox::EVERYTHING
    }

    /// Whether `cube` was loaded.
    #[inline]
    pub fn contains(&self, cube: Cube) -> bool {
        self.main.contains(cube) || (!self.extra.is_empty() && self.extra.contains(&cube))
    }

    /// Whether all 27 cubes around `cube` were loaded, so that a level there is that of the whole mesh.
    pub fn covers_level(&self, cube: Cube) -> bool {
        self.covers(&CubeBox::around(cube))
    }

    /// Whether all cubes of `range` were loaded.
    pub fn covers(&self, range: &CubeBox) -> bool {
        self.main.encloses(range) || range.cubes().all(|c| self.contains(c))
    }

    /// Whether a face with this range of cubes has a point in the region.
    #[inline]
    pub fn meets(&self, range: &CubeBox) -> bool {
        if self.main.meets(range) {
            return true;
        }
        // Long faces cover more cubes than there are boxes; short ones cover a few.
        if range.count() <= self.boxes.len() as u64 {
            range.cubes().any(|c| self.extra.contains(&c))
        } else {
            self.boxes.iter().any(|b| b.meets(range))
        }
    }

    /// Boxes that cover the region: the main one, and what it grew by.
    pub fn boxes(&self) -> impl Iterator<Item = &CubeBox> {
        std::iter::once(&self.main).chain(&self.boxes)
    }

    /// The main box.
    pub fn main(&self) -> &CubeBox {
        &self.main
    }

    /// Adds what `gaps` ask for, with `generosity` times their margins.
    pub fn grow(&mut self, gaps: &[Gap], generosity: u32) {
        let mut widest_first = gaps.to_vec();
        widest_first.sort_by_key(|gap| (Reverse(gap.margin), gap.cube));
        for gap in widest_first {
            // Gaps come in clusters: one wide surrounding mends them all.
            if self.contains(gap.cube) {
                continue;
            }
            let mut margin = i64::from(gap.margin.saturating_mul(generosity).min(MOST_MARGIN));
            if self.extra.len() > MOST_GUESSED {
                margin = margin.min(LEAST_MARGIN);
            }
            let around = CubeBox { min: gap.cube, max: gap.cube }.grown(margin);
            self.extra.extend(around.cubes().filter(|&c| !self.main.contains(c)));
            self.boxes.push(around);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grows_by_what_is_missing() {
        let mut region = Region::new(CubeBox { min: [0; 3], max: [3; 3] });
        assert!(region.covers_level([1, 1, 1]) && !region.covers_level([0, 1, 1]));
        region.grow(&[Gap { cube: [5, 1, 1], margin: 0 }], 1);
        assert!(region.contains([5, 1, 1]) && !region.contains([4, 1, 1]));
        assert!(region.meets(&CubeBox { min: [4, 0, 0], max: [9, 9, 9] }));
        assert!(!region.meets(&CubeBox { min: [6, 0, 0], max: [9, 9, 9] }));
        region.grow(&[Gap { cube: [6, 1, 1], margin: 1 }], 2);
        assert!(region.contains([8, 3, -1]));
        assert_eq!(region.boxes().count(), 3);
        region.grow(&[Gap { cube: [6, 1, 1], margin: 9 }], 1);
        assert_eq!(region.boxes().count(), 3, "nothing was missing");
        assert!(region.meets(&CubeBox { min: [8, 3, 3], max: [90, 90, 90] }));
    }

    #[test]
    fn long_edges_to_everywhere_do_not_fill_the_memory() {
        let mut region = Region::new(CubeBox { min: [0; 3], max: [3; 3] });
        let gaps: Vec<Gap> = (1..1000).map(|i| Gap { cube: [i * 1000, -i, 7], margin: 8 }).collect();
        region.grow(&gaps, 64);
        assert!(gaps.iter().all(|gap| region.contains(gap.cube) && region.covers_level(gap.cube)));
        let widest = (2 * MOST_MARGIN as usize + 1).pow(3);
        assert!(region.extra.len() < MOST_GUESSED + widest + 27 * gaps.len(), "{}", region.extra.len());
    }
}
