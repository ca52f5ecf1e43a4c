//! A job that was planned, as one of its tasks sees it.
//!
//! In: a workspace. Out: the options that the job was planned with, its files and its mesh. Everything is looked at that a task
//! relies on: the version of the program, and length and time of the mesh.

use super::args::{Cli, Command, DetectArgs, NodeArgs};
use super::exit::{Exit, Failure};
use super::input::Input;
use crate::input::{InputError, InputFiles, PlySource};
use crate::mesh::TileId;
use crate::workspace::{DoneOutput, JobRecord, PlanRecord, Workspace, WorkspaceError, relative_place};
use std::path::Path;

/// A planned job.
pub(super) struct PlannedJob {
    /// Where it is.
    pub workspace: Workspace,
    /// What its tasks must know.
    pub record: PlanRecord,
}

impl PlannedJob {
    /// The job in `directory`.
    ///
    /// # Errors
    /// If none is planned there, or by another version.
    pub fn open(directory: &Path) -> Result<PlannedJob, Failure> {
        let workspace = Workspace::planned(directory);
        if !workspace.enter()? {
            let (path, what) = (directory.to_owned(), "it is not a workspace of crease plan");
            return Err(WorkspaceError::NotPlanned { path, what }.into());
        }
        let record = workspace.plan_record()?.ok_or_else(|| workspace.not_planned())?;
        Ok(PlannedJob { workspace, record })
    }

    /// The record of the job, whose results can be looked at from now on.
    ///
    /// # Errors
    /// If it is not there or damaged.
    pub fn job(&self) -> Result<JobRecord, Failure> {
        Ok(self.workspace.job()?.ok_or_else(|| self.workspace.not_planned())?)
    }

    /// The options that it was planned with, as the machine of a task can do the work.
    ///
    /// # Errors
    /// If they are not understood any more.
    pub fn options(&self, node: Option<&NodeArgs>) -> Result<DetectArgs, Failure> {
        let words = self.record.words.iter().map(|word| word.word());
        let parsed = Cli::parse_words(words).map(|cli| cli.command);
        let Ok(Command::Plan(mut plan)) = parsed else {
            let reason = "the command that planned it is not understood any more; plan it again";
            return Err(Failure::about(Exit::Workspace, self.workspace.path(), reason));
        };
        if let Some(node) = node {
            node.apply(&mut plan.detect.work);
        }
        Ok(plan.detect)
    }

    /// The files that it was planned for.
    pub fn files(&self) -> InputFiles {
        self.record.files(self.workspace.path())
    }

    /// The mesh that tiles are loaded from.
    ///
    /// # Errors
    /// If it is not the one that was planned for.
    pub fn mesh(&self, args: &DetectArgs) -> Result<PlySource, InputError> {
        let path = self.workspace.path().join(self.record.mesh.path());
        self.record.known.open(&path, args.work.io.into())
    }

    /// The same as the input of a run.
    ///
    /// # Errors
    /// If it is not the one that was planned for.
    pub fn input(&self, args: &DetectArgs) -> Result<Input, Failure> {
        Ok(Input::planned(self.mesh(args)?, self.record.sieve.clone()))
    }

    /// Whether a task before has written `outputs`, and they are still what it wrote.
    pub fn has_written(&self, outputs: &[&Path]) -> Result<bool, Failure> {
        let Some(done) = self.workspace.done()? else { return Ok(false) };
        let here = self.workspace.path();
        let asked: Vec<_> = outputs.iter().map(|path| relative_place(here, path).ok()).collect();
        Ok(done.iter().map(|output| Some(output.path.clone())).eq(asked)
            && done.iter().all(|output| output.is_whole(here)))
    }

    /// Notes that `outputs` are written.
    ///
    /// # Errors
    /// If they cannot be read.
    pub fn note_written(&self, outputs: &[&Path]) -> Result<(), WorkspaceError> {
        let here = self.workspace.path();
        let done: Result<Vec<DoneOutput>, _> =
            outputs.iter().map(|path| DoneOutput::of(here, path)).collect();
        self.workspace.note_done(&done?)
    }
}

/// Numbers as an array specification: `0-3,7,9-12`.
pub(super) fn array(numbers: impl IntoIterator<Item = u32>) -> String {
    let mut runs: Vec<(u32, u32)> = Vec::new();
    for n in numbers {
        match runs.last_mut() {
            Some((_, last)) if *last + 1 == n => *last = n,
            _ => runs.push((n, n)),
        }
    }
    let said = |&(first, last): &(u32, u32)| match last - first {
        0 => first.to_string(),
        _ => format!("{first}-{last}"),
    };
    runs.iter().map(said).collect::<Vec<_>>().join(",")
}

/// Tiles by their numbers.
pub(super) fn tiles<C: FromIterator<TileId>>(numbers: &[u32]) -> C {
    numbers.iter().copied().map(TileId).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_are_short() {
        assert_eq!(array([0, 1, 2, 3, 7, 9, 10]), "0-3,7,9-10");
        assert_eq!((array([]), array([5]), array([5, 6])), (String::new(), "5".to_owned(), "5-6".to_owned()));
    }
}
