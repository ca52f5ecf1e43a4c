//! What a run tells whoever watches it. The library never prints.

use serde::Serialize;
use std::time::Duration;

/// The stages of a run, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// Reading an input that cannot be read in place, and writing it as one that can.
    Convert,
    /// Rewriting the mesh in spatial order; before the scan, after it, or both.
    Order,
    /// One pass over the file.
    Scan,
    /// Passes over the tiles that only measure, for the paper method.
    Survey,
    /// Voting and refining, tile by tile.
    Tiles,
    /// Joining the fragments.
    Stitch,
    /// Writing the outputs.
    Write,
}

impl Stage {
    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Convert => "convert",
            Stage::Order => "order",
            Stage::Scan => "scan",
            Stage::Survey => "survey",
            Stage::Tiles => "tiles",
            Stage::Stitch => "stitch",
            Stage::Write => "write",
        }
    }

    /// What its progress counts.
    pub fn unit(self) -> &'static str {
        match self {
            Stage::Convert => "bytes",
            Stage::Order | Stage::Scan => "faces",
            Stage::Survey | Stage::Tiles => "tiles",
            Stage::Stitch => "links",
            Stage::Write => "lines",
        }
    }
}

/// Something happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Event {
    /// Some of the tiles of the stage that begins next were done by an earlier run, and are not done again.
    Resumed {
        /// Which stage.
        stage: Stage,
        /// Tiles that are done.
        done: u64,
        /// All tiles.
        total: u64,
    },
    /// A stage begins; `total` counts the units it will report, 0 if it reports none.
    Started {
        /// Which stage.
        stage: Stage,
        /// Units of the whole stage.
        total: u64,
    },
    /// So many more units are done.
    Advanced {
        /// Which stage.
        stage: Stage,
        /// Units since the last report.
        by: u64,
    },
    /// A stage has more units than it announced.
    Grown {
        /// Which stage.
        stage: Stage,
        /// Units that come on top.
        by: u64,
    },
    /// A stage is over.
    Finished {
        /// Which stage.
        stage: Stage,
        /// How long it took.
        wall: Duration,
    },
}

/// Watches a run. Called from several threads.
pub trait Observer: Sync {
    /// Something happened.
    fn event(&self, event: Event);
}

/// Nobody watches.
pub struct Silent;

impl Observer for Silent {
    fn event(&self, _: Event) {}
}
