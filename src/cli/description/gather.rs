//! From what the layers say to a [`Description`].

use super::{
    DefectPart, Description, ElementPart, FilePart, GuessPart, InputPart, MeshPart, OrderPart, PlanPart,
    PrecisionPart, PropertyPart, SCHEMA_VERSION, SidesPart, TimePart,
};
use crate::cli::args::Preset;
use crate::cli::input::Input;
use crate::cli::summary::left_out_rows;
use crate::config::{Limits, NO_LIMIT, Order, method};
use crate::input::ply::{PropertyKind, ScalarType};
use crate::input::{LeftOut, MeshSource, Packing, PlySource};
use crate::partition::{Locality, Scan, temporary_bytes};
use crate::pipeline::{Calibration, Planned};
use std::fs;
use std::time::Duration;

/// With fewer steps than this in a median edge, rounding of the coordinates tilts the faces by half a degree or more.
const LEAST_STEPS: f64 = 100.0;
/// Rewriting the mesh costs about as much as reading it so many times (`pipeline/order.rs`).
const REWRITING_SCANS: f64 = 8.0;

/// What was found out.
pub(in crate::cli) struct Known<'a> {
    pub input: &'a Input,
    /// The mesh as tiles would be loaded from it.
    pub source: &'a dyn MeshSource,
    pub planned: &'a Planned,
    pub locality: Locality,
    pub left_out: LeftOut,
    pub limits: &'a Limits,
    pub preset: Preset,
    pub scan: Duration,
    pub calibration: Option<Calibration>,
}

/// Brings it into its form.
pub(in crate::cli) fn describe(known: &Known<'_>) -> Description {
    let (source, scan) = (known.input.mesh(), &known.planned.scan);
    let plan = plan(known);
    Description {
        schema_version: SCHEMA_VERSION,
        crease_version: env!("CARGO_PKG_VERSION"),
        input: input(known.input),
        mesh: mesh(source, scan),
        defects: defects(source, scan, &known.left_out),
        time: time(known, &plan),
        plan,
    }
}

fn input(input: &Input) -> InputPart {
    let source = input.mesh();
    let file = |file: &crate::input::InputFile| FilePart {
        path: file.path.display().to_string(),
        format: file.format.name().to_owned(),
        packing: match file.packing {
            Packing::Plain => "none".to_owned(),
            packing => packing.name().to_owned(),
        },
        vertices: file.vertices,
        polygons: file.polygons,
    };
    let sizes = input.files().iter().filter_map(|file| fs::metadata(&file.path).ok()).map(|m| m.len());
    let header = source.header();
    let elements = header.elements.iter().map(|element| ElementPart {
        name: element.name.clone(),
        records: element.count,
        properties: element
            .properties
            .iter()
            .map(|p| PropertyPart { name: p.name.clone(), kind: p.kind.to_string() })
            .collect(),
    });
    let converted = input.is_converted();
    InputPart {
        name: if converted { source.path().display().to_string() } else { source.name() },
        size_bytes: if converted { sizes.sum() } else { source.file_len() },
        converted,
        files: input.files().iter().map(file).collect(),
        encoding: (!converted).then(|| header.encoding.to_string()),
        elements: if converted { Vec::new() } else { elements.collect() },
    }
}

fn mesh(source: &PlySource, scan: &Scan) -> MeshPart {
    MeshPart {
        faces: scan.faces,
        polygons: source.polygon_count(),
        vertices: scan.vertices,
        min_mesh_units: scan.bounds.min.to_array(),
        max_mesh_units: scan.bounds.max.to_array(),
        sides_mesh_units: SidesPart {
            median: scan.median_side,
            mean: scan.mean_side,
            shortest: scan.side_range.0,
            longest: scan.side_range.1,
        },
        precision: precision(source, scan),
    }
}

/// How finely the stored coordinates resolve the mesh.
fn precision(source: &PlySource, scan: &Scan) -> Option<PrecisionPart> {
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
    let (step, kind) = coarsest.filter(|_| scan.median_side > 0.0)?;
    let steps = scan.median_side / step;
    Some(PrecisionPart {
        coordinate_type: kind.to_string(),
        step_mesh_units: step,
        steps_per_median_side: steps,
        too_coarse: steps < LEAST_STEPS,
    })
}

/// Distance from a number of this size to the next that the type can hold.
fn step(kind: ScalarType, size: f64) -> f64 {
    match kind {
        ScalarType::F32 => f64::from((size as f32).next_up() - size as f32),
        ScalarType::F64 => size.next_up() - size,
        _ => 1.0,
    }
}

fn defects(source: &PlySource, scan: &Scan, left_out: &LeftOut) -> Vec<DefectPart> {
    let all = [
        (scan.repeated_corner, "face that names a vertex twice", "faces that name a vertex twice"),
        (scan.unreferenced, "vertex that no face uses", "vertices that no face uses"),
        (
            source.short_polygons(),
            "polygon with less than three corners",
            "polygons with less than three corners",
        ),
    ];
    left_out_rows(left_out)
        .iter()
        .chain(&all)
        .filter(|(count, ..)| *count > 0)
        .map(|&(count, one, many)| DefectPart { count, what: if count == 1 { one } else { many } })
        .collect()
}

fn plan(known: &Known<'_>) -> PlanPart {
    let Planned { plan, scan, sizes, rounds, .. } = known.planned;
    let tiles = plan.cells.len() as u64;
    let sigma = plan.scale.length(method::SIGMA_EDGES);
    let locality = &known.locality;
    let scattered = Locality::is_scattered(locality.vertex_reads);
    let rewritten = match known.limits.order {
        Order::Auto => locality.rewriting_pays() && tiles > 1,
        Order::Keep => false,
        Order::Rewrite => true,
    };
    PlanPart {
        preset: known.preset.name(),
        sigma_mesh_units: sigma,
        sigma_median_edges: if scan.median_side > 0.0 {
            sigma / scan.median_side
        } else {
            method::SIGMA_EDGES
        },
        refinement_rounds: *rounds,
        threads: known.limits.threads,
        tiles,
        tiles_at_a_time: sizes.in_flight.min(tiles),
        loaded_faces: sizes.loaded,
        halo_overhead_percent: 100.0 * (sizes.loaded as f64 / scan.faces.max(1) as f64 - 1.0).max(0.0),
        memory_bytes: known.planned.expected_memory(),
        allowed_memory_bytes: Some(known.limits.memory).filter(|bytes| *bytes != NO_LIMIT),
        order: OrderPart {
            reads_per_face: locality.face_reads,
            best_reads_per_face: locality.needed_reads,
            vertex_fetches: locality.vertex_reads,
            vertices_scattered: scattered,
            rewritten,
            temporary_bytes: if rewritten { temporary_bytes(known.source, scattered) } else { 0 },
        },
    }
}

fn time(known: &Known<'_>, plan: &PlanPart) -> TimePart {
    let conversion = known.input.conversion();
    let scan = known.scan.as_secs_f64();
    let guess = known.calibration.map(|calibration| {
        let tiles = calibration.wall(known.planned.scan.faces, plan.loaded_faces, plan.threads).as_secs_f64();
        let order = if plan.order.rewritten { REWRITING_SCANS * scan } else { 0.0 };
        let before = conversion.map_or(0.0, |time| time.as_secs_f64());
        GuessPart {
            total_seconds: before + scan + order + tiles,
            tiles_seconds: tiles,
            cpu_microseconds_per_face: 1e6 * calibration.cpu_per_face(),
            calibration_faces: calibration.faces,
            calibration_places: calibration.pieces,
        }
    });
    TimePart { conversion_seconds: conversion.map(|time| time.as_secs_f64()), scan_seconds: scan, guess }
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
