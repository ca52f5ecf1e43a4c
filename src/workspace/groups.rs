//! What groups of tiles leave, in files of their own.
//!
//! In: blocks of bytes, section by section, as `stitch` hands them over. Out: the same, in any later process, to be read block
//! by block. A file is written, named and looked at as the result of a tile is ([`Results`]); the pass of a label is the number
//! of the section. Groups are consecutive tiles, as many in each as was planned, fewer in the last.

use super::frame::{self, Frame, Label};
use super::results::{Look, Results, Walked};
use super::{Workspace, WorkspaceError};
use crate::spill::{KeptRun, Run, SpillError};
use crate::stitch::{GroupShare, Section};
use std::fs::{self, File};
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

/// The tiles of a group, of `size` tiles each, in a plan of `tiles`.
pub fn tiles_of_group(group: u32, size: u32, tiles: u32) -> Range<u32> {
    let place = |group: u32| (u64::from(group) * u64::from(size)).min(u64::from(tiles)) as u32;
    place(group)..place(group.saturating_add(1))
}

/// How many groups of `size` tiles there are in a plan of `tiles`; none if the size is 0.
pub fn count_of_groups(size: u32, tiles: u32) -> u32 {
    if size == 0 { 0 } else { tiles.div_ceil(size) }
}

/// What was found of a group.
#[derive(Clone, Debug)]
pub enum FoundGroup {
    /// Nothing.
    Nothing,
    /// A file that is not a result of this job, or not any more, or of a group of other tiles.
    Damaged,
    /// All of it.
    Whole(GroupShare),
}

/// The results of the groups of one job.
#[derive(Debug)]
pub struct Groups {
    results: Results,
    job: u64,
}

impl Groups {
    /// Of the job that was opened in `workspace`, in groups of `size` tiles.
    ///
    /// # Errors
    /// If there is no job.
    pub fn open(workspace: &Workspace, size: u32) -> Result<Groups, WorkspaceError> {
        let attempt = workspace.attempt().ok_or_else(|| workspace.not_planned())?;
        let job = workspace.job_id();
        Ok(Groups { results: Results::of_groups(workspace.path(), job, attempt, size), job })
    }

    /// Where the result of `group` is, and where it is while this process writes it.
    pub fn paths(&self, group: u32) -> [PathBuf; 2] {
        [self.results.path(group), self.results.unfinished(group)]
    }

    /// Looks at the results of all of `groups`, in the current thread pool: what was found of each, in their order.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn look_at_all(&self, groups: &[u32], look: Look) -> Result<Vec<FoundGroup>, WorkspaceError> {
        self.results.each(groups, |group, there| match there {
            true => self.look(group, look),
            false => Ok(FoundGroup::Nothing),
        })
    }

    /// Looks at the result of `group`.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn look(&self, group: u32, look: Look) -> Result<FoundGroup, WorkspaceError> {
        // Of each section where it starts and ends, and its largest block.
        let mut sections: [Option<(u64, u64, u64)>; Section::ALL.len()] = Default::default();
        let mut stray = false;
        let walked = self.results.walk(group, look, |frame: Frame| {
            let Some(section) = sections.get_mut(usize::from(frame.label.pass)) else {
                stray = true;
                return;
            };
            let (start, _, largest) = section.unwrap_or((frame.offset, 0, 0));
            *section = Some((start, frame.end(), largest.max(frame.length)));
        })?;
        match walked {
            Walked::Nothing => return Ok(FoundGroup::Nothing),
            Walked::Whole if !stray && sections[Section::Counts as usize].is_some() => {}
            Walked::Whole | Walked::Damaged => return Ok(FoundGroup::Damaged),
        }
        let path = self.results.path(group);
        let failed = WorkspaceError::io(&path, "cannot read");
        let file = File::open(&path).map_err(&failed)?;
        let length = file.metadata().map_err(&failed)?.len();
        let file = Arc::new(KeptFile { path, file, length, job: self.job });
        let run = |section: Section| {
            let (start, end, largest) = sections[section as usize].unwrap_or_default();
            KeptRun::new(Arc::new(SectionRun { file: Arc::clone(&file), section, start, end, largest }))
        };
        let [vertices, lines, open, counts] = Section::ALL.map(run);
        Ok(FoundGroup::Whole(GroupShare { vertices, lines, open, counts }))
    }

    /// Begins the result of `group`, which appears when it is ended.
    ///
    /// # Errors
    /// If the directory cannot be made.
    pub fn begin(self, group: u32) -> Result<GroupWriter, WorkspaceError> {
        let path = self.results.path(group);
        let directory = path.parent().unwrap_or(&path);
        fs::create_dir_all(directory)
            .map_err(WorkspaceError::io(directory, "cannot create the directory"))?;
        Ok(GroupWriter { results: self.results, group, pieces: 0, held: None })
    }
}

/// Writes the result of a group.
#[derive(Debug)]
pub struct GroupWriter {
    results: Results,
    group: u32,
    pieces: u32,
    /// The block before is held, for the last one says that it is the last.
    held: Option<(Section, Vec<u8>)>,
}

impl GroupWriter {
    /// Adds a block. Sections come in their order.
    ///
    /// # Errors
    /// If the system refuses; nothing of the group is left then.
    pub fn put(&mut self, section: Section, bytes: &[u8]) -> Result<(), WorkspaceError> {
        match self.held.replace((section, bytes.to_vec())) {
            Some((section, bytes)) => self.write(section, &bytes, false),
            None => Ok(()),
        }
    }

    /// It is whole: it gets its name.
    ///
    /// # Errors
    /// If the system refuses; nothing of the group is left then.
    pub fn end(mut self) -> Result<(), WorkspaceError> {
        self.held.take().map_or(Ok(()), |(section, bytes)| self.write(section, &bytes, true))
    }

    fn write(&mut self, section: Section, bytes: &[u8], last: bool) -> Result<(), WorkspaceError> {
        let label = Label { pass: section as u8, cell: self.group, session: 0, piece: self.pieces, last };
        self.pieces += 1;
        self.results.append(label, bytes)
    }
}

/// A file that stays what it is while somebody reads it, even if another attempt puts its own in its place.
#[derive(Debug)]
struct KeptFile {
    path: PathBuf,
    file: File,
    length: u64,
    job: u64,
}

/// A section of a result.
#[derive(Debug)]
struct SectionRun {
    file: Arc<KeptFile>,
    section: Section,
    start: u64,
    end: u64,
    /// Bytes of the largest block.
    largest: u64,
}

impl Run for SectionRun {
    fn start(&self) -> u64 {
        self.start
    }

    fn read(&self, at: u64, out: &mut Vec<u8>) -> Result<Option<u64>, SpillError> {
        if at >= self.end {
            return Ok(None);
        }
        let KeptFile { path, file, length, job } = &*self.file;
        let failed = |source| SpillError::Io { path: path.clone(), action: "cannot read", source };
        let frame = frame::at(file, *job, at, *length).map_err(failed)?;
        let frame = frame.filter(|frame| frame.label.pass == self.section as u8);
        let Some(frame) = frame else { return Err(self.damaged(at)) };
        match frame::payload(file, &frame, out).map_err(failed)? {
            true => Ok(Some(frame.end())),
            false => Err(self.damaged(at)),
        }
    }

    fn damaged(&self, at: u64) -> SpillError {
        SpillError::Changed { path: self.file.path.clone(), offset: at }
    }

    fn reader_bytes(&self) -> u64 {
        self.largest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_runs_of_tiles() {
        assert_eq!([0, 1, 2, 3].map(|group| tiles_of_group(group, 3, 8)), [0..3, 3..6, 6..8, 8..8]);
        assert_eq!(tiles_of_group(u32::MAX, u32::MAX, 8), 8..8);
        assert_eq!([count_of_groups(0, 8), count_of_groups(3, 8), count_of_groups(8, 8)], [0, 3, 1]);
    }

    fn groups(directory: &std::path::Path, size: u32) -> Groups {
        Groups { results: Results::of_groups(directory, 7, "a", size), job: 7 }
    }

    fn blocks(run: &KeptRun) -> Result<Vec<u64>, SpillError> {
        let (mut all, mut reader) = (Vec::new(), run.records::<u64>());
        while let Some(x) = reader.read()? {
            all.push(x);
        }
        Ok(all)
    }

    #[test]
    fn sections_come_back_or_the_group_is_damaged() {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let all = groups(directory.path(), 4);
        let path = all.paths(2)[0].clone();
        let mut writer = all.begin(2).expect("begun");
        for (section, byte) in
            [(Section::Vertices, 1), (Section::Vertices, 2), (Section::Open, 3), (Section::Counts, 4)]
        {
            assert!(!path.exists());
            writer.put(section, &[byte]).expect("written");
        }
        writer.end().expect("written");
        let look = |group, size| groups(directory.path(), size).look(group, Look::Bytes).expect("look");
        let FoundGroup::Whole(share) = look(2, 4) else { panic!("it is not whole") };
        let found = [&share.vertices, &share.lines, &share.open, &share.counts];
        assert_eq!(found.map(|run| blocks(run).expect("readable")), [vec![1, 2], vec![], vec![3], vec![4]]);
        assert!(matches!(look(1, 4), FoundGroup::Nothing));
        // One of other tiles is none.
        assert!(matches!(look(2, 3), FoundGroup::Damaged));
        let bytes = fs::read(&path).expect("read");
        for at in 0..bytes.len() {
            let mut other = bytes.clone();
            other[at] ^= 1;
            fs::write(&path, &other).expect("write");
            assert!(matches!(look(2, 4), FoundGroup::Damaged), "byte {at}");
        }
        // What is damaged later is seen when it is read.
        assert!(matches!(blocks(&share.counts), Err(SpillError::Changed { .. })));
        assert_eq!(blocks(&share.vertices).expect("readable"), [1, 2]);
        fs::write(&path, &bytes[..bytes.len() - 1]).expect("write");
        assert!(matches!(look(2, 4), FoundGroup::Damaged));
    }
}
