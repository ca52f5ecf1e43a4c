//! The results of tiles, one after the other in one file.
//!
//! In: a payload with its label. Out: the places of all results that are whole, in any later process. Appending is one
//! write behind the end; there is no table that could disagree with the frames, because the frames say whose they are. What
//! follows the last whole frame is the beginning of one that was being written, and is cut off.
//!
//! A result counts when all pieces of its cell from one session are there, the last among them. Pieces of several sessions
//! are never mixed: each session may have cut the cell at other places.

use super::WorkspaceError;
use super::frame::{self, Frame};
use crate::spill::point;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, OpenOptions};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

pub use super::frame::Label;

/// Time between two syncs. A killed process loses nothing that it has written; only a power cut can take away what was
/// not synced, and so much work may be done twice then. Syncing every result would be as safe, and make many small tiles
/// wait for the disk.
const SYNC_EVERY: Duration = Duration::from_secs(1);

/// Where a result lies.
pub type Place = Frame;

/// The file, open for appending.
#[derive(Debug)]
pub struct Log {
    path: PathBuf,
    file: File,
    job: u64,
    /// Where the next frame goes.
    end: u64,
    session: u32,
    synced: Instant,
    unsynced: bool,
}

/// What was in the file.
#[derive(Debug, Default)]
pub struct Contents {
    /// The results of cells that are done, in the order in which they were written.
    pub places: Vec<Place>,
    /// How many frames or gaps between frames were not what was written.
    pub damaged: u64,
}

impl Log {
    /// Opens the log of `job` at `path`, which is made if there is none, and looks at all that is in it.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn open(path: &Path, job: u64) -> Result<(Log, Contents), WorkspaceError> {
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)
            .map_err(WorkspaceError::io(path, "cannot open the file"))?;
        let failed = WorkspaceError::io(path, "cannot read");
        let length = file.metadata().map_err(&failed)?.len();
        let (frames, damaged, end) = read_all(&file, job, length).map_err(&failed)?;
        file.set_len(end).map_err(WorkspaceError::io(path, "cannot cut off what was not whole"))?;
        let session = frames.iter().map(|f| f.label.session + 1).max().unwrap_or(0);
        let log =
            Log { path: path.to_owned(), file, job, end, session, synced: Instant::now(), unsynced: false };
        Ok((log, Contents { places: whole_cells(frames), damaged }))
    }

    /// Adds a result. `label` gets the number of this session.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn append(&mut self, label: Label, payload: &[u8]) -> Result<(), WorkspaceError> {
        let failed = WorkspaceError::io(&self.path, "cannot write");
        let label = Label { session: self.session, ..label };
        let head = frame::head(self.job, &label, self.end, payload);
        self.file.write_all_at(&head, self.end).map_err(&failed)?;
        point("record-begun");
        self.file.write_all_at(payload, self.end + head.len() as u64).map_err(&failed)?;
        self.end += (head.len() + payload.len()) as u64;
        self.unsynced = true;
        point("record-written");
        if self.synced.elapsed() >= SYNC_EVERY {
            self.sync()?;
        }
        Ok(())
    }

    /// Has everything survive a power cut.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn sync(&mut self) -> Result<(), WorkspaceError> {
        if std::mem::take(&mut self.unsynced) {
            self.file.sync_data().map_err(WorkspaceError::io(&self.path, "cannot sync the file"))?;
            point("record-synced");
        }
        self.synced = Instant::now();
        Ok(())
    }

    /// Replaces `out` by the result at `place`; `false` if it is not any more what [`Log::open`] saw.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn read(&self, place: &Place, out: &mut Vec<u8>) -> Result<bool, WorkspaceError> {
        frame::payload(&self.file, place, out).map_err(WorkspaceError::io(&self.path, "cannot read"))
    }
}

/// All whole frames, how often something else was met before the last of them, and where that one ends.
fn read_all(file: &File, job: u64, length: u64) -> std::io::Result<(Vec<Frame>, u64, u64)> {
    let (mut frames, mut damaged, mut damaged_since, mut end) = (Vec::new(), 0, 0, 0);
    let (mut at, mut bytes) = (0, Vec::new());
    while at < length {
        let found = frame::at(file, job, at, length)?;
        match found {
            Some(frame) if frame::payload(file, &frame, &mut bytes)? => {
                damaged += std::mem::take(&mut damaged_since);
                (at, end) = (frame.end(), frame.end());
                frames.push(frame);
            }
            Some(frame) => {
                damaged += 1;
                at = frame.end();
            }
            None => {
                damaged_since += 1;
                match frame::next(file, at + 1, length)? {
                    Some(next) => at = next,
                    None => break,
                }
            }
        }
    }
    // What is cut off at the end is what a killed process was writing; nobody needs to hear of it.
    Ok((frames, damaged, end))
}

/// The frames of cells of which everything is there.
fn whole_cells(frames: Vec<Frame>) -> Vec<Frame> {
    type Cell = (u8, u32);
    let mut found: BTreeMap<(Cell, u32), (BTreeSet<u32>, Option<u32>)> = BTreeMap::new();
    let key = |label: &Label| ((label.pass, label.cell), label.session);
    for Frame { label, .. } in &frames {
        let (pieces, last) = found.entry(key(label)).or_default();
        pieces.insert(label.piece);
        if label.last {
            *last = Some(label.piece);
        }
    }
    let mut done: BTreeMap<Cell, u32> = BTreeMap::new();
    for ((cell, session), (pieces, last)) in found {
        if last.is_some_and(|last| pieces.len() as u64 == u64::from(last) + 1) {
            // If two have done it, both have done it right.
            done.entry(cell).or_insert(session);
        }
    }
    let counts = |frame: &Frame| done.get(&key(&frame.label).0) == Some(&frame.label.session);
    frames.into_iter().filter(counts).collect()
}
