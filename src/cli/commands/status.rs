//! `crease status`: what is done of a planned job, and what is missing.
//!
//! In: a workspace. Out: a line for each step, an array specification, or JSON; and an exit code that says whether everything is
//! there. A scheduler whose queue is empty says nothing of tasks that failed, so this looks at the files themselves.

use super::group::GroupStatus;
use crate::cli::args::{StatusArgs, StatusStep};
use crate::cli::exit::{Exit, Failure};
use crate::cli::planned::{PlannedJob, array};
use crate::cli::text::{counted, entry, grouped};
use crate::cli::{console, targets};
use crate::workspace::{FoundResult, Look};
use serde_json::json;
use std::path::{Path, PathBuf};

/// What there is of a job.
pub(super) struct Status {
    /// Tiles of the plan.
    pub tiles: u32,
    /// Those without a result, or with a damaged one, ascending.
    pub missing: Vec<u32>,
    /// Those with a damaged one.
    pub damaged: Vec<u32>,
    /// Groups of tiles.
    pub groups: GroupStatus,
    /// Outputs, if they were written and are there.
    pub outputs: Option<Vec<PathBuf>>,
}

impl Status {
    /// Of the job `planned`.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn of(planned: &PlannedJob, look: Look) -> Result<Status, Failure> {
        let all: Vec<u32> = (0..).take(planned.job()?.cells.len()).collect();
        let found = planned.workspace.files()?.look_at_all(&all, look)?;
        let those = |keep: fn(&FoundResult) -> bool| -> Vec<u32> {
            all.iter().zip(&found).filter(|(_, found)| keep(found)).map(|(tile, _)| *tile).collect()
        };
        let here = planned.workspace.path();
        let outputs = planned.workspace.done()?.filter(|all| all.iter().all(|output| output.is_there(here)));
        Ok(Status {
            tiles: all.len() as u32,
            missing: those(|found| !matches!(found, FoundResult::Whole(_))),
            damaged: those(|found| *found == FoundResult::Damaged),
            groups: GroupStatus::of(planned, all.len() as u32, look)?,
            outputs: outputs
                .map(|all| all.iter().map(|output| place(&here.join(output.path.path()))).collect()),
        })
    }

    /// Whether nothing is left to do.
    fn is_complete(&self) -> bool {
        self.missing.is_empty() && self.outputs.is_some()
    }
}

/// Without the way there.
fn place(path: &Path) -> PathBuf {
    targets::place(path).unwrap_or_else(|| path.to_owned())
}

/// Does what `args` ask for.
///
/// # Errors
/// If nothing is planned there, or the system refuses.
pub(in crate::cli) fn status(args: &StatusArgs) -> Result<Exit, Failure> {
    console::start_log(false);
    let planned = PlannedJob::open(&args.directory)?;
    let status = Status::of(&planned, if args.quick { Look::Heads } else { Look::Bytes })?;
    let groups = |tiles: &[u32]| {
        let mut groups: Vec<u32> = tiles.iter().map(|tile| tile / args.group).collect();
        groups.dedup();
        groups
    };
    let missing = array(groups(&status.missing));
    if args.array {
        let missing = match args.step {
            StatusStep::Tile => missing,
            StatusStep::Group => array(status.groups.missing.iter().copied()),
        };
        if !missing.is_empty() {
            console::print(&format!("{missing}\n"))?;
        }
    } else if args.json {
        console::print(&format!(
            "{}\n",
            as_json(&status, args.group, &missing, &array(groups(&status.damaged)))
        ))?;
    } else {
        console::print(&as_text(&status, args.group, &missing))?;
    }
    Ok(if status.is_complete() { Exit::Done } else { Exit::Incomplete })
}

fn as_text(status: &Status, group: u32, missing: &str) -> String {
    let mut out = entry("plan", &format!("done: {}", counted(status.tiles.into(), "tile", "tiles")));
    let done = status.tiles as usize - status.missing.len();
    let mut tiles = format!("{} of {} done", grouped(done as u64), grouped(status.tiles.into()));
    if !status.missing.is_empty() {
        let what = if group > 1 { format!("groups of {group} to run") } else { "to run".to_owned() };
        tiles.push_str(&format!("; {what}: {missing}"));
    }
    if !status.damaged.is_empty() {
        tiles.push_str(&format!("; damaged among them: {}", array(status.damaged.iter().copied())));
    }
    out.push_str(&entry("tile", &tiles));
    let groups = &status.groups;
    if groups.count > 0 {
        let mut text =
            format!("{} of {} done", grouped(groups.whole.len() as u64), grouped(groups.count.into()));
        if !groups.missing.is_empty() && status.outputs.is_none() {
            text.push_str(&format!("; may be stitched first: {}", array(groups.missing.iter().copied())));
        }
        if !groups.damaged.is_empty() {
            text.push_str(&format!("; damaged among them: {}", array(groups.damaged.iter().copied())));
        }
        out.push_str(&entry("group", &text));
    }
    let stitch = match &status.outputs {
        Some(outputs) => {
            let names: Vec<String> = outputs.iter().map(|path| path.display().to_string()).collect();
            format!("done: {}", names.join(", "))
        }
        None if status.missing.is_empty() => "to run".to_owned(),
        None => "waits for tiles".to_owned(),
    };
    out.push_str(&entry("stitch", &stitch));
    out
}

fn as_json(status: &Status, group: u32, missing: &str, damaged: &str) -> serde_json::Value {
    let stitched = status.outputs.is_some();
    let tiles = status.tiles.div_ceil(group);
    let groups = &status.groups;
    let mut steps = vec![
        json!({"name": "plan", "tasks": 1, "missing": ""}),
        json!({"name": "tile", "tasks": tiles, "missing": missing, "damaged": damaged,
               "tiles_missing": status.missing.len(), "tiles": status.tiles}),
    ];
    if groups.count > 0 {
        let list = |numbers: &[u32]| array(numbers.iter().copied());
        steps.push(json!({"name": "group", "tasks": groups.count, "group_tiles": groups.size,
                          "missing": list(&groups.missing), "damaged": list(&groups.damaged)}));
    }
    steps.push(json!({"name": "stitch", "tasks": 1, "missing": if stitched { "" } else { "0" }}));
    json!({ "schema": 1, "complete": status.is_complete(), "group": group, "steps": steps })
}
