//! The results of tiles, and of groups of tiles, in files of their own, for tasks on several machines.
//!
//! In: results of a cell, one for each piece of it, or the blocks that a group of tiles leaves. Out: the same, in any later process on any machine that sees the directory.
//! A file is written under a name that no other attempt uses, synced, and renamed when the last piece is in it: it is whole or
//! not there, nobody waits for anybody, and of two attempts at one tile either may win. The frames are those of the log
//! (`frame.rs`), so each carries the job that it is of and its checksums. A file that holds anything else than all pieces of
//! its cell, in order, is damaged.

use super::frame::{self, Frame, HEAD, Label};
use super::{WorkspaceError, durable};
use crate::spill::point;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::ErrorKind;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// The directory of the results of tiles, within the workspace, and that of groups.
pub const DIRECTORY: &str = "tiles";
pub const GROUPS: &str = "groups";
/// What the names of results end in.
pub const EXTENSION: &str = ".result";

/// The results of one job.
#[derive(Debug)]
pub struct Results {
    directory: PathBuf,
    job: u64,
    /// What all labels say: 0 for tiles, and how many tiles a group has for groups, so that a group of others is none.
    session: u32,
    /// What tells this process from all others that may write here.
    attempt: String,
    begun: BTreeMap<u32, Begun>,
}

/// What was found of a tile.
#[derive(Debug, PartialEq, Eq)]
pub enum Found {
    /// Nothing.
    Nothing,
    /// A file that is not a result of this job, or not any more.
    Damaged,
    /// All its pieces.
    Whole(Vec<Frame>),
}

/// What was found, without the frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Walked {
    Nothing,
    Damaged,
    Whole,
}

/// How closely a result is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// Heads and lengths: the payloads are checked when they are read.
    Heads,
    /// Every byte.
    Bytes,
}

/// The name of the result of a cell, within the workspace.
pub fn name_of(cell: u32) -> String {
    format!("{DIRECTORY}/{cell:06}{EXTENSION}")
}

/// The name of the result of a group.
pub fn name_of_group(group: u32) -> String {
    format!("{GROUPS}/{group:06}{EXTENSION}")
}

/// Whether a file of this name is a result, or was to become one.
pub fn is_ours(name: &str) -> bool {
    let digits = name.bytes().take_while(u8::is_ascii_digit).count();
    digits >= 6
        && (&name[digits..] == EXTENSION || (name[digits..].starts_with('.') && name.ends_with(".new")))
}

impl Results {
    /// In `workspace`, of `job`; files that this process is writing are told by `attempt`.
    pub fn open(workspace: &Path, job: u64, attempt: &str) -> Results {
        let directory = workspace.join(DIRECTORY);
        Results { directory, job, session: 0, attempt: attempt.to_owned(), begun: BTreeMap::new() }
    }

    /// The same for groups of `size` tiles, whose numbers stand in the place of those of cells.
    pub fn of_groups(workspace: &Path, job: u64, attempt: &str, size: u32) -> Results {
        let directory = workspace.join(GROUPS);
        Results { directory, session: size, ..Results::open(workspace, job, attempt) }
    }

    /// Where the result of `cell` is.
    pub fn path(&self, cell: u32) -> PathBuf {
        self.directory.join(format!("{cell:06}{EXTENSION}"))
    }

    /// Where it is while this process writes it.
    pub fn unfinished(&self, cell: u32) -> PathBuf {
        self.directory.join(format!("{cell:06}.{}.new", self.attempt))
    }

    /// Looks at the result of `cell`.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn look(&self, cell: u32, look: Look) -> Result<Found, WorkspaceError> {
        let mut frames = Vec::new();
        Ok(match self.walk(cell, look, |frame| frames.push(frame))? {
            Walked::Nothing => Found::Nothing,
            Walked::Damaged => Found::Damaged,
            Walked::Whole => Found::Whole(frames),
        })
    }

    /// Hands all frames of the result of `cell` to `visit`, which knows at the end only whether it is whole.
    ///
    /// # Errors
    /// If the system refuses.
    pub(super) fn walk(
        &self,
        cell: u32,
        look: Look,
        mut visit: impl FnMut(Frame),
    ) -> Result<Walked, WorkspaceError> {
        let path = self.path(cell);
        let failed = WorkspaceError::io(&path, "cannot read");
        let file = match File::open(&path) {
            Ok(file) => file,
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Walked::Nothing),
            Err(e) => return Err(failed(e)),
        };
        let length = file.metadata().map_err(&failed)?.len();
        let (mut pieces, mut at, mut bytes, mut last) = (0, 0, Vec::new(), false);
        while at < length {
            let Some(frame) = frame::at(&file, self.job, at, length).map_err(&failed)? else {
                return Ok(Walked::Damaged);
            };
            let Label { cell: of, session, piece, last: ends, .. } = frame.label;
            let fits = of == cell && session == self.session && piece == pieces && !last;
            if !fits
                || (look == Look::Bytes && !frame::payload(&file, &frame, &mut bytes).map_err(&failed)?)
            {
                return Ok(Walked::Damaged);
            }
            last = ends;
            at = frame.end();
            pieces += 1;
            visit(frame);
        }
        Ok(if last { Walked::Whole } else { Walked::Damaged })
    }

    /// Looks at the results of all of `cells`, in the current thread pool: what was found of each, in their order.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn look_at_all(&self, cells: &[u32], look: Look) -> Result<Vec<Found>, WorkspaceError> {
        self.each(cells, |cell, there| if there { self.look(cell, look) } else { Ok(Found::Nothing) })
    }

    /// What `look` finds of each of `cells`, in the current thread pool and in their order; it is told whether there is a file.
    pub(super) fn each<T: Send>(
        &self,
        cells: &[u32],
        look: impl Fn(u32, bool) -> Result<T, WorkspaceError> + Sync,
    ) -> Result<Vec<T>, WorkspaceError> {
        // A file system over the network may remember for a while that a name was not there; a directory that is listed is
        // asked for anew. And what is not listed need not be opened.
        let there = self.list()?;
        let found: Vec<Result<T, WorkspaceError>> =
            cells.par_iter().map(|&cell| look(cell, there.contains(&cell))).collect();
        found.into_iter().collect()
    }

    /// The cells of which there are files.
    fn list(&self) -> Result<BTreeSet<u32>, WorkspaceError> {
        let failed = WorkspaceError::io(&self.directory, "cannot list the directory");
        let mut cells = BTreeSet::new();
        let entries = match fs::read_dir(&self.directory) {
            // That of tiles is made when the plan is finished, that of groups by the first of them.
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(cells),
            entries => entries.map_err(&failed)?,
        };
        for entry in entries {
            let name = entry.map_err(&failed)?.file_name();
            let cell = name.to_str().and_then(|name| name.strip_suffix(EXTENSION)?.parse::<u32>().ok());
            cells.extend(cell);
        }
        Ok(cells)
    }

    /// Adds a piece to the result of its cell, which appears with the last of them.
    ///
    /// # Errors
    /// If the system refuses; nothing of the cell is left then.
    pub fn append(&mut self, label: Label, payload: &[u8]) -> Result<(), WorkspaceError> {
        let label = Label { session: self.session, ..label };
        let unfinished = self.unfinished(label.cell);
        let mut begun = match self.begun.remove(&label.cell) {
            Some(begun) => begun,
            None => Begun::create(unfinished)?,
        };
        begun.write(&frame::head(self.job, &label, begun.end, payload))?;
        point("result-begun");
        begun.write(payload)?;
        if !label.last {
            self.begun.insert(label.cell, begun);
            return Ok(());
        }
        begun.commit(&self.path(label.cell))?;
        durable::sync_directory(&self.directory)
    }

    /// Replaces `out` by the piece at `place`; `false` if it is not any more what was seen.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn read(&self, place: &Frame, out: &mut Vec<u8>) -> Result<bool, WorkspaceError> {
        let path = self.path(place.label.cell);
        let failed = WorkspaceError::io(&path, "cannot read");
        let file = File::open(&path).map_err(&failed)?;
        let length = file.metadata().map_err(&failed)?.len();
        // Another attempt may have put its result in the place of the one that was looked at.
        let same = frame::at(&file, self.job, place.offset, length).map_err(&failed)?.as_ref() == Some(place);
        Ok(same && frame::payload(&file, place, out).map_err(&failed)?)
    }
}

/// A result that is being written; it goes if it is not finished.
#[derive(Debug)]
struct Begun {
    path: PathBuf,
    file: File,
    end: u64,
    committed: bool,
}

impl Begun {
    fn create(path: PathBuf) -> Result<Begun, WorkspaceError> {
        let file = File::create_new(&path).map_err(WorkspaceError::io(&path, "cannot create the file"))?;
        Ok(Begun { path, file, end: 0, committed: false })
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), WorkspaceError> {
        self.file.write_all_at(bytes, self.end).map_err(WorkspaceError::io(&self.path, "cannot write"))?;
        self.end += bytes.len() as u64;
        Ok(())
    }

    fn commit(mut self, path: &Path) -> Result<(), WorkspaceError> {
        debug_assert!(self.end >= HEAD as u64, "a result without a head");
        let failed = WorkspaceError::io(path, "cannot write");
        self.file.sync_all().map_err(&failed)?;
        point("result-written");
        fs::rename(&self.path, path).map_err(&failed)?;
        self.committed = true;
        point("result-renamed");
        Ok(())
    }
}

impl Drop for Begun {
    fn drop(&mut self) {
        if !self.committed {
            // Nobody takes it for a result if it stays.
            let _ = fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::OpenOptions;

    fn label(cell: u32, piece: u32, last: bool) -> Label {
        Label { pass: 2, cell, session: 0, piece, last }
    }

    fn whole(found: Found) -> usize {
        match found {
            Found::Whole(pieces) => pieces.len(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_result_is_whole_or_not_there() {
        let directory = tempfile::tempdir().expect("a temporary directory");
        fs::create_dir(directory.path().join(DIRECTORY)).expect("create");
        let [mut a, mut b] = ["a", "b"].map(|attempt| Results::open(directory.path(), 7, attempt));
        a.append(label(3, 0, false), b"first").expect("append");
        assert_eq!(a.look(3, Look::Bytes).expect("look"), Found::Nothing);
        // Another attempt at the same tile, which it did in one piece, is faster; the last one wins, and both are whole.
        b.append(label(3, 0, true), b"all").expect("append");
        assert_eq!(whole(a.look(3, Look::Bytes).expect("look")), 1);
        let place = match b.look(3, Look::Heads).expect("look") {
            Found::Whole(frames) => frames[0],
            other => panic!("{other:?}"),
        };
        a.append(label(3, 1, true), b"second").expect("append");
        assert_eq!(whole(b.look(3, Look::Bytes).expect("look")), 2);
        assert!(!b.read(&place, &mut Vec::new()).expect("read"), "another result took its place");

        // What is given up leaves nothing.
        b.append(label(4, 0, false), b"half").expect("append");
        assert!(b.unfinished(4).exists());
        let unfinished = b.unfinished(4);
        drop(b);
        assert!(!unfinished.exists());
        let found = a.look_at_all(&[2, 3, 4], Look::Bytes).expect("look");
        assert!(matches!(found[..], [Found::Nothing, Found::Whole(_), Found::Nothing]), "{found:?}");
    }

    #[test]
    fn no_damage_is_taken_for_a_result() {
        let directory = tempfile::tempdir().expect("a temporary directory");
        fs::create_dir(directory.path().join(DIRECTORY)).expect("create");
        let mut results = Results::open(directory.path(), 7, "a");
        results.append(label(0, 0, false), b"some bytes").expect("append");
        results.append(label(0, 1, true), b"and more").expect("append");
        let path = results.path(0);
        let bytes = fs::read(&path).expect("read");
        let looked = || results.look(0, Look::Bytes).expect("look");
        for length in 1..bytes.len() {
            OpenOptions::new().write(true).open(&path).expect("open").set_len(length as u64).expect("cut");
            assert_eq!(looked(), Found::Damaged, "cut off at {length}");
            fs::write(&path, &bytes).expect("write");
        }
        for at in 0..bytes.len() {
            let mut other = bytes.clone();
            other[at] ^= 1;
            fs::write(&path, &other).expect("write");
            assert_eq!(looked(), Found::Damaged, "byte {at}");
        }
        fs::write(&path, [&bytes[..], b"x"].concat()).expect("write");
        assert_eq!(looked(), Found::Damaged);
        // That of another cell, and of another job.
        fs::write(&path, &bytes).expect("write");
        fs::copy(&path, results.path(1)).expect("copy");
        assert_eq!(results.look(1, Look::Bytes).expect("look"), Found::Damaged);
        assert_eq!(
            Results::open(directory.path(), 8, "a").look(0, Look::Bytes).expect("look"),
            Found::Damaged
        );
        assert_eq!(whole(looked()), 2);
    }
}
