//! Closed outlines in the plane, of straight sides and arcs. In: corners, some of them rounded, or a circle; out: sides
//! in order, and at which of their ends the outline has a sharp corner.

use glam::DVec2;
use std::f64::consts::TAU;

/// One side.
#[derive(Clone, Copy, Debug)]
pub enum Side {
    /// Straight.
    Line {
        /// Where it starts.
        from: DVec2,
        /// Where it ends.
        to: DVec2,
    },
    /// Round.
    Arc {
        /// Its middle.
        center: DVec2,
        /// Its radius.
        radius: f64,
        /// Angle of its start around the middle.
        start: f64,
        /// How far it turns: positive counter-clockwise.
        sweep: f64,
    },
}

impl Side {
    /// Its length.
    pub fn length(&self) -> f64 {
        match *self {
            Self::Line { from, to } => from.distance(to),
            Self::Arc { radius, sweep, .. } => radius * sweep.abs(),
        }
    }

    /// The point after the length `along` from its start.
    pub fn at(&self, along: f64) -> DVec2 {
        match *self {
            Self::Line { from, to } => from + (to - from).normalize() * along,
            Self::Arc { center, radius, start, sweep } => {
                let angle = start + sweep.signum() * along / radius;
                let (sine, cosine) = libm::sincos(angle);
                center + DVec2::new(cosine, sine) * radius
            }
        }
    }

    /// Where it starts.
    pub fn start(&self) -> DVec2 {
        match *self {
            Self::Line { from, .. } => from,
            Self::Arc { .. } => self.at(0.0),
        }
    }
}

/// A closed outline: counter-clockwise around material, clockwise around a hole.
#[derive(Clone, Debug)]
pub struct Outline {
    /// Each starts where the one before ends.
    sides: Vec<Side>,
    /// Whether there is a sharp corner at the start of each side.
    sharp: Vec<bool>,
}

impl Outline {
    /// A polygon; every corner is sharp.
    pub fn polygon(corners: &[DVec2]) -> Self {
        Self::rounded(&corners.iter().map(|&corner| (corner, 0.0)).collect::<Vec<_>>())
    }

    /// A polygon whose corners are rounded by the radius given with each; 0 leaves it sharp. The sides must be long
    /// enough for the arcs.
    pub fn rounded(corners: &[(DVec2, f64)]) -> Self {
        let count = corners.len();
        let mut outline = Self { sides: Vec::new(), sharp: Vec::new() };
        let direction = |i: usize| (corners[(i + 1) % count].0 - corners[i % count].0).normalize();
        // How far from the corner its arc starts and ends.
        let cut_back = |i: usize| {
            let (corner, before, after) = (corners[i % count], direction(i + count - 1), direction(i));
            corner.1 * libm::tan(0.5 * turn(before, after)).abs()
        };
        for (i, &(corner, radius)) in corners.iter().enumerate() {
            let (before, after) = (direction(i + count - 1), direction(i));
            if radius > 0.0 {
                let sweep = turn(before, after);
                let start = corner - before * cut_back(i);
                let center = start + before.perp() * (radius * sweep.signum());
                let arm = start - center;
                outline.push(Side::Arc { center, radius, start: libm::atan2(arm.y, arm.x), sweep }, false);
            }
            let from = corner + after * cut_back(i);
            let to = corners[(i + 1) % count].0 - after * cut_back(i + 1);
            outline.push(Side::Line { from, to }, radius == 0.0);
        }
        outline
    }

    /// A circle.
    pub fn disc(center: DVec2, radius: f64) -> Self {
        Self { sides: vec![Side::Arc { center, radius, start: 0.0, sweep: TAU }], sharp: vec![false] }
    }

    /// A round hole.
    pub fn hole(center: DVec2, radius: f64) -> Self {
        Self { sides: vec![Side::Arc { center, radius, start: 0.0, sweep: -TAU }], sharp: vec![false] }
    }

    /// The sides between one sharp corner and the next. Without sharp corners this is one chain, which ends where it
    /// starts.
    pub fn chains(&self) -> Vec<Chain> {
        let count = self.sides.len();
        let Some(first) = self.sharp.iter().position(|&sharp| sharp) else {
            return vec![Chain { sides: self.sides.clone(), sharp: false }];
        };
        let mut chains: Vec<Chain> = Vec::new();
        for i in (first..first + count).map(|i| i % count) {
            if self.sharp[i] {
                chains.push(Chain { sides: Vec::new(), sharp: true });
            }
            if let Some(chain) = chains.last_mut() {
                chain.sides.push(self.sides[i]);
            }
        }
        chains
    }

    fn push(&mut self, side: Side, sharp: bool) {
        self.sides.push(side);
        self.sharp.push(sharp);
    }
}

/// Sides that go over into each other smoothly.
#[derive(Clone, Debug)]
pub struct Chain {
    /// At least one.
    pub sides: Vec<Side>,
    /// Whether it runs between sharp corners; if not, it is closed.
    pub sharp: bool,
}

impl Chain {
    /// Where it starts.
    pub fn start(&self) -> DVec2 {
        self.sides[0].start()
    }

    /// The point after the length `along` from its start.
    pub fn at(&self, along: f64) -> DVec2 {
        let mut rest = along;
        for side in &self.sides[..self.sides.len() - 1] {
            if rest < side.length() {
                return side.at(rest);
            }
            rest -= side.length();
        }
        self.sides[self.sides.len() - 1].at(rest)
    }
}

/// The angle from one direction to another: positive counter-clockwise.
fn turn(before: DVec2, after: DVec2) -> f64 {
    libm::atan2(before.perp_dot(after), before.dot(after))
}
