//! What the tiles hand over becomes the lines of the mesh, while the tiles come in.
//!
//! In: the share of each tile, tiles in any order, and word of each tile that is done. Out: all lines. A component is
//! finished as soon as it is whole and then is no more than its lines, which go to the store.

use super::close::{OpenPart, TileShare};
use super::component::{Rules, finish};
use super::error::StitchError;
use super::fragments::Defects;
use super::open::{FINISHING, Held, OpenComponents, Waiting, too_large};
use super::shelf::{Content, ShelfReader};
use super::store::{LineStore, StoredLines};
use crate::mesh::TileId;
use crate::spill::ScratchPlace;
use serde::{Deserialize, Serialize};

/// Takes the shares of tiles.
#[derive(Debug)]
pub struct Stitcher {
    rules: Rules,
    memory: LineMemory,
    pub(super) open: OpenComponents,
    pub(super) store: LineStore,
    pub(super) found: Found,
}

/// What is counted of all tiles.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Found {
    pub largest_salience: f64,
    pub defects: Defects,
    pub links: u64,
}

impl Found {
    pub fn add(&mut self, other: &Found) {
        self.largest_salience = self.largest_salience.max(other.largest_salience);
        self.defects.add(&other.defects);
        self.links += other.links;
    }
}

/// What is left when all tiles have come.
pub(super) struct Rest {
    pub store: LineStore,
    /// For tiles of others.
    pub waiting: Vec<Waiting>,
    pub shelf: ShelfReader,
    pub most_open: Held,
}

/// Bytes that stitching may use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineMemory {
    /// For components that are open between tiles. What does not fit goes to files.
    pub open: u64,
    /// For a component of those files, when all tiles are done. If one does not fit, that is an error.
    pub last: u64,
    /// For lines. What does not fit goes to files.
    pub lines: u64,
}

impl LineMemory {
    /// As much as there is.
    pub const UNBOUNDED: LineMemory = LineMemory { open: u64::MAX, last: u64::MAX, lines: u64::MAX };
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
    /// Nothing yet. What does not fit into `memory` goes to files in `scratch`, which is made when the first of it does.
    pub fn new(rules: Rules, memory: LineMemory, scratch: &ScratchPlace) -> Stitcher {
        Stitcher {
            rules,
            memory,
            open: OpenComponents::new(memory.open, scratch),
            store: LineStore::new(memory.lines, scratch),
            found: Found::default(),
        }
    }

    /// Takes a share of a tile. One tile may hand over several, as long as what one of them leaves to the others is in its
    /// seams, under the id of the tile itself.
    ///
    /// # Errors
    /// If a temporary file cannot be written, or seams alone outgrow the memory.
    pub fn take(&mut self, share: TileShare) -> Result<(), StitchError> {
        let TileShare { finished, open, links, largest_salience, defects } = share;
        self.found.add(&Found { largest_salience, defects, links });
        self.store.put(finished)?;
        open.into_iter().try_for_each(|open| self.take_open(open))
    }

    /// Takes an open part.
    pub(super) fn take_open(&mut self, open: OpenPart) -> Result<(), StitchError> {
        let whole = self.open.add(open)?;
        whole.map_or(Ok(()), |whole| self.finish_whole(whole))
    }

    /// `tile` has handed over all it has.
    ///
    /// # Errors
    /// If a temporary file cannot be written.
    pub fn done(&mut self, tile: TileId) -> Result<(), StitchError> {
        self.open.done(tile).into_iter().try_for_each(|whole| self.finish_whole(whole))
    }

    /// Links that were handed over.
    pub fn links(&self) -> u64 {
        self.found.links
    }

    /// How much is open now.
    pub fn open(&self) -> Held {
        self.open.held()
    }

    /// Bytes that are held.
    pub fn bytes(&self) -> u64 {
        self.open.held().bytes + self.store.bytes()
    }

    /// All lines. By now every tile is done, and its memory is free.
    ///
    /// # Errors
    /// If a temporary file cannot be written or read, or a component does not fit into the memory alone.
    pub fn finish(self) -> Result<Stitched, StitchError> {
        let (Rest { store, waiting, most_open, .. }, found) = self.rest()?;
        debug_assert!(
            waiting.is_empty(),
            "{} components wait for tiles that nobody called done",
            waiting.len()
        );
        let lines = store.finish(found.largest_salience)?;
        let peak_bytes = most_open.bytes + lines.peak_bytes();
        let work = StitchWork { links: found.links, most_open, peak_bytes };
        Ok(Stitched { lines, defects: found.defects, work })
    }

    /// Finishes what is whole and was put aside.
    pub(super) fn rest(self) -> Result<(Rest, Found), StitchError> {
        let Stitcher { rules, memory, open, mut store, found } = self;
        let most_open = open.peak();
        let (aside, waiting, shelf) = open.rest()?;
        for content in aside {
            let needed = content.whole_bytes().saturating_mul(1 + FINISHING);
            if needed > memory.last {
                return Err(too_large(&content, needed, memory.last));
            }
            store.put(finish(shelf.take(content)?, &rules))?;
        }
        Ok((Rest { store, waiting, shelf, most_open }, found))
    }

    /// Finishes one component; that takes several times its memory, and if it is not there, it waits for the end.
    fn finish_whole(&mut self, whole: Content) -> Result<(), StitchError> {
        let needed = whole.whole_bytes().saturating_mul(FINISHING).saturating_add(self.open.held().bytes);
        if whole.is_shelved() || needed > self.memory.open {
            return self.open.put_aside(whole);
        }
        self.store.put(finish(whole.into_part(), &self.rules))
    }
}
