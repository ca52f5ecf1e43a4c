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
    /// With what `workspace` holds of the job that was begun there.
    pub fn open(workspace: Option<&Workspace>) -> Result<Ledger, Error> {
        let places = workspace.map_or_else(|| Ok(Vec::new()), Workspace::results)?;
        Ok(Ledger { workspace: workspace.cloned(), places, pieces: BTreeMap::new() })
    }

    fn places(&self, pass: Pass) -> impl Iterator<Item = &Place> {
        self.places.iter().filter(move |place| place.label.pass == number(pass))
    }

    /// The cells that an earlier run has done.
    pub fn done(&self, pass: Pass) -> BTreeSet<TileId> {
        self.places(pass).map(|place| TileId(place.label.cell)).collect()
    }

    /// Hands over all results of an earlier run, each with the cell that it was the last of, if it was.
    pub fn replay<T: DeserializeOwned>(
        &self,
        pass: Pass,
        mut take: impl FnMut(T, Option<TileId>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let Some(workspace) = &self.workspace else { return Ok(()) };
        for place in self.places(pass) {
            let cell = place.label.last.then_some(TileId(place.label.cell));
            take(workspace.result(place)?, cell)?;
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
