//! `crease info`: what a file holds and how it would be worked on.
//!
//! In: a mesh. Out: text. The file is scanned and the plan is made, but no tile is loaded.

use crate::cli::args::InfoArgs;
use crate::cli::exit::{Exit, Failure};
use crate::cli::memory::Allocations;
use crate::cli::progress::Progress;
use crate::cli::summary::left_out_rows;
use crate::cli::text::{bytes, counted, entry, grouped, measure, with_decimals};
use crate::cli::{bus_error, console, input};
use crate::config::{Limits, NO_LIMIT, Params, method};
use crate::error::Error;
use crate::input::ply::{PropertyKind, ScalarType};
use crate::input::{InputFiles, LeftOut, MeshSource, PlySource, Sieve};
use crate::partition::{Locality, Scan, temporary_bytes, vertex_reads};
use crate::pipeline::{Event, Job, Observer, Planned, Stage};
use crate::spill::ScratchPlace;
use std::path::Path;
use std::time::Instant;

/// With fewer steps than this in a median edge, rounding of the coordinates tilts the faces by half a degree or more.
const LEAST_STEPS: f64 = 100.0;

/// Does what `args` ask for.
///
/// # Errors
/// If the file cannot be read, is not a mesh, or sigma does not suit it.
pub(in crate::cli) fn info(args: &InfoArgs, allocations: Allocations) -> Result<Exit, Failure> {
    console::start_log(args.show.verbose);
    let limits = args.work.limits();
    let files = InputFiles::find(&args.input.names)?;
    bus_error::watch(&files.name());
    let progress = Progress::new(args.show.progress, args.show.verbose, allocations);
    let scratch = ScratchPlace::below(args.work.workspace.as_deref().unwrap_or(Path::new(".")));
    let input = input::open(&files, args.input.weld, &scratch, &limits, &progress)?;
    let source = input.mesh();
    let params = Params { sigma: args.sigma.sigma(), ..Params::default() };
    let sieve = args.bad.sieve(source)?;
    let mesh_source: &dyn MeshSource = sieve.as_ref().map_or(source, |sieve| sieve);
    let planned =
        planned(mesh_source, params, limits, &progress).map_err(|e| Failure::of_run(source.path(), e))?;
    let scan = &planned.scan;
    let mut text = if input.is_converted() { input.describe() } else { file(source) };
    text.push_str(&mesh(source, scan));
    text.push_str(&precision(source, scan));
    let left_out = sieve.as_ref().map(Sieve::left_out).unwrap_or_default();
    text.push_str(&defects(source, scan, &left_out));
    text.push_str(&plan_text(&planned, limits.memory));
    let locality = Locality::new(&planned.plan, scan, vertex_reads(mesh_source)?);
    text.push_str(&order(mesh_source, &locality, planned.plan.cells.len() == 1));
    console::print(&text)?;
    Ok(Exit::Done)
}

fn planned(
    source: &dyn MeshSource,
    params: Params,
    limits: Limits,
    progress: &Progress,
) -> Result<Planned, Error> {
    let started = Instant::now();
    let result = Job::new(source, params, limits, progress)?.plan()?;
    progress.event(Event::Finished { stage: Stage::Scan, wall: started.elapsed() });
    Ok(result)
}

fn file(source: &PlySource) -> String {
    let header = source.header();
    let mut out = format!("{}\n", source.name());
    out.push_str(&entry("file", &format!("PLY, {}, {}", header.encoding, bytes(source.file_len()))));
    for element in &header.elements {
        let properties: Vec<String> =
            element.properties.iter().map(|p| format!("{} ({})", p.name, p.kind)).collect();
        let records = counted(element.count, "record", "records");
        out.push_str(&entry(&element.name, &format!("{records}: {}", properties.join(", "))));
    }
    out
}

fn mesh(source: &PlySource, scan: &Scan) -> String {
    let mut out = "\nmesh\n".to_owned();
    let cut = match source.polygon_count() {
        polygons if polygons == source.face_count() => String::new(),
        polygons => format!(", cut from {} as fans", counted(polygons, "polygon", "polygons")),
    };
    out.push_str(&entry("faces", &format!("{}{cut}", counted(scan.faces, "triangle", "triangles"))));
    out.push_str(&entry("vertices", &grouped(scan.vertices)));
    let (min, max) = (scan.bounds.min, scan.bounds.max);
    let sides = scan.side_range;
    // Enough decimals to tell neighbouring vertices apart, however far from the origin they are.
    let fine = scan.median_side / 100.0;
    let decimals = if fine > 0.0 { (-fine.log10()).ceil().clamp(0.0, 9.0) as usize } else { 3 };
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let [min, max, extent] =
            [min[axis], max[axis], max[axis] - min[axis]].map(|x| with_decimals(x, decimals));
        out.push_str(&entry(name, &format!("{min} to {max}, extent {extent}")));
    }
    let (median, mean) = (measure(scan.median_side), measure(scan.mean_side));
    let (shortest, longest) = (measure(sides.0), measure(sides.1));
    out.push_str(&entry(
        "sides",
        &format!("median {median}, mean {mean}, shortest {shortest}, longest {longest} mesh units"),
    ));
    out
}

/// How finely the stored coordinates resolve the mesh.
fn precision(source: &PlySource, scan: &Scan) -> String {
    let largest = scan.bounds.min.abs().max(scan.bounds.max.abs()).to_array();
    let properties =
        source.header().elements.iter().filter(|e| e.name == "vertex").flat_map(|e| &e.properties);
    let coarsest = properties
        .filter_map(|property| {
            let axis = ["x", "y", "z"].iter().position(|name| *name == property.name)?;
            match property.kind {
                PropertyKind::Scalar(kind) => Some((step(kind, largest[axis]), kind)),
                PropertyKind::List { .. } => None,
            }
        })
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let Some((step, kind)) = coarsest else { return String::new() };
    if scan.median_side <= 0.0 {
        return String::new();
    }
    let steps = scan.median_side / step;
    let bits = steps.log2().max(0.0).floor();
    let steps_text = if steps < 1e15 { with_decimals(steps, 0) } else { measure(steps) };
    let mut out = entry(
        "precision",
        &format!("{bits} bits: the median side is {steps_text} steps of a {kind} ({})", measure(step)),
    );
    if steps < LEAST_STEPS {
        out.push_str(
            "  warning: the coordinates are stored too coarsely for the size of the faces; rounding will look like noise.\n  \
             Export with double coordinates, or move the mesh near the origin before it is exported.\n",
        );
    }
    out
}

/// Distance from a number of this size to the next that the type can hold.
fn step(kind: ScalarType, size: f64) -> f64 {
    match kind {
        ScalarType::F32 => f64::from((size as f32).next_up() - size as f32),
        ScalarType::F64 => size.next_up() - size,
        _ => 1.0,
    }
}

fn defects(source: &PlySource, scan: &Scan, left_out: &LeftOut) -> String {
    let all = [
        (scan.repeated_corner, "face that names a vertex twice", "faces that name a vertex twice"),
        (scan.unreferenced, "vertex that no face uses", "vertices that no face uses"),
        (
            source.short_polygons(),
            "polygon with less than three corners",
            "polygons with less than three corners",
        ),
    ];
    let seen: Vec<String> = left_out_rows(left_out)
        .iter()
        .chain(&all)
        .filter(|(n, ..)| *n > 0)
        .map(|(n, one, many)| counted(*n, one, many))
        .collect();
    let seen = if seen.is_empty() { "none that a scan shows".to_owned() } else { seen.join(", ") };
    let mut out = entry("defects", &seen);
    out.push_str("                    (open borders and non-manifold edges are counted by detect)\n");
    out
}

fn plan_text(planned: &Planned, memory: u64) -> String {
    let Planned { plan, scan, sizes, .. } = planned;
    let tiles = plan.cells.len() as u64;
    let mut out = "\nplan\n".to_owned();
    let sigma = plan.scale.length(method::SIGMA_EDGES);
    out.push_str(&entry("sigma", &format!("{} mesh units", measure(sigma))));
    let side_by_side = match sizes.in_flight.min(tiles) {
        1 => String::new(),
        n => format!(", up to {n} at a time"),
    };
    out.push_str(&entry("tiles", &format!("{}{side_by_side}", grouped(tiles))));
    let halo = 100.0 * (sizes.loaded as f64 / scan.faces.max(1) as f64 - 1.0).max(0.0);
    out.push_str(&entry("halo overhead", &format!("about {} %", with_decimals(halo, 0))));
    let allowed = if memory == NO_LIMIT { String::new() } else { format!(" of {} allowed", bytes(memory)) };
    out.push_str(&entry("memory", &format!("about {}{allowed}", bytes(planned.expected_memory()))));
    out
}

/// What the order of the file means for the work.
fn order(source: &dyn MeshSource, locality: &Locality, in_core: bool) -> String {
    let Locality { face_reads, needed_reads, vertex_reads } = *locality;
    let scattered = if Locality::is_scattered(vertex_reads) { "scattered" } else { "near each other" };
    let mut out = entry(
        "locality",
        &format!(
            "each face is read {face_reads:.1} times, {needed_reads:.1} times in the best order; the vertices of a face \
             are {scattered} ({vertex_reads:.1} fetches)"
        ),
    );
    if locality.rewriting_pays() && !in_core {
        let most = bytes(temporary_bytes(source, Locality::is_scattered(vertex_reads)));
        out.push_str(&entry(
            "temporary files",
            &format!("at most about {most}: detect rewrites the mesh in spatial order first"),
        ));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_grow_with_the_coordinates() {
        assert_eq!(step(ScalarType::F32, 0.0), f64::from(f32::from_bits(1)));
        assert_eq!(step(ScalarType::F32, 500_000.0), 1.0 / 32.0);
        assert_eq!(step(ScalarType::F64, 1.0), f64::EPSILON);
        assert_eq!(step(ScalarType::I32, 70.0), 1.0);
    }
}
