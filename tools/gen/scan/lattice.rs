//! A rectangle of lattice points: what each may do, where it is, which vertex it is.

use super::super::random::Random;
use glam::DVec2;

/// Largest jitter along each axis, in cells. Below a quarter no cell turns over, whatever its diagonal; above, the
/// diagonal is chosen so that none does.
const JITTER: f64 = 0.29;
/// Least doubled area of the triangles of a cell whose diagonal is left to chance, in square cells.
const SOUND: f64 = 0.3;

/// How a point may be jittered without leaving the lines it lies on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Freedom {
    /// It is inside a house: there is no such point.
    Gone,
    /// A corner.
    Fixed,
    /// On a line along x.
    AlongX,
    /// On a line along y.
    AlongY,
    /// On a line along (1, 1).
    Rising,
    /// On a line along (1, -1).
    Falling,
    /// On a surface.
    Free,
}

impl Freedom {
    /// A jitter that keeps to it, in cells.
    pub fn jitter(self, random: &mut Random) -> DVec2 {
        let mut draw = || random.between(-JITTER, JITTER);
        match self {
            Self::Gone | Self::Fixed => DVec2::ZERO,
            Self::AlongX => DVec2::new(draw(), 0.0),
            Self::AlongY => DVec2::new(0.0, draw()),
            Self::Rising => DVec2::splat(draw()),
            Self::Falling => DVec2::new(1.0, -1.0) * draw(),
            Self::Free => DVec2::new(draw(), draw()),
        }
    }
}

/// How a cell is cut into two triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Diagonal {
    /// From the lower left to the upper right.
    Rising,
    /// From the upper left to the lower right.
    Falling,
}

impl Diagonal {
    /// The one that leads from near the corners of a rectangle towards its middle; `at` and `far` from one corner.
    pub fn towards_middle(at: [u32; 2], far: [u32; 2]) -> Self {
        let [left, low] = [0, 1].map(|axis| 2 * at[axis] < far[axis]);
        if left == low { Self::Rising } else { Self::Falling }
    }

    /// Of a point on such a line.
    pub fn freedom(self) -> Freedom {
        match self {
            Self::Rising => Freedom::Rising,
            Self::Falling => Freedom::Falling,
        }
    }

    /// A diagonal that gives two sound triangles: by chance if both do. Corners are counter-clockwise from the lower left.
    pub fn choose([a, b, c, d]: [DVec2; 4], chance: impl FnOnce() -> bool) -> Self {
        let area = |p: DVec2, q: DVec2, r: DVec2| (q - p).perp_dot(r - p);
        let rising = area(a, b, c).min(area(a, c, d));
        let falling = area(a, b, d).min(area(b, c, d));
        let by_chance = rising.min(falling) > SOUND;
        let first = if by_chance { chance() } else { rising > falling };
        if first { Self::Rising } else { Self::Falling }
    }

    /// The two triangles of a cell, of whatever names its corners.
    pub fn cut<T: Copy>(self, [a, b, c, d]: [T; 4]) -> [[T; 3]; 2] {
        match self {
            Self::Rising => [[a, b, c], [a, c, d]],
            Self::Falling => [[a, b, d], [b, c, d]],
        }
    }
}

/// A value for each point of a rectangle of cells, `(size[0] + 1) * (size[1] + 1)` of them.
#[derive(Clone, Debug)]
pub struct Table<T> {
    size: [u32; 2],
    values: Vec<T>,
}

impl<T: Copy> Table<T> {
    /// The value of `of` at each point, asked for row by row.
    pub fn new(size: [u32; 2], mut of: impl FnMut([u32; 2]) -> T) -> Self {
        let rows = 0..=size[1];
        let points = rows.flat_map(|j| (0..=size[0]).map(move |i| [i, j]));
        Self { size, values: points.map(&mut of).collect() }
    }

    /// Cells along x and y.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The value at a point.
    pub fn at(&self, point: [u32; 2]) -> T {
        self.values[self.place(point)]
    }

    /// Changes the value at a point.
    pub fn set(&mut self, point: [u32; 2], value: T) {
        let place = self.place(point);
        self.values[place] = value;
    }

    /// The values at the corners of a cell, counter-clockwise from the lower left.
    pub fn corners(&self, [i, j]: [u32; 2]) -> [T; 4] {
        [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]].map(|point| self.at(point))
    }

    /// The values along a straight line with both ends: along an axis or a diagonal.
    pub fn along(&self, [from, to]: [[u32; 2]; 2]) -> Vec<T> {
        let steps = from[0].abs_diff(to[0]).max(from[1].abs_diff(to[1]));
        let step = |axis: usize, k: u32| match to[axis].cmp(&from[axis]) {
            std::cmp::Ordering::Less => from[axis] - k,
            std::cmp::Ordering::Equal => from[axis],
            std::cmp::Ordering::Greater => from[axis] + k,
        };
        (0..=steps).map(|k| self.at([step(0, k), step(1, k)])).collect()
    }

    fn place(&self, [i, j]: [u32; 2]) -> usize {
        (j * (self.size[0] + 1) + i) as usize
    }
}

impl Table<Freedom> {
    /// Makes room for a house: points on its walls stay on them, those inside are gone.
    pub fn cut_out(&mut self, low: [u32; 2], size: [u32; 2]) {
        for j in 0..=size[1] {
            for i in 0..=size[0] {
                let (x, y) = (i == 0 || i == size[0], j == 0 || j == size[1]);
                let freedom = match (x, y) {
                    (true, true) => Freedom::Fixed,
                    (true, false) => Freedom::AlongY,
                    (false, true) => Freedom::AlongX,
                    (false, false) => Freedom::Gone,
                };
                self.set([low[0] + i, low[1] + j], freedom);
            }
        }
    }
}
