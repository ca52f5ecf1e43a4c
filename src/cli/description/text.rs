//! A [`Description`] for a person: four parts, a label and what belongs to it on each line.

use super::{Description, GuessPart, InputPart, MeshPart, PlanPart, PrecisionPart, TimePart};
use crate::cli::colour::{HEADING, WARNING, styled};
use crate::cli::text::{bytes, counted, entry, grouped, measure, rough_span, span, with_decimals};
use std::time::Duration;

/// The description as text, with styles.
pub(in crate::cli) fn text(description: &Description) -> String {
    let Description { input, mesh, plan, time, .. } = description;
    let mut out = format!("{}\n", styled(HEADING, &input.name));
    out.push_str(&input_text(input));
    out.push_str(&heading("mesh"));
    out.push_str(&mesh_text(mesh));
    out.push_str(&defects(description));
    out.push_str(&heading("plan"));
    out.push_str(&plan_text(plan));
    out.push_str(&heading("time"));
    out.push_str(&time_text(time, plan));
    out
}

fn heading(name: &str) -> String {
    format!("\n{}\n", styled(HEADING, name))
}

fn input_text(input: &InputPart) -> String {
    if let Some(encoding) = &input.encoding {
        let mut out = entry("file", &format!("PLY, {encoding}, {}", bytes(input.size_bytes)));
        for element in &input.elements {
            let properties: Vec<String> =
                element.properties.iter().map(|p| format!("{} ({})", p.name, p.kind)).collect();
            let records = counted(element.records, "record", "records");
            out.push_str(&entry(&element.name, &format!("{records}: {}", properties.join(", "))));
        }
        return out;
    }
    let name = if input.files.len() == 1 { "file" } else { "files" };
    let mut out = entry(name, &format!("{}, {}", kinds(input), bytes(input.size_bytes)));
    let vertices = counted(input.files.iter().map(|f| f.vertices).sum(), "vertex", "vertices");
    let polygons = counted(input.files.iter().map(|f| f.polygons).sum(), "polygon", "polygons");
    out.push_str(&entry("", &format!("{vertices} and {polygons}, converted to be read in place")));
    out
}

/// How many files there are of each kind.
fn kinds(input: &InputPart) -> String {
    let mut found: Vec<(String, usize)> = Vec::new();
    for file in &input.files {
        let kind = match file.packing.as_str() {
            "none" => file.format.clone(),
            packing => format!("{} in {packing}", file.format),
        };
        match found.iter_mut().find(|(name, _)| *name == kind) {
            Some((_, count)) => *count += 1,
            None => found.push((kind, 1)),
        }
    }
    match found.as_slice() {
        [(kind, 1)] => kind.clone(),
        many => many.iter().map(|(kind, count)| format!("{count} {kind}")).collect::<Vec<_>>().join(", "),
    }
}

fn mesh_text(mesh: &MeshPart) -> String {
    let cut = match mesh.polygons {
        polygons if polygons == mesh.faces => String::new(),
        polygons => format!(", cut from {} as fans", counted(polygons, "polygon", "polygons")),
    };
    let mut out = entry("faces", &format!("{}{cut}", counted(mesh.faces, "triangle", "triangles")));
    out.push_str(&entry("vertices", &grouped(mesh.vertices)));
    let sides = &mesh.sides_mesh_units;
    // Enough decimals to tell neighbouring vertices apart, however far from the origin they are.
    let fine = sides.median / 100.0;
    let decimals = if fine > 0.0 { (-fine.log10()).ceil().clamp(0.0, 9.0) as usize } else { 3 };
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let (min, max) = (mesh.min_mesh_units[axis], mesh.max_mesh_units[axis]);
        let [min, max, extent] = [min, max, max - min].map(|x| with_decimals(x, decimals));
        out.push_str(&entry(name, &format!("{min} to {max}, extent {extent}")));
    }
    let [median, mean, shortest, longest] =
        [sides.median, sides.mean, sides.shortest, sides.longest].map(measure);
    out.push_str(&entry(
        "sides",
        &format!("median {median}, mean {mean}, shortest {shortest}, longest {longest} mesh units"),
    ));
    out.push_str(&mesh.precision.as_ref().map(precision).unwrap_or_default());
    out
}

fn precision(precision: &PrecisionPart) -> String {
    let steps = precision.steps_per_median_side;
    let bits = steps.log2().max(0.0).floor();
    let steps_text = if steps < 1e15 { with_decimals(steps, 0) } else { measure(steps) };
    let (kind, step) = (&precision.coordinate_type, measure(precision.step_mesh_units));
    let mut out = entry(
        "precision",
        &format!("{bits} bits: the median side is {steps_text} steps of a {kind} ({step} mesh units)"),
    );
    if precision.too_coarse {
        out.push_str(&format!(
            "  {} the coordinates are stored too coarsely for the size of the faces; rounding will look like noise.\n  \
             Export with double coordinates, or move the mesh near the origin before it is exported.\n",
            styled(WARNING, "warning:")
        ));
    }
    out
}

fn defects(description: &Description) -> String {
    let seen: Vec<String> =
        description.defects.iter().map(|d| format!("{} {}", grouped(d.count), d.what)).collect();
    let seen = if seen.is_empty() { "none that a scan shows".to_owned() } else { seen.join(", ") };
    let mut out = entry("defects", &seen);
    out.push_str(&entry("", "(open borders and non-manifold edges are counted by detect)"));
    out
}

fn plan_text(plan: &PlanPart) -> String {
    let mut out = entry(
        "sigma",
        &format!(
            "{} mesh units ({:.2} median edges)",
            measure(plan.sigma_mesh_units),
            plan.sigma_median_edges
        ),
    );
    let side_by_side = match plan.tiles_at_a_time {
        1 => String::new(),
        n => format!(", up to {n} at a time"),
    };
    out.push_str(&entry("tiles", &format!("{}{side_by_side}", grouped(plan.tiles))));
    let halo = with_decimals(plan.halo_overhead_percent, 0);
    out.push_str(&entry("halo overhead", &format!("about {halo} %")));
    let allowed = plan.allowed_memory_bytes.map_or(String::new(), |n| format!(" of {} allowed", bytes(n)));
    out.push_str(&entry("memory", &format!("about {}{allowed}", bytes(plan.memory_bytes))));
    let order = &plan.order;
    let scattered = if order.vertices_scattered { "scattered" } else { "near each other" };
    out.push_str(&entry(
        "locality",
        &format!(
            "each face is read {:.1} times, {:.1} times in the best order; the vertices of a face are {scattered} \
             ({:.1} fetches)",
            order.reads_per_face, order.best_reads_per_face, order.vertex_fetches
        ),
    ));
    if order.rewritten {
        let most = bytes(order.temporary_bytes);
        out.push_str(&entry(
            "temporary files",
            &format!("at most about {most}: detect rewrites the mesh in spatial order first"),
        ));
    }
    out
}

fn time_text(time: &TimePart, plan: &PlanPart) -> String {
    let took = |seconds: f64| span(Duration::try_from_secs_f64(seconds).unwrap_or_default());
    let mut out = String::new();
    if let Some(seconds) = time.conversion_seconds {
        out.push_str(&entry("conversion", &took(seconds)));
    }
    out.push_str(&entry("scan and plan", &took(time.scan_seconds)));
    let Some(GuessPart {
        total_seconds,
        cpu_microseconds_per_face,
        calibration_faces,
        calibration_places,
        ..
    }) = &time.guess
    else {
        return out;
    };
    let threads = counted(plan.threads as u64, "thread", "threads");
    out.push_str(&entry("detect", &format!("about {} with {threads}", rough_span(*total_seconds))));
    let places = counted(*calibration_places, "place", "places");
    let faces = grouped(*calibration_faces);
    out.push_str(&entry(
        "",
        &format!("({cpu_microseconds_per_face:.1} us of a processor for each face, tried on {faces} faces in {places})"),
    ));
    out
}
