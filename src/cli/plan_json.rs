//! `plan.json`: the plan for those who start the tasks.
//!
//! In: what was planned. Out: JSON, every field of which `docs/CLUSTER.md` describes; the schema has a number that grows when the
//! meaning of a field changes. Same input and options, same bytes: there are no dates, names of machines or full paths in it.

use super::args::DetectArgs;
use crate::config::NO_LIMIT;
use crate::pipeline::{Laid, STITCH_SECONDS_PER_FACE, TileOutlook};
use crate::workspace::{PlanRecord, count_of_groups, name_of_group, name_of_result, tiles_of_group};
use serde::Serialize;

/// Of the fields; `docs/CLUSTER.md` says what is in which.
const SCHEMA: u32 = 1;
/// Time in which the steps that are one task go through a million faces on one core: planning reads the mesh once or thrice,
/// stitching reads the results of the tiles.
const PLAN_SECONDS: f64 = 0.4;
const STITCH_SECONDS: f64 = 1e6 * STITCH_SECONDS_PER_FACE;

#[derive(Debug, Serialize)]
pub(super) struct PlanJson {
    schema: u32,
    crease: String,
    job: String,
    input: InputJson,
    steps: Vec<StepJson>,
    group_tiles: u32,
    groups: Vec<GroupJson>,
    tiles: Vec<TileJson>,
}

#[derive(Debug, Serialize)]
struct InputJson {
    vertices: u64,
    faces: u64,
    mesh: String,
    converted: bool,
    reordered: bool,
}

#[derive(Debug, Serialize)]
struct StepJson {
    name: &'static str,
    /// "one" or "each".
    tasks: &'static str,
    count: usize,
    after: Option<&'static str>,
    /// Words behind `crease`; `{workspace}`, `{tile}` and `{group}` stand for what they say.
    arguments: Vec<&'static str>,
    memory_bytes: u64,
    cpu_seconds: f64,
}

#[derive(Debug, Serialize)]
struct GroupJson {
    id: u32,
    first_tile: u32,
    last_tile: u32,
    cpu_seconds: f64,
    result: String,
}

#[derive(Debug, Serialize)]
struct TileJson {
    id: u32,
    faces: u64,
    loaded_faces: u64,
    memory_bytes: u64,
    cpu_seconds: f64,
    neighbours: Vec<u32>,
    result: String,
}

impl PlanJson {
    /// Of a job that is called `job` in its results.
    pub fn new(args: &DetectArgs, record: &PlanRecord, laid: &Laid, job: u64) -> PlanJson {
        let scan = &laid.planned.scan;
        let tiles: Vec<TileJson> = laid.tiles.iter().map(TileJson::new).collect();
        let memory = tiles.iter().map(|tile| tile.memory_bytes).max().unwrap_or(0);
        let limit = args.work.limits().memory;
        let asked = if args.work.has_memory() && limit != NO_LIMIT { limit } else { memory };
        let longest = tiles.iter().map(|tile| tile.cpu_seconds).max_by(f64::total_cmp).unwrap_or(0.0);
        let millions = rounded(scan.faces as f64 / 1e6);
        let step = |name, tasks, count, after, arguments: &[&'static str], memory_bytes, cpu_seconds: f64| {
            StepJson {
                name,
                tasks,
                count,
                after,
                arguments: arguments.to_vec(),
                memory_bytes,
                cpu_seconds: rounded(cpu_seconds),
            }
        };
        let tile = ["tile", "{workspace}", "--tile", "{tile}"];
        let groups: Vec<GroupJson> = groups(record.group_tiles, laid);
        let slowest = groups.iter().map(|group| group.cpu_seconds).max_by(f64::total_cmp).unwrap_or(0.0);
        let mut steps = vec![
            step("plan", "one", 1, None, &["plan"], asked, millions * PLAN_SECONDS),
            step("tile", "each", tiles.len(), Some("plan"), &tile, memory, longest),
        ];
        if !groups.is_empty() {
            let words = ["stitch", "{workspace}", "--group", "{group}"];
            steps.push(step("group", "each", groups.len(), Some("tile"), &words, asked, slowest));
        }
        let before = if groups.is_empty() { "tile" } else { "group" };
        let (words, seconds) = (["stitch", "{workspace}"], millions * STITCH_SECONDS);
        steps.push(step("stitch", "one", 1, Some(before), &words, asked, seconds));
        let mesh = record.mesh.path();
        PlanJson {
            schema: SCHEMA,
            crease: record.version.clone(),
            job: format!("{job:016x}"),
            input: InputJson {
                vertices: scan.vertices,
                faces: scan.faces,
                converted: mesh.as_os_str() == "crease-mesh.ply",
                mesh: mesh.to_string_lossy().into_owned(),
                reordered: laid.work.rewritten,
            },
            steps,
            group_tiles: record.group_tiles,
            groups,
            tiles,
        }
    }

    /// As a file: one tile on a line.
    pub fn to_bytes(&self) -> Vec<u8> {
        let lines: Vec<String> = self.tiles.iter().map(|tile| format!("    {}", json(tile))).collect();
        let steps: Vec<String> = self.steps.iter().map(|step| format!("    {}", json(step))).collect();
        let groups: Vec<String> = self.groups.iter().map(|group| format!("    {}", json(group))).collect();
        let groups =
            if groups.is_empty() { "[]".to_owned() } else { format!("[\n{}\n  ]", groups.join(",\n")) };
        format!(
            "{{\n  \"schema\": {},\n  \"crease\": {},\n  \"job\": {},\n  \"input\": {},\n  \"steps\": [\n{}\n  ],\n  \"group_tiles\": \
             {},\n  \"groups\": {groups},\n  \"tiles\": [\n{}\n  ]\n}}\n",
            self.schema,
            json(&self.crease),
            json(&self.job),
            json(&self.input),
            steps.join(",\n"),
            self.group_tiles,
            lines.join(",\n")
        )
        .into_bytes()
    }
}

/// The groups of `size` tiles each.
fn groups(size: u32, laid: &Laid) -> Vec<GroupJson> {
    let tiles = laid.tiles.len() as u32;
    let group = |id: u32| {
        let of = tiles_of_group(id, size, tiles);
        let faces: u64 = laid.tiles[of.start as usize..of.end as usize].iter().map(|tile| tile.faces).sum();
        GroupJson {
            id,
            first_tile: of.start,
            last_tile: of.end - 1,
            cpu_seconds: rounded(faces as f64 * STITCH_SECONDS_PER_FACE),
            result: name_of_group(id),
        }
    };
    (0..count_of_groups(size, tiles)).map(group).collect()
}

impl TileJson {
    fn new(tile: &TileOutlook) -> TileJson {
        TileJson {
            id: tile.id.0,
            faces: tile.faces,
            loaded_faces: tile.loaded_faces,
            memory_bytes: tile.memory,
            cpu_seconds: rounded(tile.cpu_seconds),
            neighbours: tile.neighbours.iter().map(|tile| tile.0).collect(),
            result: name_of_result(tile.id.0),
        }
    }
}

/// To hundredths: a hint has no more digits.
fn rounded(x: f64) -> f64 {
    (100.0 * x).round() / 100.0
}

/// Numbers and text: nothing of what is said here can fail to be JSON.
fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default()
}
