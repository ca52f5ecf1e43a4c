//! What the tiles hand over becomes the lines of the mesh, while the tiles come in.
//!
//! In: the share of each tile, tiles in any order, and word of each tile that is done. Out: all lines. A component is
//! finished as soon as it is whole and then is no more than its lines, which go to the store.

use super::close::TileShare;
use super::component::{Part, Rules, finish};
use super::error::StitchError;
use super::fragments::Defects;
use super::open::{Held, OpenComponents};
use super::store::{LineStore, StoredLines};
use crate::mesh::TileId;
use crate::spill::ScratchPlace;

/// Takes the shares of tiles.
#[derive(Debug)]
pub struct Stitcher {
    rules: Rules,
    open: OpenComponents,
    store: LineStore,
    largest_salience: f64,
    defects: Defects,
    links: u64,
}

/// Bytes that stitching may use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineMemory {
    /// For components that are open between tiles. What does not fit is an error.
    pub open: u64,
    /// For lines. What does not fit goes to files.
    pub lines: u64,
}

impl LineMemory {
    /// As much as there is.
    pub const UNBOUNDED: LineMemory = LineMemory { open: u64::MAX, lines: u64::MAX };

    /// A half of `bytes` for each.
    pub fn halves(bytes: u64) -> LineMemory {
        LineMemory { open: bytes / 2, lines: bytes / 2 }
    }
}

/// How the stitching went. None of it is part of the result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StitchWork {
    /// Links that tiles handed over, those of closed components included.
    pub links: u64,
    /// The most that was open at a time.
    pub most_open: Held,
    /// The most bytes that were held.
    pub peak_bytes: u64,
}

/// What all tiles together have.
#[derive(Debug)]
pub struct Stitched {
    /// The lines.
    pub lines: StoredLines,
    /// Defects of all tiles.
    pub defects: Defects,
    /// How it went.
    pub work: StitchWork,
}

impl Stitcher {
    /// Nothing yet. Lines that do not fit into `memory` go to files in `scratch`, which is made when the first of them does.
    pub fn new(rules: Rules, memory: LineMemory, scratch: &ScratchPlace) -> Stitcher {
        Stitcher {
            rules,
            open: OpenComponents::new(memory.open),
            store: LineStore::new(memory.lines, scratch),
            largest_salience: 0.0,
            defects: Defects::default(),
            links: 0,
        }
    }

    /// Takes a share of a tile. One tile may hand over several, as long as what one of them leaves to the others is in its
    /// seams, under the id of the tile itself.
    ///
    /// # Errors
    /// If the memory does not suffice or a temporary file cannot be written.
    pub fn take(&mut self, share: TileShare) -> Result<(), StitchError> {
        self.largest_salience = self.largest_salience.max(share.largest_salience);
        self.defects.add(&share.defects);
        self.links += share.links;
        self.store.put(share.finished)?;
        for open in share.open {
            let whole = self.open.add(open)?;
            self.finish_parts(whole)?;
        }
        Ok(())
    }

    /// `tile` has handed over all it has.
    ///
    /// # Errors
    /// If a temporary file cannot be written.
    pub fn done(&mut self, tile: TileId) -> Result<(), StitchError> {
        let whole = self.open.done(tile);
        self.finish_parts(whole)
    }

    /// Links that were handed over.
    pub fn links(&self) -> u64 {
        self.links
    }

    /// How much is open now.
    pub fn open(&self) -> Held {
        self.open.held()
    }

    /// Bytes that are held.
    pub fn bytes(&self) -> u64 {
        self.open.held().bytes + self.store.bytes()
    }

    /// All lines. By now every tile is done.
    ///
    /// # Errors
    /// If a temporary file cannot be written or read.
    pub fn finish(mut self) -> Result<Stitched, StitchError> {
        let rest = self.open.rest();
        debug_assert!(rest.is_empty(), "{} components wait for tiles that nobody called done", rest.len());
        self.finish_parts(rest)?;
        let most_open = self.open.peak();
        let lines = self.store.finish(self.largest_salience)?;
        let peak_bytes = most_open.bytes + lines.peak_bytes();
        let work = StitchWork { links: self.links, most_open, peak_bytes };
        Ok(Stitched { lines, defects: self.defects, work })
    }

    /// One at a time: finishing takes several times the memory of what is finished.
    fn finish_parts(&mut self, parts: impl IntoIterator<Item = Part>) -> Result<(), StitchError> {
        parts.into_iter().try_for_each(|part| self.store.put(finish(part, &self.rules, |_, _| ())))
    }
}
