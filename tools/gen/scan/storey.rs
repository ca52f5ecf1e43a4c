//! A box of walls under a roof: a house, or what stands on a flat roof.
//!
//! In: a rectangle of the lattice, rows of the walls, kind of roof; out: all numbers and shapes that follow from these,
//! in cells relative to the lower left corner of the rectangle.

use super::lattice::{Diagonal, Freedom};
use glam::DVec2;

/// A roof.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Roof {
    /// Level.
    Flat,
    /// Two planes that meet in a ridge along y, or along x.
    Gable { slope: f64, along_y: bool },
    /// Four planes.
    Hip { slope: f64 },
}

/// A storey of a block.
#[derive(Clone, Debug)]
pub struct Storey {
    /// The storey on whose roof it stands; `None` on the ground.
    pub parent: Option<usize>,
    /// Lower left corner on the lattice of the block.
    pub low: [u32; 2],
    /// Cells along x and y, both even.
    pub size: [u32; 2],
    /// Cells from foot to eave.
    pub rows: u32,
    /// What it ends in.
    pub roof: Roof,
}

impl Storey {
    /// Lattice points around it, counter-clockwise from the lower left corner; the first is not repeated.
    pub fn ring(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let [w, d] = self.size;
        let south = (0..w).map(|i| [i, 0]);
        let east = (0..d).map(move |j| [w, j]);
        let north = (0..w).map(move |i| [w - i, d]);
        let west = (0..d).map(move |j| [0, d - j]);
        south.chain(east).chain(north).chain(west)
    }

    /// Number of lattice points around it.
    pub fn perimeter(&self) -> u32 {
        2 * (self.size[0] + self.size[1])
    }

    /// Cells of a wall from foot to roof at a point of the ring.
    pub fn segments(&self, at: [u32; 2]) -> u32 {
        let corner = DVec2::new(f64::from(at[0]), f64::from(at[1]));
        self.rows + self.rise(corner).round() as u32
    }

    /// Cells from foot to roof, over all points of the ring.
    pub fn all_segments(&self) -> u32 {
        self.ring().map(|at| self.segments(at)).sum()
    }

    /// How much the roof lies above the eave.
    pub fn rise(&self, at: DVec2) -> f64 {
        let [w, d] = self.size.map(f64::from);
        let (x, y) = (at.x.min(w - at.x), at.y.min(d - at.y));
        match self.roof {
            Roof::Flat => 0.0,
            Roof::Gable { slope, along_y: true } => slope * x,
            Roof::Gable { slope, along_y: false } => slope * y,
            Roof::Hip { slope } => slope * x.min(y),
        }
    }

    /// Half the width between two eaves: how far hips run inwards.
    pub fn half(&self) -> u32 {
        self.size[0].min(self.size[1]) / 2
    }

    /// How the points of the roof may be jittered without leaving their lines.
    pub fn freedom(&self, [i, j]: [u32; 2]) -> Freedom {
        let [w, d] = self.size;
        let (x, y) = (i.min(w - i), j.min(d - j));
        match (x, y, self.roof) {
            (0, 0, _) => Freedom::Fixed,
            // The ends of a ridge.
            (x, 0, Roof::Gable { along_y: true, .. }) if 2 * x == w => Freedom::Fixed,
            (0, y, Roof::Gable { along_y: false, .. }) if 2 * y == d => Freedom::Fixed,
            (0, _, _) => Freedom::AlongY,
            (_, 0, _) => Freedom::AlongX,
            (x, _, Roof::Gable { along_y: true, .. }) if 2 * x == w => Freedom::AlongY,
            (_, y, Roof::Gable { along_y: false, .. }) if 2 * y == d => Freedom::AlongX,
            (x, y, Roof::Hip { .. }) if x == y && x == self.half() => Freedom::Fixed,
            (x, y, Roof::Hip { .. }) if x == y => Diagonal::towards_middle([i, j], self.size).freedom(),
            (x, _, Roof::Hip { .. }) if x == self.half() && 2 * x == w => Freedom::AlongY,
            (_, y, Roof::Hip { .. }) if y == self.half() && 2 * y == d => Freedom::AlongX,
            _ => Freedom::Free,
        }
    }

    /// The diagonal that a cell of the roof must have, because a hip runs along it.
    pub fn forced(&self, [i, j]: [u32; 2]) -> Option<Diagonal> {
        let [w, d] = self.size;
        let on_hip = i.min(w - 1 - i) == j.min(d - 1 - j);
        (matches!(self.roof, Roof::Hip { .. }) && on_hip)
            .then(|| Diagonal::towards_middle([i, j], [w - 1, d - 1]))
    }

    /// Creases of the roof as ends of straight lines on the lattice.
    pub fn creases(&self) -> Vec<[[u32; 2]; 2]> {
        let [w, d] = self.size;
        let half = self.half();
        match self.roof {
            Roof::Flat => Vec::new(),
            Roof::Gable { along_y: true, .. } => vec![[[w / 2, 0], [w / 2, d]]],
            Roof::Gable { along_y: false, .. } => vec![[[0, d / 2], [w, d / 2]]],
            Roof::Hip { .. } => {
                let ends = [[half, half], [w - half, half], [w - half, d - half], [half, d - half]];
                let corners = [[0, 0], [w, 0], [w, d], [0, d]];
                let mut creases: Vec<_> = corners.into_iter().zip(ends).map(|(a, b)| [a, b]).collect();
                if w != d {
                    creases.push([ends[0], ends[2]]);
                }
                creases
            }
        }
    }
}
