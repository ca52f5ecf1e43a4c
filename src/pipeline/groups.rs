//! Tiles that are stitched in groups, each by a task of its own, so that the last step has less to do.
//!
//! In: the results of consecutive tiles. Out: what they leave together, block by block, for whoever keeps it; and in the last
//! step, such blocks in the place of the results of these tiles. It is the same pass over the same ledger and the same
//! stitcher as in any run. Nobody needs groups: where there is none, the results of tiles are taken.

use super::events::{Event, Stage};
use super::ledger::Ledger;
use super::prepare::Prepared;
use super::run::{Job, Part, Work};
use super::stop::{Stoppable, go_on};
use crate::config::NO_LIMIT;
use crate::error::Error;
use crate::mesh::TileId;
use crate::partition::Pass;
use crate::refine::Extremes;
use crate::spill::point;
use crate::stitch::{GroupShare, LineMemory, PutBlock, Stitcher};
use std::collections::BTreeSet;
use std::ops::Range;

/// Share of the memory that lines may use, and what is open between tiles, where no tile is in memory: half of it together.
/// The rest is for a result that is read, for the plan, and for a component that is finished.
const STITCH_SHARE: u64 = 4;

/// A group of tiles that was stitched.
#[derive(Clone, Debug)]
pub struct StitchedGroup {
    /// Its tiles.
    pub tiles: Range<u32>,
    /// What they have left.
    pub share: GroupShare,
}

impl Job<'_> {
    /// Has `groups` taken in the place of the results of their tiles. Fields of vertices still come from these.
    pub fn with_groups(mut self, groups: Vec<StitchedGroup>) -> Self {
        self.groups = groups;
        self
    }

    /// Stitches `tiles`, whose results are there, as far as that can be done without the others, and hands over to `put` what
    /// they leave.
    ///
    /// # Errors
    /// If a resource runs out, or `put` refuses.
    pub fn run_group(mut self, tiles: Range<u32>, put: PutBlock<'_, Error>) -> Result<Work, Error> {
        self.part = Part::Group(tiles.clone());
        let mut work = Work::default();
        let source = Stoppable { source: self.source, stop: self.stop };
        let Prepared { mesh, planned, mut ledger, fields } = self.prepare(&source, false, &mut work)?;
        let started = self.started(Stage::Tiles, 0, tiles.len() as u64);
        let mesh_and_plan = (mesh.source(), &planned, &mut ledger);
        let stitcher = self.tiles(mesh_and_plan, &Extremes::default(), (None, fields), &mut work);
        let stitcher = self.believed(Stage::Tiles, stitcher)?;
        self.finished(Stage::Tiles, started, &mut work);
        self.observer.event(Event::Started { stage: Stage::Stitch, total: stitcher.links() });
        point("stitching");
        work.stitch = self.timed(Stage::Stitch, &mut work, || {
            stitcher.leave(TileId(tiles.start), &mut |section, bytes| {
                go_on(self.stop)?;
                put(section, bytes)
            })
        })?;
        Ok(work)
    }

    /// Tiles whose lines come with a group.
    pub(super) fn covered(&self) -> BTreeSet<TileId> {
        self.groups.iter().flat_map(|group| group.tiles.clone()).map(TileId).collect()
    }

    /// Gives the groups to `stitcher`.
    pub(super) fn take_groups(&self, stitcher: &mut Stitcher) -> Result<(), Error> {
        for StitchedGroup { tiles, share } in &self.groups {
            go_on(self.stop)?;
            stitcher.take_group(share.clone())?;
            tiles.clone().try_for_each(|tile| stitcher.done(TileId(tile)))?;
            let stage = Stage::Tiles;
            self.observer.event(Event::Advanced { stage, by: tiles.len() as u64 });
        }
        Ok(())
    }

    /// Memory for lines: more of it where all tiles of `ledger` are done, so that none is loaded.
    pub(super) fn line_memory_for(&self, ledger: &Ledger, cells: usize) -> LineMemory {
        let memory = self.limits.memory;
        let done = ledger.done(Pass::Links);
        let (all, last) = match &self.part {
            // What waits for tiles outside is there to the end.
            Part::Group(tiles) => (tiles.clone().all(|tile| done.contains(&TileId(tile))), memory / 2),
            _ => (done.len() == cells, self.line_memory.last),
        };
        match memory {
            NO_LIMIT => self.line_memory,
            _ if !all || !self.is_for_tasks() => self.line_memory,
            _ => LineMemory { open: memory / STITCH_SHARE, lines: memory / STITCH_SHARE, last },
        }
    }
}
