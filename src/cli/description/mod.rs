//! What `crease info` knows: one structure, which is printed as text for people or as JSON for programs.
//!
//! In: the opened input, its scan and plan. Out: a [`Description`]. Lengths are in mesh units, sizes in bytes, times in
//! seconds; names end in their unit. `docs/FORMATS.md`, section 6, lists the fields.

mod gather;
mod text;

pub(super) use gather::{Known, describe};
pub(super) use text::text;

use serde::Serialize;

/// Counted up when a field changes its meaning or goes; new fields may come at any time.
pub(super) const SCHEMA_VERSION: u32 = 1;

/// All that is known of a mesh and of the work on it.
#[derive(Debug, Serialize)]
pub(super) struct Description {
    pub schema_version: u32,
    pub crease_version: &'static str,
    pub input: InputPart,
    pub mesh: MeshPart,
    pub defects: Vec<DefectPart>,
    pub plan: PlanPart,
    pub time: TimePart,
}

/// What was given.
#[derive(Debug, Serialize)]
pub(super) struct InputPart {
    pub name: String,
    pub size_bytes: u64,
    /// Whether it was converted to be read in place; then `vertices` and `polygons` are those of the files.
    pub converted: bool,
    pub files: Vec<FilePart>,
    /// Of a file that is read in place.
    pub encoding: Option<String>,
    pub elements: Vec<ElementPart>,
}

/// A file of the input.
#[derive(Debug, Serialize)]
pub(super) struct FilePart {
    pub path: String,
    pub format: String,
    /// `none`, `gzip` or `zstd`.
    pub packing: String,
    pub vertices: u64,
    pub polygons: u64,
}

/// An element of a PLY file.
#[derive(Debug, Serialize)]
pub(super) struct ElementPart {
    pub name: String,
    pub records: u64,
    pub properties: Vec<PropertyPart>,
}

/// A property of an element.
#[derive(Debug, Serialize)]
pub(super) struct PropertyPart {
    pub name: String,
    #[serde(rename = "type")]
    pub kind: String,
}

/// What the scan found.
#[derive(Debug, Serialize)]
pub(super) struct MeshPart {
    pub faces: u64,
    /// Faces of the file before they were cut into triangles.
    pub polygons: u64,
    pub vertices: u64,
    /// `[x, y, z]`.
    pub min_mesh_units: [f64; 3],
    pub max_mesh_units: [f64; 3],
    pub sides_mesh_units: SidesPart,
    pub precision: Option<PrecisionPart>,
}

/// Sides of the triangles.
#[derive(Debug, Serialize)]
pub(super) struct SidesPart {
    pub median: f64,
    pub mean: f64,
    pub shortest: f64,
    pub longest: f64,
}

/// How finely the stored coordinates resolve the mesh.
#[derive(Debug, Serialize)]
pub(super) struct PrecisionPart {
    /// Of the coarsest coordinate.
    pub coordinate_type: String,
    /// From one number that it can hold to the next, where the coordinates are largest.
    pub step_mesh_units: f64,
    pub steps_per_median_side: f64,
    /// Whether rounding will look like noise.
    pub too_coarse: bool,
}

/// Something that is wrong with the mesh, and how often.
#[derive(Debug, Serialize)]
pub(super) struct DefectPart {
    pub count: u64,
    pub what: &'static str,
}

/// How the work would be done.
#[derive(Debug, Serialize)]
pub(super) struct PlanPart {
    pub preset: &'static str,
    pub sigma_mesh_units: f64,
    pub sigma_median_edges: f64,
    /// Rounds of refinement that the noisiest of some places needs; 0 for a single tile, which has no halo to plan.
    pub refinement_rounds: u32,
    pub threads: usize,
    pub tiles: u64,
    /// Tiles that may be in memory at the same time.
    pub tiles_at_a_time: u64,
    /// Faces that all tiles together load, halos included.
    pub loaded_faces: u64,
    pub halo_overhead_percent: f64,
    pub memory_bytes: u64,
    /// What may be allocated.
    pub allowed_memory_bytes: Option<u64>,
    pub order: OrderPart,
}

/// What the order of the faces in the file means for the work.
#[derive(Debug, Serialize)]
pub(super) struct OrderPart {
    /// How often the tiles read each face, and how often they would in the best order.
    pub reads_per_face: f64,
    pub best_reads_per_face: f64,
    /// Pages of vertices that are fetched in one pass, per page of the file.
    pub vertex_fetches: f64,
    pub vertices_scattered: bool,
    /// Whether the mesh is rewritten in spatial order first, and what that takes on the disk at most.
    pub rewritten: bool,
    pub temporary_bytes: u64,
}

/// How long things took and will take.
#[derive(Debug, Serialize)]
pub(super) struct TimePart {
    pub conversion_seconds: Option<f64>,
    pub scan_seconds: f64,
    /// `None` if there was nothing to measure.
    pub guess: Option<GuessPart>,
}

/// How long `detect` will take.
#[derive(Debug, Serialize)]
pub(super) struct GuessPart {
    /// From beginning to end, on as many threads as `plan` says.
    pub total_seconds: f64,
    pub tiles_seconds: f64,
    /// What it is reckoned from: processor time for a loaded face, on so many faces in so many places.
    pub cpu_microseconds_per_face: f64,
    pub calibration_faces: u64,
    pub calibration_places: u64,
}
