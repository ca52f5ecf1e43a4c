//! What stands on a block, and how much mesh that makes.
//!
//! In: seed and place; out: the storeys of the block, and exact numbers of vertices, faces and true lines. The numbers
//! follow from sizes alone, so that those of a whole city are known before anything of it is made.

use super::super::random::Random;
use super::chart::{Chart, KERB_FOOT, KERB_TOP};
use super::storey::{Roof, Storey};
use std::ops::AddAssign;

/// Cells from the border of the block to the first house: half a street, kerb, pavement.
const MARGIN: u32 = KERB_TOP + 3;
/// Keeps what is drawn here apart from other streams.
const STREAM: u64 = 0x706c_616e;
/// Cells between what stands on a roof and its border.
const INSET: u32 = 3;
/// Smallest side of a house, and of what stands on a roof.
const LEAST_SIDE: u32 = 4;

/// How much there is of a part of a city.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Vertices.
    pub vertices: u64,
    /// Triangles.
    pub faces: u64,
    /// Points of the true lines.
    pub line_points: u64,
    /// Edges of the true lines.
    pub line_edges: u64,
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.vertices += other.vertices;
        self.faces += other.faces;
        self.line_points += other.line_points;
        self.line_edges += other.line_edges;
    }
}

/// A block before it is made.
#[derive(Clone, Debug)]
pub struct BlockPlan {
    /// Size of the blocks.
    pub chart: Chart,
    /// Column and row of the block.
    pub place: [u64; 2],
    /// Whether there is no further block to the east, to the north.
    pub last: [bool; 2],
    /// Houses and what stands on them; parents come first.
    pub storeys: Vec<Storey>,
}

impl BlockPlan {
    /// Plans the block at a place.
    pub fn new(seed: u64, chart: Chart, place: [u64; 2], last: [bool; 2]) -> Self {
        let mut random = Random::at(seed, [STREAM, place[0], place[1], 0]);
        let mut plan = Self { chart, place, last, storeys: Vec::new() };
        let (inner, half) = (chart.side - 2 * MARGIN, (chart.side - 2 * MARGIN) / 2);
        match random.below(10) {
            // A park.
            0 => {}
            1 | 2 => plan.tower([MARGIN, MARGIN], [inner, inner], &mut random),
            3 | 4 => {
                for west in [MARGIN, MARGIN + half] {
                    plan.house([west, MARGIN], [half, inner], &mut random);
                }
            }
            _ => {
                for (west, south) in [(0, 0), (half, 0), (0, half), (half, half)] {
                    plan.house([MARGIN + west, MARGIN + south], [half, half], &mut random);
                }
            }
        }
        plan
    }

    /// A house on a lot, with one cell free on each side of the lot at least.
    fn house(&mut self, low: [u32; 2], lot: [u32; 2], random: &mut Random) {
        let (low, size) = footprint(low, lot, random);
        let slope = random.between(0.55, 0.85);
        let roof = match random.below(20) {
            0..6 => Roof::Flat,
            6..14 => Roof::Gable { slope, along_y: size[1] >= size[0] },
            _ => Roof::Hip { slope },
        };
        let rows = 8 + random.below(7) as u32;
        self.storeys.push(Storey { parent: None, low, size, rows, roof });
        if roof == Roof::Flat && random.unit() < 0.6 {
            self.on_roof(3 + random.below(4) as u32, random);
        }
    }

    /// A high house in steps.
    fn tower(&mut self, low: [u32; 2], lot: [u32; 2], random: &mut Random) {
        let (low, size) = footprint(low, lot, random);
        let rows = 12 + random.below(16) as u32;
        self.storeys.push(Storey { parent: None, low, size, rows, roof: Roof::Flat });
        for _ in 0..2 {
            self.on_roof(5 + random.below(10) as u32, random);
        }
    }

    /// A box on the last storey, if there is room.
    fn on_roof(&mut self, rows: u32, random: &mut Random) {
        let below = self.storeys.len() - 1;
        let Storey { low, size, .. } = self.storeys[below];
        if size.iter().all(|&side| side >= LEAST_SIDE + 2 * INSET) {
            // A footprint leaves one cell free by itself.
            let (low, lot) = (low.map(|corner| corner + INSET - 1), size.map(|side| side - 2 * (INSET - 1)));
            let (low, size) = footprint(low, lot, random);
            self.storeys.push(Storey { parent: Some(below), low, size, rows, roof: Roof::Flat });
        }
    }

    /// The storey that stands on the roof of storey `index`.
    pub fn child(&self, index: usize) -> Option<&Storey> {
        self.storeys.iter().find(|storey| storey.parent == Some(index))
    }

    /// Lattice points that the block owns along x and y: those on the far borders only where there is no neighbour.
    pub fn owned(&self) -> [u32; 2] {
        self.last.map(|last| self.chart.side + u32::from(last))
    }

    /// How much mesh this makes.
    pub fn counts(&self) -> Counts {
        let side = u64::from(self.chart.side);
        let [columns, rows] = self.owned().map(u64::from);
        let kerb_points = [KERB_FOOT, KERB_TOP].map(|ring| 4 * (side - 2 * u64::from(ring) + 1));
        let mitre_points = 4 * u64::from(KERB_TOP - KERB_FOOT + 1);
        // The kerb has 12 lines: two rings of four sides, four mitres.
        let line_points = kerb_points[0] + kerb_points[1] + mitre_points;
        let mut counts = Counts {
            vertices: columns * rows,
            faces: 2 * side * side,
            line_points,
            line_edges: line_points - 12,
        };
        for storey in &self.storeys {
            let (ring, segments) = (u64::from(storey.perimeter()), u64::from(storey.all_segments()));
            // A roof has as many points as what it covers and a ring more; a wall of n cells has n - 1 points between.
            counts.vertices += segments;
            counts.faces += 2 * segments;
            let creases = storey.creases();
            let steps = |[a, b]: &[[u32; 2]; 2]| u64::from(a[0].abs_diff(b[0]).max(a[1].abs_diff(b[1])));
            let crease_edges: u64 = creases.iter().map(steps).sum();
            let edges = 2 * ring + 4 * u64::from(storey.rows) + crease_edges;
            counts.line_edges += edges;
            // Four sides at the foot, four at the eave, four posts.
            counts.line_points += edges + 12 + creases.len() as u64;
        }
        counts
    }
}

/// A rectangle of even sides on a lot, at least half as long, with a cell free on each side.
fn footprint(low: [u32; 2], lot: [u32; 2], random: &mut Random) -> ([u32; 2], [u32; 2]) {
    let (mut corner, mut size) = (low, lot);
    for axis in 0..2 {
        let most = (lot[axis] - 2) / 2;
        let least = lot[axis].div_ceil(4).max(LEAST_SIDE / 2).min(most);
        size[axis] = 2 * (least + random.below((most - least + 1) as usize) as u32);
        corner[axis] = low[axis] + 1 + random.below((lot[axis] - 1 - size[axis]) as usize) as u32;
    }
    (corner, size)
}
