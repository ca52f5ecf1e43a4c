//! What some tiles leave together: as what one tile leaves, but finished lines are in order, and nothing need fit into memory.
//!
//! In: a [`Stitcher`] that has taken all tiles of a group. Out: blocks of bytes in four sections, for whoever keeps them. In
//! again: these blocks, into the stitcher of a larger group or of all tiles. What no tile outside of the group can add to is
//! finished; sorted vertices and lines are merged as they are, without being put in order again. What waits for tiles outside
//! is handed over with them, by the criterion of [`super::close`], so the stitcher cannot tell a group from a tile.
//!
//! A component that waits may be larger than memory. It is handed over in pieces, which are one component again because they
//! have a vertex in common; and because that vertex waits for a tile of the group itself, none of them is taken for whole
//! before the last has come.

use super::close::OpenPart;
use super::error::StitchError;
use super::fragments::Seam;
use super::open::Waiting;
use super::shelf::ShelfReader;
use super::stitcher::{Found, Rest, StitchWork, Stitcher};
use crate::mesh::TileId;
use crate::spill::{KeptRun, blocks_of_records};

/// The parts of what a group leaves, in the order in which they are handed over. The numbers are those of the files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Section {
    /// Vertices of finished lines, by ascending id.
    Vertices = 0,
    /// Finished lines, in canonical order.
    Lines = 1,
    /// Open parts.
    Open = 2,
    /// What is counted; one block.
    Counts = 3,
}

impl Section {
    /// All sections, in order.
    pub const ALL: [Section; 4] = [Section::Vertices, Section::Lines, Section::Open, Section::Counts];
}

/// Whoever keeps the blocks of a group.
pub type PutBlock<'a, E> = &'a mut dyn FnMut(Section, &[u8]) -> Result<(), E>;

/// Bytes of a block of open parts.
const OPEN_BLOCK: usize = 1 << 16;

/// What a group has left, by section.
#[derive(Clone, Debug)]
pub struct GroupShare {
    /// [`Section::Vertices`].
    pub vertices: KeptRun,
    /// [`Section::Lines`].
    pub lines: KeptRun,
    /// [`Section::Open`].
    pub open: KeptRun,
    /// [`Section::Counts`].
    pub counts: KeptRun,
}

impl Stitcher {
    /// Hands over all that the tiles leave to others, block by block, section after section. By now all of them are done;
    /// `own` is one of them.
    ///
    /// # Errors
    /// If a temporary file cannot be written or read, a whole component does not fit into the memory alone, or `put` refuses.
    pub fn leave<E: From<StitchError>>(self, own: TileId, put: PutBlock<'_, E>) -> Result<StitchWork, E> {
        let (Rest { store, waiting, shelf, most_open }, found) = self.rest()?;
        let links = found.links;
        let held = store.hand_over(put)?;
        let pieces = waiting.into_iter().flat_map(|waiting| pieces(waiting, own, &shelf));
        let pieces = pieces.map(|piece| piece.map_err(E::from));
        blocks_of_records(pieces, OPEN_BLOCK, |bytes| put(Section::Open, bytes))?;
        blocks_of_records([Ok(found)].into_iter(), 0, |bytes| put(Section::Counts, bytes))?;
        Ok(StitchWork { links, most_open, peak_bytes: most_open.bytes + held })
    }

    /// Takes what the tiles of a group have left. They are not done yet: lines that wait for them are waited for until
    /// [`Stitcher::done`] has been told of each.
    ///
    /// # Errors
    /// If it cannot be read, a temporary file cannot be written, or seams alone outgrow the memory.
    pub fn take_group(&mut self, group: GroupShare) -> Result<(), StitchError> {
        let GroupShare { vertices, lines, open, counts } = group;
        let mut all = counts.records::<Found>();
        while let Some(found) = all.read()? {
            self.found.add(&found);
        }
        self.store.adopt(vertices, lines);
        let mut parts = open.records::<OpenPart>();
        while let Some(part) = parts.read()? {
            self.take_open(part)?;
        }
        Ok(())
    }
}

/// A component that waits, in pieces that are joined again: the first has all seams, and each has the first of them.
fn pieces(
    waiting: Waiting,
    own: TileId,
    shelf: &ShelfReader,
) -> impl Iterator<Item = Result<OpenPart, StitchError>> + '_ {
    let Waiting { kind, content, mut seams } = waiting;
    let common: Vec<Seam> =
        seams.iter().take(1).map(|seam| Seam { vertex: seam.vertex, tiles: vec![own] }).collect();
    if let Some(first) = seams.first_mut() {
        first.tiles.push(own);
        first.tiles.sort_unstable();
    }
    let mut seams = Some(seams);
    shelf.pieces(content).map(move |part| {
        let seams = seams.take().unwrap_or_else(|| common.clone());
        Ok(OpenPart { kind, part: part?, seams })
    })
}
