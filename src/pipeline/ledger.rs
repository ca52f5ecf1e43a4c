//! Which tiles are done, and where their results are kept.
//!
//! In: results as the committer takes them. Out: those of an earlier run, before any tile is loaded. Without a workspace
//! there are none, and nothing is kept. A cell that had to be cut has a result for each piece; it is done when the last of
//! them is kept.

use crate::error::Error;
use crate::mesh::TileId;
use crate::partition::Pass;
use crate::workspace::{Label, Place, Workspace};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::{BTreeMap, BTreeSet};

/// The results of all passes over the tiles.
pub(super) struct Ledger {
    workspace: Option<Workspace>,
    places: Vec<Place>,
    /// How many pieces of a cell were kept in this run.
    pieces: BTreeMap<(u8, u32), u32>,
    /// The tiles that this process is for; all, if nothing is said.
    wanted: Option<BTreeSet<TileId>>,
    /// Tiles whose lines come with a group.
    covered: BTreeSet<TileId>,
}

/// The number of a pass in the workspace.
fn number(pass: Pass) -> u8 {
    match pass {
        Pass::Omega => 0,
        Pass::Salience => 1,
        Pass::Links => 2,
    }
}

impl Ledger {
    /// With what `workspace` holds of the job that was begun there, as far as it is of `cells`.
    pub fn open(workspace: Option<&Workspace>, cells: &[u32]) -> Result<Ledger, Error> {
        let places = workspace.map_or_else(|| Ok(Vec::new()), |workspace| workspace.results(cells))?;
        let (workspace, pieces, covered) = (workspace.cloned(), BTreeMap::new(), BTreeSet::new());
        Ok(Ledger { workspace, places, pieces, wanted: None, covered })
    }

    /// For the tiles of `wanted` and no others, which are done whether they were before or not.
    pub fn of(workspace: &Workspace, wanted: &BTreeSet<TileId>) -> Result<Ledger, Error> {
        workspace.write_files()?;
        let (places, pieces, covered) = (Vec::new(), BTreeMap::new(), BTreeSet::new());
        let workspace = Some(workspace.clone());
        Ok(Ledger { workspace, places, pieces, wanted: Some(wanted.clone()), covered })
    }

    /// Makes no tile that is not one of `wanted`.
    pub fn only(mut self, wanted: BTreeSet<TileId>) -> Ledger {
        self.wanted = Some(wanted);
        self
    }

    /// Counts `tiles` as done. What is kept of them is handed over only if somebody wants more of it than their lines.
    pub fn cover(&mut self, tiles: BTreeSet<TileId>, fields: bool) {
        if !fields {
            self.places.retain(|place| !tiles.contains(&TileId(place.label.cell)));
        }
        self.covered = tiles;
    }

    /// The tiles that are to be done in `pass`.
    pub fn to_do(&self, pass: Pass) -> impl Fn(TileId) -> bool {
        let done = self.done(pass);
        move |tile| !done.contains(&tile) && self.wanted.as_ref().is_none_or(|wanted| wanted.contains(&tile))
    }

    fn places(&self, pass: Pass) -> impl Iterator<Item = &Place> {
        self.places.iter().filter(move |place| place.label.pass == number(pass))
    }

    /// The cells that an earlier run has done.
    pub fn done(&self, pass: Pass) -> BTreeSet<TileId> {
        let own = self.places(pass).map(|place| TileId(place.label.cell));
        own.chain(self.covered.iter().copied()).collect()
    }

    /// Hands over all results of an earlier run, each with its cell and whether it was the last of it.
    pub fn replay<T: DeserializeOwned>(
        &self,
        pass: Pass,
        mut take: impl FnMut(T, TileId, bool) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let Some(workspace) = &self.workspace else { return Ok(()) };
        for place in self.places(pass) {
            take(workspace.result(place)?, TileId(place.label.cell), place.label.last)?;
        }
        Ok(())
    }

    /// Keeps a result of `cell`; `whole` if it is the last.
    pub fn keep(
        &mut self,
        pass: Pass,
        cell: TileId,
        whole: bool,
        result: &impl Serialize,
    ) -> Result<(), Error> {
        let Some(workspace) = &self.workspace else { return Ok(()) };
        let pieces = self.pieces.entry((number(pass), cell.0)).or_insert(0);
        let label = Label { pass: number(pass), cell: cell.0, session: 0, piece: *pieces, last: whole };
        *pieces += 1;
        workspace.keep(label, result)?;
        if whole && pass == Pass::Links {
            workspace.count_one();
        }
        Ok(())
    }

    /// Says how many of `tiles` are done.
    pub fn count(&self, tiles: u64) {
        if let Some(workspace) = &self.workspace {
            workspace.count(self.done(Pass::Links).len() as u64, tiles);
        }
    }

    /// Has everything survive a power cut.
    pub fn sync(&self) -> Result<(), Error> {
        Ok(self.workspace.as_ref().map_or(Ok(()), Workspace::sync)?)
    }
}
