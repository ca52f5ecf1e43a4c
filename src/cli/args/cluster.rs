//! What the steps of a job take that is planned for many tasks.
//!
//! In: words. Out: a workspace, tiles, and what the machine of a task has. What is detected is said once, to `plan`, which takes
//! the options of `detect`.

use super::HOW;
use super::OUTPUT;
use super::detect::DetectArgs;
use super::method::{MethodKind, refusal};
use super::output::OutputArgs;
use super::report::ReportArgs;
use super::show::ShowArgs;
use super::values::memory;
use super::work::{Io, WorkArgs};
use clap::{Args, ValueEnum};
use std::collections::BTreeSet;
use std::path::PathBuf;

/// Arguments of `plan`.
#[derive(Debug, Args)]
#[command(mut_arg("keep_workspace", |arg| arg.hide(true)))]
pub(in crate::cli) struct PlanArgs {
    #[command(flatten)]
    pub detect: DetectArgs,

    /// Tiles of a group, which a task of its own may stitch between `tile` and the last `stitch` (docs/CLUSTER.md); 0 is no groups.
    /// Default: as many as are worth it, which is none below about a billion faces.
    #[arg(long, value_name = "N", help_heading = HOW)]
    pub group_tiles: Option<u32>,
}

impl PlanArgs {
    /// Refuses what cannot be planned.
    pub(super) fn check(&self) -> Result<(), clap::Error> {
        let refused = |message: &str| Err(refusal(message));
        match &self.detect {
            args if args.work.workspace.is_none() => {
                refused("plan needs --workspace DIR, a directory that all machines see")
            }
            args if args.method.method == MethodKind::Paper => refused(
                "--method paper needs numbers of the whole mesh before its lines, and is not planned for many tasks; use detect",
            ),
            args if args.keep_workspace => {
                refused("--keep-workspace is for detect: a planned workspace stays until crease clean")
            }
            _ => Ok(()),
        }
    }
}

/// What the machine has that a task runs on. None of this changes the result.
#[derive(Debug, Args)]
pub(in crate::cli) struct NodeArgs {
    /// Threads that compute, at most 1024. 0 is one for each processor that the process may use. Default: as planned.
    #[arg(long, value_name = "N", help_heading = HOW, value_parser = clap::value_parser!(u16).range(..=1024))]
    threads: Option<u16>,

    /// Memory that may be allocated at a time, as for `detect`. Default: as planned; if nothing was said there, three quarters of
    /// what the machine or the control group of the process has.
    #[arg(long, value_name = "SIZE", help_heading = HOW, value_parser = memory)]
    memory: Option<u64>,

    /// How the mesh is read: `auto`, `map`, `read`. Default: as planned.
    #[arg(long, value_enum, value_name = "MODE", help_heading = HOW, hide_possible_values = true)]
    io: Option<Io>,
}

impl NodeArgs {
    /// Has `work` done as this machine can.
    pub fn apply(&self, work: &mut WorkArgs) {
        work.set(self.threads, self.memory, self.io);
    }
}

/// Arguments of `tile`.
#[derive(Debug, Args)]
pub(in crate::cli) struct TileArgs {
    /// The workspace that `crease plan` was given.
    #[arg(value_name = "DIR")]
    pub directory: PathBuf,

    /// The tile to work on, counted from 0.
    #[arg(long, value_name = "N", required_unless_present = "tiles", conflicts_with = "tiles")]
    pub tile: Option<u32>,

    /// Several tiles, as `crease status` lists them: 0-3,7,9-12.
    #[arg(long, value_name = "A-B,...", value_parser = ranges)]
    pub tiles: Option<TileSet>,

    #[command(flatten)]
    pub node: NodeArgs,

    /// Say nothing unless something goes wrong.
    #[arg(short, long, help_heading = OUTPUT, conflicts_with = "verbose")]
    pub quiet: bool,

    #[command(flatten)]
    pub show: ShowArgs,
}

impl TileArgs {
    /// All tiles that are named.
    pub fn wanted(&self) -> BTreeSet<u32> {
        self.tile.into_iter().chain(self.tiles.iter().flat_map(|tiles| &tiles.0).copied()).collect()
    }
}

/// Arguments of `stitch`.
#[derive(Debug, Args)]
pub(in crate::cli) struct StitchArgs {
    /// The workspace that `crease plan` was given.
    #[arg(value_name = "DIR")]
    pub directory: PathBuf,

    /// Stitch the tiles of a group only, counted from 0, for the stitching of the whole, which takes it in their place.
    #[arg(long, value_name = "N", conflicts_with_all = ["groups", "OutputArgs", "ReportArgs"])]
    pub group: Option<u32>,

    /// The same for several groups, one after the other, as `crease status --step group` lists them: 0-3,7.
    #[arg(long, value_name = "A-B,...", value_parser = ranges, conflicts_with_all = ["OutputArgs", "ReportArgs"])]
    pub groups: Option<TileSet>,

    #[command(flatten)]
    pub node: NodeArgs,

    /// Outputs in the place of all those that were given to `crease plan`.
    #[command(flatten)]
    pub output: Option<OutputArgs>,

    /// Reports in the place of those.
    #[command(flatten)]
    pub report: ReportArgs,

    /// Say nothing unless something goes wrong: no progress, no summary.
    #[arg(short, long, help_heading = OUTPUT, conflicts_with = "verbose")]
    pub quiet: bool,

    #[command(flatten)]
    pub show: ShowArgs,
}

impl StitchArgs {
    /// All groups that are named; nothing if the whole is to be stitched.
    pub fn wanted(&self) -> Option<Vec<u32>> {
        let named = self.group.is_some() || self.groups.is_some();
        let all: BTreeSet<u32> =
            self.group.into_iter().chain(self.groups.iter().flat_map(|groups| &groups.0).copied()).collect();
        named.then(|| all.into_iter().collect())
    }
}

/// Arguments of `status`.
#[derive(Debug, Args)]
pub(in crate::cli) struct StatusArgs {
    /// The workspace that `crease plan` was given.
    #[arg(value_name = "DIR")]
    pub directory: PathBuf,

    /// Count tiles in groups of N consecutive ones: group 0 is the tiles 0 to N - 1. What is listed are groups then, as tasks of an
    /// array take them.
    #[arg(long, value_name = "N", default_value_t = 1, hide_default_value = true, value_parser = clap::value_parser!(u32).range(1..))]
    pub group: u32,

    /// Print nothing but what is missing of a step, as an array specification: 0-3,7,9-12. Nothing if nothing is.
    #[arg(long, conflicts_with = "json")]
    pub array: bool,

    /// The step that `--array` is about: `tile`, or `group`, the groups of tiles that were planned to be stitched by tasks.
    #[arg(
        long,
        value_enum,
        value_name = "STEP",
        default_value = "tile",
        hide_default_value = true,
        hide_possible_values = true,
        requires = "array"
    )]
    pub step: StatusStep,

    /// Print one JSON object, which docs/CLUSTER.md describes.
    #[arg(long)]
    pub json: bool,

    /// Look at heads and lengths of results only, and not at every byte.
    #[arg(long)]
    pub quick: bool,
}

/// A step of which there are many tasks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum StatusStep {
    Tile,
    Group,
}

/// Some tiles, or groups.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::cli) struct TileSet(pub Vec<u32>);

/// More tiles than a plan has; a slip of the hand must not take all memory.
const MOST_TILES: u32 = 1 << 24;

fn ranges(text: &str) -> Result<TileSet, String> {
    let mut tiles = Vec::new();
    let number = |text: &str| match text.trim().parse::<u32>() {
        Ok(n) if n < MOST_TILES => Ok(n),
        _ => Err(format!("`{text}` is no number of a tile or group; say them like 0-3,7,9-12")),
    };
    for part in text.split(',') {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let (first, last) = (number(first)?, number(last)?);
        if first > last {
            return Err(format!("{first} comes after {last}"));
        }
        tiles.extend(first..=last);
    }
    Ok(TileSet(tiles))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_said_as_arrays_are() {
        assert_eq!(ranges("0-3,7,9-9"), Ok(TileSet(vec![0, 1, 2, 3, 7, 9])));
        for wrong in ["", "a", "3-1", "1-", "-1", "1,,2", "0-99999999", "1%2"] {
            assert!(ranges(wrong).is_err(), "{wrong}");
        }
    }
}
