//! `crease stitch --group`: the stitching of some tiles of a planned job, as one task of many.
//!
//! In: a workspace and groups of tiles, whose results are there. Out: for each group what its tiles leave together, in a file that
//! is whole or not there, and a log of this attempt. Nothing is locked and nobody is waited for.

use crate::cli::args::{DetectArgs, ProgressKind, StitchArgs};
use crate::cli::attempt::Attempt;
use crate::cli::exit::{Exit, Failure};
use crate::cli::interrupt::Interrupts;
use crate::cli::memory::Allocations;
use crate::cli::planned::{PlannedJob, array};
use crate::cli::progress::Progress;
use crate::cli::text::counted;
use crate::cli::{bus_error, console};
use crate::error::Error;
use crate::input::{MeshSource, Sieve};
use crate::pipeline::{Job, StitchedGroup};
use crate::workspace::{FoundGroup, FoundResult, Groups, Look, count_of_groups, tiles_of_group};
use serde_json::json;
use std::ffi::OsString;
use std::sync::Arc;

/// What there is of the groups of a job.
pub(super) struct GroupStatus {
    /// All that were planned.
    pub count: u32,
    /// Tiles of each.
    pub size: u32,
    /// Those that are there and right, ascending.
    pub whole: Vec<StitchedGroup>,
    /// Those that are not, ascending.
    pub missing: Vec<u32>,
    /// Those among them with a result that is damaged, of another job or of other tiles.
    pub damaged: Vec<u32>,
}

impl GroupStatus {
    /// Of all groups of `planned`, whose plan has `tiles` tiles.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn of(planned: &PlannedJob, tiles: u32, look: Look) -> Result<GroupStatus, Failure> {
        let size = planned.record.group_tiles;
        let count = count_of_groups(size, tiles);
        let all: Vec<u32> = (0..count).collect();
        let mut status =
            GroupStatus { count, size, whole: Vec::new(), missing: Vec::new(), damaged: Vec::new() };
        let found = Groups::open(&planned.workspace, size)?.look_at_all(&all, look)?;
        for (group, found) in all.into_iter().zip(found) {
            match found {
                FoundGroup::Whole(share) => {
                    status.whole.push(StitchedGroup { tiles: tiles_of_group(group, size, tiles), share });
                    continue;
                }
                FoundGroup::Damaged => status.damaged.push(group),
                FoundGroup::Nothing => {}
            }
            status.missing.push(group);
        }
        Ok(status)
    }

    /// Tiles whose lines come with a group that is there.
    pub fn covers(&self, tile: u32) -> bool {
        self.whole.iter().any(|group| group.tiles.contains(&tile))
    }
}

/// Stitches those of the groups `wanted` that are not there yet.
///
/// # Errors
/// If tiles of them are missing, or anything fails; results that are there then are whole.
pub(super) fn groups(
    args: &StitchArgs,
    wanted: &[u32],
    planned: &PlannedJob,
    words: &[OsString],
    allocations: Allocations,
) -> Result<Exit, Failure> {
    let options = planned.options(Some(&args.node))?;
    let tiles = planned.job()?.cells.len() as u32;
    let missing = missing(planned, wanted, tiles)?;
    if missing.is_empty() {
        if !args.quiet {
            console::print("done before\n")?;
        }
        return Ok(Exit::Done);
    }
    has_tiles(planned, &missing, tiles)?;
    let mut attempt = Attempt::begin(planned, &options, ("stitch", "groups"), &missing)?;
    let task = Task { planned, quiet: args.quiet, options: &options, missing: &missing, tiles };
    let done = task.work(args, &mut attempt, words, allocations);
    attempt.end(&done, allocations)?;
    if let Ok(Exit::Done) = done
        && !args.quiet
    {
        console::print(&format!("{} done\n", counted(missing.len() as u64, "group", "groups")))?;
    }
    done
}

/// Those of `wanted` whose results are not there, or damaged.
fn missing(planned: &PlannedJob, wanted: &[u32], tiles: u32) -> Result<Vec<u32>, Failure> {
    let size = planned.record.group_tiles;
    let count = count_of_groups(size, tiles);
    let refused = |reason: String| Err(Failure::about(Exit::Usage, planned.workspace.path(), reason));
    if count == 0 {
        return refused(
            "the job was planned without groups; crease plan --group-tiles N makes some".to_owned(),
        );
    }
    if let Some(stray) = wanted.iter().find(|group| **group >= count) {
        return refused(format!("there is no group {stray}: the job has the groups 0 to {}", count - 1));
    }
    let all = Groups::open(&planned.workspace, size)?;
    let found = all.look_at_all(wanted, Look::Bytes)?;
    let mut missing = Vec::new();
    for (&group, found) in wanted.iter().zip(found) {
        match found {
            FoundGroup::Whole(_) => continue,
            FoundGroup::Damaged => {
                tracing::warn!("{}: damaged; the group is done again", all.paths(group)[0].display());
            }
            FoundGroup::Nothing => {}
        }
        missing.push(group);
    }
    Ok(missing)
}

/// Refuses groups of which tiles are not there.
fn has_tiles(planned: &PlannedJob, groups: &[u32], tiles: u32) -> Result<(), Failure> {
    let size = planned.record.group_tiles;
    let needed: Vec<u32> = groups.iter().flat_map(|&group| tiles_of_group(group, size, tiles)).collect();
    let found = planned.workspace.files()?.look_at_all(&needed, Look::Bytes)?;
    let is_missing =
        |(tile, found): (&u32, &FoundResult)| (!matches!(found, FoundResult::Whole(_))).then_some(*tile);
    let missing: Vec<u32> = needed.iter().zip(&found).filter_map(is_missing).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let reason = format!(
        "{} of {} tiles of these groups are missing or damaged: {}; run them with crease tile, then stitch the groups again",
        missing.len(),
        needed.len(),
        array(missing)
    );
    Err(Failure::about(Exit::Incomplete, planned.workspace.path(), reason))
}

/// What there is to do.
struct Task<'a> {
    planned: &'a PlannedJob,
    quiet: bool,
    options: &'a DetectArgs,
    missing: &'a [u32],
    /// Of the plan.
    tiles: u32,
}

impl Task<'_> {
    fn work(
        &self,
        args: &StitchArgs,
        attempt: &mut Attempt,
        words: &[OsString],
        allocations: Allocations,
    ) -> Result<Exit, Failure> {
        let Task { planned, quiet, options, missing, .. } = *self;
        let workspace = &planned.workspace;
        let all = Groups::open(workspace, planned.record.group_tiles)?;
        let parts = missing.iter().map(|&group| all.paths(group)[1].clone()).collect();
        let kind = if quiet { ProgressKind::None } else { args.show.progress };
        bus_error::watch(&planned.record.mesh.path());
        let progress = Progress::new(kind, allocations, options.work.limits().memory);
        let interrupts = Interrupts::watch(workspace, parts, words)
            .map_err(|e| Failure::new(Exit::Resource, format!("cannot watch for signals: {e}")))?;
        let done = missing.iter().try_for_each(|&group| self.stitch(group, attempt, &progress, &interrupts));
        interrupts.claim_end();
        match done {
            Ok(()) => Ok(Exit::Done),
            Err(Error::Stopped) => Ok(interrupts.report()),
            Err(error) => Err(Failure::of_run(&planned.record.name.path(), error)),
        }
    }

    fn stitch(
        &self,
        group: u32,
        attempt: &mut Attempt,
        progress: &Progress,
        interrupts: &Interrupts,
    ) -> Result<(), Error> {
        let Task { planned, options, tiles, .. } = *self;
        let mesh = planned.mesh(options)?;
        let sieve = planned.record.sieve.clone().map(|decided| Sieve::again(&mesh, Arc::new(decided)));
        let source: &dyn MeshSource = sieve.as_ref().map_or(&mesh, |sieve| sieve);
        let job = Job::new(source, options.params(), options.work.limits(), progress)?
            .with_workspace(&planned.workspace, false)
            .with_stop(interrupts.flag());
        let size = planned.record.group_tiles;
        let mut writer = Groups::open(&planned.workspace, size)?.begin(group)?;
        let work = job.run_group(tiles_of_group(group, size, tiles), &mut |section, bytes| {
            Ok(writer.put(section, bytes)?)
        })?;
        writer.end()?;
        attempt.done("group", group, json!({ "links": work.stitch.links }))?;
        Ok(())
    }
}
