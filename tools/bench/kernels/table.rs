//! All steps beside each other. In: what `criterion` has kept of this run; out: a table in markdown.

use super::town::Town;
use anyhow::{Context, Result};
use serde::Deserialize;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::time::SystemTime;

/// Under which name the steps are kept.
pub const GROUP: &str = "kernels";

/// A row of the table.
struct Step {
    /// As the bench is called.
    name: &'static str,
    what: &'static str,
    /// Whether the time of a run is made of it; other rows are a part of one of these, or look closer.
    counts: bool,
    /// Nanoseconds for each face that a bare implementation takes, and what it does.
    bare: Option<(&'static str, &'static str)>,
}

const fn step(name: &'static str, what: &'static str, counts: bool) -> Step {
    Step { name, what, counts, bare: None }
}

impl Step {
    const fn beside(self, bare: &'static str, doing: &'static str) -> Step {
        Step { bare: Some((bare, doing)), ..self }
    }
}

/// In the order of the data. What stands beside was measured once, on a processor of the same kind, with programs that do
/// nothing else, on a city of a million triangles; medians of three to five runs that differed by up to a fifth.
const STEPS: [Step; 26] = [
    step("decode", "faces and positions out of the mapped file", false)
        .beside("2.4", "decode records of 13 bytes, and of 12 for vertices"),
    step("scan", "bounds, median edge, sample, a box for each block", true),
    step("load", "choose faces, number them anew, gather positions, adjacency", true)
        .beside("70-90", "read, sort by tile, number anew, adjacency"),
    step("adjacency", "of that: faces around vertices, one-rings, faces across edges", false)
        .beside("22-26", "faces around vertices, faces across edges, by counting"),
    step("geometry", "normals, areas, windings", true).beside("20-30", "normals, areas, barycentres"),
    step("noise", "levels of noise at vertices and faces", true),
    step("demand", "what the tile depends on, and that it is there", true),
    step("refine", "rounds of refinement, each face as many as its noise asks for", true),
    step("refine 1", "the same with one round of all faces", false),
    step("refine 2", "the same with two", false).beside("65", "each round over the faces at the corners"),
    step("tensors", "votes of the faces around each vertex", true)
        .beside("20", "the same without weights by distance"),
    step("vote again", "tensors vote over the one-ring", true)
        .beside("120", "three rounds by way of the faces"),
    step("votes", "eigensystems of both tensors, fold angles, directions", true),
    step("eigen", "of that: the eigensystems", false)
        .beside("26", "one root by Newton's method, one vector; Jacobi's method to the last bit: 291"),
    step("surroundings", "what is calm around each vertex", true),
    step("widen", "tensors of calm vertices vote further", true),
    step("stops", "corners and boundaries", true),
    step("smooth", "positions as walks see them", true),
    step("contrast", "contrast across, where a trace looks", true),
    step("support", "traces along lines", true),
    step("thin", "average along the line, ridges", true),
    step("link", "paths between ridges", true),
    step("fit", "planes at the vertices that are left after pruning", true),
    step("close", "graph, pruning, lines of one tile", true),
    step("stitch", "the same lines joined from four tiles, and put in order", false),
    step("whole run", "from the file to lines, in core, one thread", false),
];

/// The part of an estimate of `criterion` that is shown.
#[derive(Deserialize)]
struct Estimates {
    median: Estimate,
}

#[derive(Deserialize)]
struct Estimate {
    point_estimate: f64,
    confidence_interval: Interval,
}

#[derive(Deserialize)]
struct Interval {
    lower_bound: f64,
    upper_bound: f64,
}

/// What was measured since `started`.
///
/// # Errors
/// If a file of this run cannot be read.
pub fn markdown(results: &Path, started: SystemTime, town: &Town) -> Result<String> {
    let mut measured = Vec::new();
    for step in &STEPS {
        if let Some(found) = estimate(&results.join(GROUP).join(step.name), started)? {
            measured.push((step, found.median));
        }
    }
    if measured.is_empty() {
        return Ok(String::new());
    }
    let per_face = |ns: f64| ns / town.faces() as f64;
    let of = |name: &str| measured.iter().find(|(step, _)| step.name == name).map(|(_, m)| m.point_estimate);
    let whole = of("whole run");
    let mut text = format!(
        "\n{} faces, {} vertices, {:.1} rounds of refinement for each face; one thread, processor time\n\n\
         | step | what | ns / face | interval | share of a run | bare |\n| --- | --- | ---: | ---: | ---: | --- |\n",
        town.faces(),
        town.vertices(),
        town.mean_rounds()
    );
    for (step, Estimate { point_estimate, confidence_interval }) in &measured {
        let Interval { lower_bound, upper_bound } = confidence_interval;
        let share =
            whole.filter(|_| step.counts).map(|whole| format!("{:.1} %", 100.0 * point_estimate / whole));
        let bare = step.bare.map(|(ns, doing)| format!("{ns}: {doing}"));
        writeln!(
            text,
            "| {} | {} | {:.1} | {:.1}-{:.1} | {} | {} |",
            step.name,
            step.what,
            per_face(*point_estimate),
            per_face(*lower_bound),
            per_face(*upper_bound),
            share.unwrap_or_default(),
            bare.unwrap_or_default()
        )?;
    }
    if let (Some(one), Some(two)) = (of("refine 1"), of("refine 2")) {
        writeln!(text, "\nA round of refinement: {:.1} ns / face.", per_face(two - one))?;
    }
    let mut counting = STEPS.iter().filter(|step| step.counts);
    if let Some(whole) = whole.filter(|_| counting.all(|step| of(step.name).is_some())) {
        let sum: f64 = measured.iter().filter(|(step, _)| step.counts).map(|(_, m)| m.point_estimate).sum();
        writeln!(
            text,
            "\nSum of the steps with a share: {:.0} ns / face, {:.0} % of the whole run; the rest counts defects, moves \
             memory, and looks at the mesh before it is planned.",
            per_face(sum),
            100.0 * sum / whole
        )?;
    }
    Ok(text)
}

/// What was measured of one step, unless it is of an earlier run: then the step was not asked for.
fn estimate(step: &Path, started: SystemTime) -> Result<Option<Estimates>> {
    let path = step.join("new").join("estimates.json");
    let fresh = fs::metadata(&path).and_then(|data| data.modified()).is_ok_and(|at| at >= started);
    if !fresh {
        return Ok(None);
    }
    let text = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    Ok(Some(serde_json::from_str(&text).with_context(|| format!("{} is not what it was", path.display()))?))
}
