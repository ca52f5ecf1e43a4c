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
    /// With what `workspace` holds of the job that was begun there, which has so many tiles.
    pub fn open(workspace: Option<&Workspace>, tiles: usize) -> Result<Ledger, Error> {
        let all: Vec<u32> = (0..).take(tiles).collect();
        let places = workspace.map_or_else(|| Ok(Vec::new()), |workspace| workspace.results(&all))?;
        Ok(Ledger { workspace: workspace.cloned(), places, pieces: BTreeMap::new(), wanted: None })
    }

    /// For the tiles of `wanted` and no others, which are done whether they were before or not.
    pub fn of(workspace: &Workspace, wanted: &BTreeSet<TileId>) -> Result<Ledger, Error> {
        workspace.write_files()?;
        let (places, pieces) = (Vec::new(), BTreeMap::new());
        Ok(Ledger { workspace: Some(workspace.clone()), places, pieces, wanted: Some(wanted.clone()) })
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
        self.places(pass).map(|place| TileId(place.label.cell)).collect()
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
