//! The scan of a city of any size, made block by block.
//!
//! In: a seed and how many triangles; out: blocks of an open surface that is one mesh: ground that rolls gently, sunken
//! streets with kerbs, houses with flat, gable and hip roofs, and the noise of a scanner. The unit is the spacing of the
//! samples, some 0.4 m in a real city. Everything is a function of seed and place, so that a block can be made without
//! the others, in any order and by any thread; and numbers of vertices and faces follow from the plan of a block alone,
//! without making it, so that a file can be begun with the right header and written in constant memory.
//!
//! Blocks meet in the middle of streets. A block owns the vertices on its lower and left border; those on the others
//! belong to its neighbours, which it names as [`Ghost`]s.

mod block;
mod chart;
mod ground;
mod lattice;
mod lines;
mod plan;
mod storey;
mod wall;
pub mod write;

pub use block::Block;
pub use plan::Counts;

use super::noise::NoiseKind;
use anyhow::{Context, Result, ensure};
use chart::Chart;
use plan::BlockPlan;
use std::ops::RangeInclusive;

/// Cells along the side of a block: fewer leave no room for houses, and more make no difference.
const SIDES: RangeInclusive<u32> = 40..=80;
/// The usual one.
const USUAL_SIDE: u32 = 64;
/// What a block that differs from it by a cell may be worth in the number of triangles.
const ODD_SIZE: f64 = 5e-4;
/// Triangles of a small block with few houses.
const LEAST_TRIANGLES: u64 = 5_000;
/// Blocks that are looked at to know the mean of all.
const SAMPLED: [u64; 2] = [16, 16];
/// Mean length of the edges, which noise is measured in. It hardly depends on seed and size; a test measures it.
pub const MEAN_EDGE: f64 = 1.155;

/// Which city.
#[derive(Clone, Copy, Debug)]
pub struct CityScan {
    seed: u64,
    chart: Chart,
    columns: u64,
    rows: u64,
    noise: Option<(NoiseKind, f64)>,
}

impl CityScan {
    /// A city of about `triangles` triangles: within a tenth, from a million on within a hundredth.
    ///
    /// # Errors
    /// If there are too few for one block.
    pub fn new(triangles: u64, seed: u64) -> Result<Self> {
        ensure!(
            triangles >= LEAST_TRIANGLES,
            "a block of houses has some {LEAST_TRIANGLES} triangles at least"
        );
        let wanted = triangles as f64;
        let mut best = (f64::INFINITY, None);
        for side in SIDES {
            let of = |[columns, rows]: [u64; 2]| Self {
                seed,
                chart: Chart::new(side),
                columns,
                rows,
                noise: None,
            };
            let mean = of(SAMPLED).expected_triangles() / (SAMPLED[0] * SAMPLED[1]) as f64;
            let blocks = (wanted / mean).max(1.0);
            let middle = blocks.sqrt().round() as u64;
            for columns in middle.saturating_sub(2).max(1)..=middle + 2 {
                let city = of([columns, (blocks / columns as f64).round().max(1.0) as u64]);
                let error = (city.expected_triangles() / wanted - 1.0).abs();
                let odd = error + ODD_SIZE * f64::from(side.abs_diff(USUAL_SIDE));
                if odd < best.0 {
                    best = (odd, Some(city));
                }
            }
        }
        best.1.context("there is no size of blocks")
    }

    /// The same city with noise of the scanner, `amount` in mean edge lengths.
    ///
    /// # Errors
    /// If the amount is no length, or the kind is not one that is a function of place.
    pub fn with_noise(mut self, kind: NoiseKind, amount: f64) -> Result<Self> {
        ensure!(amount.is_finite() && amount >= 0.0, "an amplitude of {amount} is not a length");
        ensure!(
            matches!(kind, NoiseKind::Normal | NoiseKind::Isotropic),
            "the noise of a city is normal or isotropic, not {kind}"
        );
        self.noise = (amount > 0.0).then_some((kind, amount * MEAN_EDGE));
        Ok(self)
    }

    /// Blocks from west to east, and from south to north.
    pub fn size(&self) -> [u64; 2] {
        [self.columns, self.rows]
    }

    /// How much there is in a block.
    pub fn counts(&self, place: [u64; 2]) -> Counts {
        self.plan(place).counts()
    }

    /// Makes a block.
    pub fn block(&self, place: [u64; 2]) -> Block {
        block::build(self, &self.plan(place))
    }

    fn plan(&self, place: [u64; 2]) -> BlockPlan {
        let last = [place[0] + 1 == self.columns, place[1] + 1 == self.rows];
        BlockPlan::new(self.seed, self.chart, place, last)
    }

    /// Triangles of all blocks, by the mean of some.
    fn expected_triangles(&self) -> f64 {
        let blocks = self.columns * self.rows;
        let step = blocks.div_ceil(SAMPLED[0] * SAMPLED[1]);
        let sampled = (0..blocks).step_by(step as usize);
        let (mut sum, mut count) = (0, 0);
        for block in sampled {
            sum += self.counts([block % self.columns, block / self.columns]).faces;
            count += 1;
        }
        sum as f64 / f64::from(count) * blocks as f64
    }
}
